"""Curves of an ensemble and its training image, worked out once for each content."""

from __future__ import annotations

from collections.abc import Callable
from weakref import WeakKeyDictionary

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import Bundle
from ccwsim.metrics import EType, connectivity, etype, variogram
from ccwsim.model.bounds import MAX_CURVES, MAX_LAG
from ccwsim.model.ensemble import Ensemble
from ccwsim.report.pictures import bundle_of_curves

SMALL_SHARES = 4_000_000
"""Shares of facies, eight bytes each, of an E-type that is kept when its ensemble is gone."""

Floats = NDArray[np.float64]
_large: WeakKeyDictionary[Ensemble, EType] = WeakKeyDictionary()


def variogram_bundle(ensemble: Ensemble, facies: int, direction: str) -> Bundle:
    """Return indicator variograms of a facies (a place in the codes) along "E-W" or "N-S"."""

    def curve(images: NDArray[np.integer], lags: int) -> Floats:
        return variogram(images, facies, direction, lags).gamma

    key = ("variogram", ensemble.digest, ensemble.training_image.digest, facies, direction)
    return _bundle(key, ensemble, direction, curve)


def connection_bundle(ensemble: Ensemble, facies: int, direction: str) -> Bundle:
    """Return probabilities of connection of a facies along "E-W" or "N-S", 8 neighbours."""

    def curve(images: NDArray[np.integer], lags: int) -> Floats:
        return connectivity(images, facies, direction, lags).tau

    key = ("connection", ensemble.digest, ensemble.training_image.digest, facies, direction)
    return _bundle(key, ensemble, direction, curve)


@st.cache_resource(max_entries=64, show_spinner=False)
def _bundle(
    key: tuple,
    _ensemble: Ensemble,
    _direction: str,
    _curve: Callable[[NDArray[np.integer], int], Floats],
) -> Bundle:
    image = _ensemble.training_image
    axis = 1 if _direction == "E-W" else 0
    longest = min(image.shape[axis], _ensemble.grid.shape[axis])
    lags = max(1, min(MAX_LAG, longest // 2))
    of_image = (key[0], image.digest, *key[3:], lags)
    reference = _of_image(of_image, lambda: _curve(image.indices, lags).reshape(-1))
    each = _curve(_ensemble.indices[:MAX_CURVES], lags)
    return bundle_of_curves(np.arange(len(reference), dtype=float), reference, each)


@st.cache_resource(max_entries=64, show_spinner=False)
def _of_image(key: tuple, _curve: Callable[[], Floats]) -> Floats:
    """Return the image's own curve, which is the same for all its ensembles."""
    return _curve()


def e_type_of(ensemble: Ensemble) -> EType:
    """Return what an ensemble says about each cell, worked out once.

    Small ones are shared by all sessions; a large one goes with its ensemble.
    """
    if ensemble.grid.ny * ensemble.grid.nx * ensemble.training_image.n_facies <= SMALL_SHARES:
        return _e_type(ensemble.digest, ensemble)
    if ensemble not in _large:
        _large[ensemble] = etype(ensemble.indices, ensemble.training_image.n_facies)
    return _large[ensemble]


@st.cache_resource(max_entries=8, show_spinner=False)
def _e_type(digest: str, _ensemble: Ensemble) -> EType:
    return etype(_ensemble.indices, _ensemble.training_image.n_facies)


def alike_up_to(bundle: Bundle, tolerance: float) -> int:
    """Return the largest lag up to which the image's curve lies in the band, or −1.

    Parameters
    ----------
    bundle : Bundle
    tolerance : float
        How far outside the band still counts as in it.
    """
    outside = (bundle.reference < bundle.low - tolerance) | (
        bundle.reference > bundle.high + tolerance
    )
    beyond = np.flatnonzero(outside[1:])
    return int(bundle.lags[beyond[0]]) if len(beyond) else int(bundle.lags[-1])
