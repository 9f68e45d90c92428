"""Patterns of realizations that do not occur in the training image."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.metrics.pattern_codes import are_unknown, codes_in, count_patterns, table_of
from ccwsim.metrics.patterns import layers_of
from ccwsim.metrics.stack import Codes, Fraction, Images, as_image, as_stack, map_parallel
from ccwsim.model.arrays import as_array, check_int
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage


def unseen_patterns(
    images: Images,
    training_image: TrainingImage | ArrayLike,
    size: int = 3,
    mask: NDArray[np.bool_] | None = None,
    codes: Codes | None = None,
    progress: Fraction | None = None,
) -> NDArray[np.float64]:
    """Return the share of the patterns of each image that do not occur in the training image.

    Patterns have size × size cells, in volumes size × size × size, or as many layers as the thinner
    image.

    Parameters
    ----------
    images, training_image, codes, progress
        As in `pattern_distance`.
    size : int
        Side of the patterns in cells.
    mask : ndarray of bool, shape of one image, optional
        Only patterns with one of these cells count, for example cells with hard data.

    Returns
    -------
    ndarray, shape (n,)
        From 0 to 1; NaN for a mask without cells.

    Raises
    ------
    CCWSIMError
        For unknown codes, patterns that do not fit, maps with a volume or the reverse, and a mask
        of another shape.

    Examples
    --------
    >>> stripes = np.tile([0, 0, 1, 1], (8, 2))
    >>> unseen_patterns([stripes, stripes.T], stripes)
    array([0., 1.])
    """
    own = as_image(training_image, codes)
    stack = as_stack(images, own.codes)
    sides = min(own.shape[-2:] + stack.shape[-2:])
    size = check_int("pattern size", size, 1, sides)
    how = own.n_facies, min(size, layers_of(own, stack)), size
    chosen = None if mask is None else _containing(mask, stack.shape, how[1], size)
    table = table_of(count_patterns(own.volume(0), *how)[0])

    def one(k: int) -> float:
        strips = [are_unknown(c.ravel(), *table) for c in codes_in(stack.volume(k), *how)]
        unknown = np.concatenate(strips)
        if chosen is not None:
            unknown = unknown[chosen]
        return float(unknown.mean()) if len(unknown) else float("nan")

    return np.array(map_parallel(one, len(stack), progress))


def _containing(
    mask: NDArray[np.bool_], shape: tuple[int, ...], height: int, size: int
) -> NDArray[np.bool_]:
    """Return, flat like the codes, which patterns have a cell of the mask."""
    mask = as_array(mask, "mask")
    if mask.shape != shape or mask.dtype != np.bool_:
        raise CCWSIMError(
            f"mask must be of type bool and shape {shape}, not of type {mask.dtype} and shape "
            f"{mask.shape}"
        )
    chosen = mask.reshape(-1, *shape[-2:])
    for axis, side in enumerate((height, size, size)):
        windows = np.lib.stride_tricks.sliding_window_view(chosen, side, axis)
        chosen = windows.any(axis=-1)
    return chosen.ravel()
