"""Numbers from the paper and from measurements of the published codes, with their sources.

Seconds from another machine and language cannot be compared with seconds measured here. Ratios
within one source (of two levels, methods or numbers of data) can be compared.
"""

import csv
from dataclasses import dataclass
from importlib.resources import files
from operator import attrgetter
from typing import Any, NamedTuple

from ccwsim.paper.experiment import TEXTS


@dataclass(frozen=True)
class Source:
    """Source of published CPU times."""

    reference: str  # name of the publication or of the measurement
    machine: str  # language and machine


SOURCES = {name: Source(**about) for name, about in TEXTS["sources"].items()}
"""Sources of times, by their names in the table of times."""
PAPER, OCTAVE = SOURCES["paper"], SOURCES["octave"]


@dataclass(frozen=True)
class PublishedTime:
    """CPU time of one realization, as reported by a source."""

    source: Source
    where: str  # table or figure in the source
    image: str  # training image: "channel", "stone wall", "three facies", …
    n_cells: int | None  # number of grid cells; None if unknown
    n_data: int | None  # number of hard data (0: unconditional run); None if unknown
    method: str  # "ccwsim", "ms-ccsim" or "ccsim"
    level: int | None  # wavelet level (for MS-CCSIM, the scale); None if unknown
    cpu_seconds: float | None  # CPU time; None if no run was completed
    wrong_share: float | None = None  # data not honoured; None if unknown
    note: str = ""


def _read_times() -> tuple[PublishedTime, ...]:
    """Read the table of times in the folder of this module; empty fields are unknown values."""
    text = files("ccwsim.paper").joinpath("published_times.csv").read_text("utf-8")
    kinds = dict.fromkeys(("n_cells", "n_data", "level"), int)
    kinds |= dict.fromkeys(("cpu_seconds", "wrong_share"), float)
    times = []
    for row in csv.DictReader(text.splitlines()):
        values: dict[str, Any] = {**row, "source": SOURCES[row["source"]]}
        values |= {key: kind(row[key]) if row[key] else None for key, kind in kinds.items()}
        times.append(PublishedTime(**values))
    return tuple(times)


ALL_TIMES = _read_times()
TABLE_2 = tuple(t for t in ALL_TIMES if t.where == "Table 2")
"""CPU times of Table 2 by number of hard data, method, level and image, for T 32 and OR 8."""
TABLE_2_DATA = (1000, 2000)  # numbers of hard data in Table 2
FIGURE_13 = tuple(t for t in ALL_TIMES if t.where == "Fig. 13")
"""CPU times of Fig. 13 for the largest grid; no numbers are available for the other four grids."""
LEVEL_CHANGES = {(1, 2): -0.548, (2, 3): -0.174}
"""Fig. 13: relative change of CPU time from one level to the next, averaged over the five sizes."""
OCTAVE_TIMES = tuple(t for t in ALL_TIMES if t.source is OCTAVE)
"""Times and shares of wrong data measured on the published codes in GNU Octave."""


class RelativeDistances(NamedTuple):
    """Ratios of CCWSIM's ANODI distances to MS-CCSIM's distances at resolutions 1, 1/2 and 1/3."""

    between: tuple[float, float, float]
    within: tuple[float, float, float]
    ratio: float  # r = Σ w · between / within over the resolutions


TABLE_1 = {
    name: RelativeDistances(**about["table_1"])
    for name, about in TEXTS["images"].items()
    if "table_1" in about
}
"""Table 1 of the paper, by training image."""


def published_time(
    source: Source, method: str, level: int, n_cells: int, n_data: int, image: str = "channel"
) -> PublishedTime | None:
    """Return the time that a source reports for a case, or None if there is no such time."""
    case = source, method, level, n_cells, n_data, image
    case_of = attrgetter("source", "method", "level", "n_cells", "n_data", "image")
    return next((t for t in ALL_TIMES if case_of(t) == case), None)


def stated_seconds(where: str) -> float | None:
    """Return the time that the paper states for a figure, or None if it states none."""
    return next((t.cpu_seconds for t in ALL_TIMES if t.where == where), None)
