"""Settings to try: the combinations of ranges that fit together, and what they will take."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.parameters import Parameters

RANGED = {
    "method": "",
    "template_size": "T",
    "overlap_size": "OR",
    "wavelet_level": "level",
    "n_candidates": "K",
    "search_fraction": "search",
}
"""The parameters that may have a range, and their signs in a label."""


@dataclass(frozen=True)
class Settings:
    """The settings that a sweep tries."""

    fitting: tuple[Parameters, ...]  # the combinations that fit together, each once
    # the others: the values of each, and why they do not fit
    left_out: tuple[tuple[dict[str, Any], str], ...] = ()
    # how many were left out as they simulate the same as another: "ccsim" has no level
    n_equal: int = 0

    def __len__(self) -> int:
        return len(self.fitting)

    def __iter__(self) -> Iterator[Parameters]:
        return iter(self.fitting)


def settings(
    base: Parameters,
    ranges: Mapping[str, Sequence[Any]],
    image_shape: tuple[int, int] | None = None,
) -> Settings:
    """Return all combinations of ranges that fit together.

    Parameters
    ----------
    base : Parameters
        What is not in the ranges.
    ranges : mapping of str to sequence
        Values by the name of a parameter of `RANGED`.
    image_shape : pair of int, optional
        Of the training image; templates larger than it are left out.

    Returns
    -------
    Settings

    Raises
    ------
    CCWSIMError
        For the name of another parameter, or a range without a value.

    Examples
    --------
    >>> found = settings(Parameters(), {"wavelet_level": [1, 3], "overlap_size": [8, 12]})
    >>> [(p.wavelet_level, p.overlap_size) for p in found], found.left_out[0][1]
    ([(1, 8), (3, 8), (1, 12)], 'Overlap 12 must be a multiple of 8 at level 3: try 8 or 16')
    """
    for name, values in ranges.items():
        if name not in RANGED:
            raise CCWSIMError(f"{shown(name)} has no range: choose from {', '.join(RANGED)}")
        if not len(values):
            raise CCWSIMError(f"{name} has no value to try: give at least one")
    names = [name for name in RANGED if name in ranges]
    fitting: dict[Parameters, Parameters] = {}
    left_out: list[tuple[dict[str, Any], str]] = []
    n_equal = 0
    for values in product(*(dict.fromkeys(ranges[name]) for name in names)):
        changes = dict(zip(names, values, strict=True))
        try:
            parameters = replace(base, **changes)
            _check_fits(parameters, image_shape)
        except CCWSIMError as error:
            left_out.append((changes, str(error)))
            continue
        n_equal += _canonical(parameters) in fitting
        fitting.setdefault(_canonical(parameters), parameters)
    return Settings(tuple(fitting.values()), tuple(left_out), n_equal)


def varied(parameters: Iterable[Parameters]) -> list[str]:
    """Return which of the ranged parameters are not the same in all settings.

    Examples
    --------
    >>> varied([Parameters(), Parameters(template_size=48)])
    ['template_size']
    """
    found = list(parameters)
    return [name for name in RANGED if len({_value(p, name) for p in found}) > 1]


def label(parameters: Parameters, names: Iterable[str]) -> str:
    """Return a setting in one short line.

    Examples
    --------
    >>> label(Parameters(), ["template_size", "wavelet_level"])
    'T 32 · level 2'
    """
    parts = []
    for name in names:
        value = _value(parameters, name)
        if name == "wavelet_level" and parameters.method == "ccsim":
            continue
        text = f"{value:g}" if isinstance(value, float) else str(value)
        parts.append(f"{RANGED[name]} {text}".strip())
    return " · ".join(parts)


def _canonical(p: Parameters) -> Parameters:
    """Return equal parameters for all settings that simulate the same."""
    return replace(p, wavelet_level=0) if p.method == "ccsim" else p


def _value(p: Parameters, name: str) -> Any:
    return p.level if name == "wavelet_level" else getattr(p, name)


def _check_fits(p: Parameters, image_shape: tuple[int, int] | None) -> None:
    if image_shape is not None and p.template_size > min(image_shape):
        ny, nx = image_shape
        raise CCWSIMError(
            f"Template {p.template_size} is larger than the training image of {nx} × {ny}"
        )
