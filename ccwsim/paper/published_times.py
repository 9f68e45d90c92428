"""Numbers that the paper and the published codes report, each with its source.

Seconds of another machine and another language cannot be compared with seconds measured here; the
ratios within one source can: of two levels, two methods, two numbers of data.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Source:
    """Where times come from."""

    name: str  # short, for a legend or the head of a table
    reference: str  # where they can be looked up, or how they were measured
    machine: str  # language and machine, as far as they are known


PAPER = Source(
    "Bavandsavadkoohi et al. (2024)",
    "Bavandsavadkoohi, Gloaguen, Tokhmechi, Arab-Amiri and Giroux (2024), CCWSIM",
    "MATLAB, Core i7 at 2.6 GHz, 16 GB",
)
OCTAVE = Source(
    "published codes in Octave",
    "The authors' CCWSIM and MS-CCSIM run unchanged but without their windows: T 32, OR 8, 20 "
    "candidates, prop 0.1, CT [2 2], 8 paths",
    "GNU Octave, one thread, on another machine than the paper's; 2.5 to 5.8 times the paper's "
    "MATLAB times where both are known. The interpreted cut alone takes 5.4 of the 5.8 s of an "
    "unconditional run, so these times say little about levels",
)
OTHER_ENGINES = Source(
    "other engines",
    "DeeSse (geone 1.3.4, n 24), SNESIM and QuickSampling of G2S, SNESIM (tree) of MPSLIB",
    "compiled, one thread, on the same machine as the Octave times",
)


@dataclass(frozen=True)
class PublishedTime:
    """CPU time of one realization as a source reports it."""

    source: Source
    where: str  # the table or figure
    image: str  # training image: "channel", "stone wall", "three facies", …
    n_cells: int | None  # cells of the grid; None where the source at hand does not say
    n_data: int | None  # hard data, 0 for an unconditional run; None where the source does not say
    # "ccwsim" or "ms-ccsim", as `Parameters.method` has it, or the name of another engine
    method: str
    # wavelet level, or scale of MS-CCSIM; None where the source does not say or has none
    level: int | None
    cpu_seconds: float | None  # None where no run came to an end
    # share of the hard data not honoured at full resolution, 0 … 1; None where not reported
    wrong_share: float | None = None
    note: str = ""


_TABLE_2 = {
    ("ms-ccsim", 1): {
        "channel": (26.78, 41.18),
        "stone wall": (14.53, 21.62),
        "Ganges": (30.57, 42.52),
    },
    ("ms-ccsim", 3): {"channel": (2.35, 3.42), "stone wall": (1.93, 3.05), "Ganges": (2.52, 3.35)},
    ("ccwsim", 1): {
        "channel": (10.45, 23.09),
        "stone wall": (9.27, 16.76),
        "Ganges": (14.71, 28.18),
    },
    ("ccwsim", 3): {"channel": (2.49, 2.82), "stone wall": (2.30, 2.45), "Ganges": (2.75, 2.91)},
}
TABLE_2_DATA = (1000, 2000)
"""Numbers of hard data of Table 2."""
TABLE_2 = tuple(
    PublishedTime(PAPER, "Table 2", image, 512 * 512, n_data, method, level, s)
    for (method, level), images in _TABLE_2.items()
    for image, both in images.items()
    for n_data, s in zip(TABLE_2_DATA, both, strict=True)
)
"""CPU time against the number of hard data, by method, level and image; T 32, OR 8."""

FIGURE_13 = tuple(
    PublishedTime(PAPER, "Fig. 13", "channel", 25_000_000, None, "ccwsim", level, s)
    for level, s in ((1, 56.0), (2, 32.0), (3, 31.0))
)
"""CPU time of the largest of five grids, by level; the values of the other four are not at hand."""
LEVEL_CHANGES = {(1, 2): -0.548, (2, 3): -0.174}
"""Fig. 13: relative change of CPU time from one level to the next, averaged over the five sizes."""


def _single(
    source: Source, where: str, seconds: float, image: str = "channel", **known: Any
) -> PublishedTime:
    """Return a time whose level the source does not say, and of the rest only what is `known`."""
    known = {"n_cells": None, "n_data": None, **known}
    return PublishedTime(
        source, where, image, method="ccwsim", level=None, cpu_seconds=seconds, **known
    )


SINGLE_TIMES = (
    _single(PAPER, "Fig. 6", 6.52, n_data=0),
    _single(PAPER, "Fig. 7", 2.42, note="mean of 100 realizations"),
    _single(PAPER, "Fig. 8", 7.7, "Ganges"),
    _single(PAPER, "Fig. 14", 1.06, n_data=4000, note="about 4000 data"),
    _single(PAPER, "Fig. 16", 3.50, "three facies", n_cells=1_000_000),
)
"""Times that stand alone; None is what their source does not say."""


class RelativeDistances(NamedTuple):
    """ANODI of CCWSIM divided by that of MS-CCSIM, at three resolutions, the full one first."""

    between: tuple[float, float, float]
    within: tuple[float, float, float]
    ratio: float  # r = Σ w · between / within over the resolutions


TABLE_1 = {
    "stone wall": RelativeDistances((0.95, 0.92, 1.02), (0.79, 0.79, 0.95), 1.19),
    "channel": RelativeDistances((0.79, 0.78, 0.88), (0.78, 0.77, 0.99), 1.01),
}
"""Table 1: 50 realizations of each method, 8 × 8 patterns, Jensen–Shannon divergence."""

_MEASURED = (
    ("channel", 512, 0, "ccwsim", 1, 6.0, None),
    ("channel", 512, 0, "ccwsim", 2, 5.7, None),
    ("channel", 512, 0, "ccwsim", 3, 5.8, None),
    ("channel", 512, 0, "ms-ccsim", 1, 7.1, None),
    ("channel", 512, 0, "ms-ccsim", 2, 7.3, None),
    ("channel", 512, 0, "ms-ccsim", 3, 7.6, None),
    ("channel", 512, 397, "ccwsim", 1, 8.7, 5.6),
    ("channel", 512, 397, "ccwsim", 2, 7.2, 6.5),
    ("channel", 512, 397, "ccwsim", 3, 6.4, 13.3),
    ("channel", 512, 397, "ms-ccsim", 1, 20.2, 0.0),
    ("channel", 512, 397, "ms-ccsim", 2, 11.5, 0.0),
    ("channel", 512, 397, "ms-ccsim", 3, 9.2, 0.2, "one of five runs crashes"),
    ("channel", 512, 1000, "ccwsim", 1, 26.4, 5.1),
    ("channel", 512, 1000, "ccwsim", 3, 7.8, 13.2),
    ("channel", 512, 1000, "ms-ccsim", 1, 77.5, 0.4),
    ("channel", 512, 1000, "ms-ccsim", 3, 13.8, 0.5),
    ("channel", 512, 2000, "ccwsim", 1, 49.1, 4.8),
    ("channel", 512, 2000, "ccwsim", 3, 8.6, 16.4),
    ("channel", 512, 2000, "ms-ccsim", 1, 126.0, 0.7),
    ("channel", 512, 2000, "ms-ccsim", 3, 15.8, 1.9, "two of three runs crash"),
    ("channel", 256, 3883, "ccwsim", 2, 5.0, 9.4),
    ("channel", 256, 3883, "ms-ccsim", 1, 42.0, 2.1),
    (
        "channel",
        256,
        3883,
        "ms-ccsim",
        2,
        None,
        None,
        "crashes always; patched 11.5 s, 3.2 % of the data wrong",
    ),
    ("channel", 256, 3883, "ms-ccsim", 3, None, None, "crashes"),
    ("stone wall", 512, 298, "ccwsim", 1, 6.6, 5.3),
    ("stone wall", 512, 298, "ccwsim", 3, 6.1, 18.1),
    ("stone wall", 512, 298, "ms-ccsim", 1, 9.2, 0.0),
    ("stone wall", 512, 298, "ms-ccsim", 3, 8.2, 0.0),
    ("stone wall", 512, 1000, "ccwsim", 1, 18.5, 4.8),
    ("stone wall", 512, 1000, "ccwsim", 3, 7.2, 20.6),
    ("stone wall", 512, 2000, "ccwsim", 1, 33.9, 5.5),
    ("stone wall", 512, 2000, "ccwsim", 3, 7.7, 23.0),
    ("three facies", 1000, 400, "ccwsim", 2, 25.0, 8.9),
    ("three facies", 1000, 400, "ms-ccsim", 2, 37.0, 0.0),
)
"""Image, side of the grid, data, method, level, CPU seconds, percent of the data wrong, note."""

OCTAVE_TIMES = tuple(
    PublishedTime(
        OCTAVE, "", image, side**2, n_data, method, level, s, wrong and wrong / 100, *note
    )
    for image, side, n_data, method, level, s, wrong, *note in _MEASURED
)
"""Times and shares of wrong data measured on the published codes in GNU Octave."""


def _engine(name: str, free: float, conditional: float | None) -> list[PublishedTime]:
    side = 512 * 512
    times = [PublishedTime(OTHER_ENGINES, "", "channel", side, 0, name, None, free)]
    if conditional is not None:
        times.append(
            PublishedTime(OTHER_ENGINES, "", "channel", side, 397, name, None, conditional, 0.0)
        )
    return times


ENGINE_TIMES = (
    *_engine("DeeSse", 8.1, 7.5),
    *_engine("G2S SNESIM", 13.6, 17.1),
    *_engine("MPSLIB SNESIM", 24.6, 22.1),
    *_engine("G2S QuickSampling", 173.0, None),
)
"""Times of pixel-based engines, which honour every datum."""

ALL_TIMES = (*TABLE_2, *FIGURE_13, *SINGLE_TIMES, *OCTAVE_TIMES, *ENGINE_TIMES)


def published_time(
    source: Source, method: str, level: int, n_cells: int, n_data: int, image: str = "channel"
) -> PublishedTime | None:
    """Return what a source reports for one case, None where it reports nothing."""
    wanted = source, method, level, n_cells, n_data, image
    for t in ALL_TIMES:
        if (t.source, t.method, t.level, t.n_cells, t.n_data, t.image) == wanted:
            return t
    return None


def stated_seconds(where: str) -> float:
    """Return a time that the paper states for one figure.

    Examples
    --------
    >>> stated_seconds("Fig. 6")
    6.52
    """
    found = next(t.cpu_seconds for t in SINGLE_TIMES if t.where == where)
    assert found is not None
    return found
