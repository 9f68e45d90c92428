"""How much of the paper is run: everything in minutes, or a little of everything in seconds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Extent:
    """Sizes and numbers of the experiments.

    Attributes
    ----------
    name : str
        "full" or "quick".
    n_many : int
        Realizations where the paper has 100.
    n_few : int
        Realizations where methods are compared in pictures and curves.
    n_anodi : int
        Realizations of each method for the analysis of distances.
    n_timed : int
        Realizations whose times are averaged.
    largest_side : int
        Longest side of a grid that is not about time, in cells.
    timed_sides : tuple of int
        Sides of the square grids whose time is measured.
    largest_lag : int
        Of variograms and connection, in cells.
    """

    name: str
    n_many: int
    n_few: int
    n_anodi: int
    n_timed: int
    largest_side: int
    timed_sides: tuple[int, ...]
    largest_lag: int

    def side(self, wanted: int) -> int:
        """Return a side that the paper uses, made smaller where this extent asks for it.

        Examples
        --------
        >>> FULL.side(512), QUICK.side(512)
        (512, 144)
        """
        return min(wanted, self.largest_side)


FULL = Extent("full", 100, 10, 50, 9, 1000, (500, 1000, 1500, 2000, 2500), 100)
QUICK = Extent("quick", 6, 3, 4, 2, 144, (64, 128, 192), 40)
PAPER_SIDES = (1000, 2000, 3000, 4000, 5000)
"""Five grids up to the 25 million cells of the paper's Fig. 13."""
