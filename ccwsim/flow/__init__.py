"""From realizations to an answer: flow, tracks of particles, and what follows from them."""

from ccwsim.flow.answers import Capture as Capture
from ccwsim.flow.answers import EffectiveK as EffectiveK
from ccwsim.flow.answers import capture_probability as capture_probability
from ccwsim.flow.answers import effective_k as effective_k
from ccwsim.flow.answers import flow_efficiency as flow_efficiency
from ccwsim.flow.answers import over as over
from ccwsim.flow.answers import representatives as representatives
from ccwsim.flow.answers import travel_times as travel_times
from ccwsim.flow.darcy import Flow as Flow
from ccwsim.flow.darcy import darcy as darcy
from ccwsim.flow.tracks import Tracks as Tracks
from ccwsim.flow.tracks import starts_at_inflow as starts_at_inflow
from ccwsim.flow.tracks import tracks as tracks
