"""Read secondary information: probabilities of facies, other variables, and active cells."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.io.data_file import DataFile, listed
from ccwsim.io.formats.pictures import PictureFile
from ccwsim.io.gridding import as_grid
from ccwsim.io.hard_data.columns import is_points
from ccwsim.io.isolated import IsolatedFile
from ccwsim.io.limits import limits
from ccwsim.io.opening import PathOrFile, open_file, read_bytes
from ccwsim.model.arrays import as_floats, describe_shape, frozen
from ccwsim.model.bounds import MAX_IMAGES
from ccwsim.model.errors import refused
from ccwsim.model.numbers import plural
from ccwsim.model.secondary import Auxiliary, Secondary, cells_in_polygon

PREFIX = "p_"  # begin, in lower case, of variables with probabilities, such as `P_sand`
HEIGHTS = ("z", "layer")  # first columns of a vertical curve, which has one row for each layer
KINDS_OF_ARRAYS = {
    "active": "b",
    **dict.fromkeys(("probabilities", "auxiliary_of_image", "auxiliary_of_grid"), "f"),
    **dict.fromkeys(("auxiliary_weights", "soft_weight", "zones", "weights"), "fiu"),
    **dict.fromkeys(("angle", "scale_x", "scale_y", "scale_z", "dip", "angle_tolerance"), "fiu"),
    "mirrored": "U",
    **{f"image_{k}": "fiu" for k in range(1, MAX_IMAGES)},
}
"""NumPy kinds of the arrays of `arrays_of_secondary`, by name."""
MAX_DEPTH = 8  # maximum number of collections inside each other in GeoJSON
MAX_POLYGONS = 1000  # each is compared with all rows of a grid


def read_probabilities(
    path_or_file: PathOrFile, grid: Grid, facies: str | int | None = None
) -> dict[str | int, NDArray[np.float64]]:
    """Read probabilities of facies for `Secondary(probabilities=...)`.

    The file is a grid in any format, or a table with the centres of the cells, with a variable
    `P_<name or code of the facies>` for each facies; or for a volume a vertical curve: a table with
    a column `z` or `layer` and one row for each layer. The only variable of a file belongs to
    `facies`, whatever its name. The arrays have the shape of the simulation grid, or (nz,) for a
    vertical curve, and NaN in cells without a value.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_probabilities(BytesIO(b"2 1 1\\n1\\nP_sand\\n0.25\\n-999\\n"), Grid(1, 2))
    {'sand': array([[0.25,  nan]])}
    """
    file, maps = _maps(path_or_file, grid)
    named = {name: name[len(PREFIX) :] for name in maps if name.lower().startswith(PREFIX)}
    if facies is not None and len(maps) == 1:
        return {facies: next(iter(maps.values()))}
    if not named:
        raise refused("no_map_of_facies", name=file.name, maps=listed([*maps]))
    return {int(of) if of.isdecimal() else of: maps[name] for name, of in named.items()}


def read_values(path_or_file: PathOrFile, grid: Grid) -> NDArray[np.float64]:
    """Read the only variable of a grid, such as an auxiliary variable; the shape is that of `grid`.

    Cells without a value are NaN.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_values(BytesIO(b"2 1 1\\n1\\ndepth\\n12\\n15\\n"), Grid(1, 2))
    array([[12., 15.]])
    """
    file, maps = _maps(path_or_file, grid)
    if len(maps) != 1:
        raise CCWSIMError(f"{file.name} has the variables {listed([*maps])}; give one variable")
    return next(iter(maps.values()))


def read_active(path_or_file: PathOrFile, grid: Grid) -> NDArray[np.bool_ | np.float64]:
    """Read the active cells of a grid for `Secondary(active=...)`.

    The file is a grid with NaN, a code for missing values or (beside 1) 0 in inactive cells; or
    polygons in GeoJSON, in the coordinates of `grid`. Raises `CCWSIMError` for other files.

    Examples
    --------
    >>> from io import BytesIO
    >>> ring = b'{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 2], [0, 2]]]}'
    >>> read_active(BytesIO(ring), Grid(2, 3))
    array([[ True, False, False],
           [ True, False, False]])
    """
    if isinstance(path_or_file, IsolatedFile):
        polygons = path_or_file.read_with(_polygons)
    else:
        polygons = _polygons(path_or_file)
    if polygons is None:
        return read_values(path_or_file, grid)
    active = np.zeros(grid.shape, bool)
    for rings in polygons:  # a ring inside another is a hole
        active |= np.logical_xor.reduce([cells_in_polygon(ring, grid) for ring in rings])
    return active


def arrays_of_secondary(given: Secondary | None) -> dict[str, NDArray]:
    """Return the arrays that describe fitted secondary information, for projects and npz files."""
    if given is None:
        return {}
    several = given.auxiliary
    arrays = {
        "active": given.active,
        "probabilities": given.probabilities,
        "auxiliary_of_image": [each.image for each in several] or None,
        "auxiliary_of_grid": [each.grid for each in several] or None,
        "auxiliary_weights": [each.weight for each in several] or None,
        "soft_weight": given.soft_weight,
        **{name: getattr(given, name) for name in ("zones", "weights", "angle", "dip")},
        **{f"scale_{axis}": own for axis, own in zip("xyz", given.scale or (), strict=False)},
        **{f"image_{k}": image.array for k, image in enumerate(given.images, 1)},
    }
    if given.has_copies:
        arrays |= {"mirrored": "".join(given.mirrored), "angle_tolerance": given.angle_tolerance}
    return {name: np.asarray(own) for name, own in arrays.items() if own is not None}


def secondary_of_arrays(
    arrays: Mapping[str, NDArray], grid: Grid, image: TrainingImage
) -> Secondary | None:
    """Return the fitted secondary information that `arrays_of_secondary` describes, checked again.

    Raises `CCWSIMError` if arrays do not fit together; return None if there is no information.
    """
    maps = arrays.get("auxiliary_of_image", ()), arrays.get("auxiliary_of_grid", ())
    weights = arrays.get("auxiliary_weights", np.empty(0)).ravel().tolist()
    if not len(maps[0]) == len(maps[1]) == len(weights):
        raise CCWSIMError("auxiliary variables need maps of image and grid, and weights")
    soft = arrays.get("probabilities")
    if soft is not None and len(soft) != image.n_facies:
        raise CCWSIMError(f"probabilities: {len(soft)} maps for {image.n_facies} facies")

    def one(name: str, default: Any) -> Any:
        value = arrays.get(name, np.asarray(default))
        if value.size != 1:
            raise CCWSIMError(f"{name} must be one value, not {value.size}; save it again")
        return value.item()

    fitted = Secondary(
        arrays.get("active"),
        None if soft is None else dict(zip(image.codes.tolist(), soft, strict=True)),
        [Auxiliary(*each) for each in zip(*maps, weights, strict=True)],
        float(one("soft_weight", 1.0)),
        images=[arrays[k] for k in KINDS_OF_ARRAYS if k.startswith("image_") and k in arrays],
        **cast(Any, {name: arrays.get(name) for name in ("zones", "weights", "angle", "dip")}),
        scale=tuple(own for axis in "xyz" if (own := arrays.get(f"scale_{axis}")) is not None)
        or None,
        mirrored=str(one("mirrored", "")),
        angle_tolerance=float(one("angle_tolerance", 2.0)),
    ).fitted(grid, image)
    own = fitted.probabilities
    if soft is not None and own is not None and np.allclose(soft, own, 0, 1e-12, equal_nan=True):
        fitted = replace(fitted, probabilities=frozen(soft))  # the saved values, to the last digit
    return None if fitted.is_empty else fitted


def _maps(path_or_file: PathOrFile, grid: Grid) -> tuple[DataFile, dict[str, NDArray[np.float64]]]:
    """Return a file and its variables on a grid, or its vertical curves."""
    file = open_file(path_or_file)
    if isinstance(file, PictureFile):
        raise CCWSIMError(f"{file.name} is a picture in colours; give a grid of numbers")
    heights = [name for name in file.variables if name.lower() in HEIGHTS]
    points = is_points(list(file.names))
    if file.is_table and heights and not points:
        order = np.argsort(file.variables[heights[0]])
        if len(order) != grid.nz:
            raise refused("rows_of_layers", name=file.name, n=len(order), nz=grid.nz or "no")
        maps = {name: v[order] for name, v in file.variables.items() if name != heights[0]}
    else:
        file = as_grid(file) if not file.is_table or points else file
        _check_geometry(file, grid)
        shape, volume = grid.shape if file.is_table else None, grid.nz is not None
        grids = {name: file.grid_of(name, shape) for name in file.variables}
        maps = {name: file.oriented(values, volume=volume) for name, values in grids.items()}
        for values in maps.values():
            if values.shape != grid.shape:
                raise CCWSIMError(
                    f"{file.name} has {describe_shape(values.shape)} cells, but "
                    f"{describe_shape(grid.shape)} are needed; give one value for each cell"
                )
    known = {name: np.where(file.known(v), v, np.nan) for name, v in maps.items()}
    return file, {name: values.astype(np.float64) for name, values in known.items()}


def _check_geometry(file: DataFile, grid: Grid) -> None:
    """Raise an error if file and grid both have world coordinates, and these differ."""
    usual = Grid.of(grid.shape)
    if file.cell_size is None or (grid.cell_size, grid.origin) == (usual.cell_size, usual.origin):
        return
    both = file.placed(grid.shape), grid
    given, own = (np.array([one.cell_size[:2], one.origin[:2]]) for one in both)
    if (np.abs(given - own) > 0.01 * own[0]).any():
        raise CCWSIMError(
            f"{file.name} has cells of {_pair(given[0])} from {_pair(given[1])}, but the grid has "
            f"cells of {_pair(own[0])} from {_pair(own[1])}; give a map of this grid"
        )


def _pair(numbers: NDArray[np.float64]) -> str:
    return " × ".join(f"{number:g}" for number in numbers)


def _polygons(path_or_file: PathOrFile) -> list[list[NDArray[np.float64]]] | None:
    """Return the polygons of GeoJSON, as lists of rings; None for another file."""
    content, name = read_bytes(path_or_file)
    if not content.lstrip().startswith(b"{"):
        return None
    try:
        given = [*_geometries(json.loads(content.decode()), MAX_DEPTH)]
        polygons = [[as_floats(ring, "ring")[:, :2] for ring in rings] for rings in given]
    except (CCWSIMError, ValueError, TypeError, AttributeError, LookupError, RecursionError):
        raise CCWSIMError(f"{name} is not valid GeoJSON; save the polygons again") from None
    polygons = [rings for rings in polygons if rings]
    if not polygons:
        raise CCWSIMError(f"{name} has no polygon; give a Polygon or MultiPolygon")
    n = sum(len(ring) for rings in polygons for ring in rings)
    if n > limits().points or len(polygons) > MAX_POLYGONS:
        raise CCWSIMError(
            f"{name} has {plural(len(polygons), 'polygon')} with {n} corners; {MAX_POLYGONS} with "
            f"{limits().points} corners are allowed: simplify them, or give a grid"
        )
    if not all(len(ring) > 2 and np.isfinite(ring).all() for rings in polygons for ring in rings):
        raise CCWSIMError(f"{name}: a polygon needs at least three corners with finite coordinates")
    return polygons


def _geometries(given: dict[str, Any], depth: int) -> Iterator[list[Any]]:
    """Yield the coordinates of each polygon in GeoJSON."""
    if not depth:
        raise ValueError("collections are nested too deeply")
    if given.get("type") == "Polygon":
        yield given["coordinates"]
    elif given.get("type") == "MultiPolygon":
        yield from given["coordinates"]
    parts = given.get("features") or given.get("geometries") or [given.get("geometry")]
    for part in filter(None, parts):
        yield from _geometries(part, depth - 1)
