"""The user's choices as plain values, from which the arguments of `simulate` are made."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import Any, Literal, Self

from ccwsim import CCWSIMError, Grid, HardData, Parameters, Secondary
from ccwsim.model import (
    MAX_AUXILIARY_WEIGHT,
    MAX_CONDUCTIVITY,
    MAX_DEGREES,
    MAX_FACIES,
    MAX_MAGNITUDE,
    MAX_REALIZATIONS_COMPARED,
    MAX_REALIZATIONS_OF_SWEEP,
    MAX_SCALE,
    MAX_SETTINGS,
    MAX_SOFT_WEIGHT,
    MIN_CONDUCTIVITY,
    MIN_SCALE,
    MIN_SETTINGS,
    check_number,
    digest,
)

DataSource = Literal["none", "bundled", "file", "sampled", "placed"]
MIN_POROSITY = 0.01
MAX_CORNERS = 1000  # maximum number of corners of a drawn polygon, and of points of a stroke
EMap = Literal["probability", "most likely", "entropy", "mean", "deviation", "P10", "P50", "P90"]
Answers = tuple[tuple[str, Any], ...]
"""The user's answers to the questions of a file reader, as sorted (argument, value) pairs."""
FaciesAnswers = tuple[tuple[str, int], ...]  # codes of the training image, by code or name


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
    facies_names: FaciesAnswers = ()  # facies of the study's image, if this is a further image

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

    @property
    def rotated(self) -> Self:
        """The choice of the same image, turned by a further 90° anticlockwise."""
        return replace(
            self, transpose=not self.transpose, flip_ew=not self.flip_ns, flip_ns=self.flip_ew
        )

    def variant(self, name: str) -> Self:
        """Return the choice of a turned or mirrored variant of `metrics.rank_variants`."""
        choice = replace(self, flip_ew=self.flip_ew != ("mirrored" in name))
        degrees = next((angle for angle in (90, 180, 270) if f"{angle}°" in name), 360)
        for _ in range(degrees, 360, 90):  # variants are turned clockwise
            choice = choice.rotated
        return choice


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
    def digest(self) -> str:
        """Short digest of the files, the data placed by hand, and the answers."""
        placed = self.placed and self.placed.digest
        return digest(*(file.digest for file in self.files), placed, self.answers, self.wells)

    @property
    def waits(self) -> bool:
        """Whether the chosen source is a file that is not uploaded yet."""
        tables = self.tables
        missing = self.upload is None or (tables is not None and tables.collars is None)
        return self.source == "file" and missing

    def without_facies(self) -> Self:
        """Return the choice without answers about facies, which are for one training image."""
        return replace(self, answers=tuple(a for a in self.answers if a[0] != "facies_names"))


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

    probabilities: Upload | tuple[Upload, ...] | Gradient | tuple[Stroke, ...] | None = None
    facies: int = 1  # index of the facies of a shape, or of the map of files that is shown
    facies_names: FaciesAnswers = ()  # facies of the maps in files
    soft_weight: float = 1.0
    active: Upload | Corners | None = None
    active_codes: tuple[float, ...] = ()  # values of a mask in active cells; () for the usual ones
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

    def __post_init__(self) -> None:
        for name, low, high in (
            ("facies", 0, MAX_FACIES - 1),
            ("soft_weight", 0, MAX_SOFT_WEIGHT),
            ("auxiliary_weight", 0, MAX_AUXILIARY_WEIGHT),
            ("flow_azimuth", -MAX_DEGREES, MAX_DEGREES),
            ("scale", MIN_SCALE, MAX_SCALE),
        ):
            check_number(f"{name} of the guides", getattr(self, name), low, high)
        outlines = *(self.zones if isinstance(self.zones, tuple) else ()), self.active
        lines = self.angle if isinstance(self.angle, tuple) else ()
        shapes = *((outline, 3) for outline in outlines), *((line, 2) for line in lines)
        if any(isinstance(shape, tuple) and len(shape) < least for shape, least in shapes):
            raise CCWSIMError("an outline needs three points, and a line two")

    @property
    def probability_files(self) -> tuple[Upload, ...]:
        """The uploaded files of probabilities."""
        soft = self.probabilities
        several = soft if isinstance(soft, tuple) else (soft,)
        return tuple(file for file in several if isinstance(file, Upload))

    @property
    def points(self) -> Corners:
        """The points of all shapes drawn on the map."""
        soft = self.probabilities
        strokes: Any = soft if isinstance(soft, tuple) and not self.probability_files else ()
        shapes = [self.active if isinstance(self.active, tuple) else ()]
        shapes += self.zones if isinstance(self.zones, tuple) else ()
        shapes += self.angle if isinstance(self.angle, tuple) else ()
        return tuple(chain.from_iterable([*shapes, *(stroke.points for stroke in strokes)]))

    @property
    def files(self) -> tuple[Upload, ...]:
        """The uploaded files."""
        pair = self.auxiliary if isinstance(self.auxiliary, tuple) else ()
        image_files = chain.from_iterable(image.files for image in self.images)
        guides = (*self.probability_files, self.active, self.angle, self.zones, *pair, *image_files)
        return tuple(file for file in guides if isinstance(file, Upload))

    def without_facies(self) -> Self:
        """Return the choice without answers about facies, which are for one training image."""
        images = tuple(replace(image, facies_names=()) for image in self.images)
        return replace(self, facies_names=(), images=images)

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


Rocks = tuple[tuple[str, tuple[float, float]], ...]
"""Conductivity in m/s and porosity by the name of a facies."""


@dataclass(frozen=True)
class FlowChoice:
    """The settings of the page Flow; lengths and heads in m."""

    rocks: Rocks = ()  # only of facies whose values were changed
    # what the values of a continuous variable are; K and porosity otherwise follow from classes
    values_are: Literal["classes", "K", "log K", "porosity"] = "classes"
    unit: Literal["m/s", "m/d"] = "m/s"
    # "edge" for heads along the outline; None for the usual heads
    axis: Literal["x", "y", "z", "edge"] | None = None
    along: Literal["x", "y", "points", "constant"] = "x"  # how heads change along the outline
    points: tuple[float, ...] = ()  # x, y, x, y of two points of a line; () for corners of the grid
    thickness: float = 1.0  # of a map
    high: float = 1.0
    low: float = 0.0
    anisotropy: float = 1.0
    well: tuple[int, ...] | None = None  # cell
    rate: float = 0.0  # m³/d

    def __post_init__(self) -> None:
        heads = self.high, self.low, *self.points
        limits = (
            ([k for _, (k, _) in self.rocks], MIN_CONDUCTIVITY, MAX_CONDUCTIVITY),
            ([porosity for _, (_, porosity) in self.rocks], MIN_POROSITY, 1.0),
            ([self.thickness], 0.001, 1e5),
            ([self.anisotropy], 0.001, 1.0),
            (heads, -MAX_MAGNITUDE, MAX_MAGNITUDE),
            ([self.rate, *(self.well or ())], 0.0, MAX_MAGNITUDE),
        )
        for values, low, high in limits:
            for value in values:
                check_number("a setting of the page Flow", value, low, high)
        if len(self.points) not in (0, 4) or len(self.well or (0, 0)) not in (2, 3):
            raise CCWSIMError("Flow needs x, y, x, y of two points, and the cell of a well")


Beside = ImageChoice | Literal["", "two-point"]
"""Simulation shown beside the compared settings: none, two-point, or a second training image."""


@dataclass(frozen=True)
class CompareChoice:
    """The settings of the page Compare beside the setting of the study."""

    others: tuple[Parameters | None, ...] = (None, None)  # None: usual, derived from the study
    n: int | None = None  # realizations per setting; None for the usual number
    beside: Beside = ""

    def __post_init__(self) -> None:
        check_number(
            "the number of compared settings", len(self.others) + 1, MIN_SETTINGS, MAX_SETTINGS
        )
        if self.n is not None:
            check_number("realizations compared", self.n, 1, MAX_REALIZATIONS_COMPARED)


@dataclass(frozen=True)
class SweepChoice:
    """The settings of the page Sweep; other ranges depend on the study."""

    ranges: tuple[tuple[str, tuple[Any, ...]], ...] = ()  # chosen ranges, by parameter
    n_realizations: int = 4  # per setting
    # that the chart shows, as in `SWEEP_ERRORS`
    error: Literal["patterns", "connection", "proportions", "copying", "mended"] = "patterns"

    def __post_init__(self) -> None:
        check_number("realizations of a sweep", self.n_realizations, 1, MAX_REALIZATIONS_OF_SWEEP)


@dataclass(frozen=True)
class Shown:
    """The results that the user has selected for display, and the settings of pages."""

    realization: int = 0  # index of the realization shown large, from 0
    facies: int | None = None  # index in curves and probability map; None if not chosen
    e_type: EMap = "probability"  # name of the selected uncertainty map
    threshold: float | None = None  # of a continuous variable; None for the median of the image
    flow: FlowChoice = FlowChoice()
    compare: CompareChoice = CompareChoice()
    sweep: SweepChoice = SweepChoice()
