"""From realizations to an answer: flow, tracks of particles, and what follows from them."""

from ccwsim.flow.answers import (
    Capture,
    EffectiveK,
    capture_probability,
    effective_k,
    flow_efficiency,
    over,
    representatives,
    travel_times,
)
from ccwsim.flow.darcy import Flow, darcy
from ccwsim.flow.tracks import Tracks, starts_at_inflow, tracks

__all__ = [
    "Capture",
    "EffectiveK",
    "Flow",
    "Tracks",
    "capture_probability",
    "darcy",
    "effective_k",
    "flow_efficiency",
    "over",
    "representatives",
    "starts_at_inflow",
    "tracks",
    "travel_times",
]
