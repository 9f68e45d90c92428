"""The simulation in plain NumPy, SciPy and Python, for verifying the compiled kernels.

The module simulates one unconditional realization as in the paper: the score map by FFT of block
sums, the K best by partition, and the cut by dynamic programming, line by line. No kernel of
`ccwsim` is used.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from ccwsim import Parameters, TrainingImage
from ccwsim.engine.stages.path import N_ORIENTATIONS, from_path, n_tiles, to_path


def block_sums(image: NDArray, level: int, n_facies: int) -> NDArray[np.float64]:
    """Return the number of cells of each facies in each block of 2^level × 2^level cells.

    For two facies, only the plane of facies 1 is returned.

    Parameters
    ----------
    image : ndarray, shape (ny, nx)
        Facies indices.

    Returns
    -------
    ndarray, shape (n_planes, ny / 2^level, nx / 2^level)

    Examples
    --------
    >>> block_sums(np.eye(4, dtype=int), 1, 2)
    array([[[2., 0.], [0., 2.]]])
    """
    unit = 2**level
    ny, nx = (length // unit for length in image.shape)
    planes = [image == f for f in (range(n_facies) if n_facies > 2 else [1])]
    cropped = np.array(planes)[:, : ny * unit, : nx * unit]
    return cropped.reshape(len(planes), ny, unit, nx, unit).sum(axis=(2, 4), dtype=float)


def score_map(sums: NDArray, overlap: NDArray, mask: NDArray) -> NDArray[np.int64]:
    """Return ΣA² − 2·ΣA·B over the overlap for every location of the training image, by FFT.

    Parameters
    ----------
    sums : ndarray, shape (n_planes, my, mx)
        Block sums A of the training image.
    overlap : ndarray, shape (n_planes, t, t)
        Block sums B of a tile; only those in `mask` are used.
    mask : ndarray of bool, shape (t, t)
        Cells of the overlap.

    Returns
    -------
    ndarray, shape (my − t + 1, mx − t + 1)

    Examples
    --------
    >>> score_map(np.array([[[0.0, 2.0, 3.0]]]), np.array([[[2.0]]]), np.array([[True]]))
    array([[ 0, -4, -3]])
    """
    turned = (overlap * mask)[:, ::-1, ::-1]
    energy = fftconvolve((sums**2).sum(axis=0), mask[::-1, ::-1].astype(float), "valid")
    ccf = fftconvolve(sums, turned, "valid", axes=(1, 2)).sum(axis=0)
    return np.rint(energy - 2 * ccf).astype(np.int64)


def overlap_mask(template: int, overlap: int, left: bool, top: bool) -> NDArray[np.bool_]:
    """Return the cells of the overlap of a tile, shape (template, template).

    Examples
    --------
    >>> overlap_mask(2, 1, left=False, top=True).tolist()
    [[True, True], [False, False]]
    """
    mask = np.zeros((template, template), bool)
    mask[:, :overlap] |= left
    mask[:overlap] |= top
    return mask


def boundary(error: NDArray) -> NDArray[np.int64]:
    """Return the cheapest boundary through an overlap: the number of old cells kept in each line.

    Parameters
    ----------
    error : ndarray, shape (n, m)
        1 for different old and new cells, otherwise 0; n lines along the boundary, m cells across.

    Examples
    --------
    >>> boundary(np.array([[1, 0, 0, 1], [1, 0, 0, 1]])).tolist()
    [2, 2]
    """
    n, m = error.shape
    sides = np.arange(m + 1)
    own = error[:, np.maximum(sides - 1, 0)] + error[:, np.minimum(sides, m - 1)].astype(int)
    cost = own.copy()
    for i in range(1, n):
        before = np.pad(cost[i - 1], 1, constant_values=np.iinfo(int).max)
        cost[i] += np.minimum(np.minimum(before[:-2], before[2:]), before[1:-1])
    path = np.empty(n, np.int64)
    path[-1] = at = int(cost[-1].argmin())
    for i in range(n - 2, -1, -1):
        near = [at] + [c for c in (at - 1, at + 1) if 0 <= c <= m]
        at = min(near, key=lambda c: cost[i, c])
        path[i] = at
    return path


def kept_cells(
    old: NDArray, new: NDArray, overlap: int, left: bool, top: bool
) -> NDArray[np.bool_]:
    """Return the mask of the old cells of a tile that are kept, shape (template, template)."""
    kept = np.zeros(old.shape, bool)
    differs = old != new
    if left:
        path = boundary(differs[:, :overlap])
        kept[:, :overlap] |= np.arange(overlap) < path[:, None]
    if top:
        path = boundary((differs & ~kept)[:overlap].T)
        kept[:overlap] |= np.arange(overlap)[:, None] < path
    return kept


def refined(
    image: NDArray, old: NDArray, mask: NDArray, place: tuple[int, int], unit: int
) -> tuple[int, int]:
    """Return the best location near `place` at full resolution, searched with halved strides."""
    template = len(old)

    def misfit(y: int, x: int) -> float:
        if not (0 <= y <= len(image) - template and 0 <= x <= image.shape[1] - template):
            return np.inf
        return int(np.count_nonzero((image[y : y + template, x : x + template] != old)[mask]))

    stride = unit // 2
    while stride:
        y, x = place
        near = [(y + dy, x + dx) for dy in (-stride, 0, stride) for dx in (-stride, 0, stride)]
        place = min([place, *near], key=lambda at: misfit(*at))
        stride //= 2
    return place


def simulate_reference(
    training_image: TrainingImage, shape: tuple[int, int], p: Parameters, seed: int
) -> tuple[NDArray[np.uint8], float]:
    """Return one unconditional realization and its CPU time in seconds.

    Parameters
    ----------
    training_image : TrainingImage
    shape : pair of int
        Rows and columns.
    p : Parameters
    seed : int

    Returns
    -------
    indices : ndarray of uint8, shape `shape`
    seconds : float

    Examples
    --------
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> image, _ = simulate_reference(TrainingImage(np.eye(40)), (30, 50), p, seed=1)
    >>> image.shape
    (30, 50)
    """
    start = time.thread_time()
    rng = np.random.default_rng(seed)
    orientation = int(rng.integers(N_ORIENTATIONS)) if p.random_path else 0
    image = to_path(training_image.indices, orientation)
    sums = block_sums(image, p.level, training_image.n_facies)
    own = shape[::-1] if orientation & 4 else shape
    n_rows, n_columns = (n_tiles(length, p.template_size, p.overlap_size) for length in own)
    grid = np.zeros(
        (n_rows * p.step + p.overlap_size, n_columns * p.step + p.overlap_size), np.uint8
    )
    for row in range(n_rows):
        for column in range(n_columns):
            tile = grid[
                row * p.step : row * p.step + p.template_size,
                column * p.step : column * p.step + p.template_size,
            ]
            simulate_tile(tile, image, sums, p, column > 0, row > 0, rng)
    done = from_path(grid[: own[0], : own[1]], orientation)
    return np.ascontiguousarray(done), time.thread_time() - start


def simulate_tile(
    tile: NDArray[np.uint8],
    image: NDArray,
    sums: NDArray,
    p: Parameters,
    left: bool,
    top: bool,
    rng: np.random.Generator,
) -> None:
    """Simulate one tile in place: score, choose one of the K best at random, refine, cut, paste."""
    unit = 2**p.level
    mask = overlap_mask(p.template_size, p.overlap_size, left, top)
    n_facies = max(2, len(sums))
    scores = score_map(sums, block_sums(tile, p.level, n_facies), mask[::unit, ::unit])
    k = min(p.n_candidates, scores.size)
    best = np.argpartition(scores, k - 1, axis=None)[:k]
    py, px = np.unravel_index(best[rng.integers(k)], scores.shape)
    place = int(py) * unit, int(px) * unit
    if p.refine:
        place = refined(image, tile, mask, place, unit)
    patch = image[place[0] : place[0] + p.template_size, place[1] : place[1] + p.template_size]
    kept = kept_cells(tile, patch, p.overlap_size, left, top)
    tile[~kept] = patch[~kept]
