"""Random fields and walks that make the drawn geobodies irregular, as in nature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray
from scipy import ndimage

Floats = NDArray[np.float64]


def _filtered_noise(
    shape: tuple[int, int],
    margin: int,
    response: Callable[[Floats, Floats], Floats],
    rng: RandomState,
) -> Floats:
    """Return white noise filtered by a response to frequency (ky, kx), in cycles per cell.

    The noise is drawn with a margin, which is cut off, because the Fourier filter is periodic.
    """
    ny, nx = shape[0] + margin, shape[1] + margin
    ky = np.asarray(np.fft.fftfreq(ny)[:, None], np.float64)
    kx = np.asarray(np.fft.fftfreq(nx)[None, :], np.float64)
    spectrum = np.fft.fft2(rng.standard_normal((ny, nx))) * response(ky, kx)
    field = np.fft.ifft2(spectrum).real
    return ((field - field.mean()) / field.std())[: shape[0], : shape[1]]


def gaussian_field(
    shape: tuple[int, int],
    length: float,
    rng: RandomState,
    *,
    ratio: float = 1.0,
    azimuth: float = 0.0,
) -> Floats:
    """Return a smooth random field with mean 0, variance 1 and a Gaussian covariance.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns.
    length : float
        Correlation length along the main axis, in cells.
    rng : RandomState
        Source of the noise.
    ratio : float
        Correlation length across the main axis, as a share of `length`.
    azimuth : float
        Angle of the main axis from the east, counter-clockwise, in degrees.

    Examples
    --------
    >>> gaussian_field((64, 80), 10, RandomState(0), ratio=0.5, azimuth=30).shape
    (64, 80)
    """
    cos, sin = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))

    def response(ky: Floats, kx: Floats) -> Floats:
        along, across = kx * cos + ky * sin, ky * cos - kx * sin
        return np.exp(-((np.pi * length) ** 2) * (along**2 + (ratio * across) ** 2))

    return _filtered_noise(shape, int(3 * length), response, rng)


def ridge_field(
    shape: tuple[int, int], wavelength: float, azimuth: float, spread: float, rng: RandomState
) -> Floats:
    """Return a field of crests that fork and end like ripples, `wavelength` cells apart.

    The spectrum is a narrow band of wavelengths. Crests run along `azimuth`, counter-clockwise from
    the east, and deviate from it by about `spread` degrees on either side.
    """
    normal = np.radians(azimuth + 90)

    def response(ky: Floats, kx: Floats) -> Floats:
        off = np.angle(np.exp(2j * (np.arctan2(ky, kx) - normal))) / 2
        band = np.exp(-0.5 * ((np.hypot(ky, kx) * wavelength - 1) / 0.22) ** 2)
        return band * np.exp(-0.5 * (off / np.radians(spread)) ** 2)

    return _filtered_noise(shape, int(6 * wavelength), response, rng)


def wave(n: int, wavelength: float, damping: float, rng: RandomState) -> Floats:
    """Return n steps of an irregular wave with mean 0 and variance 1.

    The wave is a damped oscillator driven by noise: the AR(2) process for the direction of a
    meandering river (Ferguson, 1976, Disturbed periodic model for river meanders).

    Parameters
    ----------
    n : int
        Number of unit steps.
    wavelength : float
        Number of steps between bends to the same side.
    damping : float
        From near 0 (regular) to 1 (no memory of the last bend).
    rng : RandomState
        Source of the disturbances.
    """
    k = 2 * np.pi / wavelength
    a1 = 2 * np.exp(-damping * k) * np.cos(k * np.sqrt(1 - damping**2))
    a2 = -np.exp(-2 * damping * k)
    lead = int(4 * wavelength)
    from scipy.signal import lfilter  # imported late: it loads slowly

    series = lfilter([1.0], [1.0, -a1, -a2], rng.standard_normal(n + lead))[lead:]
    gain = (1 - a2) / ((1 + a2) * ((1 - a2) ** 2 - a1**2))
    return np.asarray(series / np.sqrt(gain))


def smoothed(facies: NDArray[np.integer], sigma: float) -> NDArray[np.uint8]:
    """Give each cell the facies that prevails around it; this rounds corners and removes specks."""
    shares = [
        ndimage.gaussian_filter((facies == code).astype(float), sigma, mode="nearest")
        for code in range(int(facies.max()) + 1)
    ]
    return np.argmax(shares, axis=0).astype(np.uint8)


def without_specks(facies: NDArray[np.integer], n_cells: int) -> NDArray[np.uint8]:
    """Give geobodies of fewer than `n_cells` cells the facies of the nearest larger geobody.

    Examples
    --------
    >>> without_specks(np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0]]), 2).max()
    np.uint8(0)
    """
    speck = np.zeros(facies.shape, bool)
    for code in range(int(facies.max()) + 1):
        bodies = bodies_of(facies == code)
        sizes = np.bincount(bodies.ravel())
        speck |= (bodies > 0) & (sizes[bodies] < n_cells)
    nearest = np.empty((2, *facies.shape), np.int32)
    ndimage.distance_transform_edt(
        speck, return_distances=False, return_indices=True, indices=nearest
    )
    return facies[nearest[0], nearest[1]].astype(np.uint8)


def bodies_of(inside: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Label the geobodies (4 neighbours) from 1 on; cells outside are 0."""
    bodies = np.empty(inside.shape, np.int32)
    ndimage.label(inside, output=bodies)
    return bodies
