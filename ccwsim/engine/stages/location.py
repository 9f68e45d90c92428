"""Keep patches near their place in the training image, where that is not stationary.

Section 5.9 of the paper names nonstationary training images as a limit of the method: patches from
anywhere may be laid anywhere. Here a place costs more the farther it is from where the tile lies in
the grid, both measured as shares of the way from one end to the other.
"""

from __future__ import annotations

from ccwsim.engine.kernels import kernel


@kernel
def add_location(y0, x0, size, shape, cost, totals):
    """Add `cost` times the squared distance from the tile's own place to every place's score.

    Parameters
    ----------
    y0, x0, size : int
        First cell and side of the patch.
    shape : pair of int
        Rows and columns of the simulation grid; its last patch corresponds to the last place.
    cost : float
        Of a place at the other end of one axis.
    totals : ndarray of int64, shape (ny_places, nx_places)
    """
    ny, nx = totals.shape
    row = y0 / max(shape[0] - size, 1) * (ny - 1)
    column = x0 / max(shape[1] - size, 1) * (nx - 1)
    for py in range(ny):
        down = (py - row) / max(ny - 1, 1)
        for px in range(nx):
            along = (px - column) / max(nx - 1, 1)
            totals[py, px] += int(cost * (down * down + along * along))
