"""Follow a realization patch by patch: the real run, with what it leaves at each step kept."""

from ccwsim.engine.trace.frames import Frame
from ccwsim.engine.trace.patch import DataTerms, Patch, PlaceFate, SeenDatum, TracedPatch, fates
from ccwsim.engine.trace.trace import ResimulatedWindow, Trace, check_traceable

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
