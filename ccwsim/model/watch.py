"""The progress of long work, and a request to stop it."""

from __future__ import annotations

from collections.abc import Callable

from ccwsim.model.errors import Cancelled

Fraction = Callable[[float], None] | bool
"""A function called with the finished share of the work; True shows a bar."""
Progress = Callable[[float, int], None]
"""A function called with the finished share of the work and the number of finished pieces."""
Cancel = Callable[[], bool]
"""A function that returns True if the work should stop."""


def progress_bar() -> Progress:
    """Return a function that shows the progress as a bar, which ends with the work."""
    from tqdm.auto import tqdm  # slow to import

    bar = tqdm(total=1.0, bar_format="{percentage:3.0f} % {bar} {remaining} left")
    return lambda share, n_done: bar.update(share - bar.n)  # type: ignore[return-value]


class Watch:
    """The progress of some work, and whether the work should stop.

    Work that uses `progress` and `cancel` ends as it likes, for example with a part of its result;
    other work calls `tell` and `check`, which end it with an error.

    Examples
    --------
    >>> watch = Watch(lambda share, n_done: print(share, n_done))
    >>> watch.part(0.5, 1.0, n_before=3).tell(0.5, n_done=1)
    0.75 4
    """

    def __init__(
        self, progress: Progress | bool | None = None, cancel: Cancel | None = None
    ) -> None:
        progress = progress_bar() if progress is True else progress
        self.progress: Progress = progress or (lambda share, n_done: None)
        self.cancel: Cancel = cancel or (lambda: False)

    @classmethod
    def of_share(cls, progress: Fraction | None, cancel: Cancel | None = None) -> Watch:
        """Return the watch of a function that is called only with the finished share."""
        each = (lambda share, n_done: progress(share)) if callable(progress) else progress
        return cls(each, cancel)

    def check(self) -> None:
        """Raise `Cancelled` if the work should stop."""
        if self.cancel():
            raise Cancelled("stopped")

    def tell(self, share: float, n_done: int = 0) -> None:
        """Report the finished share; raise `Cancelled` if the work should stop."""
        self.check()
        self.progress(share, n_done)

    def part(self, low: float, high: float, n_before: int = 0, counts: bool = True) -> Watch:
        """Return the watch of a part of the work, from the share `low` to `high`.

        `n_before` pieces are finished before the part. Pieces of the part itself are counted only
        if `counts`.
        """

        def progress(share: float, n_done: int) -> None:
            n = n_before + (n_done if counts else 0)
            self.progress((1 - share) * low + share * high, n)

        return Watch(progress, self.cancel)


UNWATCHED = Watch()
"""A watch of work that nobody follows."""
