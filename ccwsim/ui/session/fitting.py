"""Keep a study whole when one of its parts changes: sizes go to the nearest legal ones."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ccwsim.model.bounds import MAX_LEVEL, MAX_TEMPLATE, MIN_TEMPLATE
from ccwsim.model.choices import Choices
from ccwsim.model.parameters import Parameters, legal_sizes
from ccwsim.model.training_image import TrainingImage


def template_sizes(level: int, shape: tuple[int, int]) -> list[int]:
    """Return the template sizes that a level and a training image of (ny, nx) cells allow.

    Examples
    --------
    >>> template_sizes(3, (40, 60))
    [16, 24, 32, 40]
    """
    smallest = max(MIN_TEMPLATE, 2 * 2**level)
    return legal_sizes(level, smallest, min(*shape, MAX_TEMPLATE))


def overlap_sizes(level: int, template_size: int) -> list[int]:
    """Return the overlap sizes that a level and a template allow."""
    return legal_sizes(level, 1, template_size // 2)


def levels(shape: tuple[int, int]) -> list[int]:
    """Return the levels for which a training image of (ny, nx) cells has a template."""
    return [level for level in range(MAX_LEVEL + 1) if template_sizes(level, shape)]


def fitted(parameters: Parameters, shape: tuple[int, int], **changes: Any) -> Parameters:
    """Return parameters with some changed, and the sizes moved to the nearest legal ones.

    Examples
    --------
    >>> p = fitted(Parameters(overlap_size=12), (256, 256), wavelet_level=3)
    >>> p.template_size, p.overlap_size
    (32, 8)
    """
    values = {name: getattr(parameters, name) for name in Parameters.__dataclass_fields__}
    values |= changes
    possible = levels(shape)
    level = 0 if values["method"] == "ccsim" else values["wavelet_level"]
    if possible and level not in possible:
        level = values["wavelet_level"] = max(possible)
    template = _nearest(template_sizes(level, shape), values["template_size"])
    values["template_size"] = template
    values["overlap_size"] = _nearest(overlap_sizes(level, template), values["overlap_size"])
    return Parameters(**values)


def fitted_to_image(choices: Choices, image: TrainingImage) -> Choices:
    """Return choices whose parameters suit another training image."""
    return replace(choices, parameters=fitted(choices.parameters, image.shape))


def _nearest(sizes: list[int], wanted: int) -> int:
    return min(sizes, key=lambda size: (abs(size - wanted), size), default=wanted)
