"""Read and describe the bundled training images, hard data and reference fields.

Images are indexed PNG files, whose indices are the facies codes; the first row is in the north.
Volumes and continuous variables are npz files. Hard data are CSV files with the columns x, y, (for
volumes) z, and facies or the continuous variable.
Coordinates are cell centres, in cells from the south-west corner of the grid.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TypeVar

import numpy as np
from PIL import Image

from ccwsim import Grid, HardData, TrainingImage
from ccwsim.model import Bytes, CCWSIMError, Shape, describe_shape, read_toml, refused, shown

ASSETS = Path(__file__).parents[1] / "assets"
Row = TypeVar("Row")


@dataclass(frozen=True)
class Dataset:
    """Description of a bundled training image."""

    shape: Shape
    picture: str
    good_for: str
    facies_names: tuple[str, ...] = ()
    variable: str = ""  # name of a continuous variable


@dataclass(frozen=True)
class Survey:
    """Description of bundled hard data."""

    training_image: str
    grid_shape: Shape
    picture: str


_TABLES = read_toml("assets/datasets.toml")


def _rows(kind: type[Row], table: str) -> dict[str, Row]:
    """Return the rows of a table by name, with lists converted to tuples."""
    return {
        name: kind(**{key: tuple(v) if isinstance(v, list) else v for key, v in row.items()})
        for name, row in _TABLES[table].items()
    }


DATASETS = _rows(Dataset, "images")
VOLUMES = _rows(Dataset, "volumes")
"""Bundled volumes; ten vertical wells for each volume were sampled from a similar volume."""
CONTINUOUS = _rows(Dataset, "continuous")
BUNDLED_IMAGES = DATASETS | CONTINUOUS | VOLUMES
"""Descriptions of the bundled training images, by name."""
WELLS_SHAPE = (48, 100, 100)  # shape of the simulation grid for the bundled wells

BUNDLED_SURVEYS = _rows(Survey, "surveys")
BUNDLED_WELLS = {
    f"{name}_10_wells": Survey(name, WELLS_SHAPE, "10 vertical wells") for name in VOLUMES
}
"""Descriptions of the bundled wells, by name of the hard data."""
BUNDLED_MEASUREMENTS = _rows(Survey, "measurements")
"""Descriptions of the bundled data of continuous variables, by name."""
BUNDLED_DATA = BUNDLED_SURVEYS | BUNDLED_MEASUREMENTS | BUNDLED_WELLS
"""Descriptions of all bundled hard data, by name."""

FIELD_SIDES = {"channels": (256, 512), "stone_wall": (512,), "barchans": (512, 1000)}
"""Sides in cells of each image's square reference fields, generated with another seed."""


def names() -> tuple[str, ...]:
    """Return the names of the bundled training images.

    Examples
    --------
    >>> "channels" in names()
    True
    """
    return tuple(DATASETS)


def volume_names() -> tuple[str, ...]:
    """Return the names of the bundled volumes.

    Examples
    --------
    >>> volume_names()
    ('sinuous_channels', 'stacked_lenses', 'folded_layers')
    """
    return tuple(VOLUMES)


@cache
def load(name: str) -> TrainingImage:
    """Read a bundled training image, one of `BUNDLED_IMAGES`.

    Examples
    --------
    >>> ti = load("channels")
    >>> ti.shape, ti.facies_names
    ((256, 256), ('mud', 'sand'))
    """
    dataset, path = _dataset(name), image_path(name)
    if path.suffix == ".npz":
        with np.load(_present(path)) as file:
            array = file["ti"]  # row 0 in the south, layer 0 at the bottom
    else:
        array = read_image(path)
    if variable := dataset.variable:
        return TrainingImage.from_array(array, continuous=True, name=name, variable=variable)
    return TrainingImage(array, name=name, facies_names=dataset.facies_names)


def describe(name: str) -> str:
    """Describe a bundled training image in one line: its content, size and use.

    Examples
    --------
    >>> print(describe("stone_wall"))
    Rounded stones of many sizes in mortar that is connected everywhere (200 × 200 cells; stone,
    mortar). Good for closed shapes: stones must not break, joints must not stop.
    """
    dataset = _dataset(name)
    size, what = describe_shape(dataset.shape), dataset.variable or ", ".join(dataset.facies_names)
    return f"{dataset.picture} ({size} cells; {what}). Good for {dataset.good_for}."


def hard_data_names() -> tuple[str, ...]:
    """Return the names of the bundled hard data of facies in maps.

    Examples
    --------
    >>> "channels_60_wells" in hard_data_names()
    True
    """
    return tuple(BUNDLED_SURVEYS)


@cache
def load_hard_data(name: str) -> HardData:
    """Read bundled hard data for a grid of the shape `hard_data_grid_shape(name)`.

    Examples
    --------
    >>> load_hard_data("channels_60_wells")
    HardData(n=60)
    """
    survey, path = _survey(name), _present(hard_data_path(name))
    *places, measured = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    cells = Grid.of(survey.grid_shape).cells_of(*places)
    if variable := _dataset(survey.training_image).variable:
        return HardData(cells, values={variable: measured})
    return HardData(cells, measured)


def hard_data_grid_shape(name: str) -> tuple[int, ...]:
    """Return the shape of the grid of bundled hard data: (layers,) rows and columns.

    Examples
    --------
    >>> hard_data_grid_shape("channels_60_wells")
    (512, 512)
    """
    return _survey(name).grid_shape


def hard_data_training_image(name: str) -> str:
    """Return the name of the training image for bundled hard data.

    Examples
    --------
    >>> hard_data_training_image("channels_60_wells")
    'channels'
    """
    return _survey(name).training_image


def describe_hard_data(name: str) -> str:
    """Describe bundled hard data in one line.

    Examples
    --------
    >>> describe_hard_data("channels_60_wells")
    '60 wells, none close to another (512 × 512 cells, for the training image channels).'
    """
    survey = _survey(name)
    size = describe_shape(survey.grid_shape)
    return f"{survey.picture} ({size} cells, for the training image {survey.training_image})."


def load_reference_field(name: str) -> TrainingImage:
    """Read the reference field from which data for a map, one of `hard_data_names()`, were sampled.

    The training image's generator made the field with another seed. Use it to score realizations.

    Examples
    --------
    >>> field = load_reference_field("channels_60_wells")
    >>> load_hard_data("channels_60_wells").n_mismatched(field.array)
    0
    """
    survey = _survey(name)
    if name not in BUNDLED_SURVEYS:
        raise CCWSIMError(f"the field from which {name} were sampled is not bundled")
    ny, nx = survey.grid_shape
    return reference_field(survey.training_image, (ny, nx))


@cache
def reference_field(image: str, shape: tuple[int, int]) -> TrainingImage:
    """Return the reference field of a training image, cut to `shape` if it is larger."""
    sides = FIELD_SIDES[image]
    side = next((side for side in sides if side >= max(shape)), sides[-1])
    codes = read_image(field_path(image, side))[: shape[0], : shape[1]]
    facies_names = [_dataset(image).facies_names[code] for code in np.unique(codes)]
    return TrainingImage(codes, name=image, facies_names=facies_names)


def image_path(name: str) -> Path:
    """Return the path of the file of a training image (a map or a volume)."""
    if name not in DATASETS:
        return ASSETS / ("volumes" if name in VOLUMES else "training_images") / f"{name}.npz"
    return ASSETS / "training_images" / f"{name}.png"


def hard_data_path(name: str) -> Path:
    """Return the path of the file of hard data."""
    return ASSETS / ("volumes" if name in BUNDLED_WELLS else "hard_data") / f"{name}.csv"


def field_path(image: str, side: int) -> Path:
    """Return the path of the file of a reference field."""
    return ASSETS / "reference_fields" / f"{image}_{side}.png"


def read_image(path: Path) -> Bytes:
    """Return the facies codes of a bundled image, shape (ny, nx), row 0 at the south."""
    with Image.open(_present(path)) as image:
        return np.asarray(image, np.uint8)[::-1]


def _present(path: Path) -> Path:
    if not path.is_file():
        raise refused("bundled_file_missing", path=path)
    return path


def _dataset(name: str) -> Dataset:
    if name not in BUNDLED_IMAGES:
        raise CCWSIMError(
            f"training image {shown(name)} is unknown; there are {', '.join(BUNDLED_IMAGES)}"
        )
    return BUNDLED_IMAGES[name]


def _survey(name: str) -> Survey:
    if name not in BUNDLED_DATA:
        raise CCWSIMError(
            f"hard data {shown(name)} are unknown; there are {', '.join(BUNDLED_DATA)}"
        )
    return BUNDLED_DATA[name]
