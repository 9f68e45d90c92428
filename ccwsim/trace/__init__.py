"""Follow a realization patch by patch: the real run, with what it leaves at each step kept."""

from ccwsim.trace.data import DataTerms, SeenDatum
from ccwsim.trace.fates import PlaceFate, fates
from ccwsim.trace.mended import MendedWindow
from ccwsim.trace.patch import Patch, TracedPatch
from ccwsim.trace.trace import Trace, check_traceable
from ccwsim.trace.world import Frame

__all__ = [
    "DataTerms",
    "Frame",
    "MendedWindow",
    "Patch",
    "PlaceFate",
    "SeenDatum",
    "Trace",
    "TracedPatch",
    "check_traceable",
    "fates",
]
