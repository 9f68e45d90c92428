"""What the page of sweeps remembers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from ccwsim.ui.sweep.run import SweepRun

Error = Literal["patterns", "connection", "mended"]


@dataclass
class SweepState:
    """What the page of sweeps remembers.

    Attributes
    ----------
    ranges : dict
        The ranges that the user chose, by the name of the parameter; others follow the study.
    n_realizations : int
        Of each setting.
    error : str
        What the chart shows over time.
    run : SweepRun or None
        The latest sweep.
    chosen : int or None
        Which of its settings is large; None for the recommended one.
    shown : int
        Which of that setting's realizations.
    message : str
        Why a sweep was not started.
    """

    ranges: dict[str, list[Any]] = field(default_factory=dict)
    n_realizations: int = 4
    error: Error = "patterns"
    run: SweepRun | None = None
    chosen: int | None = None
    shown: int = 0
    message: str = ""
