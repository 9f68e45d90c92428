"""Generators of the bundled training images, reference fields and hard data.

`python -m tools.datasets write` generates the files in ccwsim/assets.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray
from PIL import Image

from ccwsim import datasets
from ccwsim.datasets import catalogue
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from tools.datasets.channels import bend, channels
from tools.datasets.delta import delta
from tools.datasets.deposits import barchans, dunes, lenses
from tools.datasets.fractures import fractures
from tools.datasets.levees import levees
from tools.datasets.porosity import porous_channels
from tools.datasets.stone_wall import stone_wall
from tools.datasets.volumes import folded_layers, sinuous_channels, stacked_lenses

PALETTE = [(235, 225, 200), (60, 90, 150), (190, 90, 50), (80, 140, 80)]
MIN_SIDE, MAX_SIDE = 64, 1024
FIELD_SEED = 2024
"""Seed of every reference field."""


class Generator(NamedTuple):
    """Function that generates an image of a given shape, and the seed of the bundled image."""

    draw: Callable[[Any, RandomState], NDArray[Any]]
    seed: int


class Sampling(NamedTuple):
    """How a hard data set is sampled from its reference field."""

    seed: int
    n: int
    min_spacing: float


GENERATORS = {
    "channels": Generator(channels, 10),
    "stone_wall": Generator(stone_wall, 11),
    "barchans": Generator(barchans, 5),
    "dunes": Generator(dunes, 1),
    "levees": Generator(levees, 11),
    "delta": Generator(delta, 11),
    "bend": Generator(bend, 3),
    "fractures": Generator(fractures, 2),
    "lenses": Generator(lenses, 5),
}

VOLUMES = {
    "sinuous_channels": Generator(sinuous_channels, 1),
    "stacked_lenses": Generator(stacked_lenses, 2),
    "folded_layers": Generator(folded_layers, 3),
}
N_WELLS, WELL_SPACING, WELL_SEED = 10, 12.0, 6

CONTINUOUS = {"porous_channels": Generator(porous_channels, 7)}

SAMPLINGS = {
    "channels_60_wells": Sampling(1, 60, 40.0),
    "channels_400_data": Sampling(2, 400, 0.0),
    "stone_wall_300_data": Sampling(3, 300, 0.0),
    "barchans_200_data": Sampling(4, 200, 12.0),
    "porous_channels_80_wells": Sampling(5, 80, 16.0),
}


def generate(
    name: str, *, shape: tuple[int, int] | None = None, seed: int | None = None
) -> TrainingImage:
    """Generate a training image with the generator of a bundled image.

    Parameters
    ----------
    name : str
        One of `ccwsim.datasets.names()`.
    shape : pair of int, optional
        Rows and columns, each from 64 to 1024; by default the shape of the bundled image.
    seed : int, optional
        From 0 to 2³² − 1; by default the seed of the bundled image.

    Returns
    -------
    TrainingImage
        Equal for equal arguments, except for single cells on another processor or library version,
        where rounding may differ.

    Raises
    ------
    CCWSIMError
        For an unknown name, or a shape or seed out of range.
    """
    if name not in GENERATORS:
        there = ", ".join(GENERATORS)
        raise CCWSIMError(f"training image {shown(name)} is unknown; there are {there}")
    dataset, generator = catalogue.DATASETS[name], GENERATORS[name]
    # the stream of RandomState is frozen; newer generators may change with NumPy's version
    rng = RandomState(generator.seed if seed is None else _checked_seed(seed))
    facies = generator.draw(dataset.shape if shape is None else _checked_shape(shape), rng)
    return TrainingImage(
        facies, name=name, facies_names=[dataset.facies_names[code] for code in np.unique(facies)]
    )


def generate_reference_field(image: str, side: int) -> TrainingImage:
    """Generate a square reference field with the generator of a training image."""
    return generate(image, shape=(side, side), seed=FIELD_SEED)


def generate_values(name: str, seed: int | None = None) -> TrainingImage:
    """Generate an image of a continuous variable, by default with the seed of the bundled image."""
    dataset, generator = catalogue.CONTINUOUS[name], CONTINUOUS[name]
    rng = RandomState(generator.seed if seed is None else _checked_seed(seed))
    values, variable = generator.draw(dataset.shape, rng), dataset.variable
    return TrainingImage.from_array(values, continuous=True, name=name, variable=variable)


def generate_measurements(name: str) -> HardData:
    """Sample the bundled data of a continuous variable from a field with another seed."""
    how, image = SAMPLINGS[name], datasets.hard_data_training_image(name)
    field = generate_values(image, FIELD_SEED)
    cells = scattered_data(field.indices, how.n, how.min_spacing, RandomState(how.seed)).cells
    return HardData(cells, values={v: a[tuple(cells.T)] for v, a in field.values.items()})


def generate_hard_data(name: str) -> HardData:
    """Sample the bundled hard data from their reference field."""
    how, side = SAMPLINGS[name], datasets.hard_data_grid_shape(name)[0]
    field = generate_reference_field(datasets.hard_data_training_image(name), side)
    return scattered_data(field.array, how.n, how.min_spacing, RandomState(how.seed))


def generate_volume(
    name: str, *, shape: tuple[int, int, int] | None = None, seed: int | None = None
) -> TrainingImage:
    """Generate a volume with a bundled volume's generator, and by default its shape and seed."""
    dataset, generator = catalogue.VOLUMES[name], VOLUMES[name]
    rng = RandomState(generator.seed if seed is None else _checked_seed(seed))
    facies = generator.draw(shape or dataset.shape, rng)
    names = [dataset.facies_names[code] for code in np.unique(facies)]
    return TrainingImage(facies, name=name, facies_names=names)


def generate_wells(name: str) -> HardData:
    """Sample vertical wells from a volume of the same generator with another seed."""
    field = generate_volume(name, shape=catalogue.WELLS_SHAPE, seed=FIELD_SEED).array
    places = scattered_data(field[0], N_WELLS, WELL_SPACING, RandomState(WELL_SEED)).cells
    cells = np.array([(z, row, column) for row, column in places for z in range(len(field))])
    return HardData(cells, field[tuple(cells.T)])


def scattered_data(
    field: NDArray[np.integer], n: int, min_spacing: float, rng: RandomState
) -> HardData:
    """Sample n cells of a field, shape (ny, nx), that are at least `min_spacing` cells apart.

    The result has fewer than n data if the field has no room for n data.
    """
    cells = np.empty((n, 2), np.int64)
    found = 0
    for candidate in rng.permutation(field.size):
        cell = np.array(divmod(int(candidate), field.shape[1]))
        if (np.hypot(*(cells[:found] - cell).T) >= min_spacing).all():
            cells[found] = cell
            found += 1
            if found == n:
                break
    chosen = cells[:found]
    return HardData(chosen, field[chosen[:, 0], chosen[:, 1]])


def write_image(path: Path, facies: NDArray[np.integer]) -> None:
    """Write facies codes 0, 1, … of shape (ny, nx), row 0 at the south, as an indexed PNG."""
    image = Image.fromarray(np.ascontiguousarray(facies[::-1], np.uint8))
    image.putpalette([channel for colour in PALETTE for channel in colour])
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, optimize=True, bits=2)


def write_hard_data(path: Path, data: HardData, grid: Grid) -> None:
    """Write hard data as columns x, y, (for a volume) z, and facies or the continuous variable."""
    (what, measured), *_ = [*data.values.items(), ("facies", data.facies)]
    rows = np.column_stack([grid.centers_of(data.cells), measured])
    path.parent.mkdir(parents=True, exist_ok=True)
    kinds, axes = ["%.1f"] * grid.n_dimensions, "xyz"[: grid.n_dimensions]
    header = ",".join([*axes, what])
    np.savetxt(path, rows, fmt=(*kinds, "%.10g"), delimiter=",", header=header, comments="")


def write_assets() -> None:
    """Generate all bundled images, fields and data sets, and write the files to ccwsim/assets."""
    for name in datasets.names():
        write_image(catalogue.image_path(name), generate(name).array)
    for name, sides in catalogue.FIELD_SIDES.items():
        for side in sides:
            field = generate_reference_field(name, side)
            write_image(catalogue.field_path(name, side), field.array)
    for name in datasets.hard_data_names():
        grid = Grid.of(datasets.hard_data_grid_shape(name))
        write_hard_data(catalogue.hard_data_path(name), generate_hard_data(name), grid)
    for name, image in catalogue.CONTINUOUS.items():
        np.savez_compressed(
            catalogue.image_path(name), ti=generate_values(name).values[image.variable]
        )
    for name, survey in datasets.BUNDLED_MEASUREMENTS.items():
        grid = Grid.of(survey.grid_shape)
        write_hard_data(catalogue.hard_data_path(name), generate_measurements(name), grid)
    grid = Grid.of(catalogue.WELLS_SHAPE)
    for name in datasets.volume_names():
        write_hard_data(catalogue.hard_data_path(f"{name}_10_wells"), generate_wells(name), grid)
        np.savez_compressed(catalogue.image_path(name), ti=generate_volume(name).array)


def _checked_seed(seed: int) -> int:
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < 2**32:
        raise CCWSIMError(f"seed = {shown(seed)} must be a whole number from 0 to {2**32 - 1}")
    return int(seed)


def _checked_shape(shape: tuple[int, int]) -> tuple[int, int]:
    sides = shape if isinstance(shape, (tuple, list)) else ()
    fitting = [n for n in sides if isinstance(n, (int, np.integer)) and MIN_SIDE <= n <= MAX_SIDE]
    if len(sides) != 2 or len(fitting) != 2:
        raise CCWSIMError(
            f"shape = {shown(shape)} must be two whole numbers (rows, columns) from {MIN_SIDE} to "
            f"{MAX_SIDE}"
        )
    return int(shape[0]), int(shape[1])
