"""Eclipse grids of any direction and shape, and what they contain."""

import numpy as np

VOLUME = np.random.default_rng(5).integers(0, 3, (3, 4, 6))
"""Codes with layer 0 at the bottom, and rows to the left of columns in the frame of the grid."""


def grdecl(
    *,
    angle: float = 0.0,
    south_first: bool = False,
    bottom_first: bool = False,
    slant: float = 0.0,
    irregular: bool = False,
    moved: bool = False,
    dip: float = 0.0,
    map_axes: float | None = None,
) -> bytes:
    """Return a grid of 6 × 4 × 3 cells whose columns run at `angle` from the east, in degrees."""
    nz, ny, nx = VOLUME.shape
    x, y = 50.0 * np.arange(nx + 1), 40.0 * np.arange(ny + 1)
    if irregular:
        x, y = x + np.array([0, 4, 0, -3, 2, 0, 1]), y + np.array([0, 3, -2, 0, 4])
    codes = VOLUME
    if not south_first:
        y, codes = y[::-1], codes[:, ::-1]
    if not bottom_first:
        codes = codes[::-1]
    x, y = np.meshgrid(x, y)
    if moved:
        x[1, 2] += 12
    a = np.deg2rad(angle)
    east, north = x * np.cos(a) - y * np.sin(a), x * np.sin(a) + y * np.cos(a)
    pillars = np.stack(
        [east, north, east * 0 + 1500, east + slant, north + slant, east * 0 + 1515], axis=-1
    )
    depths = 1500 + 5.0 * np.arange(nz + 1)
    tops = depths[::-1] if bottom_first else depths
    corners = []
    for k in range(nz):
        for depth in tops[k : k + 2]:
            columns = np.repeat(np.arange(nx + 1), 2)[1:-1]
            corners += [depth + dip * columns] * (2 * ny)
    parts = ["SPECGRID", f"{nx} {ny} {nz} 1 F /"]
    if map_axes is not None:
        b = np.deg2rad(map_axes)
        ends = (1000 - np.sin(b), 2000 + np.cos(b), 1000, 2000, 1000 + np.cos(b), 2000 + np.sin(b))
        parts += ["MAPAXES", " ".join(map(str, ends)) + " /"]
    parts += ["COORD", *(" ".join(map(str, row)) for row in pillars.reshape(-1, 6)), "/"]
    parts += ["ZCORN", *(" ".join(map(str, row)) for row in corners), "/"]
    parts += ["FACIES", *(" ".join(map(str, row)) for row in codes.reshape(-1, nx)), "/", ""]
    return "\n".join(parts).encode()


GRIDS = {
    "unrotated, rows from the north": {},
    "unrotated, rows from the south": {"south_first": True},
    "10°": {"angle": 10, "south_first": True},
    "60°": {"angle": 60, "south_first": True},
    "135°": {"angle": 135, "south_first": True},
    "−30°, rows from the north": {"angle": -30},
    "irregular": {"irregular": True, "south_first": True},
    "slanted pillars": {"slant": 7.0, "south_first": True},
    "one pillar moved": {"moved": True, "south_first": True},
    "layers from the bottom": {"bottom_first": True, "south_first": True},
    "dipping layers": {"dip": 20.0, "angle": 25},
    "map axes": {"map_axes": 30.0, "south_first": True},
}
"""Arguments of `grdecl`."""
