"""Parameter sweeps: many settings of one study, judged and compared."""

from ccwsim.experiments.sweep.choice import Recommendation, pareto_front, recommended
from ccwsim.experiments.sweep.cost import expected_seconds
from ccwsim.experiments.sweep.running import ERRORS, Row, Sweep, sweep
from ccwsim.experiments.sweep.settings import RANGED, Settings, label, settings, varied

__all__ = [
    "ERRORS",
    "RANGED",
    "Recommendation",
    "Row",
    "Settings",
    "Sweep",
    "expected_seconds",
    "label",
    "pareto_front",
    "recommended",
    "settings",
    "sweep",
    "varied",
]
