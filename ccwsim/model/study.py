"""A study: the inputs of a simulation, checked to fit together."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.arrays import AXES, check_int, describe_shape
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import PER_AXIS, Lengths, Parameters, legal_sizes
from ccwsim.model.training_image import TrainingImage


@dataclass(frozen=True, eq=False)
class Study:
    """Training image, grid, parameters, hard data and seed of a simulation.

    Raises `CCWSIMError` for data outside the grid or of an unknown facies, for a template larger
    than the training image, and for a map combined with a volume. The message suggests a remedy.

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
        _check_dimensions(self.training_image, self.grid)
        self.hard_data.check(self.grid, self.training_image)
        _check_template(self.training_image, self.parameters)
        # Cells index the grid, so empty hard data get as many coordinates as the grid has axes.
        if self.hard_data.n_dimensions != self.grid.n_dimensions:
            none = HardData(np.empty((0, self.grid.n_dimensions)), ())
            object.__setattr__(self, "hard_data", none)

    @cached_property
    def facies_of_data(self) -> NDArray[np.uint8]:
        """Index of the facies of each datum in the codes of the training image, shape (n,)."""
        return np.searchsorted(self.training_image.codes, self.hard_data.facies).astype(np.uint8)


def _check_dimensions(training_image: TrainingImage, grid: Grid) -> None:
    if training_image.n_dimensions == grid.n_dimensions:
        return
    image, cells = describe_shape(training_image.shape), describe_shape(grid.shape)
    if grid.nz is None:
        raise CCWSIMError(
            f"the training image is a volume of {image} cells, but the grid of {cells} is a map: "
            "give the grid nz, or one layer of the image: ti.array[k]"
        )
    raise CCWSIMError(
        f"the training image of {image} cells is a map, but the grid is a volume of {cells}: "
        "leave out nz of the grid, or give a volume as training image"
    )


def _check_template(training_image: TrainingImage, p: Parameters) -> None:
    shape = training_image.shape
    lengths = p.along(shape)
    sides = list(zip(AXES[::-1], lengths.template, (1, *shape)[-3:], strict=True))
    large = [(axis, size) for axis, size, n in sides if size > n]
    if not large:
        return
    axis, template = large[0]
    if training_image.n_dimensions == 3:
        what, advice = f"Template {template} along {axis}", _smaller(p, lengths, shape)
    else:
        what = f"Template {template}"
        legal = legal_sizes(lengths.level[-1], max(4, 2 * lengths.overlap[-1]), min(shape))
        advice = f"at most {legal[-1]}" if legal else "a larger image or a smaller overlap"
    raise CCWSIMError(
        f"{what} is larger than the training image of {describe_shape(shape)}: use {advice}"
    )


def _smaller(p: Parameters, lengths: Lengths, shape: tuple[int, ...]) -> str:
    """Return the `Parameters` arguments, as text, that make the template fit into a volume."""
    fitting = []
    for template, overlap, level, n in zip(*lengths, shape, strict=True):
        while template > n and level and n < 2 * 2**level:
            level -= 1
        block = 2**level
        template = min(template, n // block * block)
        fitting.append((template, min(overlap, template // 2 // block * block), level))
    changes = zip(PER_AXIS, zip(*fitting, strict=True), lengths, strict=True)
    return " and ".join(f"{name}={new}" for name, new, old in changes if new != old)
