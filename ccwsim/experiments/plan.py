"""Plan a sweep over all valid combinations of parameter ranges, and suggest ranges."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from ccwsim import TrainingImage
from ccwsim.metrics.diagnosis import recommended_parameters, resolving_levels
from ccwsim.model import (
    MAX_CANDIDATES,
    MAX_TEMPLATE,
    MIN_TEMPLATE,
    PER_AXIS,
    CCWSIMError,
    Parameters,
    Shape,
    fitted,
    levels,
    shown,
)

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
SIZES = [name for name in RANGED if name.removesuffix(ALONG_Z) in PER_AXIS]
"""Template, overlap and level, each also along z."""
MIN_SUGGESTED = 9  # minimum number of settings in suggested ranges, if so many are legal
SIZE_STEP, K_STEP = 1.5, 4.0  # ratios of neighbouring values in suggested ranges
N_VALUES = (2, 3, 5, MAX_TEMPLATE)
"""Numbers of values in suggested ranges; the first is used that gives enough settings."""


@dataclass(frozen=True)
class SweepPlan:
    """The settings of a sweep."""

    fitting: tuple[Parameters, ...]  # the valid combinations, without repetitions
    # invalid combinations as (values, reason)
    left_out: tuple[tuple[dict[str, Any], str], ...] = ()
    # combinations omitted as repetitions ("ccsim" has no level; sizes may be rounded alike)
    n_equal: int = 0

    def __len__(self) -> int:
        return len(self.fitting)

    def __iter__(self) -> Iterator[Parameters]:
        return iter(self.fitting)


def plan_sweep(
    base: Parameters,
    ranges: Mapping[str, Sequence[Any]],
    image_shape: Shape | None = None,
) -> SweepPlan:
    """Return all valid combinations of parameter ranges.

    `base` has the parameters without a range; `ranges` maps other parameters, by keys of `RANGED`,
    to the values to try. With `image_shape`, sizes become the nearest ones that the level and an
    image of this shape allow; otherwise combinations with other sizes are excluded. Raises
    `CCWSIMError` if a name is not in `RANGED`, or a range has no value.

    Examples
    --------
    >>> tried = {"template_size": [30], "wavelet_level": [1, 2]}
    >>> [p.template_size for p in plan_sweep(Parameters(), tried, (256, 256))]
    [30, 28]
    """
    for name, values in ranges.items():
        if name not in RANGED:
            raise CCWSIMError(f"{shown(name)} has no range: choose from {', '.join(RANGED)}")
        if not len(values):
            raise CCWSIMError(f"{name} has no value to try: give at least one value")
    names = [name for name in RANGED if name in ranges]
    fitting: dict[tuple, Parameters] = {}
    left_out: list[tuple[dict[str, Any], str]] = []
    n_equal = 0
    for values in product(*(dict.fromkeys(ranges[name]) for name in names)):
        changes = dict(zip(names, values, strict=True))
        try:
            sizes = _sizes(base, changes)
            parameters = (
                fitted(base, image_shape, **sizes) if image_shape else replace(base, **sizes)
            )
        except CCWSIMError as error:
            left_out.append((changes, str(error)))
            continue
        # settings with the same values in `RANGED` give identical realizations
        key = tuple(value_of(parameters, name) for name in RANGED)
        n_equal += key in fitting
        fitting.setdefault(key, parameters)
    return SweepPlan(tuple(fitting.values()), tuple(left_out), n_equal)


def suggested_ranges(parameters: Parameters, training_image: TrainingImage) -> dict[str, list[Any]]:
    """Return ranges around the parameters of a study, for a plan that is rounded to the image.

    The plan has at least nine settings or, if fewer are legal, all of them. Template, overlap and
    level are varied, and K if it has an effect: in volumes, and with the published draw. Levels
    whose blocks are larger than the thinnest facies is thick are tried only if the study has them.

    Examples
    --------
    >>> import numpy as np
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> ranges = suggested_ranges(Parameters(30, 10, 1), stripes)
    >>> ranges["template_size"], ranges["overlap_size"], ranges["wavelet_level"]
    ([20, 30, 45], [7, 10, 15], [0, 1])
    """
    shape, volume = training_image.shape, training_image.n_dimensions == 3
    p, resolving = fitted(parameters, shape), resolving_levels(training_image)[-1]
    ranges = {name: [value_of(p, name)] for name in RANGED if value_of(p, name) is not None}
    template, overlap, level = (ranges[name][0] for name in PER_AXIS)
    longest = min(*shape[-2:], MAX_TEMPLATE)
    near = sorted(levels(shape), key=lambda k: (abs(k - level), -k))
    resolved = [k for k in near if k <= resolving or k == level]
    for n in N_VALUES if volume else N_VALUES[1:]:  # volumes take longer
        ranges["template_size"] = _near(template, MIN_TEMPLATE, longest, n)
        ranges["overlap_size"] = _near(overlap, 1, longest // 2, n)
        if p.method != "ccsim":
            ranges["wavelet_level"] = sorted((resolved if n < MAX_TEMPLATE else near)[:n])
        if p.published_draw or volume:
            k, n_candidates = p.n_candidates, 2 if n < 5 else 5
            ranges["n_candidates"] = _near(k, 1, MAX_CANDIDATES, n_candidates, step=K_STEP)
        if len(plan_sweep(p, ranges, shape)) >= MIN_SUGGESTED:
            break
    return ranges


def varied(parameters: Iterable[Parameters]) -> list[str]:
    """Return the names of the parameters in `RANGED` that differ between settings, or `SIZES`."""
    settings = list(parameters)
    return [name for name in RANGED if len({value_of(p, name) for p in settings}) > 1] or SIZES


def label(parameters: Parameters, names: Iterable[str]) -> str:
    """Return a short label of a setting on one line."""
    parts = []
    for name in names:
        value = value_of(parameters, name)
        no_level = name.startswith("wavelet_level") and parameters.method == "ccsim"
        if value is not None and not no_level:
            text = f"{value:g}" if isinstance(value, float) else str(value)
            parts.append(f"{RANGED[name]} {text}".strip())
    return " · ".join(parts)


def _near(value: int, low: int, high: int, n: int, step: float = SIZE_STEP) -> list[int]:
    """Return `n` values from `low` to `high` near a value, with ratios of about `step`."""
    if high - low < n:
        return [*range(low, high + 1)] or [value]
    powers = sorted(range(-n, n + 1), key=lambda k: (abs(k), k))
    values = (min(max(round(value * step**k), low), high) for k in powers)
    return sorted([*dict.fromkeys(values)][:n])


def describe_advice(training_image: TrainingImage, parameters: Parameters | None = None) -> str:
    """Return the sizes of `metrics.recommended_parameters` and the reasons; "" without advice."""
    try:
        advised, reason = recommended_parameters(training_image, parameters)
    except CCWSIMError:
        return ""
    return f"Advised: {label(advised, SIZES)}. {reason}"


def value_of(p: Parameters, name: str) -> Any:
    """Return the value of a parameter in `RANGED`, or None for a z value of a map."""
    along_z = name.endswith(ALONG_Z)
    value = getattr(p, name.removesuffix(ALONG_Z))
    if name.startswith("wavelet_level") and p.method == "ccsim":
        value = (0, 0, 0) if isinstance(value, tuple) else 0
    if isinstance(value, tuple):
        return value[0 if along_z else -1]
    return None if along_z else value


def _sizes(base: Parameters, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return new values of parameters by their names; `changes` has keys of `RANGED`."""
    values = dict(changes)
    for name in PER_AXIS:
        z, value = values.pop(name + ALONG_Z, value_of(base, name + ALONG_Z)), values.get(name)
        if z is not None and not isinstance(value, tuple):
            x = value_of(base, name) if value is None else value
            values[name] = z, x, x
    return values
