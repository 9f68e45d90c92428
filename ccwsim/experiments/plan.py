"""Plan a sweep over all valid combinations of parameter ranges."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from ccwsim.model.arrays import Shape, describe_shape
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.parameters import PER_AXIS, Parameters
from ccwsim.model.sizes import largest_sides, per_axis

RANGED = {
    "method": "",
    "template_size": "T",
    "template_size_z": "T z",
    "overlap_size": "OR",
    "overlap_size_z": "OR z",
    "wavelet_level": "level",
    "wavelet_level_z": "level z",
    "n_candidates": "K",
    "search_fraction": "search",
}
"""Symbols of the parameters that may have a range; in volumes, also a separate one along z."""
ALONG_Z = "_z"


@dataclass(frozen=True)
class SweepPlan:
    """The settings of a sweep."""

    fitting: tuple[Parameters, ...]  # the valid combinations, without repetitions
    # invalid combinations as (values, reason)
    left_out: tuple[tuple[dict[str, Any], str], ...] = ()
    # combinations omitted as repetitions ("ccsim" has no level)
    n_equal: int = 0

    def __len__(self) -> int:
        return len(self.fitting)

    def __iter__(self) -> Iterator[Parameters]:
        return iter(self.fitting)


def plan_sweep(
    base: Parameters, ranges: Mapping[str, Sequence[Any]], image_shape: Shape | None = None
) -> SweepPlan:
    """Return all valid combinations of parameter ranges.

    `base` has the parameters without a range; `ranges` maps other parameters, by keys of `RANGED`,
    to the values to try. Templates larger than `image_shape` are excluded. Raises `CCWSIMError` if
    a name is not in `RANGED`, or a range has no value.
    """
    for name, values in ranges.items():
        if name not in RANGED:
            raise CCWSIMError(f"{shown(name)} has no range: choose from {', '.join(RANGED)}")
        if not len(values):
            raise CCWSIMError(f"{name} has no value to try: give at least one value")
    names = [name for name in RANGED if name in ranges]
    fitting: dict[Parameters, Parameters] = {}
    left_out: list[tuple[dict[str, Any], str]] = []
    n_equal = 0
    for values in product(*(dict.fromkeys(ranges[name]) for name in names)):
        changes = dict(zip(names, values, strict=True))
        try:
            parameters = _changed(base, changes)
            _check_fits(parameters, image_shape)
        except CCWSIMError as error:
            left_out.append((changes, str(error)))
            continue
        n_equal += _canonical(parameters) in fitting
        fitting.setdefault(_canonical(parameters), parameters)
    return SweepPlan(tuple(fitting.values()), tuple(left_out), n_equal)


def varied(parameters: Iterable[Parameters]) -> list[str]:
    """Return the names of the parameters in `RANGED` that differ between settings."""
    settings = list(parameters)
    return [name for name in RANGED if len({value_of(p, name) for p in settings}) > 1]


def label(parameters: Parameters, names: Iterable[str]) -> str:
    """Return a short label of a setting on one line."""
    parts = []
    for name in names:
        value = value_of(parameters, name)
        no_level = name.startswith("wavelet_level") and parameters.method == "ccsim"
        if value is None or no_level:
            continue
        text = f"{value:g}" if isinstance(value, float) else str(value)
        parts.append(f"{RANGED[name]} {text}".strip())
    return " · ".join(parts)


def _canonical(p: Parameters) -> Parameters:
    """Return one representative for all settings that give identical realizations."""
    return replace(p, wavelet_level=0) if p.method == "ccsim" else p


def value_of(p: Parameters, name: str) -> Any:
    """Return the value of a parameter in `RANGED`, or None for a z value of a map."""
    along_z = name.endswith(ALONG_Z)
    value = getattr(p, name.removesuffix(ALONG_Z))
    if name.startswith("wavelet_level") and p.method == "ccsim":
        value = (0, 0, 0) if isinstance(value, tuple) else 0
    if isinstance(value, tuple):
        return value[0 if along_z else -1]
    return None if along_z else value


def _changed(base: Parameters, changes: Mapping[str, Any]) -> Parameters:
    """Return a copy of the parameters with new values, given by keys of `RANGED`."""
    values = dict(changes)
    for name in PER_AXIS:
        z, value = values.pop(name + ALONG_Z, value_of(base, name + ALONG_Z)), values.get(name)
        if z is not None and not isinstance(value, tuple):
            x = value_of(base, name) if value is None else value
            values[name] = z, x, x
    return replace(base, **values)


def _check_fits(p: Parameters, image_shape: Shape | None) -> None:
    if image_shape is None:
        return
    template = p.along(image_shape).template
    if any(t > n for t, n in zip(template, largest_sides(image_shape), strict=True)):
        size = per_axis(template, image_shape)
        size = describe_shape(size) if isinstance(size, tuple) else size
        raise refused("template_too_large", size=size, image=describe_shape(image_shape))
