"""Numbers from the paper.

Seconds from another machine and language cannot be compared with seconds measured here. Ratios of
two levels, methods or numbers of data can be compared.
"""

import csv
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, NamedTuple

from ccwsim.paper.experiment import PAPER_TEXTS


@dataclass(frozen=True)
class PublishedTime:
    """CPU time of one realization, as reported by the paper."""

    where: str  # table or figure
    image: str  # training image: "channel", "stone wall", "three facies", …
    n_cells: int | None  # number of grid cells; None if unknown
    n_data: int | None  # number of hard data (0: unconditional run); None if unknown
    method: str  # "ccwsim", "ms-ccsim" or "ccsim"
    level: int | None  # wavelet level (for MS-CCSIM, the scale); None if unknown
    cpu_seconds: float


def _read_times() -> tuple[PublishedTime, ...]:
    """Read the table of times in the folder of this module; empty fields are unknown values."""
    text = files("ccwsim.paper").joinpath("published_times.csv").read_text("utf-8")
    times = []
    for row in csv.DictReader(text.splitlines()):
        values: dict[str, Any] = row | {"cpu_seconds": float(row["cpu_seconds"])}
        for key in ("n_cells", "n_data", "level"):
            values[key] = int(row[key]) if row[key] else None
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


class RelativeDistances(NamedTuple):
    """Ratios of CCWSIM's ANODI distances to MS-CCSIM's distances at resolutions 1, 1/2 and 1/3."""

    between: tuple[float, float, float]
    within: tuple[float, float, float]
    ratio: float  # r = Σ w · between / within over the resolutions


TABLE_1 = {
    name: RelativeDistances(**about["table_1"])
    for name, about in PAPER_TEXTS["images"].items()
    if "table_1" in about
}
"""Table 1 of the paper, by training image."""


def stated_seconds(where: str) -> float | None:
    """Return the time that the paper states for a figure, or None if it states none."""
    return next((t.cpu_seconds for t in ALL_TIMES if t.where == where), None)
