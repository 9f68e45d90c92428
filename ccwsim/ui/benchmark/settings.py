"""From what the page was asked for to the cases that are timed."""

from __future__ import annotations

from collections.abc import Sequence

from ccwsim.experiments.timing import Timing, TimingCase, data_cases, expected_seconds, grid_cases
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.parameters import METHODS, Parameters
from ccwsim.ui.benchmark.run import TimingRun
from ccwsim.ui.benchmark.state import Benchmark
from ccwsim.ui.session.fitting import fitted, levels
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State

SIDES = (256, 512, 1000, 2000, 3000, 5000)
"""Of the square grids of Fig. 13's kind; the last has the paper's 25 million cells."""
DATA_SIDES = (256, 512, 1000)
NUMBERS = (0, 100, 400, 1000, 2000, 4000)
BYTES_A_CELL = 10
"""Memory that a run needs for each cell, with room to spare."""
MAX_OF_MEMORY = 0.5
FINEST, COARSEST = 0, 3
NAMES = {"ccwsim": "CCWSIM", "ccsim": "CCSIM", "ms-ccsim": "MS-CCSIM"}


def method_options() -> list[str]:
    """Return the methods with levels that this program has; CCSIM is level 0 of CCWSIM.

    Examples
    --------
    >>> method_options()[0]
    'ccwsim'
    """
    return [method for method in METHODS if method != "ccsim"]


def level_options(state: State) -> list[int]:
    """Return the levels that the study's training image allows."""
    allowed = levels(image_of(state.choices.image).shape)
    return [level for level in allowed if FINEST <= level <= COARSEST]


def side_options(free_bytes: int | None) -> list[int]:
    """Return the largest grids on offer: two sizes at least, and what memory allows.

    Examples
    --------
    >>> side_options(100_000_000), side_options(None)[-1]
    ([512, 1000, 2000], 5000)
    """
    room = float("inf") if free_bytes is None else MAX_OF_MEMORY * free_bytes
    return [s for s in SIDES[1:] if s == SIDES[1] or s * s * BYTES_A_CELL <= room]


def number_options(side: int) -> list[int]:
    """Return the numbers of data on offer: at most a quarter of the cells."""
    return [n for n in NUMBERS if 4 * n <= side * side]


def cases_of_grids(state: State) -> list[TimingCase]:
    """Return what is timed against the size of the grid.

    Raises
    ------
    CCWSIMError
        Where nothing is chosen, or a level does not go with the study.
    """
    own = state.page(Benchmark)
    sides = [side for side in SIDES if side <= own.largest]
    return grid_cases(sides, settings(state, own.grid_methods, own.grid_levels))


def cases_of_data(state: State) -> list[TimingCase]:
    """Return what is timed against the number of data.

    Raises
    ------
    CCWSIMError
        As `cases_of_grids`.
    """
    own = state.page(Benchmark)
    numbers = [n for n in number_options(own.side) if n in own.numbers]
    if not numbers:
        raise CCWSIMError("Choose at least one number of data.")
    chosen = settings(state, own.data_methods, own.data_levels)
    return data_cases(numbers, chosen, (own.side, own.side))


def settings(
    state: State, methods: Sequence[str], chosen_levels: Sequence[int]
) -> list[Parameters]:
    """Return the study's parameters at each method and level; sizes go to the nearest legal."""
    shape = image_of(state.choices.image).shape
    pairs = [(m, level) for m in method_options() if m in methods for level in level_options(state)
             if level in chosen_levels]  # fmt: skip
    if not pairs:
        raise CCWSIMError("Choose at least one method and one level.")
    return [
        fitted(state.choices.parameters, shape, method=method, wavelet_level=level)
        for method, level in pairs
    ]


def expected(state: State, cases: Sequence[TimingCase]) -> float:
    """Return about how many seconds a run will take, from what this session has measured."""
    page_state = state.page(Benchmark)
    image = image_of(state.choices.image)
    known = known_timings(page_state, image.digest)
    return expected_seconds(image, cases, page_state.n_realizations, known)


def known_timings(own: Benchmark, digest: str) -> list[Timing]:
    """Return all times of one training image."""
    runs: list[TimingRun] = [run for run in (own.grids, own.data) if run]
    return [t for run in runs if run.training_image.digest == digest for t in run.timings]
