"""Trace the simulation of a realization patch by patch, with the results of each step."""

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
