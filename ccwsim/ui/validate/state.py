"""What the page of validation remembers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import streamlit as st

from ccwsim.ui.jobs.statistics import LruCache, StatisticsWorker, Task
from ccwsim.ui.validate.large_ensemble_job import LargeEnsembleRun


@st.cache_resource(show_spinner=False)
def shelf() -> LruCache:
    """Return the values that all sessions share; their keys are digests of contents."""
    return LruCache()


@dataclass
class Validation:
    """What the page remembers.

    Attributes
    ----------
    azimuth : int
        Direction of the third variogram, in degrees from north.
    along : str
        Direction of the transiograms, "E-W" or "N-S".
    tail : int
        Place of the facies whose transitions are shown where there are many.
    seen : set of str
        Sections that came into view; others are not worked out.
    drawn : dict
        By panel, what it drew last, to be dimmed while something new is worked out.
    waiting : dict
        By panel, what it waits for.
    bench : StatisticsWorker
    deadline : float
        Until when this run of the page may wait for quick statistics.
    n_long : int
        How many realizations a long run is asked for.
    long_run : LargeEnsembleRun, optional
        The latest one.
    long_message : str
        Why one was not started.
    """

    azimuth: int = 45
    along: str = "E-W"
    tail: int = 0
    seen: set[str] = field(default_factory=set)
    drawn: dict[str, Callable[[], Any]] = field(default_factory=dict)
    waiting: dict[str, Task] = field(default_factory=dict)
    bench: StatisticsWorker = field(default_factory=lambda: StatisticsWorker(shelf()))
    deadline: float = 0.0
    n_long: int = 1000
    long_run: LargeEnsembleRun | None = None
    long_message: str = ""
