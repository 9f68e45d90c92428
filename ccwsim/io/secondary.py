"""Read secondary information: probabilities, other variables, active cells, and angles."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.io.data_file import DataFile, listed
from ccwsim.io.formats.gis import GIS_FILES, as_geojson
from ccwsim.io.formats.numpy_files import one_value
from ccwsim.io.formats.pictures import PictureFile, is_grey
from ccwsim.io.gridding import as_grid
from ccwsim.io.hard_data import columns as of_data
from ccwsim.io.isolated import IsolatedFile
from ccwsim.io.limits import limits
from ccwsim.io.opening import PathOrFile, open_file, read_bytes, recognized
from ccwsim.io.places import check_place, on_grid
from ccwsim.model import (
    MAX_IMAGES,
    Array,
    ArrayLike,
    Auxiliary,
    Floats,
    Secondary,
    as_floats,
    cells_in_polygon,
    code_or_name,
    describe_shape,
    frozen,
    plural,
    refused,
    shown,
)

PREFIX = re.compile(r"(?im)^(?:p|proba?|probability)[ _-]+(?:of[ _-]+)?(.+)$")
"""Names of probabilities, such as `P_sand` or `probability of sand`."""
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
    path_or_file: PathOrFile | Sequence[PathOrFile], grid: Grid, facies: str | int | None = None
) -> dict[str | int, Floats]:
    """Read probabilities of facies for `Secondary(probabilities=...)` from one or several files.

    A file is a grid in any format, or a table with the centres of the cells, with a variable for
    each facies; or for a volume a vertical curve: a table with a column `z` or `layer` and one row
    for each layer. Variables named `P_<name or code of the facies>` are used, or `probability of …`
    or, if there are none, all variables as names of facies. The only variable of a file belongs to
    `facies` or, by default, to the facies in its name or in that of the file. The arrays have the
    shape of the simulation grid, or (nz,) for a vertical curve, and NaN in cells without a value.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_probabilities(BytesIO(b"2 1 1\\n1\\nP_sand\\n0.25\\n-999\\n"), Grid(1, 2))
    {'sand': array([[0.25,  nan]])}
    """
    pairs = list[tuple[str | int, Floats]]()
    files: Any = path_or_file if isinstance(path_or_file, (list, tuple)) else [path_or_file]
    for each in files:
        file, maps = _maps(each, grid)
        title = PurePath(file.name).stem if len(maps) == 1 else ""
        labels = {k: start[1] for k in maps if (start := PREFIX.search(f"{k}\n{title}"))}
        labels = labels or {k: title or k for k in maps}
        if title and facies is not None:
            labels = dict.fromkeys(maps, facies)
        pairs += [(code_or_name(label), maps[k]) for k, label in labels.items()]
    by_facies = dict(pairs)
    if len(by_facies) < len(pairs):
        raise refused("two_maps_of_facies", maps=", ".join(str(label) for label, _ in pairs))
    return by_facies


def read_values(path_or_file: PathOrFile, grid: Grid) -> Floats:
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


def read_active(
    path_or_file: PathOrFile, grid: Grid, active_codes: Sequence[float] | None = None
) -> NDArray[np.bool_ | np.float64]:
    """Read the active cells of a grid for `Secondary(active=...)`.

    The file is a grid with NaN, a code for missing values or (beside one other value) 0 in inactive
    cells; a picture in black, which is inactive, and white; or polygons in GeoJSON, GeoPackage or a
    Shapefile. In a grid of several codes, such as numbers of basins, `active_codes` are the codes
    of active cells. Raises `CCWSIMError` for other files, and for polygons outside the grid.

    Examples
    --------
    >>> from io import BytesIO
    >>> ring = b'{"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 2], [0, 2]]]}'
    >>> read_active(BytesIO(ring), Grid(2, 3))
    array([[ True, False, False],
           [ True, False, False]])
    >>> read_active(BytesIO(b"3 1 1\\n1\\nbasin\\n1\\n2\\n3\\n"), Grid(1, 3), active_codes=[2, 3])
    array([[False,  True,  True]])
    """
    polygons = _shapes(path_or_file, "Polygon", grid)
    if polygons is None:
        values = read_values(path_or_file, grid)
        return values if active_codes is None else np.isin(values, active_codes)
    active = np.zeros(grid.shape, bool)
    for rings in polygons:  # a ring inside another is a hole
        active |= np.logical_xor.reduce([cells_in_polygon(ring, grid) for ring in rings])
    return active


def read_lines(
    path_or_file: PathOrFile,
    grid: Grid | None = None,
    kind: Literal["LineString", "Polygon"] = "LineString",
) -> list[Floats] | None:
    """Read lines of GeoJSON, GeoPackage or a Shapefile for `angles_along`, or rings of polygons.

    With a `grid`, the lines are in its coordinate system; lines outside the grid are refused. The
    result is None for other files.

    Examples
    --------
    >>> from io import BytesIO
    >>> len(read_lines(BytesIO(b'{"type": "LineString", "coordinates": [[0, 0], [1, 2]]}')))
    1
    """
    shapes = _shapes(path_or_file, kind, grid)
    return None if shapes is None else [line for parts in shapes for line in parts]


def angles_along(lines: Sequence[ArrayLike], grid: Grid, azimuth: float = 0.0) -> Floats:
    """Return angles for `Secondary(angle=...)` that turn a direction of the image along lines.

    `azimuth`, in degrees clockwise from north, is the direction of the image, such as that of its
    geobodies. Each line has points (x, y), shape (n, 2), in the order of its direction. Between
    lines, directions are averaged as unit vectors; their weights fall with the fourth power of the
    distance. Raises `CCWSIMError` if no line has a length or reaches the grid, or if points are not
    finite or farther than 1e15.

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
    if points:
        points = [line for (line,) in on_grid("the lines", [[p] for p in points], "", grid)]
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


def arrays_of_secondary(secondary: Secondary | None) -> dict[str, Array]:
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
    arrays: Mapping[str, Array], grid: Grid, image: TrainingImage
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
        facies={code: code for code in image.codes.tolist()},
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


def _maps(path_or_file: PathOrFile, grid: Grid) -> tuple[DataFile, dict[str, Floats]]:
    """Return a file and its variables on a grid, or its vertical curves."""
    file = open_file(path_or_file)
    if isinstance(file, PictureFile):
        if not is_grey(file.rgb):
            raise CCWSIMError(f"{file.name} is a picture in colours; save it in black and white")
        file = file.grid()
    points = of_data.is_points(list(file.names))
    column = of_data.height_column([*file.variables], "") if file.is_table and not points else None
    if column and len(file.variables[column]) != grid.n_cells:
        order = _layers_of_curve(file, column, grid)
        maps = {name: v[order] for name, v in file.variables.items() if name != column}
    else:
        file = as_grid(file) if not file.is_table or points else file
        check_place(file.name, file.geometry, grid)
        shape, volume = grid.shape if file.is_table else None, grid.is_volume
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


def _layers_of_curve(file: DataFile, column: str, grid: Grid) -> NDArray[np.intp]:
    """Return the order of the rows of a curve from the bottom; heights must be the grid's."""
    heights = of_data.upward(column, file.variables[column])
    if len(heights) != grid.nz:
        raise refused("rows_of_layers", name=file.name, n=len(heights), nz=grid.nz or "no")
    order, is_layer = np.argsort(heights), of_data.is_kind(column, ["layer"])
    if is_layer and heights.min() > 0:
        raise refused("layers_from_one", name=file.name, column=column)
    if is_layer or (grid.cell_size[2], grid.origin[2]) == (1.0, 0.0):  # the grid has no heights
        return order
    for z, rows in ((heights, order), (-heights, order[::-1])):  # depths may be in a column z
        if np.abs(z[rows] - grid.axes[2]).max() <= grid.cell_size[2] / 2:
            return rows
    z = f"{heights.min():g} to {heights.max():g}"
    layers = f"{grid.axes[2][0]:g} to {grid.axes[2][-1]:g}"
    raise refused("other_heights", name=file.name, column=column, z=z, layers=layers)


def _shapes(path_or_file: PathOrFile, kind: str, grid: Grid | None) -> list[list[Floats]] | None:
    """Return polygons, as lists of rings, or lists of one line; None for other kinds of files."""
    if isinstance(path_or_file, IsolatedFile):
        return path_or_file.read_with(_shapes, kind, grid)
    content, name = read_bytes(path_or_file)
    kind_of_file, content = recognized(content, name)
    what, least = ("polygon", 3) if kind == "Polygon" else ("line", 2)
    crs = ""
    if kind_of_file in GIS_FILES:
        content, crs = as_geojson(content, name, kind_of_file)
    elif not content.lstrip().startswith(b"{"):
        return None
    try:
        collection = json.loads(content)
        crs = crs or collection.get("crs", {}).get("properties", {}).get("name", "")
        coordinates = [*_geometries(collection, kind, MAX_DEPTH)]
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
    return shapes if grid is None else on_grid(name, shapes, crs, grid)


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
