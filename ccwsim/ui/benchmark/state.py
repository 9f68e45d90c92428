"""What the page of times remembers."""

from __future__ import annotations

from dataclasses import dataclass, field

from ccwsim.ui.benchmark.run import TimingRun


@dataclass
class Benchmark:
    """What the page remembers.

    Attributes
    ----------
    largest : int
        Side of the largest grid.
    grid_levels, data_levels : list of int
        Wavelet levels that are timed.
    grid_methods, data_methods : list of str
        Methods that are timed; those that do not exist are left out.
    side : int
        Of the grid on which the number of data changes.
    numbers : list of int
        Of hard data.
    n_realizations : int
        Of each setting.
    grids, data : TimingRun, optional
        The latest run of each kind.
    message : str
        Why a run could not start.
    """

    largest: int = 2000
    grid_levels: list[int] = field(default_factory=lambda: [1, 2, 3])
    grid_methods: list[str] = field(default_factory=lambda: ["ccwsim"])
    side: int = 512
    numbers: list[int] = field(default_factory=lambda: [0, 1000, 2000])
    data_levels: list[int] = field(default_factory=lambda: [1, 3])
    data_methods: list[str] = field(default_factory=lambda: ["ccwsim", "ms-ccsim"])
    n_realizations: int = 3
    grids: TimingRun | None = None
    data: TimingRun | None = None
    message: str = ""

    @property
    def running(self) -> TimingRun | None:
        """The run that goes on now; two at once would slow each other down."""
        return next((run for run in (self.grids, self.data) if run and run.going), None)
