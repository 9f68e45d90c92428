"""Flow through realizations, tracks of particles, and results computed from them.

Arguments shared by several functions are explained only here:

- `values`: the conductivity of each facies, by name or code.
- `axis`: the direction of the flow between fixed heads on two sides, "x", "y" or "z".
- `west_east`, `south_north`, `bottom_top`: heads at two opposite sides: numbers, arrays over the
  faces of the side, or None.
- `wells`: the rate (volume per time, negative for pumping) of the well in each cell ((layer,) row,
  column).
- `anisotropy`: the ratio of vertical to horizontal conductivity.
- `porosity`: the share of the volume through which water flows, above 0 and at most 1: a number,
  or one for each cell (of an ensemble, for each facies).
- `run`: the arguments `n_workers`, `progress`, `cancel` and `executor` of `ccwsim.simulate`;
  `Cancelled` is raised if `cancel` returned True.
"""

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
