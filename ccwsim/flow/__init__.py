"""Flow through realizations, tracks of particles, and results computed from them.

Arguments shared by several functions are explained only here:

- `values`: the conductivity of each facies, by name or code; or `FromValues`, if it follows from
  the value of a continuous variable in each cell.
- `axis`: the direction of the flow between fixed heads on two sides, "x", "y" or "z".
- `west_east`, `south_north`, `bottom_top`: heads at two opposite sides: numbers, arrays over the
  faces of the side, or None.
- `edge`: heads along the outline of the active cells, instead of heads at sides.
- `heads`: heads at both ends of `axis`, or an `Edge`; None is 1 and 0 at both sides, or along the
  outline if one of them has no active cell.
- `thickness`: the thickness of a map, 1 by default, in the unit of the cell sizes.
- `wells`: the rate (volume per time, negative for pumping) of the well in each cell ((layer,) row,
  column).
- `anisotropy`: the ratio of vertical to horizontal conductivity.
- `porosity`: the share of the volume through which water flows, above 0 and at most 1: a number,
  or one for each cell (of an ensemble, for each facies, or `FromValues`).
- `run`: the arguments `n_workers`, `progress`, `cancel` and `executor` of `ccwsim.simulate`;
  `Cancelled` is raised if `cancel` returned True.
"""

from ccwsim.flow.answers import (
    Capture as Capture,
    EffectiveK as EffectiveK,
    at_percentiles as at_percentiles,
    capture_probability as capture_probability,
    effective_k as effective_k,
    flow_efficiency as flow_efficiency,
    over as over,
    travel_times as travel_times,
)
from ccwsim.flow.boundary import Edge as Edge, FixedFaces as FixedFaces
from ccwsim.flow.darcy import Flow as Flow, darcy as darcy
from ccwsim.flow.tracks import (
    Tracks as Tracks,
    starts_at_inflow as starts_at_inflow,
    tracks as tracks,
)
from ccwsim.model import FromValues as FromValues
