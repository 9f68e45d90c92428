"""Which settings a sweep tries: ranges that suit the study, and what they come to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ccwsim.experiments.sweep import JUDGING, Settings, expected_seconds, settings
from ccwsim.model.bounds import MAX_TEMPLATE, MIN_TEMPLATE
from ccwsim.model.choices import Choices
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.parameters import METHODS, Parameters
from ccwsim.ui.session.fitting import fitted, levels
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.state import SweepState

MOST = 64
"""Settings in one sweep."""
TEMPLATES = (8, 12, 16, 24, 32, 40, 48, 64, 96, 128, 192, 256)
OVERLAPS = (2, 4, 6, 8, 12, 16, 24, 32, 48, 64)
CANDIDATES = (1, 5, 10, 20, 50, 100)
FRACTIONS = (0.01, 0.05, 0.1, 0.25, 0.5, 1.0)
DEFAULT_LEVELS = (1, 2, 3)


def values_on_offer(choices: Choices) -> dict[str, list[Any]]:
    """Return the values that each range may have: those of the study among the usual ones."""
    p, side = choices.parameters, min(image_of(choices.image).shape)
    templates = [t for t in TEMPLATES if t <= min(side, MAX_TEMPLATE)]
    overlaps = [o for o in OVERLAPS if o <= min(side, MAX_TEMPLATE) // 2]
    offered = {
        "template_size": _with(templates, p.template_size),
        "wavelet_level": _with(levels(image_of(choices.image).shape), p.wavelet_level),
        "overlap_size": _with(overlaps, p.overlap_size),
        "n_candidates": _with(CANDIDATES, p.n_candidates),
        "method": list(METHODS),
    }
    if _may_have_data(choices):
        offered["search_fraction"] = _with(FRACTIONS, p.search_fraction)
    return offered


def ranges_of(state: State) -> dict[str, list[Any]]:
    """Return the ranges as the user chose them, or as they suit the study."""
    offered = values_on_offer(state.choices)
    suited = suited_ranges(state.choices)
    ranges = {}
    for name, values in offered.items():
        chosen = state.page(SweepState).ranges.get(name)
        still = None if chosen is None else [value for value in chosen if value in values]
        ranges[name] = suited[name] if still is None or (chosen and not still) else still
    return ranges


def suited_ranges(choices: Choices) -> dict[str, list[Any]]:
    """Return the study's own values, with templates and levels around them."""
    p, shape = choices.parameters, image_of(choices.image).shape
    near = (p.template_size // 2, p.template_size, p.template_size * 3 // 2)
    offered = values_on_offer(choices)
    templates = [t for t in near if t >= MIN_TEMPLATE and t in offered["template_size"]]
    tried = [level for level in levels(shape) if level in DEFAULT_LEVELS] or [p.wavelet_level]
    return {
        "template_size": templates or [p.template_size],
        "wavelet_level": [p.wavelet_level] if p.method == "ccsim" else tried,
        "overlap_size": [p.overlap_size],
        "n_candidates": [p.n_candidates],
        "method": [p.method],
        "search_fraction": [p.search_fraction],
    }


def plan_of(state: State) -> Settings:
    """Return the settings that the ranges come to.

    Raises
    ------
    CCWSIMError
        For a range without a value.
    """
    shape = image_of(state.choices.image).shape
    # pills come in the order of their clicks, methods in no order but their own
    ranges = {
        name: values if name == "method" else sorted(values)
        for name, values in ranges_of(state).items()
    }
    return settings(state.choices.parameters, ranges, shape)


def seconds_of(state: State, plan: Sequence[Parameters] | Settings) -> float:
    """Return how long a plan will take about, by the pace of the latest run where there is one."""
    choices = state.choices
    image, n_data = image_of(choices.image), data_of(choices).n
    sizes = image.shape, choices.grid.shape, image.n_facies, n_data
    each = sum(expected_seconds(p, *sizes) for p in plan)
    return each * state.page(SweepState).n_realizations * pace(state.ensemble)


def pace(ensemble: Ensemble | None) -> float:
    """Return how many times longer than expected an ensemble took; 1 where there is none.

    Examples
    --------
    >>> pace(None)
    1.0
    """
    if ensemble is None:
        return 1.0
    image, grid = ensemble.training_image, ensemble.grid
    expected = expected_seconds(
        ensemble.parameters, image.shape, grid.shape, image.n_facies, ensemble.hard_data.n
    )
    took = float(ensemble.cpu_seconds.mean()) + grid.ny * grid.nx * JUDGING
    return min(max(took / expected, 0.3), 10.0)


def use_setting(state: State, parameters: Parameters) -> None:
    """Take a setting into the study, moved to what its training image allows."""
    state.change(parameters=fitted(parameters, image_of(state.choices.image).shape))


def _may_have_data(choices: Choices) -> bool:
    try:
        return data_of(choices).n > 0
    except CCWSIMError:
        return True


def _with(values: Sequence[Any], own: Any) -> list[Any]:
    return sorted({*values, own})
