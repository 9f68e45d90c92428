"""Show the progress of a run as a bar on terminals, otherwise as lines; stop a run on signals."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from shutil import get_terminal_size
from typing import TextIO

import click
from tqdm import tqdm

from ccwsim.cli.program import PROGRAM
from ccwsim.model import duration

SECONDS_A_LINE = 5.0  # time between progress lines if there is no terminal, as in a batch system
STARTING = "starting …"
BAR = "{bar:24} {percentage:3.0f} %  {desc}  {remaining} left"


class ProgressLine:
    """Display of the progress of `n` units on a stream; pass it to `simulate` as `progress`."""

    def __init__(self, n: int, stream: TextIO, unit: str = "realizations") -> None:
        self._n, self._unit, self._stream = n, unit, stream
        self._is_terminal = stream.isatty()
        self._bar: tqdm | None = None
        self._first: tuple[float, float] | None = None
        self._last_line: float | None = None
        self._waiting = ""  # text shown on a terminal before the work begins

    def __call__(self, fraction: float, n_done: int) -> None:
        """Show that `fraction` of all work and `n_done` units are done."""
        with suppress(OSError):  # continue if the terminal was closed
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
        """Write a line above the progress bar."""
        with suppress(OSError):
            self.clear()
            print(line, file=self._stream, flush=True)

    def clear(self) -> None:
        """Remove the progress bar until the next call."""
        if self._bar is not None:
            self._bar.clear()
        elif self._waiting:
            self._stream.write("\r" + " " * len(self._waiting) + "\r")
            self._stream.flush()
            self._waiting = ""

    def close(self) -> None:
        """Remove the progress bar permanently."""
        with suppress(OSError):
            self.clear()
            if self._bar is not None:
                self._bar.close()

    def _show_bar(self, fraction: float, done: str) -> None:
        if self._bar is None:  # measure the pace from here, to exclude compiling
            self.clear()
            columns = min(100, get_terminal_size().columns)  # 80 if the width is unknown
            self._bar = tqdm(
                desc=done,
                total=1.0,
                file=self._stream,
                initial=fraction,
                smoothing=0,
                miniters=0,
                bar_format=BAR,
                ncols=columns,
                nrows=20,
                leave=False,
            )
        self._bar.set_description_str(done, refresh=False)
        self._bar.update(fraction - self._bar.n)

    def _say_line(self, fraction: float, done: str) -> None:
        now = time.monotonic()
        compiles = fraction == 0 and starting_text() != STARTING
        if self._last_line is None:
            self._last_line = now - SECONDS_A_LINE * compiles
        if fraction > 0 and self._first is None:
            self._first = now, fraction
        if now - self._last_line < SECONDS_A_LINE:
            return
        self._last_line = now
        line = f"{100 * fraction:.0f} %, {done}" if self._first else starting_text()
        if self._first and fraction > self._first[1]:
            pace = (fraction - self._first[1]) / (now - self._first[0])
            line += f", {duration((1 - fraction) / pace, rough=True)} left"
        print(line, file=self._stream, flush=True)


def starting_text() -> str:
    """Return a text on the preparation of a run, with the number of kernels to compile."""
    from ccwsim.engine.compilation import compilation

    progress = compilation()
    if progress is None:
        return STARTING
    text = f"compiling kernels, once for this machine: {progress.n_done} of {progress.n}"
    seconds_left = progress.seconds_left
    return (
        f"{text}, {duration(seconds_left, rough=True)} left" if seconds_left is not None else text
    )


SIGNALS = {"SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}
"""Exit codes for the signals that stop a run: Ctrl-C, a batch system, a closed terminal."""


class Stop:
    """A flag with an exit code; calling the flag returns whether a signal stopped the run."""

    def __init__(self) -> None:
        self.exit_code = 0

    def __call__(self) -> bool:
        return self.exit_code != 0

    def note(self, number: int, *_: object) -> None:
        """Record a signal, and let the next signal of this kind end the program at once."""
        name = signal.Signals(number).name
        self.exit_code = SIGNALS[name]
        signal.signal(number, signal.SIG_DFL)
        if name == "SIGHUP":  # the terminal is closed: discard all output
            nowhere = os.open(os.devnull, os.O_WRONLY)
            for stream in (1, 2):
                os.dup2(nowhere, stream)


@contextmanager
def stop_on_signals() -> Iterator[Stop]:
    """Yield a flag that the first signal sets; a second signal of this kind ends the program.

    A stopped run can therefore write its finished realizations. Outside the main thread, the flag
    is never set, because signals cannot be caught. If the program ends after the command, its
    output is complete at the end of the block, and later signals are ignored.
    """
    stop = Stop()
    before = {}
    if threading.current_thread() is threading.main_thread():
        for name in SIGNALS:
            number = getattr(signal, name, None)
            ignored = number and signal.getsignal(number) == signal.SIG_IGN
            if number and not (name == "SIGHUP" and ignored):  # respect `nohup`
                before[number] = signal.signal(number, stop.note)
    try:
        yield stop
    finally:
        context = click.get_current_context(silent=True)
        ends = context is not None and context.obj == PROGRAM
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if ends else handler)
