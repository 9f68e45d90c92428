"""One line on the terminal: how far a simulation is and how long it will still take."""

from __future__ import annotations

import time
from typing import TextIO

WIDTH = 24
"""Characters of the bar."""


class ProgressLine:
    """A line on a terminal that is written over and over; call it as `simulate` calls progress.

    Parameters
    ----------
    n : int
        How many realizations, or other units, there will be.
    stream : text file
        Nothing is written where it is no terminal.
    unit : str
        What is counted.
    """

    def __init__(self, n: int, stream: TextIO, unit: str = "realizations") -> None:
        self._n = n
        self._unit = unit
        self._stream = stream
        self._shown = "" if stream.isatty() else None
        self._first: tuple[float, float] | None = None

    def __call__(self, fraction: float, n_done: int) -> None:
        """Show that `fraction` of all work is done, and `n_done` units."""
        if self._shown is None:
            return
        left = self._seconds_left(fraction)
        line = progress_text(fraction, n_done, self._n, left, self._unit)
        if line != self._shown:
            self._stream.write("\r" + line.ljust(len(self._shown)))
            self._stream.flush()
            self._shown = line

    def clear(self) -> None:
        """Take the line away."""
        if self._shown:
            self._stream.write("\r" + " " * len(self._shown) + "\r")
            self._stream.flush()
            self._shown = ""

    def _seconds_left(self, fraction: float) -> float | None:
        """Estimate from the first sign of work on: compiling comes before and says nothing."""
        now = time.monotonic()
        if fraction <= 0:
            return None
        if self._first is None:
            self._first = now, fraction
        since, done = now - self._first[0], fraction - self._first[1]
        return since * (1 - fraction) / done if done > 0 else None


def progress_text(
    fraction: float, n_done: int, n: int, seconds_left: float | None, unit: str = "realizations"
) -> str:
    """Return one line on how far the work is.

    Examples
    --------
    >>> progress_text(0.5, 4, 10, 75.0)
    '████████████············  50 %  4 of 10 realizations  1 min 15 s left'
    """
    if fraction <= 0:
        return "starting; the first run after an installation compiles for half a minute …"
    full = int(WIDTH * fraction)
    bar = "█" * full + "·" * (WIDTH - full)
    line = f"{bar} {100 * fraction:3.0f} %  {n_done} of {n} {unit}"
    return line if seconds_left is None else f"{line}  {duration(seconds_left)} left"


def duration(seconds: float) -> str:
    """Return a time in words.

    Examples
    --------
    >>> duration(8.4), duration(75), duration(7260)
    ('8 s', '1 min 15 s', '2 h 1 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
