"""The settings of a project file, checked for their kinds before anything is made of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, get_args

from ccwsim.io.data_file import printable
from ccwsim.model.arrays import check_int
from ccwsim.model.choices import EMap, Shown
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters

MAX_REALIZATIONS = 1_000_000
MAX_LETTERS = 10_000
"""Of a value of the address that a project keeps; packed hard data are the longest."""


@dataclass(frozen=True)
class Settings:
    """What the settings of a project say; the nouns check the values themselves."""

    image_name: str
    facies_names: list[str]
    colours: tuple[tuple[int, str], ...]
    n_data: int
    grid: dict[str, Any]
    parameters: dict[str, Any]
    n_realizations: int
    seed: int
    shown: Shown
    link: dict[str, list[str]]
    versions: dict[str, str]
    digest: str


def checked(given: Any, name: str, format: str, version: int) -> Settings:
    """Return the settings of the JSON of a project.

    Raises
    ------
    CCWSIMError
        For another format, a newer version, or a value that is missing or of another kind.

    Examples
    --------
    >>> checked({"format": "A", "version": 2}, "a.ccwsim", "A", 1)
    Traceback (most recent call last):
        ...
    ccwsim.model.errors.CCWSIMError: a.ccwsim was saved by a newer version of CCWSIM; ...
    """
    if not isinstance(given, dict) or given.get("format") != format:
        raise CCWSIMError(f"{name} is no project of CCWSIM")
    said = given.get("version")
    if not isinstance(said, int) or said < 1:
        raise CCWSIMError(f"{name}: version {shown(said)} of the file is unknown; save it again")
    if said > version:
        raise CCWSIMError(f"{name} was saved by a newer version of CCWSIM; update this one")
    image = _take(given, "training_image", dict, name)
    n = check_int(f"{name}: n_realizations", given.get("n_realizations"), 1)
    if n > MAX_REALIZATIONS:
        raise CCWSIMError(f"{name}: {n} realizations are too many")
    return Settings(
        printable(_take(image, "name", str, name)),
        [printable(own) for own in _texts(image, "facies_names", name)],
        _colours(_take(image, "colours", list, name), name),
        check_int(f"{name}: n_hard_data", given.get("n_hard_data"), 0),
        _known(_take(given, "grid", dict, name), Grid, name),
        _known(_take(given, "parameters", dict, name), Parameters, name),
        n,
        check_int(f"{name}: seed", given.get("seed"), 0),
        _shown(_take(given, "shown", dict, name), name),
        _link(_take(given, "link", dict, name), name),
        {
            printable(key): printable(shown(value) if not isinstance(value, str) else value)
            for key, value in _take(given, "made_with", dict, name).items()
        },
        printable(_take(given, "digest", str, name)),
    )


def _take(given: Mapping[str, Any], key: str, kind: type, name: str) -> Any:
    value = given.get(key)
    if not isinstance(value, kind):
        raise CCWSIMError(f"{name}: {key} is missing or broken in its settings; save it again")
    return value


def _texts(given: Mapping[str, Any], key: str, name: str) -> list[str]:
    found = _take(given, key, list, name)
    if not all(isinstance(one, str) for one in found):
        raise CCWSIMError(f"{name}: {key} must be a list of words; save it again")
    return found


def _link(given: dict[str, Any], name: str) -> dict[str, list[str]]:
    return {
        printable(key): [printable(own, MAX_LETTERS) for own in _texts(given, key, name)]
        for key in given
    }


def _colours(given: list[Any], name: str) -> tuple[tuple[int, str], ...]:
    for pair in given:
        ok = isinstance(pair, list) and len(pair) == 2 and type(pair[0]) is int
        if not ok or not re.fullmatch("#[0-9a-fA-F]{6}", str(pair[1])):
            raise CCWSIMError(f"{name}: {shown(pair)} is no code and colour; save it again")
    return tuple((code, colour) for code, colour in given)


def _known(given: dict[str, Any], kind: type, name: str) -> dict[str, Any]:
    missing = [f.name for f in fields(kind) if f.default is MISSING and f.name not in given]
    if missing:
        raise CCWSIMError(f"{name}: {missing[0]} is missing in its settings; save it again")
    unknown = sorted(set(given) - {f.name for f in fields(kind)})
    if unknown:
        raise CCWSIMError(
            f"{name}: {shown(unknown[0])} is unknown here; it may be of a newer version"
        )
    return given


def _shown(given: dict[str, Any], name: str) -> Shown:
    e_type: Any = given.get("e_type")
    if e_type not in get_args(EMap):
        raise CCWSIMError(f"{name}: {shown(e_type)} is no map of uncertainty")
    return Shown(
        check_int(f"{name}: realization", given.get("realization"), 0),
        check_int(f"{name}: facies", given.get("facies"), 0),
        e_type,
    )
