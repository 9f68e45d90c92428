"""How far a run is: a bar on a terminal, a line every few seconds elsewhere; and Ctrl-C."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from shutil import get_terminal_size
from typing import TextIO

from tqdm import tqdm

SECONDS_A_LINE = 5.0
"""Between two lines where there is no terminal, such as in the log of a batch system."""
STARTING = "starting; the first run after an installation compiles the kernels …"
BAR = "{bar:24} {percentage:3.0f} %  {desc}  {remaining} left"


class ProgressLine:
    """Progress of `n` units on a stream; call it as `simulate` calls `progress`."""

    def __init__(self, n: int, stream: TextIO, unit: str = "realizations") -> None:
        self._n, self._unit, self._stream = n, unit, stream
        self._is_terminal = stream.isatty()
        self._bar: tqdm | None = None
        self._first: tuple[float, float] | None = None
        self._said: float | None = None

    def __call__(self, fraction: float, n_done: int) -> None:
        """Show that `fraction` of all work is done, and `n_done` units."""
        done = f"{n_done} of {self._n} {self._unit}"
        if not self._is_terminal:
            self._say_line(fraction, done)
        elif fraction > 0:
            self._show_bar(fraction, done)
        elif self._said is None:
            self._said = 0.0
            self._stream.write(f"\r{STARTING}")
            self._stream.flush()

    def write(self, line: str) -> None:
        """Write a line above the bar."""
        self.clear()
        print(line, file=self._stream, flush=True)

    def clear(self) -> None:
        """Take the bar away until the next call."""
        if self._bar is not None:
            self._bar.clear()
        elif self._is_terminal and self._said is not None:
            self._stream.write("\r" + " " * len(STARTING) + "\r")
            self._stream.flush()

    def close(self) -> None:
        """Take the bar away for good."""
        self.clear()
        if self._bar is not None:
            self._bar.close()

    def _show_bar(self, fraction: float, done: str) -> None:
        if self._bar is None:  # from here on: compiling comes before and says nothing of the pace
            self.clear()
            columns = min(100, get_terminal_size().columns)  # also where the width is unknown
            look = {"bar_format": BAR, "ncols": columns, "nrows": 20, "leave": False}
            pace = {"initial": fraction, "smoothing": 0, "miniters": 0}
            self._bar = tqdm(desc=done, total=1.0, file=self._stream, **pace, **look)
        self._bar.set_description_str(done, refresh=False)
        self._bar.update(fraction - self._bar.n)

    def _say_line(self, fraction: float, done: str) -> None:
        now = time.monotonic()
        self._said = now if self._said is None else self._said
        if fraction > 0 and self._first is None:
            self._first = now, fraction
        if now - self._said < SECONDS_A_LINE:
            return
        self._said = now
        line = f"{100 * fraction:.0f} %, {done}" if self._first else STARTING
        if self._first and fraction > self._first[1]:
            pace = (fraction - self._first[1]) / (now - self._first[0])
            line += f", {duration((1 - fraction) / pace)} left"
        print(line, file=self._stream, flush=True)


def duration(seconds: float) -> str:
    """Return a time in words: "8 s", "1 min 15 s", "2 h 1 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


@contextmanager
def stop_on_interrupt() -> Iterator[Callable[[], bool]]:
    """Yield a function that says whether Ctrl-C was pressed; a second Ctrl-C ends the program.

    What is finished can so still be written. Outside the main thread, where signals cannot be
    caught, it never is.
    """
    pressed = threading.Event()

    def note(*_: object) -> None:
        pressed.set()
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    if threading.current_thread() is not threading.main_thread():
        yield pressed.is_set
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)
