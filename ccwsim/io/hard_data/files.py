"""Read hard data from files in one call, and write them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ccwsim import CCWSIMError, Grid, HardData, TrainingImage
from ccwsim.io.atomic import format_of, write_bytes
from ccwsim.io.formats.csv_table import csv_as_bytes
from ccwsim.io.formats.gis import points_as_geojson
from ccwsim.io.hard_data.columns import PointColumns
from ccwsim.io.hard_data.placing import Conversion, HardDataImport, place_points, resolve_points
from ccwsim.io.hard_data.points import read_points
from ccwsim.io.opening import PathOrFile
from ccwsim.model import WORLD_AXES


def import_hard_data(
    path_or_file: PathOrFile,
    grid: Grid | Sequence[int] | None = None,
    training_image: TrainingImage | None = None,
    **options: Any,
) -> HardDataImport:
    """Read hard data from a file and return them with a report of the import.

    Files are those of `read_points`, and tables in memory: a DataFrame, a dict of columns, or a
    structured array. In a volume, an interval in a well gives a datum in each cell whose centre is
    in the interval. Options are fields of `PointColumns`, such as `x="Easting"`, and of
    `Conversion`, such as `on_outside="drop"`.

    Examples
    --------
    >>> from io import BytesIO
    >>> file = BytesIO(b"row,col,facies\\n3,4,1\\n9,4,1\\n")
    >>> import_hard_data(file, Grid(8, 8), on_outside="drop").notes
    ('1 of 2 data lie outside the grid and were left out (line 3).',)
    """
    grid = None if grid is None else Grid.of(grid)
    conversion = Conversion.taken_from(options)
    shape = None if grid is None else grid.shape
    if training_image is not None:
        options = {"variable": training_image.variable} | options
    points = read_points(path_or_file, PointColumns(**options), grid_shape=shape)
    return resolve_points(place_points(points, grid, training_image, conversion), conversion)


def read_hard_data(
    path_or_file: PathOrFile,
    grid: Grid | Sequence[int] | None = None,
    training_image: TrainingImage | None = None,
    **options: Any,
) -> HardData:
    """Read hard data from a file, without the report of `import_hard_data`.

    Options are those of `import_hard_data`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_hard_data(BytesIO(b"x;y;facies\\n10,5;2,5;1\\n"), (8, 16)).cells
    array([[ 2, 10]])
    """
    return import_hard_data(path_or_file, grid, training_image, **options).hard_data


HARD_DATA_FORMATS = ("csv", "geojson", "gslib", "dat")


def write_hard_data(
    path_or_file: Any, hard_data: HardData, grid: Grid | None = None, *, format: str | None = None
) -> None:
    """Write hard data as `csv`, `geojson`, `gslib` or `dat`: points at the centres of their cells.

    By default, cells have size 1 and the origin is (0, 0).

    Examples
    --------
    >>> from io import BytesIO
    >>> file = BytesIO()
    >>> write_hard_data(file, HardData([[3, 4]], [1]), format="csv")
    >>> file.getvalue()
    b'x,y,facies\\n4.5,3.5,1\\n'
    """
    kind = format_of(path_or_file, format, HARD_DATA_FORMATS)
    write_bytes(path_or_file, hard_data_as_bytes(hard_data, kind, grid))


def hard_data_as_bytes(
    hard_data: HardData,
    format: str,
    grid: Grid | None = None,
    names: Mapping[str, Sequence[str]] | None = None,
) -> bytes:
    """Return the file content that `write_hard_data` writes, for a download.

    `csv` has the columns x, y, facies (for volumes x, y, z, facies), and `geojson` the property
    facies; both also have `names` of each datum, such as those of `names_of_data`. `gslib` and
    `dat` have x, y, z (0 for maps) and facies in a Geo-EAS table, the format of point sets in SGeMS
    and GSLIB. Data of a continuous variable have a column of its name instead of facies. Raises
    `CCWSIMError` if there are no data.
    """
    kind = format_of(None, format, HARD_DATA_FORMATS)
    if not hard_data.n:
        raise CCWSIMError("there are no hard data to write; place some first")
    frame = grid or Grid.of((1,) * hard_data.n_dimensions)
    name = next(iter(hard_data.values), "facies")
    places, codes = frame.centers_of(hard_data.cells).tolist(), hard_data.measured.tolist()
    if kind in ("csv", "geojson"):
        axes = dict(zip(WORLD_AXES, zip(*places, strict=True), strict=False))
        columns = {**axes, name: codes, **(names or {})}
        if kind == "geojson":
            return points_as_geojson(columns, frame.crs)
        return csv_as_bytes(columns, zip(*columns.values(), strict=True))
    head = [f"{hard_data.n} hard data", "4", "x", "y", "z", name]
    rows = zip(places, codes, strict=True)
    lines = [" ".join([*(*map(repr, place), "0")[:3], str(code)]) for place, code in rows]
    return "\n".join([*head, *lines, ""]).encode()


def names_of_data(
    hard_data: HardData, image: TrainingImage, wells: Iterable[tuple[str, Any]]
) -> dict[str, list[str]]:
    """Return the name of the facies and of the well of each datum; `wells` have their cells.

    Examples
    --------
    >>> names_of_data(HardData([[3, 4]], [1]), TrainingImage([[0, 1]]), [("F001", [(3, 4)])])
    {'facies_name': ['facies 1'], 'well': ['F001']}
    """
    well_of = {tuple(cell): name for name, cells in wells for cell in cells}
    return {
        "facies_name": [image.facies_names[image.index_of(c)] for c in hard_data.facies.tolist()],
        "well": [well_of.get(tuple(cell), "") for cell in hard_data.cells.tolist()],
    }
