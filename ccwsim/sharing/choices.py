"""The user's choices as plain values; the arguments of `simulate` are made from them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

from ccwsim.model.arrays import digest
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters

DataSource = Literal["none", "bundled", "file", "sampled", "placed"]
EMap = Literal["probability", "most likely", "entropy"]
Answers = tuple[tuple[str, Any], ...]
"""The user's answers to questions of a file reader, as sorted (argument, value) pairs."""


@dataclass(frozen=True)
class Upload:
    """A file uploaded by the user; its name is shown, never used as a path."""

    name: str
    content: bytes = field(repr=False)

    @cached_property
    def digest(self) -> str:
        """Short digest of name and content."""
        return digest(self.name, self.content)


@dataclass(frozen=True)
class ImageChoice:
    """Choice of the training image, with its reading options, orientation and names."""

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
        """Short digest of all choices that determine the image; colours are left out."""
        source = self.upload.digest if self.upload else self.bundled
        turned = self.flip_ew, self.flip_ns, self.transpose
        return digest(source, self.answers, turned, self.names)

    @property
    def files(self) -> tuple[Upload, ...]:
        """The uploaded file, if the image comes from one."""
        return () if self.upload is None else (self.upload,)


@dataclass(frozen=True)
class WellTables:
    """Tables that belong to a table of well intervals."""

    collars: Upload | None = None
    surveys: Upload | None = None  # None if all wells are vertical


CellsOfWells = tuple[tuple[str, tuple[tuple[int, ...], ...]], ...]
"""Wells as (name, cells) pairs."""


@dataclass(frozen=True)
class DataChoice:
    """Choice of the source of the hard data."""

    source: DataSource = "none"
    bundled: str = ""
    upload: Upload | None = None
    answers: Answers = ()
    n_sampled: int = 400
    seed_sampled: int = 1
    placed: HardData | None = None
    tables: WellTables | None = None  # the other tables if `upload` has well intervals
    wells: CellsOfWells = ()  # wells by name, if data placed by hand came from a file

    @property
    def files(self) -> tuple[Upload, ...]:
        """The uploaded files."""
        tables = self.tables or WellTables()
        return tuple(f for f in (self.upload, tables.collars, tables.surveys) if f is not None)

    @property
    def waits(self) -> bool:
        """Whether a file still has to be uploaded."""
        tables = self.tables
        missing = self.upload is None or (tables is not None and tables.collars is None)
        return self.source == "file" and missing


@dataclass(frozen=True)
class Choices:
    """A whole study as the user set it up."""

    image: ImageChoice = ImageChoice()
    data: DataChoice = DataChoice("bundled", "channels_400_data")
    grid: Grid = field(default_factory=lambda: Grid(512, 512))
    parameters: Parameters = field(default_factory=Parameters)
    n_realizations: int = 12
    seed: int = 0


@dataclass(frozen=True)
class Shown:
    """The results that the user looks at."""

    realization: int = 0  # number of the large realization, from 0
    facies: int = 1  # index of the facies whose curves and probability are shown
    e_type: EMap = "probability"  # name of the uncertainty map
