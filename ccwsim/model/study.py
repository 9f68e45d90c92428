"""A study: the inputs of a simulation, checked to fit together."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ccwsim.model.active_cells import (
    Window,
    count_in_windows,
    smallest_box,
    widest_window,
    window_shape,
)
from ccwsim.model.arrays import (
    WORLD_AXES,
    Bytes,
    Integers,
    Mask,
    Shape,
    as_seed,
    check_type,
    describe_shape,
)
from ccwsim.model.bounds import MIN_TEMPLATE
from ccwsim.model.errors import refused
from ccwsim.model.facies_match import FaciesNames
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import PER_AXIS, Lengths, Parameters
from ccwsim.model.published import LARGEST_CODES
from ccwsim.model.secondary import Secondary
from ccwsim.model.sizes import in_layers, largest_sides, legal_sizes
from ccwsim.model.training_image import TrainingImage


@dataclass(frozen=True, eq=False)
class Study:
    """Training image, grid, parameters, hard data, seed and secondary information of a simulation.

    Hard data in inactive cells are moved to `inactive_data`. Raises `CCWSIMError` for data outside
    the grid or of an unknown facies, for a template larger than the training image, and for a map
    combined with a volume. The message suggests a remedy.
    """

    training_image: TrainingImage
    grid: Grid
    parameters: Parameters = field(default_factory=Parameters)
    hard_data: HardData = field(default_factory=HardData)
    seed: int = 0
    secondary: Secondary | None = None
    checked: bool = field(default=True, kw_only=True)
    """False for realizations whose inputs need not fit together: those from files, of other
    methods, and slices of volumes."""
    inactive_data: HardData = field(init=False, default_factory=HardData)

    def __post_init__(self) -> None:
        object.__setattr__(self, "seed", as_seed(self.seed))
        names = "training_image", "grid", "parameters", "hard_data"
        kinds = TrainingImage, Grid, Parameters, HardData
        for name, kind in zip(names, kinds, strict=True):
            check_type(name, getattr(self, name), kind)
        # Cells index the grid, so empty hard data get as many coordinates as the grid has axes.
        if not self.hard_data.n and self.hard_data.n_dimensions != self.grid.n_dimensions:
            no_data = HardData(np.empty((0, self.grid.n_dimensions)), ())
            object.__setattr__(self, "hard_data", no_data)
        if not self.checked:
            return
        _check_dimensions(self.training_image, self.grid)
        object.__setattr__(self, "hard_data", self.hard_data.of_image(self.training_image))
        self.hard_data.check(self.grid, self.training_image)
        _check_template(self.training_image, self.parameters)
        _check_gaps(self.training_image, self.parameters)
        if self.secondary is not None:
            check_type("secondary", self.secondary, Secondary)
            secondary = self.secondary.fitted(self.grid, self.training_image)
            object.__setattr__(self, "secondary", None if secondary.is_empty else secondary)
        _check_variant(self)
        _check_values(self)
        if self.active is not None and self.hard_data.n:
            data, inside = self.hard_data, self.active[tuple(self.hard_data.cells.T)]
            for name, mask in (("inactive_data", ~inside), ("hard_data", inside)):
                object.__setattr__(self, name, data.part(mask))

    @classmethod
    def of(
        cls,
        training_image: TrainingImage | ArrayLike,
        grid_shape: Grid | Sequence[int] | Integers,
        parameters: Parameters | None = None,
        hard_data: Any = None,
        *,
        facies: FaciesNames | None = None,
        **others: Any,
    ) -> Self:
        """Return a study of inputs in any of the forms that `simulate` accepts."""
        grid, image = Grid.of(grid_shape), TrainingImage.of(training_image)
        data = HardData.of(hard_data, grid, image, facies)
        return cls(image, grid, Parameters() if parameters is None else parameters, data, **others)

    def fitting(self) -> Self:
        """Return the study, with inputs that are checked to fit together."""
        return self if self.checked else replace(self, checked=True)

    @cached_property
    def contents(self) -> dict[str, Hashable]:
        """The inputs by name, as values that are equal for inputs that give equal realizations.

        Names of images and of facies do not count.
        """
        return {
            "training image": self.training_image.digest,
            "grid": self.grid,
            "parameters": self.parameters,
            "hard data": self.hard_data.digest,
            "seed": self.seed,
            "secondary information": self.secondary and self.secondary.digest,
        }

    def differs_from(self, other: Study) -> list[str]:
        """Return the names of the inputs that differ from those of another study."""
        return [name for name, value in self.contents.items() if value != other.contents[name]]

    def key(self, *without: str) -> tuple[Hashable, ...]:
        """Return a key of all inputs but those named `without`."""
        return tuple(value for name, value in self.contents.items() if name not in without)

    @cached_property
    def secondary_or_empty(self) -> Secondary:
        """The secondary information; without any, an object whose fields have their defaults."""
        return self.secondary or Secondary()

    @property
    def active(self) -> Mask | None:
        """The active cells, shape of the grid; None if all cells are active."""
        return self.secondary_or_empty.active

    @cached_property
    def active_mask(self) -> Mask:
        """The active cells, shape of the grid, also if all cells are active."""
        return np.broadcast_to(True if self.active is None else self.active, self.grid.shape)

    @cached_property
    def whole_window(self) -> Window:
        """A large window without inactive cells, in which whole realizations are judged."""
        return widest_window(self.active_mask)

    @property
    def whole_shape(self) -> Shape:
        """Shape of `whole_window`; the shape of the grid if all cells are active."""
        return window_shape(self.whole_window)

    @property
    def is_guided(self) -> bool:
        """Whether a location weight, probabilities or auxiliary variables guide the search."""
        placed = max(self.parameters.location_weights) > 0
        return placed or self.secondary_or_empty.guides

    def around_active(self) -> tuple[Study, tuple[slice, ...]]:
        """Return the study in the smallest grid with all active cells, and the slices of this grid.

        With a `location_weight`, the whole grid is needed.
        """
        if self.active is None or self.secondary is None or max(self.parameters.location_weights):
            return self, tuple(slice(None) for _ in self.grid.shape)
        part = smallest_box(self.active)
        cells = self.hard_data.cells - np.array([k.start for k in part])
        return replace(
            self,
            grid=Grid.of(window_shape(part)),
            hard_data=self.hard_data.part(..., cells),
            secondary=self.secondary.cropped(part),
        ), part

    @cached_property
    def facies_of_data(self) -> Bytes:
        """Index of the facies of each datum in the codes of the training image, shape (n,)."""
        return np.searchsorted(self.training_image.codes, self.hard_data.facies).astype(np.uint8)

    @cached_property
    def ranks_of_data(self) -> Bytes:
        """Rank of each datum among the values of the image, shape (n,); empty for facies."""
        image = self.training_image
        if not image.values or not self.hard_data.n:
            return np.empty(0, np.uint8)
        return image.ranks_of(self.hard_data.values[image.variable])


def _check_dimensions(training_image: TrainingImage, grid: Grid) -> None:
    if training_image.n_dimensions == grid.n_dimensions:
        return
    image, cells = describe_shape(training_image.shape), describe_shape(grid.shape)
    if not grid.is_volume:
        raise refused("volume_for_map", image=image, cells=cells)
    raise refused("map_for_volume", image=image, cells=cells)


def _check_template(training_image: TrainingImage, p: Parameters) -> None:
    shape = training_image.shape
    lengths = p.along(shape)
    sides = list(zip(WORLD_AXES[::-1], lengths.template, in_layers(shape), strict=True))
    large = [(axis, size) for axis, size, n in sides if size > n]
    if not large:
        return
    axis, template = large[0]
    if training_image.n_dimensions == 3:
        what, advice = f"Template {template} along {axis}", _smaller(p, lengths, shape)
    else:
        what = f"Template {template}"
        legal = legal_sizes(
            lengths.level[-1], max(MIN_TEMPLATE, 2 * lengths.overlap[-1]), largest_sides(shape)[-1]
        )
        advice = f"at most {legal[-1]}" if legal else "a larger image or a smaller overlap"
    raise refused("patch_too_large", what=what, shape=describe_shape(shape), advice=advice)


def _check_variant(study: Study) -> None:
    """Raise an error if a published variant does not allow the kind of study or its codes."""
    variant, secondary = study.parameters.variant, study.secondary_or_empty
    if variant == "ours":
        return
    if study.grid.is_volume or secondary.guides or secondary.has_copies:
        raise refused("variant_of_map", variant=variant)
    codes, largest = study.training_image.codes, LARGEST_CODES[variant]
    if codes[0] < 0 or codes[-1] > largest:
        listed = ", ".join(map(str, codes.tolist()))
        raise refused("variant_codes", variant=variant, largest=largest, codes=listed)


def _check_values(study: Study) -> None:
    """Raise an error if a study of a continuous variable has what only facies can have."""
    p, secondary = study.parameters, study.secondary_or_empty
    if not study.training_image.values:
        if any(image.values for image in secondary.images):
            raise refused("values_with", what="further images with values", remedy="omit them")
        return
    unsuitable = {
        "volumes": (study.grid.is_volume, "simulate a map"),
        f"the variant {p.variant!r}": (p.variant != "ours", "use variant='ours'"),
        "exact_data=False": (not p.exact_data, "use exact_data=True"),
        f"method={p.method!r}": (p.scale > 0, "use method='ccwsim'"),
        "probabilities of facies": (secondary.probabilities is not None, "omit them"),
        "further images": (bool(secondary.images), "omit them"),
    }
    for what, (is_there, remedy) in unsuitable.items():
        if is_there:
            raise refused("values_with", what=what, remedy=remedy)


def _check_gaps(training_image: TrainingImage, p: Parameters) -> None:
    """Raise an error if each patch of the image contains unknown cells."""
    if training_image.known is None:
        return
    unknown, lengths = ~training_image.known, p.along(training_image.shape)
    reached = zip(lengths.template, lengths.level, strict=True)  # refinement shifts a patch
    sides = [t + 2 * (2**j - 1) for t, j in reached][-unknown.ndim :]
    if count_in_windows(unknown, np.minimum(sides, unknown.shape).tolist()).all():
        size = describe_shape(lengths.template[-training_image.n_dimensions :])
        raise refused("no_whole_piece", size=size)


def _smaller(p: Parameters, lengths: Lengths, shape: Shape) -> str:
    """Return the `Parameters` arguments, as text, that make the template fit into a volume."""
    fitting = []
    for template, overlap, level, n in zip(
        lengths.template, lengths.overlap, lengths.level, shape, strict=True
    ):
        while template > n and level and n < 2 * 2**level:
            level -= 1
        block = 2**level
        template = min(template, n // block * block)
        fitting.append((template, min(overlap, template // 2 // block * block), level))
    changes = zip(PER_AXIS, zip(*fitting, strict=True), lengths, strict=True)
    return " and ".join(f"{name}={new}" for name, new, old in changes if new != old)
