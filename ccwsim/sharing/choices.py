"""The choices of the user as plain values, before they become the arguments of `simulate`."""

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
"""Answers of the user to the questions of a reader: (argument, value), sorted."""


@dataclass(frozen=True)
class Upload:
    """A file from the user's machine; its name is shown, never used as a path."""

    name: str
    content: bytes = field(repr=False)

    @cached_property
    def digest(self) -> str:
        """A short name of name and content."""
        return digest(self.name, self.content)


@dataclass(frozen=True)
class ImageChoice:
    """Which training image, how it is read, and how it is turned and named."""

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
        """A short name of all that decides how the image looks, colours excepted."""
        source = self.upload.digest if self.upload else self.bundled
        turned = self.flip_ew, self.flip_ns, self.transpose
        return digest(source, self.answers, turned, self.names)

    @property
    def files(self) -> tuple[Upload, ...]:
        """The file of the user, if it is one."""
        return () if self.upload is None else (self.upload,)


@dataclass(frozen=True)
class WellTables:
    """The other tables that a table of intervals of wells needs."""

    collars: Upload | None = None
    surveys: Upload | None = None  # none if all wells are vertical


CellsOfWells = tuple[tuple[str, tuple[tuple[int, ...], ...]], ...]
"""Names of wells, and the cells of each."""


@dataclass(frozen=True)
class DataChoice:
    """Where the hard data come from."""

    source: DataSource = "none"
    bundled: str = ""
    upload: Upload | None = None
    answers: Answers = ()
    n_sampled: int = 400
    seed_sampled: int = 1
    placed: HardData | None = None
    tables: WellTables | None = None  # `upload` has intervals of wells, and these are the others
    wells: CellsOfWells = ()  # of data placed by hand: wells that had a name in a file

    @property
    def files(self) -> tuple[Upload, ...]:
        """The files of the user."""
        tables = self.tables or WellTables()
        return tuple(f for f in (self.upload, tables.collars, tables.surveys) if f is not None)

    @property
    def waits(self) -> bool:
        """Whether a file is still to be brought."""
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
    """The results that are looked at."""

    realization: int = 0  # which one is large, from 0
    facies: int = 1  # the place of the facies whose curves and probability are shown
    e_type: EMap = "probability"  # the content of the uncertainty map
