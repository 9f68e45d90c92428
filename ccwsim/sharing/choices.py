"""The user's choices as plain values, from which the arguments of `simulate` are made."""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from typing import Any, Literal

from ccwsim import CCWSIMError, Grid, HardData, Parameters, Secondary
from ccwsim.model.arrays import check_number, digest

DataSource = Literal["none", "bundled", "file", "sampled", "placed"]
MAX_CORNERS = 1000  # maximum number of corners of a drawn polygon, and of points of a stroke
EMap = Literal["probability", "most likely", "entropy"]
Answers = tuple[tuple[str, Any], ...]
"""The user's answers to the questions of a file reader, as sorted (argument, value) pairs."""


@dataclass(frozen=True)
class Upload:
    """A file uploaded by the user; the file name is displayed but never used as a path."""

    name: str
    content: bytes = field(repr=False)

    @cached_property
    def digest(self) -> str:
        """Short digest of the file's name and content."""
        return digest(self.name, self.content)


@dataclass(frozen=True)
class ImageChoice:
    """Choice of the training image, with reading options, orientation and facies names."""

    bundled: str = "channels"
    upload: Upload | None = None
    answers: Answers = ()
    flip_ew: bool = False
    flip_ns: bool = False
    transpose: bool = False
    names: tuple[str, ...] = ()
    colours: tuple[tuple[int, str], ...] = ()

    @property
    def digest(self) -> str:
        """Short digest of all choices, except colours, that determine the training image."""
        source = self.upload.digest if self.upload else self.bundled
        turned = self.flip_ew, self.flip_ns, self.transpose
        return digest(source, self.answers, turned, self.names)

    @property
    def files(self) -> tuple[Upload, ...]:
        """The uploaded file of the training image, or an empty tuple."""
        return () if self.upload is None else (self.upload,)


@dataclass(frozen=True)
class WellTables:
    """The tables that complete a table of well intervals: collars and deviation surveys."""

    collars: Upload | None = None
    surveys: Upload | None = None  # deviation surveys; None if all wells are vertical


CellsOfWells = tuple[tuple[str, tuple[tuple[int, ...], ...]], ...]  # (name, cells) pairs


@dataclass(frozen=True)
class DataChoice:
    """Choice of the hard data and of the source of these data."""

    source: DataSource = "none"
    bundled: str = ""
    upload: Upload | None = None
    answers: Answers = ()
    n_sampled: int = 400
    seed_sampled: int = 1
    placed: HardData | None = None
    tables: WellTables | None = None  # collars and surveys if `upload` has well intervals
    wells: CellsOfWells = ()  # wells by name, if edited data were read from a file

    @property
    def files(self) -> tuple[Upload, ...]:
        """The uploaded files of the hard data."""
        tables = self.tables or WellTables()
        return tuple(f for f in (self.upload, tables.collars, tables.surveys) if f is not None)

    @property
    def waits(self) -> bool:
        """Whether the chosen source is a file that is not uploaded yet."""
        tables = self.tables
        missing = self.upload is None or (tables is not None and tables.collars is None)
        return self.source == "file" and missing


@dataclass(frozen=True)
class Gradient:
    """A probability of the chosen facies, or an angle, that changes linearly across the grid."""

    azimuth: float = 90.0  # direction of the change, in degrees from north, clockwise
    start: float = 0.0  # value at the edge where the change begins
    end: float = 1.0


@dataclass(frozen=True)
class Directions:
    """Directions of image and grid whose positions correspond; a trend is turned from one to the
    other."""

    image: float = 0.0  # azimuth in the training image, in degrees from north, clockwise
    grid: float = 0.0


Corners = tuple[tuple[float, float], ...]  # (x, y) of a polygon or a line, world coordinates


@dataclass(frozen=True)
class Stroke:
    """A stroke of a brush, which draws a probability of the chosen facies."""

    value: float  # probability in the middle of the stroke
    radius: float  # half of the width of the brush, in world coordinates
    softness: float  # share of the radius within which the probability fades into its surroundings
    points: Corners

    def __post_init__(self) -> None:
        for name, low, high in (("value", 0, 1), ("softness", 0, 1), ("radius", 1e-12, 1e300)):
            check_number(f"{name} of a stroke", getattr(self, name), low, high)
        if not 1 <= len(self.points) <= MAX_CORNERS:
            raise CCWSIMError(f"a stroke of {len(self.points)} points: draw 1 to {MAX_CORNERS}")


@dataclass(frozen=True)
class ZoneLayers:
    """Zones of a volume: each further image is used from its first layer up to the next zone."""

    first: tuple[int, ...]  # number of a layer, from 0 at the bottom, for each further image


@dataclass(frozen=True)
class GuideChoice:
    """Choice of the secondary information: files and shapes, or the arrays of a project."""

    probabilities: Upload | Gradient | tuple[Stroke, ...] | None = None
    facies: int = 1  # index of the facies of a shape, or of a file with one variable
    soft_weight: float = 1.0
    active: Upload | Corners | None = None
    # files of image and grid, or directions
    auxiliary: tuple[Upload | None, Upload | None] | Directions | None = None
    auxiliary_weight: float = 1.0
    # degrees from north, clockwise; or lines, which a direction of the image follows
    angle: Upload | Gradient | tuple[Corners, ...] | float | None = None
    flow_azimuth: float = 0.0  # the direction in the image that follows drawn lines
    scale: float = 1.0
    mirrored: str = ""  # axes, of x, y and z
    images: tuple[ImageChoice, ...] = ()  # further training images
    # outlines, layers, or a share of patches
    zones: Upload | tuple[Corners, ...] | ZoneLayers | float | None = None
    saved: Secondary | None = None  # arrays of a project, used instead of files and shapes

    @property
    def points(self) -> Corners:
        """The points of all shapes drawn on the map."""
        strokes = self.probabilities if isinstance(self.probabilities, tuple) else ()
        shapes = [self.active if isinstance(self.active, tuple) else ()]
        shapes += self.zones if isinstance(self.zones, tuple) else ()
        shapes += self.angle if isinstance(self.angle, tuple) else ()
        return tuple(chain.from_iterable([*shapes, *(stroke.points for stroke in strokes)]))

    @property
    def files(self) -> tuple[Upload, ...]:
        """The uploaded files."""
        pair = self.auxiliary if isinstance(self.auxiliary, tuple) else ()
        image_files = chain.from_iterable(image.files for image in self.images)
        guides = (self.probabilities, self.active, self.angle, self.zones, *pair, *image_files)
        return tuple(file for file in guides if isinstance(file, Upload))

    @property
    def is_empty(self) -> bool:
        """Whether nothing is chosen."""
        guides = self.probabilities, self.active, self.auxiliary, self.angle, self.saved
        has_options = self.scale != 1 or self.mirrored or self.images
        return all(one is None for one in guides) and not has_options

    @property
    def digest(self) -> str:
        """Short digest of all choices."""
        saved = self.saved and self.saved.digest
        names = [name for name in self.__dataclass_fields__ if name != "saved"]
        parts = [repr(getattr(self, name)) for name in names]  # without the contents of files
        parts += [file.digest for file in self.files]
        return digest(*parts, saved)


@dataclass(frozen=True)
class Choices:
    """All choices of the user that define a study."""

    image: ImageChoice = ImageChoice()
    data: DataChoice = DataChoice("bundled", "channels_400_data")
    grid: Grid = field(default_factory=lambda: Grid(512, 512))
    parameters: Parameters = field(default_factory=Parameters)
    n_realizations: int = 12
    seed: int = 0
    guides: GuideChoice = GuideChoice()


@dataclass(frozen=True)
class Shown:
    """The results that the user has selected for display."""

    realization: int = 0  # index of the realization shown large, from 0
    facies: int = 1  # index of the facies for the curves and the probability map
    e_type: EMap = "probability"  # name of the selected uncertainty map
