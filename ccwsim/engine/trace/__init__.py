"""Follow a realization patch by patch: the real run, with what it leaves at each step kept."""

from ccwsim.engine.trace.data import DataTerms, SeenDatum
from ccwsim.engine.trace.fates import PlaceFate, fates
from ccwsim.engine.trace.frames import Frame
from ccwsim.engine.trace.patch import Patch, TracedPatch
from ccwsim.engine.trace.resimulation import ResimulatedWindow
from ccwsim.engine.trace.trace import Trace, check_traceable

__all__ = [
    "DataTerms",
    "Frame",
    "Patch",
    "PlaceFate",
    "ResimulatedWindow",
    "SeenDatum",
    "Trace",
    "TracedPatch",
    "check_traceable",
    "fates",
]
