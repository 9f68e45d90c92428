"""Arrays with named axes, such as a DataArray of xarray, in the order of this package."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.errors import CCWSIMError

NAMES = {
    "x": ("x", "easting", "east", "lon", "longitude", "i", "column", "col", "xc", "x1"),
    "y": ("y", "northing", "north", "lat", "latitude", "j", "row", "yc", "y1"),
    "z": ("z", "elevation", "height", "altitude", "layer", "k", "level", "lev", "zc", "band"),
}
"""Usual names of axes along x, y and z, in lower case."""


def is_labelled(array: Any) -> bool:
    """Return whether an array names its axes, as a DataArray does."""
    return hasattr(array, "dims") and hasattr(array, "coords") and hasattr(array, "transpose")


def oriented_values(array: Any) -> NDArray:
    """Return the values of a DataArray as (z,) y, x, each axis ascending."""
    names = _axes(array)
    array = array.squeeze([d for d in array.dims if array.sizes[d] == 1 and d not in names[:2]])
    order = list(reversed(_axes(array)))
    values = np.asarray(array.transpose(*order).values)
    for axis, name in enumerate(order):
        coordinates = _coordinates(array, name)
        if coordinates is not None and len(coordinates) > 1 and coordinates[0] > coordinates[-1]:
            values = np.flip(values, axis)
    return values


def labelled_axes(array: Any) -> list[tuple[float, float]]:
    """Return cell size and origin along x, y (and z) of a DataArray."""
    names = _axes(array)
    names = [name for name in names if name in names[:2] or array.sizes[name] > 1]
    return [_cells_along(array, name) for name in names]


def _axes(array: Any) -> list[Any]:
    """Return the names of the axes in the order x, y, z and others."""
    known: dict[str, Any] = {}
    for name in array.dims:
        attributes = array.coords[name].attrs if name in array.coords else {}
        said = str(attributes.get("axis", "")).lower()
        kind = next((k for k, words in NAMES.items() if str(name).lower() in words), said)
        if kind in NAMES and kind not in known:
            known[kind] = name
    rest = [name for name in reversed(array.dims) if name not in known.values()]
    for kind in NAMES:
        if kind not in known and rest:
            known[kind] = rest.pop(0)
    return [known[kind] for kind in NAMES if kind in known] + rest


def _coordinates(array: Any, name: Any) -> NDArray[np.float64] | None:
    values = np.asarray(array.coords[name].values) if name in array.coords else np.empty(0)
    return values.astype(np.float64) if values.size and values.dtype.kind in "iuf" else None


def _cells_along(array: Any, name: Any) -> tuple[float, float]:
    coordinates = _coordinates(array, name)
    if coordinates is None or len(coordinates) < 2:
        return 1.0, 0.0 if coordinates is None else float(coordinates[0]) - 0.5
    steps = np.diff(np.sort(coordinates))
    size = float(np.median(steps))
    if size <= 0 or np.abs(steps - size).max() > 1e-3 * size:
        raise CCWSIMError(
            f"the coordinates along {name} are not equally spaced; interpolate to a regular grid"
        )
    size = float(f"{(coordinates.max() - coordinates.min()) / (len(coordinates) - 1):.12g}")
    return size, float(coordinates.min()) - size / 2
