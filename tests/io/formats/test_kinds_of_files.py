"""Test kinds of files whose meaning is decided in one place, with files made by the tests."""

import contextlib
import importlib
import json
import re
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ccwsim import Auxiliary, CCWSIMError, Grid, Secondary, TrainingImage
from ccwsim.io import (
    angles_along,
    import_hard_data,
    import_wells,
    inspect,
    read_active,
    read_geometry,
    read_grid,
    read_hard_data,
    read_lines,
    read_probabilities,
    read_training_image,
    read_values,
)
from ccwsim.io.formats.text_tables import is_missing
from ccwsim.io.hard_data.columns import upward
from ccwsim.metrics import warn_of_probabilities
from ccwsim.model.missing import known_values
from ccwsim.model.study import Study
from tests.io.formats.grdecl_grids import GRIDS, VOLUME, grdecl

rasterio = pytest.importorskip("rasterio")
pyogrio = pytest.importorskip("pyogrio")
xarray = pytest.importorskip("xarray")

GRID = Grid(8, 12, (25.0, 25.0), (500000.0, 4200000.0), crs="EPSG:32632")
LAYERS = Grid(2, 3, (25.0, 25.0, 5.0), (500000.0, 4200000.0, -1600.0), nz=4, crs="EPSG:32632")
CODES = np.add.outer(np.arange(8) // 3, np.arange(12) // 5) % 3  # without symmetry
MASK = np.zeros((8, 12), bool)
MASK[1:7, 2:9] = True
IMAGE = TrainingImage(np.indices((40, 40)).sum(axis=0) // 5 % 2, facies_names=["mud", "sand"])
NORTH_UP = rasterio.Affine(25, 0, 500000, 0, -25, 4200200)


def tiff(values, transform=NORTH_UP, crs="EPSG:32632", nodata=None) -> BytesIO:
    """Return a GeoTIFF of one band; `values` are in the order of the file."""
    look = {"height": values.shape[0], "width": values.shape[1], "count": 1, "crs": crs}
    look |= {"transform": transform, "dtype": values.dtype, "nodata": nodata}
    with rasterio.MemoryFile() as memory:
        with memory.open(driver="GTiff", **look) as file:
            file.write(values, 1)
        return BytesIO(memory.read())


def geojson(kind: str, coordinates, crs: str = "", encoding: str = "utf-8") -> BytesIO:
    feature = {"type": "Feature", "properties": {}}
    feature |= {"geometry": {"type": kind, "coordinates": coordinates}}
    collection = {"type": "FeatureCollection", "features": [feature]}
    if crs:
        collection["crs"] = {"type": "name", "properties": {"name": crs}}
    return BytesIO(json.dumps(collection).encode(encoding))


def ring(west=500050, south=4200025, east=500225, north=4200175):
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]


# directions of columns, rows and layers


@pytest.mark.parametrize("name", GRIDS)
def test_rows_are_turned_by_the_handedness_of_the_grid(name):
    volume = read_training_image(BytesIO(grdecl(**GRIDS[name])), volume=True)
    np.testing.assert_array_equal(volume.array, VOLUME)


def test_xtgeo_gives_the_same_handedness(tmp_path):
    xtgeo = pytest.importorskip("xtgeo")
    assert len(GRIDS) == 12
    for k, (name, grid) in enumerate(GRIDS.items()):
        path = tmp_path / f"{k}.grdecl"
        path.write_bytes(grdecl(**grid))
        handed = xtgeo.grid_from_file(path, fformat="grdecl").ijk_handedness
        south_first = not np.array_equal(grdecl_rows(path), VOLUME[:, ::-1])
        assert south_first == (handed == "left"), name


def grdecl_rows(path) -> np.ndarray:
    """Return the values of a file with layers from the bottom, and rows as in the file."""
    from ccwsim.io.opening import open_file

    return open_file(path).variables["FACIES"]


def test_layers_of_grdecl_are_answered_for_the_file():
    content = grdecl(**GRIDS["unrotated, rows from the north"])
    same = read_training_image(BytesIO(content), volume=True, z_up=False)
    turned = read_training_image(BytesIO(content), volume=True, z_up=True)
    np.testing.assert_array_equal(same.array, VOLUME)
    np.testing.assert_array_equal(turned.array, VOLUME[::-1])
    assert not inspect(BytesIO(content)).bottom_first


@pytest.mark.parametrize("x", [1, -1])
@pytest.mark.parametrize("y", [1, -1])
def test_columns_and_rows_of_rasters_run_east_and_north(x, y):
    corner = 500000 if x > 0 else 500300, 4200000 if y > 0 else 4200200
    transform = rasterio.Affine(25 * x, 0, corner[0], 0, 25 * y, corner[1])
    file = tiff(CODES[::y, ::x].astype(np.uint8), transform)
    np.testing.assert_array_equal(read_grid(file), CODES)
    assert read_geometry(file) == GRID


@pytest.mark.parametrize("angle", [10, 60, 90, 200])
@pytest.mark.parametrize("mirrored", [False, True])
def test_rows_of_rotated_rasters_run_to_the_left_of_columns(angle, mirrored):
    step = -1 if mirrored else 1
    turned = rasterio.Affine.rotation(angle) @ rasterio.Affine.scale(25, 25 * step)
    file = tiff(CODES[::step].astype(np.uint8), turned)
    np.testing.assert_array_equal(read_grid(file), CODES)
    assert read_geometry(file) is None


VERTICAL = {
    "depth": ("depth", [2.5, 7.5, 12.5], {}, True),
    "Tiefe": ("Tiefe", [2.5, 7.5, 12.5], {}, True),
    "negative depth": ("depth", [-12.5, -7.5, -2.5], {}, False),
    "name in words": ("z", [2.5, 7.5, 12.5], {"long_name": "depth below ground"}, True),
    "standard name": ("z", [2.5, 7.5, 12.5], {"standard_name": "depth"}, True),
    "positive": ("z", [2.5, 7.5, 12.5], {"positive": "Down"}, True),
    "positive decides": ("depth", [2.5, 7.5, 12.5], {"positive": "up"}, False),
    "layers": ("lay", [0, 1, 2], {}, True),
    "layers without numbers": ("layer", None, {}, True),
    "k": ("k", [1, 2, 3], {}, True),
    "heights": ("z", [2.5, 7.5, 12.5], {}, False),
    "descending heights": ("z", [12.5, 7.5, 2.5], {}, True),
}


@pytest.mark.parametrize("case", VERTICAL)
def test_names_of_vertical_axes_say_where_the_top_is(case):
    name, places, attributes, top_first = VERTICAL[case]
    stack = np.stack([CODES, CODES * 0, CODES * 0 + 1])
    axes = {"y": np.arange(8.0), "x": np.arange(12.0)}
    axes |= {} if places is None else {name: (name, places, attributes)}
    file = BytesIO(
        xarray.Dataset({"facies": ((name, "y", "x"), stack)}, axes).to_netcdf(engine="scipy")
    )
    found = read_training_image(file, volume=True).array
    np.testing.assert_array_equal(found, stack[::-1] if top_first else stack)
    assert inspect(file).bottom_first == (not top_first)


CURVES = {
    "depth,P_sand\n1597.5,.1\n1592.5,.2\n1587.5,.3\n1582.5,.4\n": True,
    "Z (m);P_sand\n-1597,5;0,1\n-1592,5;0,2\n-1587,5;0,3\n-1582,5;0,4\n": True,
    "z,P_sand\n1597.5,.1\n1592.5,.2\n1587.5,.3\n1582.5,.4\n": True,
    "layer,P_sand\n0,.1\n1,.2\n2,.3\n3,.4\n": True,
    "layer,P_sand\n1,.4\n2,.3\n3,.2\n4,.1\n": "layer 1 of column layer may be the top",
    "K,P_sand\n1,.4\n2,.3\n3,.2\n4,.1\n": "layer 1 of column K may be the top",
    "z,P_sand\n2.5,.1\n7.5,.2\n12.5,.3\n17.5,.4\n": "z is from 2.5 to 17.5, but .* -1597.5 to",
}


@pytest.mark.parametrize("curve", CURVES)
def test_curves_have_the_heights_of_the_grid(curve):
    file = BytesIO(curve.encode())
    if CURVES[curve] is True:
        np.testing.assert_allclose(read_probabilities(file, LAYERS)["sand"], [0.1, 0.2, 0.3, 0.4])
    else:
        with pytest.raises(CCWSIMError, match=CURVES[curve]):
            read_probabilities(file, LAYERS)


def test_a_table_of_depths_has_its_top_above():
    rows = [(x, y, d, x + d) for d in (1, 2, 3) for y in range(2, 5) for x in range(4)]
    text = "x,y,depth,facies\n" + "\n".join(",".join(map(str, row)) for row in rows)
    bottom = read_grid(BytesIO(text.encode()), volume=True)[0]
    np.testing.assert_array_equal(bottom, [[3, 4, 5, 6]] * 3)
    assert upward("depth", np.array([1.0])).tolist() == [-1]


# masks


MASKS = {
    "0 and 255": np.where(MASK, 255, 0),
    "0 and 2": np.where(MASK, 2, 0),
    "true is −1": np.where(MASK, -1, 0),
    "−1 and 1": np.where(MASK, 1, -1),
    "IBOUND": np.where(MASK, np.where(np.arange(12) == 2, -1, 1), 0),
    "gaps": np.where(MASK, np.arange(12.0), np.nan),
}
OPEN_MASKS = {
    "numbers of basins": np.where(MASK, np.where(np.arange(12) < 5, 3, 8), 0),
    "two basins": np.where(MASK, 3, 8),
    "shares": np.where(MASK, np.linspace(0.2, 1, 12), 0),
    "IDOMAIN with cells that water passes": np.where(np.arange(12) == 0, -1, MASK),
}


@pytest.mark.parametrize("kind", [*MASKS, *OPEN_MASKS])
def test_numbers_of_masks_are_decided_or_refused(kind):
    values = (MASKS | OPEN_MASKS)[kind]
    file = tiff(values[::-1].astype(np.float32))
    if kind in MASKS:
        fitted = Secondary(active=read_active(file, GRID)).fitted(GRID, IMAGE)
        np.testing.assert_array_equal(fitted.active, MASK)
        assert fitted.describe() == f"{MASK.sum()} of {MASK.size} cells are active"
    else:
        with pytest.raises(CCWSIMError, match="do not say which cells are inactive; choose which"):
            Secondary(active=read_active(file, GRID)).fitted(GRID, IMAGE)
        codes = np.unique(values)[1:].astype(np.float32).tolist()
        active = read_active(file, GRID, active_codes=codes)
        np.testing.assert_array_equal(active, values != values.min())


# the place of guides


READERS = {"values": read_values, "mask": read_active, "probabilities": read_probabilities}
PLACES = {
    "system": ((NORTH_UP, "EPSG:32633"), "system 'EPSG:32633', but the grid has 'EPSG:32632'"),
    "rotation": ((NORTH_UP @ rasterio.Affine.rotation(20), "EPSG:32632"), "towards 110° from nor"),
    "extent": (
        (NORTH_UP @ rasterio.Affine.scale(1.05, 1), "EPSG:32632"),
        "x from 500000 to 500315, y from 4200000 to 4200200, but",
    ),
    "corner": (
        (rasterio.Affine(25, 0, 500010, 0, -25, 4200200), None),
        "x from 500010 to 500310, .* x from 500000 to 500300",
    ),
}


@pytest.mark.parametrize("kind", PLACES)
def test_a_grid_of_hard_data_is_at_the_place_of_the_grid(kind):
    place, message = PLACES[kind]
    data = np.where(MASK, CODES, np.nan).astype(np.float32)
    with pytest.raises(CCWSIMError, match=message):
        read_hard_data(tiff(data[::-1], *place), GRID)
    assert read_hard_data(tiff(data[::-1]), GRID).n == MASK.sum()


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", PLACES)
def test_the_place_of_a_guide_is_that_of_the_grid(reader, kind):
    (transform, crs), said = PLACES[kind]
    options = ("sand",) if reader == "probabilities" else ()
    with pytest.raises(CCWSIMError, match=said):
        READERS[reader](tiff(MASK.astype(np.uint8), transform, crs), GRID, *options)


def test_systems_that_coincide_are_equal():
    file = tiff(MASK[::-1].astype(np.uint8), crs="EPSG:25832")
    np.testing.assert_array_equal(read_active(file, GRID), MASK)


def test_heights_of_a_cube_are_those_of_the_grid():
    cube = "3 2 4 25 25 5 500000 4200000 {}\n1\nP_sand\n" + "0.3\n" * 24
    read_probabilities(BytesIO(cube.format(-1600).encode()), LAYERS)
    with pytest.raises(
        CCWSIMError, match=r"z from 0 to 20, but the grid has .* z from -1600 to -1580"
    ):
        read_probabilities(BytesIO(cube.format(0).encode()), LAYERS)


def test_lines_outside_the_grid_are_refused():
    far = geojson("LineString", [[600000, 4200100], [601500, 4200100]])
    with pytest.raises(CCWSIMError, match=r"x from 600000 to 601500, .* x from 500000 to 500300"):
        read_lines(far, GRID)
    with pytest.raises(CCWSIMError, match=r"the lines .* not reach the grid"):
        angles_along(read_lines(far), GRID)


@pytest.mark.parametrize("crs", ["", "urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:32633"])
def test_outlines_of_other_systems_are_moved_to_the_grid(crs):
    to = crs or "EPSG:4326"
    x, y = rasterio.warp.transform(GRID.crs, to, *np.array(ring()).T)
    file = geojson("Polygon", [np.column_stack([x, y]).tolist()], crs)
    np.testing.assert_array_equal(read_active(file, GRID), MASK)


def test_an_outline_of_swapped_axes_is_refused_with_both_extents():
    swapped = geojson("Polygon", [[[y, x] for x, y in ring()]])
    with pytest.raises(CCWSIMError, match=r"y from 500050 to 500225, but .* y from 4200000 to"):
        read_active(swapped, GRID)


# outlines and masks in other formats


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_outlines_and_lines_have_any_encoding(encoding):
    file = geojson("Polygon", [ring()], encoding=encoding)
    np.testing.assert_array_equal(read_active(file, GRID), MASK)
    assert len(read_lines(geojson("LineString", ring(), encoding=encoding))) == 1


HOLE = [[500100, 4200075], [500150, 4200075], [500150, 4200125], [500100, 4200125]]


def geometry_file(path, kind: str, rings, crs: str = "EPSG:32632"):
    """Write a polygon or line in the format that the path names."""
    import struct

    parts = [np.array(points, "<f8") for points in rings]
    code = {"Polygon": 3, "LineString": 2}[kind]
    body = [struct.pack("<I", len(points)) + points.tobytes() for points in parts]
    start = struct.pack("<BI", 1, code) + (struct.pack("<I", len(parts)) if code == 3 else b"")
    shapes = np.array([start + b"".join(body)], object)
    look = {"geometry_type": kind, "crs": crs, "fields": ["id"]}
    pyogrio.raw.write(path, shapes, field_data=[np.array([1])], **look)
    return path


@pytest.mark.parametrize("end", ["gpkg", "shp", "zip"])
@pytest.mark.parametrize("crs", ["EPSG:32632", "EPSG:32633"])
def test_outlines_and_lines_of_gis_programs_are_read(tmp_path, end, crs):
    x, y = rasterio.warp.transform(GRID.crs, crs, *np.array(ring()).T)
    hole = rasterio.warp.transform(GRID.crs, crs, *np.array([*HOLE, HOLE[0]]).T)
    rings = np.column_stack([x, y]), np.column_stack(hole)
    inner = np.zeros_like(MASK)
    inner[3:5, 4:6] = True
    suffix = "shp" if end == "zip" else end
    for kind, parts in (("Polygon", rings), ("LineString", rings[:1])):
        path = geometry_file(tmp_path / f"{kind}.{suffix}", kind, parts, crs)
        if end == "zip":
            path = tmp_path / f"{kind}.zip"
            with zipfile.ZipFile(path, "w") as archive:
                for part in tmp_path.glob(f"{kind}.???"):
                    archive.write(part, part.name)
        if kind == "Polygon":
            np.testing.assert_array_equal(read_active(path, GRID), MASK & ~inner)
        else:
            np.testing.assert_allclose(read_lines(path, GRID)[0], ring(), atol=1e-3)


@pytest.mark.parametrize("mode", ["1", "L", "RGB", "P"])
def test_a_picture_in_black_and_white_is_a_mask(mode):
    file = BytesIO()
    Image.fromarray(np.where(MASK[::-1], 255, 0).astype(np.uint8)).convert(mode).save(file, "PNG")
    active = Secondary(active=read_active(file, GRID)).fitted(GRID, IMAGE).active
    np.testing.assert_array_equal(active, MASK)


def test_other_files_of_outlines_are_refused_with_advice():
    corners = "x,y\n" + "\n".join(f"{x},{y}" for x, y in ring())
    with pytest.raises(CCWSIMError, match="save an outline as a polygon in GeoJSON"):
        read_active(BytesIO(corners.encode()), GRID)
    file = BytesIO()
    Image.fromarray(np.full((8, 12, 3), (200, 0, 0), np.uint8)).save(file, "PNG")
    with pytest.raises(CCWSIMError, match="in colours; save it in black and white"):
        read_active(file, GRID)


# codes for missing values


@pytest.mark.parametrize("code", [2e9, 2147483647, -2147483648, 1e33, 1e20, -1e20])
def test_undefined_values_of_reservoir_programs_are_unknown(code):
    assert known_values(np.array([0.0, 1.0, code])).tolist() == [True, True, False]


CONTINUOUS = {
    "inside": (np.arange(-129.0, -10, 2), -99, True),
    "at the end": (np.arange(-99.0, -59), -99, True),
    "far": (np.array([*np.linspace(0.1, 0.3, 50), -99.0]), -99, False),
    "frequent": (np.array([*np.linspace(-200, -20, 90), *[-99.0] * 40]), -99, False),
    "another code beyond": (np.array([*np.linspace(0, 1, 50), -99.0, -999.0]), -99, False),
    "few codes": (np.array([0.0, 1.0, 2.0, -99.0, -100.0]), -99, False),
    "elevations": (np.linspace(-1100, -900, 201), -999, True),
}


@pytest.mark.parametrize("kind", CONTINUOUS)
def test_customary_codes_in_the_range_of_values_are_values(kind):
    values, code, is_value = CONTINUOUS[kind]
    assert known_values(values)[values == code].all() == is_value
    assert not known_values(values, (code,))[values == code].any()  # stated by the file


# values outside the mask


OUTSIDE = {
    "zones": ({"images": [IMAGE]}, 1, -1),
    "angle": ({}, 30.0, 999.0),
    "scale": ({}, 2.0, -1.0),
    "probabilities": ({}, 0.4, -1.0),
    "auxiliary": ({}, 0.4, np.nan),
}


def guide(name: str, values):
    """Return a guide of secondary information for a map."""
    if name == "probabilities":
        return {"sand": values}
    return Auxiliary(np.zeros((40, 40)), values) if name == "auxiliary" else values


@pytest.mark.parametrize("name", OUTSIDE)
def test_only_values_in_active_cells_are_checked(name):
    others, right, wrong = OUTSIDE[name]
    values = np.where(MASK, right, wrong)
    fitted = Secondary(active=MASK, **{name: guide(name, values)}, **others).fitted(GRID, IMAGE)
    assert not fitted.is_empty
    with pytest.raises(CCWSIMError):
        Secondary(**{name: guide(name, values)}, **others).fitted(GRID, IMAGE)


def test_every_map_of_secondary_information_is_tested_outside():
    from ccwsim.io.secondary import KINDS_OF_ARRAYS

    other = ("active", "weights", "mirrored", "angle_tolerance", "soft_weight", "dip")  # no maps
    known = {*OUTSIDE, *other, "auxiliary_of_image", "auxiliary_of_grid", "auxiliary_weights"}
    names = {k.removesuffix("_x").removesuffix("_y").removesuffix("_z") for k in KINDS_OF_ARRAYS}
    assert {k for k in names if not k.startswith("image_")} <= known


def test_an_auxiliary_variable_needs_no_values_in_gaps_of_the_image():
    cells = np.where(np.arange(40) < 3, np.nan, IMAGE.array)
    of_image = np.where(np.arange(40) < 3, np.nan, np.linspace(0, 1, 40)) * np.ones((40, 1))
    variable = Auxiliary(of_image, np.full((8, 12), 0.5))
    fitted = Secondary(auxiliary=variable).fitted(GRID, TrainingImage(cells))
    assert 0 < fitted.auxiliary[0].image.min() < 0.1
    with pytest.raises(CCWSIMError, match="of the image: some cells have no finite value"):
        Secondary(auxiliary=variable).fitted(GRID, IMAGE)


def test_a_negative_probability_is_not_percent():
    with pytest.raises(CCWSIMError, match=r"-1 in row 0, column 0 .* mark unknown cells with NaN"):
        Secondary(probabilities={"sand": np.full((8, 12), -1.0)}).fitted(GRID, IMAGE)


def test_angles_in_radians_are_reported():
    radians = np.linspace(0.5, 1.5, 96).reshape(8, 12)
    with pytest.warns(UserWarning, match="angles from 0.5 to 1.5 look like radians"):
        study = Study(IMAGE, GRID, secondary=Secondary(angle=radians))
    notes = warn_of_probabilities(study.secondary, IMAGE, study.parameters)
    assert any("radians" in note for note in notes)
    for usual in (np.degrees(radians), np.round(radians)):
        Secondary(angle=usual).fitted(GRID, IMAGE)  # a warning is an error


# text and tables


ZMAP = """! a remark
@facies HEADER , GRID, 5
 15, -99999.0, , 4, 1
 3, 4, {}
 0.0, 0.0, 0.0
@
{}"""
COLUMNS = [[0, 1, 2], [1, 1, 1], [2, 2, 0], [0, 0, 1]]  # from the west, each from the north


@pytest.mark.parametrize("remark", ["", "+ Grid data starts after this line\n"])
@pytest.mark.parametrize(
    ("extent", "size", "corner"),
    [
        ("500000.0, 500150.0, 4200000.0, 4200100.0", (50.0, 50.0), (499975.0, 4199975.0)),
        ("500000.0, 500200.0, 4200000.0, 4200150.0", (50.0, 50.0), (500000.0, 4200000.0)),
    ],
)
def test_zmap_states_the_extent_of_nodes_unless_cells_are_round(remark, extent, size, corner):
    rows = "\n".join("".join(f"{value:15.4f}" for value in column) for column in COLUMNS)
    file = BytesIO((ZMAP.format(extent, remark) + rows + "\n").encode())
    np.testing.assert_array_equal(read_grid(file), [[2, 1, 0, 1], [1, 1, 2, 0], [0, 1, 2, 0]])
    assert read_geometry(file) == Grid(3, 4, size, corner)


def test_grdecl_may_have_a_long_start():
    content = grdecl(**GRIDS["unrotated, rows from the north"])
    comments = b"".join(b"-- line %d of a long history\n" % k for k in range(4000))
    head, coord, rest = content.partition(b"COORD")
    last = coord + rest + b"\n" + b"SPECGRID -- the size\n" + head.split(b"\n", 1)[1]
    for text in (comments + content, comments + last):
        found = read_training_image(BytesIO(text), volume=True).array
        np.testing.assert_array_equal(found, VOLUME)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("-- a property\nFACIES\n0 1 1\n0 0 1 /\n", "has no SPECGRID or DIMENS; add the size"),
        ("SPECGRID\n3 2 1 1 F /\nFACIES\nFACIES.dat /\n", "in place of FACIES.dat"),
        ("SPECGRID\n3 2 1 1 F /\nINCLUDE\n'a.inc' /\n", "in place of INCLUDE"),
        ("SPECGRID\n3 2 1 1 F /\nEQUALS\nFACIES 1 /\n/\n", "in place of EQUALS"),
    ],
)
def test_parts_of_grdecl_are_refused_with_the_cure(text, said):
    with pytest.raises(CCWSIMError, match=said):
        read_training_image(BytesIO(text.encode()))


MARKS = [
    "#N/A",
    "#REF!",
    "#VALUE!",
    "#DIV/0!",
    "#NAME?",
    "#NV",
    "#WERT!",
    "ND",
    "n.d.",
    "?",
    "--",
    ".",
    "unknown",
    "missing",
    "<0.5",
]


@pytest.mark.parametrize("mark", MARKS)
def test_marks_of_missing_numbers_leave_a_row_out(mark):
    text = f"well,x,y,facies\nA,1.5,2.5,sand\nB,3.5,4.5,mud\nC,{mark},{mark},sand\n"
    found = import_hard_data(BytesIO(text.encode()), Grid(8, 12), IMAGE)
    assert found.hard_data.cells.tolist() == [[2, 1], [4, 3]]


@pytest.mark.parametrize("name", ["#1", "#A12", "A-1", "1", "-1", "0.5", "sand", "P?"])
def test_names_and_numbers_are_no_marks(name):
    assert not is_missing(name)


def test_data_are_on_the_sheet_with_coordinates():
    openpyxl = pytest.importorskip("openpyxl")
    book, file = openpyxl.Workbook(), BytesIO()
    sheets = {
        "Cover": [["Site investigation"]],
        "Legend": [["code", "meaning"], [0, "mud"], [1, "sand"]],
        "Data": [["x", "y", "facies"], [1.5, 2.5, "sand"], ["#N/A", "#N/A", "mud"]],
    }
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
    book.save(file)
    found = import_hard_data(file, Grid(8, 12), IMAGE)
    assert found.hard_data.cells.tolist() == [[2, 1]]


LAS = """~Version
VERS. 3.0 : CWLS LOG ASCII STANDARD - VERSION 3.0
WRAP. NO : ONE LINE PER DEPTH STEP
DLM . {} : DELIMITING CHARACTER
~Well
NULL . -999.25 : Null
~Log_Definition
DEPT .M : Depth {{F}}
GR .GAPI : Gamma ray {{F}}
FACIES . : Facies {{F}}
~Log_Data | Log_Definition
100.0|45.1|0
100.5|-999.25|1
101.0|88.0|1
"""


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16-le"])
@pytest.mark.parametrize(("word", "mark"), [("COMMA", ","), ("SPACE", " "), ("TAB", "\t")])
def test_logs_of_las_3_are_read(word, mark, encoding):
    head, data = LAS.format(word).split("100.0|")
    text = head + ("100.0|" + data).replace("|", mark)
    summary = inspect(BytesIO(text.encode(encoding)))
    assert {v.name: v.n_known for v in summary.variables} == {"DEPT": 3, "GR": 2, "FACIES": 3}


def test_names_of_flags_and_codes_of_systems_are_read_from_netcdf():
    flags = {"flag_values": np.array([0, 1, 2], "i2"), "flag_meanings": "mud sand gravel"}
    axes = {"y": GRID.axes[1], "x": GRID.axes[0]}
    data = xarray.Dataset({"facies": (("y", "x"), CODES.astype("i2"), flags)}, axes)
    attributes = {"grid_mapping_name": "transverse_mercator", "epsg_code": "EPSG:32632"}
    data = data.assign({"crs": ((), np.int32(0), attributes)})
    file = BytesIO(data.to_netcdf(engine="scipy"))
    image = read_training_image(file)
    assert image.facies_names == ("mud", "sand", "gravel")
    np.testing.assert_array_equal(image.array, CODES)
    assert read_geometry(file) == GRID


@pytest.mark.parametrize("names", ["XCOLLAR,YCOLLAR,ZCOLLAR", "XC,YC,ZC"])
def test_collars_of_mining_programs_are_recognized(names):
    collars = BytesIO(f"BHID,{names},LENGTH\nA,2.5,1.5,4,4\n".encode())
    intervals = BytesIO(b"BHID,FROM,TO,ROCK\nA,0,2,0\nA,2,4,1\n")
    volume = TrainingImage(np.indices((8, 8, 8)).sum(axis=0) % 2)
    found = import_wells(collars, intervals, Grid(4, 4, nz=4), volume).hard_data
    assert found.cells.tolist() == [[k, 1, 2] for k in (3, 2, 1, 0)] or found.n == 4
    assert {*found.cells[:, 1].tolist()} == {1}


VALUES = "0\n1\n1\n0\n1\n0\n"
HEADERS = {
    "empty line, sizes": ("\n3 2 1\n1\nfacies\n", 1),
    "empty lines, sizes and place": ("\n\n3 2 1 1 1 1 0 0 0\n1\nfacies\n", 1),
    "empty line, title": ("\ntitle (3x2)\n1\nfacies\n", 1),
    "count after sizes": ("3 2 1 2\n1\nfacies\n", 2),
    "count after the place": ("3 2 1 1 1 1 0 0 0 2\n1\nfacies\n", 2),
    "count in line 2": ("title\n1 3 2 1 0.5 0.5 0.5 1 1 1 2\nfacies\n", 2),
    "count after the cell size": ("3 2 1 1 1 1 2\n1\nfacies\n", 2),
    "a last number that is no count": ("3 2 1 2\n1\nfacies\n", 1),
}


@pytest.mark.parametrize("kind", HEADERS)
def test_headers_of_gslib_may_count_realizations(kind):
    header, n = HEADERS[kind]
    variables = inspect(BytesIO((header + VALUES * n).encode())).variables
    assert [v.shape for v in variables] == [(1, 2, 3)] * n


def test_points_of_gis_files_are_read_beside_their_parts(tmp_path):
    points = np.array([np.array([1.5, 2.5], "<f8")])
    shapes = np.array([b"\x01\x01\x00\x00\x00" + p.tobytes() for p in points], object)
    look = {"geometry_type": "Point", "crs": "EPSG:32632", "fields": ["facies"]}
    pyogrio.raw.write(tmp_path / "a.shp", shapes, field_data=[np.array([1])], **look)
    assert read_hard_data(tmp_path / "a.shp", Grid(8, 12), IMAGE).cells.tolist() == [[2, 1]]


def test_the_documents_name_the_place_of_each_decision_and_its_test():
    text = (Path(__file__).parents[3] / "docs" / "extending.md").read_text("utf-8")
    rows = re.findall(r"^\| [^|]+ \| `(ccwsim[\w.]+)`[^|]* \| `(test_\w+)` \|$", text, re.M)
    assert len(rows) > 20
    for place, test in rows:
        module, found = place.split("."), None
        while found is None:
            *module, _ = module
            with contextlib.suppress(ImportError):
                found = importlib.import_module(".".join(module))
        for name in place.split(".")[len(module) :]:
            found = getattr(found, name)
        assert test in globals(), test
