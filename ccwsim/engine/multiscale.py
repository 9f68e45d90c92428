"""The finer scales of MS-CCSIM: the place of each patch is refined on a finer training image."""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import kernel
from ccwsim.engine.stages.bits import make_strips
from ccwsim.engine.stages.refinement import refine_place
from ccwsim.engine.stages.similarity import LEFT, TOP
from ccwsim.engine.tiles import place_patch

REACH = 2
"""Places up to REACH − 1 cells from that of the coarser scale are looked at, along each axis."""


@kernel
def refine_tiles(
    first, last, n_columns, split_of, splits, image, bits, data, template, overlap, refine, counts,
    grid, sources, places,
):  # fmt: skip
    """Lay tiles `first` to `last` − 1 at one scale, near the places of the coarser scale.

    Parameters
    ----------
    first, last, n_columns, split_of
        As in `simulate_tiles`.
    splits : ndarray of int64, shape (n_splits,)
        Into how many parts, along each axis, a tile may be split.
    image : ndarray of uint8, shape (my, mx)
        The training image of this scale in the path frame.
    bits : ndarray of uint64, shape (n_planes, my, n_words)
        The same as `to_bits` gives it.
    data : PlacedData
        Of this scale.
    template, overlap : int
        T and OR in cells of this scale.
    refine : bool
        Without it the places are those of the coarser scale.
    counts, grid, sources
        As in `simulate_tiles`, of this scale.
    places : ndarray of int32, shape (n_tiles, n_parts, 2)
        Places in the training image of the coarser scale; of this scale on return.
    """
    room = np.empty((template, template), np.bool_)
    strips = make_strips(bits, template)
    step = template - overlap
    for tile in range(first, last):
        row, column = divmod(tile, n_columns)
        parts = splits[split_of[tile]]
        size = step // parts + overlap
        for part in range(parts * parts):
            down, along = divmod(part, parts)
            shape = (LEFT if column + along > 0 else 0) | (TOP if row + down > 0 else 0)
            y0, x0 = row * step + down * (step // parts), column * step + along * (step // parts)
            ty, tx = 2 * np.int64(places[tile, part, 0]), 2 * np.int64(places[tile, part, 1])
            if refine:
                ty, tx = refine_place(
                    image, bits, grid, data, y0, x0, size, overlap, shape, REACH, ty, tx, strips
                )
            place_patch(
                image, ty, tx, y0, x0, size, overlap, shape, data.kept, room, counts, grid, sources
            )
            places[tile, part, 0], places[tile, part, 1] = ty, tx
