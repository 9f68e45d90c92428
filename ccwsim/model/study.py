"""A study: everything that a simulation starts from, checked to fit together."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.arrays import check_int
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters, legal_sizes
from ccwsim.model.training_image import TrainingImage


@dataclass(frozen=True, eq=False)
class Study:
    """What realizations are simulated from.

    Raises
    ------
    CCWSIMError
        For data outside the grid or of an unknown facies, and for a template larger than the
        training image; the message says what would fit.

    Examples
    --------
    >>> Study(TrainingImage(np.eye(40)), Grid(50, 60)).grid.nx
    60
    """

    training_image: TrainingImage
    grid: Grid
    parameters: Parameters = field(default_factory=Parameters)
    hard_data: HardData = field(default_factory=HardData)
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "seed", check_int("seed", self.seed, 0))
        for name, kind in (
            ("training_image", TrainingImage),
            ("grid", Grid),
            ("parameters", Parameters),
            ("hard_data", HardData),
        ):
            if not isinstance(getattr(self, name), kind):
                given = type(getattr(self, name)).__name__
                raise CCWSIMError(f"{name}: a {kind.__name__} is needed, not a {given}")
        self.hard_data.check(self.grid, self.training_image)
        _check_template(self.training_image, self.parameters)

    @cached_property
    def facies_of_data(self) -> NDArray[np.uint8]:
        """Where the facies of each datum stands in the codes of the training image, shape (n,)."""
        found = np.searchsorted(self.training_image.codes, self.hard_data.facies)
        return found.astype(np.uint8)


def _check_template(training_image: TrainingImage, p: Parameters) -> None:
    ny, nx = training_image.shape
    if p.template_size <= min(ny, nx):
        return
    legal = legal_sizes(p.level, max(4, 2 * p.overlap_size), min(ny, nx))
    advice = f"use at most {legal[-1]}" if legal else "use a larger image or a smaller overlap"
    raise CCWSIMError(
        f"Template {p.template_size} is larger than the training image of {nx} × {ny}: {advice}"
    )
