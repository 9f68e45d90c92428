"""Colours and facies: which are there, and the nearest few of them."""

from __future__ import annotations

import colorsys
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.errors import CCWSIMError, shown

MAX_COLOURS = 16
"""More different colours in a picture come from blur or shading, not from facies."""

DEFAULT_COLOURS = ("#1f3f77", "#f0a830", "#2f8f5b", "#a63d2f", "#7d5ba6", "#8a8f98")
"""Deep blue, amber, green, brick, violet, grey: one a facies, in the order of the codes."""


def colours_for(n: int, colours: Sequence[str] | None = None) -> NDArray[np.uint8]:
    """Return n colours as red, green and blue, shape (n, 3).

    Parameters
    ----------
    n : int
        How many facies there are.
    colours : sequence of str, optional
        As `#rrggbb`; the default palette, then hues around the circle, where they are too few.

    Raises
    ------
    CCWSIMError
        For a colour that is not written so.

    Examples
    --------
    >>> colours_for(1, ["#ff8000"]).tolist()
    [[255, 128, 0]]
    """
    given = list(DEFAULT_COLOURS if colours is None else colours)[:n]
    rgb = [_rgb(colour) for colour in given]
    for k in range(len(rgb), n):
        hue = (k * 0.618034) % 1.0
        rgb.append(
            tuple(round(255 * c) for c in colorsys.hsv_to_rgb(hue, 0.6, 0.5 + 0.1 * (k % 5)))
        )
    return np.array(rgb, dtype=np.uint8).reshape(n, 3)


def grey_of(rgb: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the luminance (ITU-R 601) of colours, 0 black to 255 white, shape (...,).

    Examples
    --------
    >>> grey_of(np.array([[255, 255, 255]], np.uint8)).round(3).tolist()
    [255.0]
    """
    weights = np.array([0.299, 0.587, 0.114])
    return np.rint(rgb @ weights * 1000) / 1000


def distinct_colours(rgb: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Return the colours of a picture from dark to light and the place of each cell among them.

    Parameters
    ----------
    rgb : ndarray of uint8, shape (ny, nx, 3)
        The picture.

    Returns
    -------
    colours : ndarray of uint8, shape (n, 3)
    places : ndarray of int, shape (ny, nx)

    Examples
    --------
    >>> colours, places = distinct_colours(np.array([[[255] * 3, [0] * 3]], np.uint8))
    >>> places.tolist()
    [[1, 0]]
    """
    packed = _packed(rgb, 8)
    there = np.zeros(1 << 24, bool)
    there[packed] = True
    found = np.flatnonzero(there)
    colours = np.stack([found >> 16, found >> 8, found], axis=1).astype(np.uint8)
    order = np.lexsort((found, grey_of(colours)))
    rank = np.empty(1 << 24, np.int32)
    rank[found[order]] = np.arange(len(order))
    return colours[order], rank[packed]


def nearest_colours(rgb: NDArray[np.uint8], n: int) -> NDArray[np.int64]:
    """Return the facies of a picture brought down to n colours, numbered from dark to light.

    Starts from the most frequent colour and, again and again, the one that is frequent and far
    from those taken; then Lloyd's k-means on the histogram of colours.

    Raises
    ------
    CCWSIMError
        Where n is not from 2 to `MAX_COLOURS`, or the picture has fewer colours.

    Examples
    --------
    >>> picture = np.array([[[0] * 3, [3] * 3, [250] * 3, [255] * 3]], np.uint8)
    >>> nearest_colours(picture, 2).tolist()
    [[0, 0, 1, 1]]
    """
    if not 2 <= n <= MAX_COLOURS:
        raise CCWSIMError(f"classes = {shown(n)} must be from 2 to {MAX_COLOURS} for a picture")
    coarse = _packed(rgb >> 3, 5)
    counts = np.bincount(coarse.ravel(), minlength=1 << 15)
    bins = np.flatnonzero(counts)
    if len(bins) < n:
        raise CCWSIMError(f"the picture has only {len(bins)} clearly different colours, not {n}")
    points = np.stack([bins >> 10, bins >> 5, bins], axis=1) % 32 * 8.0 + 4.0
    label = _k_means(points, counts[bins].astype(np.float64), n)
    of_bin = np.zeros(1 << 15, np.int64)
    of_bin[bins] = label
    return of_bin[coarse]


def _packed(rgb: NDArray[np.integer], bits: int) -> NDArray[np.int32]:
    """Red, green and blue in one number."""
    red, green, blue = np.moveaxis(rgb.astype(np.int32), -1, 0)
    return red << 2 * bits | green << bits | blue


def _k_means(points: NDArray, weights: NDArray, n: int) -> NDArray[np.intp]:
    centres = points[[weights.argmax()]]
    while len(centres) < n:
        far = ((points[:, None] - centres) ** 2).sum(axis=2).min(axis=1)
        centres = np.vstack([centres, points[(far * weights).argmax()]])
    label = np.zeros(len(points), np.intp)
    for _ in range(20):
        label = ((points[:, None] - centres) ** 2).sum(axis=2).argmin(axis=1)
        for k in range(n):
            mine = label == k
            if mine.any():
                centres[k] = np.average(points[mine], axis=0, weights=weights[mine])
    rank = np.empty(n, np.intp)
    rank[np.argsort(centres @ [0.299, 0.587, 0.114], kind="stable")] = np.arange(n)
    return rank[label]


def _rgb(colour: str) -> tuple[int, ...]:
    digits = str(colour).removeprefix("#")
    if not re.fullmatch("[0-9a-fA-F]{6}", digits):
        raise CCWSIMError(f"{shown(colour)} is not a colour; write it as #rrggbb")
    return tuple(bytes.fromhex(digits))
