"""Two to four settings simulated alike, and what sets them apart."""

from ccwsim.experiments.comparison.comparing import FEWEST, MOST, add_curves, compare
from ccwsim.experiments.comparison.curves import DIRECTIONS, STATISTICS, ComparedCurves
from ccwsim.experiments.comparison.result import Comparison, PairRatio

__all__ = [
    "DIRECTIONS",
    "FEWEST",
    "MOST",
    "STATISTICS",
    "ComparedCurves",
    "Comparison",
    "PairRatio",
    "add_curves",
    "compare",
]
