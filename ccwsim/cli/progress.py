"""How far a run is: a bar on a terminal, a line every few seconds elsewhere; and what stops it."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from shutil import get_terminal_size
from typing import TextIO

from tqdm import tqdm

SECONDS_A_LINE = 5.0
"""Between two lines where there is no terminal, such as in the log of a batch system."""
STARTING = "starting …"
BAR = "{bar:24} {percentage:3.0f} %  {desc}  {remaining} left"


class ProgressLine:
    """Progress of `n` units on a stream; call it as `simulate` calls `progress`."""

    def __init__(self, n: int, stream: TextIO, unit: str = "realizations") -> None:
        self._n, self._unit, self._stream = n, unit, stream
        self._is_terminal = stream.isatty()
        self._bar: tqdm | None = None
        self._first: tuple[float, float] | None = None
        self._said: float | None = None
        self._waiting = ""  # what a terminal shows before the work begins

    def __call__(self, fraction: float, n_done: int) -> None:
        """Show that `fraction` of all work is done, and `n_done` units."""
        with suppress(OSError):  # a terminal that is gone is no reason to end
            self._show(fraction, n_done)

    def _show(self, fraction: float, n_done: int) -> None:
        done = f"{n_done} of {self._n} {self._unit}"
        if not self._is_terminal:
            self._say_line(fraction, done)
        elif fraction > 0:
            self._show_bar(fraction, done)
        else:
            text = starting_text()
            if text != self._waiting:
                self._stream.write("\r" + text.ljust(len(self._waiting)))
                self._stream.flush()
                self._waiting = text

    def write(self, line: str) -> None:
        """Write a line above the bar."""
        with suppress(OSError):
            self.clear()
            print(line, file=self._stream, flush=True)

    def clear(self) -> None:
        """Take the bar away until the next call."""
        if self._bar is not None:
            self._bar.clear()
        elif self._waiting:
            self._stream.write("\r" + " " * len(self._waiting) + "\r")
            self._stream.flush()
            self._waiting = ""

    def close(self) -> None:
        """Take the bar away for good."""
        with suppress(OSError):
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
        compiles = fraction == 0 and starting_text() != STARTING
        self._said = (now - SECONDS_A_LINE * compiles) if self._said is None else self._said
        if fraction > 0 and self._first is None:
            self._first = now, fraction
        if now - self._said < SECONDS_A_LINE:
            return
        self._said = now
        line = f"{100 * fraction:.0f} %, {done}" if self._first else starting_text()
        if self._first and fraction > self._first[1]:
            pace = (fraction - self._first[1]) / (now - self._first[0])
            line += f", {duration((1 - fraction) / pace)} left"
        print(line, file=self._stream, flush=True)


def starting_text() -> str:
    """Say what comes before the work: kernels are compiled, how many, how long the others take."""
    from ccwsim.engine.compilation import compilation

    progress = compilation()
    if progress is None:
        return STARTING
    text = f"compiling kernels, once for this machine: {progress.n_done} of {progress.n}"
    left = progress.seconds_left
    return f"{text}, {duration(left)} left" if left is not None else text


def duration(seconds: float) -> str:
    """Return a time in words: "8 s", "1 min 15 s", "2 h 1 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


SIGNALS = {"SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}
"""What asks a run to end, Ctrl-C, a batch system, a terminal that is closed; and the exit codes."""


class Stop:
    """Whether a signal asked the run to end; a call tells, and `exit_code` says which it was."""

    def __init__(self) -> None:
        self.exit_code = 0

    def __call__(self) -> bool:
        return self.exit_code != 0

    def note(self, number: int, *_: object) -> None:
        """Take a signal; the same one again ends the program."""
        name = signal.Signals(number).name
        self.exit_code = SIGNALS[name]
        signal.signal(number, signal.SIG_DFL)
        if name == "SIGHUP":  # the terminal is gone: what is said goes nowhere, and stops nothing
            nowhere = os.open(os.devnull, os.O_WRONLY)
            for stream in (1, 2):
                os.dup2(nowhere, stream)


@contextmanager
def stop_on_signals() -> Iterator[Stop]:
    """Yield what says whether the run is asked to end; the same signal again ends the program.

    What is finished can so still be written. Outside the main thread, where signals cannot be
    caught, it never is asked.
    """
    stop = Stop()
    before = {}
    if threading.current_thread() is threading.main_thread():
        for name in SIGNALS:
            number = getattr(signal, name, None)
            ignored = number and signal.getsignal(number) == signal.SIG_IGN
            if number and not (name == "SIGHUP" and ignored):  # as `nohup` has it
                before[number] = signal.signal(number, stop.note)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
