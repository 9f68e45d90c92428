"""Read secondary information: probabilities, other variables, active cells, and angles."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.io.data_file import DataFile, listed
from ccwsim.io.formats.numpy_files import one_value
from ccwsim.io.formats.pictures import PictureFile
from ccwsim.io.gridding import as_grid
from ccwsim.io.hard_data.columns import is_points
from ccwsim.io.isolated import IsolatedFile
from ccwsim.io.limits import limits
from ccwsim.io.opening import PathOrFile, open_file, read_bytes
from ccwsim.model.arrays import as_floats, describe_shape, frozen
from ccwsim.model.bounds import MAX_IMAGES
from ccwsim.model.errors import refused, shown
from ccwsim.model.numbers import plural
from ccwsim.model.secondary import Auxiliary, Secondary, cells_in_polygon

PREFIX = "p_"  # start, in lower case, of the names of probabilities, such as `P_sand`
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
MAX_SHAPES = 1000  # polygons or lines; a polygon is compared with all rows of a grid
N_KNOTS = 64  # maximum number of positions along an axis between which angles are interpolated
FARTHEST = 1e15  # maximum coordinate of a line, whose squares can be summed
N_SAMPLES = 500  # number of points, at equal distances along all lines, with a direction


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
    polygons = _shapes(path_or_file, "Polygon")
    if polygons is None:
        return read_values(path_or_file, grid)
    active = np.zeros(grid.shape, bool)
    for rings in polygons:  # a ring inside another is a hole
        active |= np.logical_xor.reduce([cells_in_polygon(ring, grid) for ring in rings])
    return active


def read_lines(path_or_file: PathOrFile) -> list[NDArray[np.float64]] | None:
    """Read the lines of GeoJSON for `angles_along`; None for other files.

    Examples
    --------
    >>> from io import BytesIO
    >>> len(read_lines(BytesIO(b'{"type": "LineString", "coordinates": [[0, 0], [1, 2]]}')))
    1
    """
    lines = _shapes(path_or_file, "LineString")
    return None if lines is None else [line for (line,) in lines]


def angles_along(
    lines: Sequence[ArrayLike], grid: Grid, azimuth: float = 0.0
) -> NDArray[np.float64]:
    """Return angles for `Secondary(angle=...)` that turn a direction of the image along lines.

    `azimuth`, in degrees clockwise from north, is the direction of the image, such as that of its
    geobodies. Each line has points (x, y), shape (n, 2), in the order of its direction. Between
    lines, directions are averaged as unit vectors; their weights fall with the fourth power of the
    distance. Raises `CCWSIMError` if no line has a length, or if points are not finite or farther
    than 1e15.

    Examples
    --------
    >>> angles_along([[(0, 0), (9, 9)]], Grid(1, 3), azimuth=15.0).round(6)
    array([[30., 30., 30.]])
    """
    from scipy.ndimage import zoom  # slow to import

    points = [as_floats(line, "line") for line in lines]
    for line in points:
        if line.ndim != 2 or line.shape[1] != 2 or not (np.abs(line) <= FARTHEST).all():
            raise CCWSIMError(f"line {shown(line)}: points (x, y) within ±{FARTHEST:g} are needed")
    ends = np.concatenate([np.empty((0, 4)), *(np.hstack([p[:-1], p[1:]]) for p in points)])
    steps = ends[:, 2:] - ends[:, :2]
    reached = np.cumsum(lengths := np.hypot(steps[:, 0], steps[:, 1]))
    if not lengths.any():
        raise CCWSIMError("angles along lines need a line between two different points")
    distances = (np.arange(N_SAMPLES) + 0.5) / N_SAMPLES * reached[-1]
    segments = np.searchsorted(reached, distances)
    x, y = (
        ends[segments, 2:]
        + ((distances - reached[segments]) / lengths[segments])[:, None] * steps[segments]
    ).T
    directions = steps[segments] @ [1j, 1] / lengths[segments]  # north is 1, east is i
    columns, rows = (np.linspace(k[0], k[-1], min(len(k), N_KNOTS)) for k in grid.axes[:2])
    far = (rows[:, None, None] - y) ** 2 + (columns[:, None] - x) ** 2
    close = 1 / (far + min(grid.cell_size[:2]) ** 2 / 4) ** 2
    mean, factors = (
        close @ directions / close.sum(axis=-1),
        np.divide(grid.shape[-2:], far.shape[:2]),
    )
    turned = np.degrees(np.angle(np.asarray(zoom(mean, factors, order=1)))) - azimuth
    return np.broadcast_to(turned % 360, grid.shape).copy()


def arrays_of_secondary(secondary: Secondary | None) -> dict[str, NDArray]:
    """Return the arrays that describe fitted secondary information, for projects and npz files."""
    if secondary is None:
        return {}
    several = secondary.auxiliary
    arrays = {
        "active": secondary.active,
        "probabilities": secondary.probabilities,
        "auxiliary_of_image": [each.image for each in several] or None,
        "auxiliary_of_grid": [each.grid for each in several] or None,
        "auxiliary_weights": [each.weight for each in several] or None,
        "soft_weight": secondary.soft_weight,
        **{name: getattr(secondary, name) for name in ("zones", "weights", "angle", "dip")},
        **{f"scale_{axis}": k for axis, k in zip("xyz", secondary.scale or (), strict=False)},
        **{f"image_{k}": image.array for k, image in enumerate(secondary.images, 1)},
    }
    if secondary.has_copies:
        arrays |= {
            "mirrored": "".join(secondary.mirrored),
            "angle_tolerance": secondary.angle_tolerance,
        }
    return {name: np.asarray(array) for name, array in arrays.items() if array is not None}


def secondary_of_arrays(
    arrays: Mapping[str, NDArray], grid: Grid, image: TrainingImage
) -> Secondary | None:
    """Return the fitted secondary information that `arrays_of_secondary` describes, checked again.

    Raises `CCWSIMError` if arrays do not fit together; return None if there is no information.
    """
    images, grids = arrays.get("auxiliary_of_image", ()), arrays.get("auxiliary_of_grid", ())
    weights = arrays.get("auxiliary_weights", np.empty(0)).ravel().tolist()
    if not len(images) == len(grids) == len(weights):
        raise CCWSIMError("auxiliary variables need maps of image and grid, and weights")
    soft = arrays.get("probabilities")
    if soft is not None and len(soft) != image.n_facies:
        raise CCWSIMError(f"probabilities: {len(soft)} maps for {image.n_facies} facies")

    fitted = Secondary(
        arrays.get("active"),
        None if soft is None else dict(zip(image.codes.tolist(), soft, strict=True)),
        [
            Auxiliary(of_image, of_grid, weight)
            for of_image, of_grid, weight in zip(images, grids, weights, strict=True)
        ],
        float(one_value(arrays, "soft_weight", 1.0)),
        images=[arrays[k] for k in KINDS_OF_ARRAYS if k.startswith("image_") and k in arrays],
        **cast(Any, {name: arrays.get(name) for name in ("zones", "weights", "angle", "dip")}),
        scale=tuple(arrays[k] for k in ("scale_x", "scale_y", "scale_z") if k in arrays) or None,
        mirrored=str(one_value(arrays, "mirrored", "")),
        angle_tolerance=float(one_value(arrays, "angle_tolerance", 2.0)),
    ).fitted(grid, image)
    normalized = fitted.probabilities
    if (
        soft is not None
        and normalized is not None
        and np.allclose(soft, normalized, 0, 1e-12, equal_nan=True)
    ):
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
    filled = {name: np.where(file.known(v), v, np.nan) for name, v in maps.items()}
    return file, {name: values.astype(np.float64) for name, values in filled.items()}


def _check_geometry(file: DataFile, grid: Grid) -> None:
    """Raise an error if file and grid both have world coordinates, and these differ."""
    usual = Grid.of(grid.shape)
    is_usual = (grid.cell_size, grid.origin) == (usual.cell_size, usual.origin)
    if is_usual or not file.geometry.cell_size:
        return
    both = file.geometry.grid(grid.shape), grid
    stated, expected = (np.array([one.cell_size[:2], one.origin[:2]]) for one in both)
    if (np.abs(stated - expected) > 0.01 * expected[0]).any():
        raise CCWSIMError(
            f"{file.name} has cells of {_pair(stated[0])} from {_pair(stated[1])}, but the grid "
            f"has cells of {_pair(expected[0])} from {_pair(expected[1])}; give a map of this grid"
        )


def _pair(numbers: NDArray[np.float64]) -> str:
    return " × ".join(f"{number:g}" for number in numbers)


def _shapes(path_or_file: PathOrFile, kind: str) -> list[list[NDArray[np.float64]]] | None:
    """Return polygons, as lists of rings, or lists of one line in GeoJSON; None for other files."""
    if isinstance(path_or_file, IsolatedFile):
        return path_or_file.read_with(_shapes, kind)
    content, name = read_bytes(path_or_file)
    if not content.lstrip().startswith(b"{"):
        return None
    what, least = ("polygon", 3) if kind == "Polygon" else ("line", 2)
    try:
        coordinates = [*_geometries(json.loads(content.decode()), kind, MAX_DEPTH)]
        coordinates = coordinates if kind == "Polygon" else [[line] for line in coordinates]
        shapes = [[as_floats(points, what)[:, :2] for points in parts] for parts in coordinates]
    except (CCWSIMError, ValueError, TypeError, AttributeError, LookupError, RecursionError):
        raise CCWSIMError(f"{name} is not valid GeoJSON; save the {what}s again") from None
    shapes = [parts for parts in shapes if parts]
    if not shapes:
        raise CCWSIMError(f"{name} has no {what}; give a {kind} or Multi{kind}")
    n = sum(len(points) for parts in shapes for points in parts)
    if n > limits().points or len(shapes) > MAX_SHAPES:
        raise CCWSIMError(
            f"{name} has {plural(len(shapes), what)} with {n} points; {MAX_SHAPES} with "
            f"{limits().points} points are allowed: simplify them, or give a grid"
        )
    if not all(
        len(points) >= least and np.isfinite(points).all() for parts in shapes for points in parts
    ):
        raise CCWSIMError(f"{name}: a {what} needs at least {least} points with finite coordinates")
    return shapes


def _geometries(collection: dict[str, Any], kind: str, depth: int) -> Iterator[list[Any]]:
    """Yield the coordinates of each shape of a kind in GeoJSON."""
    if not depth:
        raise ValueError("collections are nested too deeply")
    if collection.get("type") == kind:
        yield collection["coordinates"]
    elif collection.get("type") == f"Multi{kind}":
        yield from collection["coordinates"]
    parts = (
        collection.get("features") or collection.get("geometries") or [collection.get("geometry")]
    )
    for part in filter(None, parts):
        yield from _geometries(part, kind, depth - 1)
