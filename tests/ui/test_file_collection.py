"""Test on the pages that files of many programs can be simulated after at most three answers."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy.io import savemat
from scipy.ndimage import gaussian_filter
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, Parameters
from ccwsim.model.missing import UNKNOWN
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.session.resolve import data_of, geometry_of, image_of
from ccwsim.ui.session.state import KEY, State
from tests.io import sample_files as sample
from tests.ui.widgets import named, opened, texts

pytestmark = pytest.mark.slow

STUDY = Choices(
    data=DataChoice(),
    grid=Grid(48, 64),
    parameters=Parameters(template_size=16, overlap_size=4, wavelet_level=1),
    n_realizations=1,
)
SMOOTH = gaussian_filter(np.random.default_rng(3).normal(size=(60, 80)), 4)
FIELD = ((SMOOTH - SMOOTH.min()) / np.ptp(SMOOTH)).round(4)
CODES = (FIELD > 0.5).astype(np.uint8)
THREE = np.digitize(FIELD, [0.4, 0.6]).astype(np.uint8)
GREYS, DEEP = (FIELD * 255).astype(np.uint8), (FIELD * 6e4).astype(np.uint16)
COLOURS = np.array([(40, 60, 150), (235, 200, 90), (60, 150, 80)], np.uint8)
GAPS = np.where(np.indices(CODES.shape)[0] < 55, CODES.astype(float), -999)
WITH_GAP = np.where(GAPS < 0, UNKNOWN, CODES)
BOREHOLES = np.array([[3, 5, 1], [20, 41, 0], [33, 12, 1], [40, 60, 0], [11, 30, 1]])
"""Row, column and facies."""
WORLD = np.column_stack([BOREHOLES[:, 1] + 0.5, BOREHOLES[:, 0] + 0.5, BOREHOLES[:, 2]])
NAMES = np.array(["mud", "Sand"])
PETREL = b"# Petrel Points with attributes\nVERSION 1\nBEGIN HEADER\nX\nY\nfacies\nEND HEADER\n"

Answer = Callable[[AppTest], None]


@dataclass
class Case:
    """A file, the expected result, and the answers of the user."""

    name: str
    content: Callable[[], bytes]
    wanted: NDArray = field(default_factory=lambda: CODES)
    answers: tuple[Answer, ...] = ()


def click(key: str) -> Answer:
    return lambda app: named(app.button, key).click().run()


def select(key: str, value: Any) -> Answer:
    return lambda app: named(app.selectbox, key).set_value(value).run()


def number(key: str, value: float) -> Answer:
    return lambda app: named(app.number_input, key).set_value(value).run()


def segment(key: str, value: str) -> Answer:
    return lambda app: named(app.button_group, key).set_value(value).run()


TAKE = click("image_take")
LAYER = segment("ask_layers", "one layer")
FROM_NORTH = select("ask_up", 2)


def shown(grid: NDArray) -> NDArray:
    """Return rows in the order of a picture, from the north."""
    return np.ascontiguousarray(grid[::-1])


def saved(grid: NDArray, kind: str, mode: str | None = None, **options: Any) -> bytes:
    file, image = BytesIO(), Image.fromarray(shown(grid))
    (image.convert(mode) if mode else image).save(file, kind, **options)
    return file.getvalue()


def palette() -> bytes:
    file, image = BytesIO(), Image.fromarray(shown(THREE), "P")
    image.putpalette(COLOURS.ravel().tolist())
    image.save(file, "PNG")
    return file.getvalue()


def text(grid: NDArray, separator: str) -> bytes:
    file = BytesIO()
    np.savetxt(file, shown(grid), fmt="%g", delimiter=separator)
    return file.getvalue()


def table_of(grid: NDArray) -> bytes:
    return pd.DataFrame(shown(grid)).to_csv(header=False, index=False).encode()


def tiff(grid: NDArray) -> bytes:
    tifffile, file = pytest.importorskip("tifffile"), BytesIO()
    tifffile.imwrite(file, shown(grid))
    return file.getvalue()


def geotiff(grid: NDArray) -> bytes:
    pytest.importorskip("rasterio")
    from rasterio.io import MemoryFile
    from rasterio.transform import from_origin

    place = {"transform": from_origin(436000.0, 4506000.0, 25.0, 25.0), "crs": "EPSG:25832"}
    with MemoryFile() as file:
        size = {"height": grid.shape[0], "width": grid.shape[1], "count": 1}
        with file.open(driver="GTiff", dtype=grid.dtype, compress="lzw", **size, **place) as band:
            band.write(shown(grid), 1)
        return bytes(file.getbuffer())


def matlab(**arrays: NDArray) -> bytes:
    file = BytesIO()
    savemat(file, arrays)
    return file.getvalue()


def gslib(sizes: str = "80 60 1", **columns: NDArray) -> bytes:
    table = np.column_stack([np.ravel(values) for values in columns.values()])
    rows = "\n".join(" ".join(f"{v:g}" for v in row) for row in table)
    return "\n".join([sizes, str(len(columns)), *columns, rows, ""]).encode()


def volume(grid: NDArray) -> NDArray:
    """Return five layers, the middle one of which is the grid."""
    return np.stack([1 - grid, 1 - grid, grid, 1 - grid, 1 - grid])


IMAGES = [
    Case("grid.sgems", lambda: sample.sgems(CODES)),
    Case("windows.sgems", lambda: sample.crlf(sample.sgems(CODES))),
    Case("three.gslib", lambda: sample.sgems(THREE), THREE),
    Case("geone.gslib", lambda: gslib("80 60 1 25.0 25.0 1.0 436000 4506000 0", facies=CODES)),
    Case("mpslib.dat", lambda: gslib("80 60 1", v=CODES)),
    Case("values.sgems", lambda: sample.sgems(FIELD), FIELD, (TAKE,)),
    Case("two.sgems", lambda: gslib(porosity=FIELD, facies=CODES), CODES, (TAKE,)),
    Case("classic.dat", lambda: sample.gslib_table(CODES), CODES,
         (select("ask_columns", 80), TAKE)),
    Case("gaps.sgems", lambda: sample.sgems(GAPS), WITH_GAP),
    Case("volume.sgems", lambda: gslib("80 60 5", facies=volume(CODES)), volume(CODES), (TAKE,)),
    Case("layer.sgems", lambda: gslib("80 60 5", facies=volume(CODES)), CODES, (LAYER, TAKE)),
    Case("dem.asc", lambda: sample.esri(CODES)),
    Case("dem_of_values.asc", lambda: sample.esri(FIELD), FIELD, (TAKE,)),
    Case("matrix.txt", lambda: text(CODES, " ")),
    Case("matrix_tabs.txt", lambda: text(CODES, "\t")),
    Case("matrix.csv", lambda: text(THREE, ","), THREE),
    Case("matrix_semicolons.csv", lambda: text(CODES, ";")),
    Case("frame.csv", lambda: table_of(CODES)),
    Case("codes.npy", lambda: sample.npy(CODES)),
    Case("mask.npy", lambda: sample.npy(CODES.astype(bool))),
    Case("floats.npy", lambda: sample.npy(CODES.astype(np.float32))),
    Case("by_columns.npy", lambda: sample.npy(np.asfortranarray(THREE.astype(np.int64))), THREE),
    Case("nan.npy", lambda: sample.npy(np.where(GAPS < 0, np.nan, GAPS)), WITH_GAP),
    Case("volume.npy", lambda: sample.npy(volume(CODES)), volume(CODES), (TAKE,)),
    Case("one.npz", lambda: sample.npz(facies=CODES)),
    Case("several.npz", lambda: sample.npz(porosity=FIELD, facies=CODES), CODES, (TAKE,)),
    Case("ti.npz", lambda: sample.npz(ti=CODES, other=FIELD)),
    Case("one.mat", lambda: matlab(facies=CODES.astype(float))),
    Case("values.mat", lambda: matlab(field=FIELD), FIELD, (TAKE,)),
    Case("two.mat", lambda: matlab(porosity=FIELD, facies=shown(CODES)), CODES,
         (FROM_NORTH, TAKE)),
    Case("black_and_white.png", lambda: saved(CODES * 255, "PNG")),
    Case("one_bit.png", lambda: saved(CODES * 255, "PNG", "1")),
    Case("alpha.png", lambda: saved(COLOURS[THREE], "PNG", "RGBA"), THREE),
    Case("palette.png", palette, THREE),
    Case("greys.png", lambda: saved(GREYS, "PNG"), GREYS.astype(float), (TAKE,)),
    Case("colours.jpg", lambda: saved(COLOURS[THREE], "JPEG", quality=90), THREE, (TAKE,)),
    Case("colours.gif", lambda: saved(COLOURS[THREE], "GIF"), THREE),
    Case("colours.bmp", lambda: saved(COLOURS[THREE], "BMP"), THREE),
    Case("volume.mat", lambda: matlab(facies=np.moveaxis(volume(CODES), 0, -1)), volume(CODES),
         (TAKE,)),
    Case("codes.tif", lambda: tiff(CODES * 255)),
    Case("values.tif", lambda: tiff(FIELD.astype(np.float32)), FIELD, (TAKE,)),
    Case("categories.tif", lambda: geotiff(CODES)),
    Case("elevation.tif", lambda: geotiff(FIELD.astype(np.float32)), FIELD, (TAKE,)),
    Case("sixteen_bit.png", lambda: saved(DEEP, "PNG"), DEEP.astype(float), (TAKE,)),
]  # fmt: skip


def settled(app: AppTest) -> State:
    state = app.session_state[KEY]
    if state.job is not None:
        assert state.job.wait(180)
        app.run()
    assert not app.exception
    assert texts(app) == ""
    return app.session_state[KEY]


def simulated(choices: Choices) -> State:
    """Return the result of the page Simulate for a study."""
    state = settled(opened("simulate", State(choices=choices)).run())
    assert state.ensemble is not None
    return state


@pytest.mark.parametrize("case", IMAGES, ids=lambda case: case.name)
def test_an_image_becomes_that_of_the_study(case):
    app = opened("import", State(choices=STUDY)).run()
    app.file_uploader(key="import_image_file").upload(case.name, case.content(), "text/plain").run()
    assert not app.error
    for answer in case.answers:
        answer(app)
    assert len(case.answers) <= 3
    state = app.session_state[KEY]
    assert state.image_draft is None
    assert state.choices.image.upload is not None
    image, wanted = image_of(state.choices.image), case.wanted
    if wanted.dtype.kind == "f":  # continuous values, divided at the guessed threshold
        threshold = dict(state.choices.image.answers)["threshold"]
        assert 0.3 < (threshold - wanted.min()) / np.ptp(wanted) < 0.7
        wanted = (wanted >= threshold).astype(int)
    found = image.indices
    if case.name.split(".")[0] in (
        "colours",
        "alpha",
        "palette",
    ):  # the order of the data differs
        order = np.array([np.median(wanted[found == k]) for k in range(image.n_facies)])
        assert sorted(order) == list(range(image.n_facies))
        found = order[found]
    assert (found == wanted).mean() >= (0.97 if case.name.endswith("jpg") else 1.0)
    if case.name not in SIMULATED:
        return
    ensemble = simulated(state.choices).ensemble
    assert ensemble.training_image.digest == image.digest
    layers = wanted.shape[:-2]  # a volume gets a usual grid
    grid = (*layers, 100, 100) if layers else image.shape
    if (geometry := geometry_of(state.choices.image)) is not None:  # the grid is that of the file
        grid = geometry.shape
    assert ensemble.realizations.shape == (STUDY.n_realizations, *grid)
    assert np.isin(ensemble.realizations, image.codes).all()


def csv(columns: str, rows: Any, separator: str = ",", decimal: str = ".") -> bytes:
    frame = pd.DataFrame(rows, columns=columns.split(",") if columns else None)
    return frame.to_csv(index=False, sep=separator, decimal=decimal).encode()


def named_rows() -> list[tuple[str, float, float, str]]:
    return [(f"B {k}", x, y, NAMES[int(code)]) for k, (x, y, code) in enumerate(WORLD)]


def with_heights() -> bytes:
    return csv("Ostwert,Nordwert,Höhe,Fazies", np.insert(WORLD, 2, 100, axis=1))


def far() -> NDArray:
    """Return the same locations in a grid of 25 m cells."""
    return np.column_stack([WORLD[:, :2] * 25 + [436000, 4505000], WORLD[:, 2]])


def log() -> bytes:
    gamma = np.where(BOREHOLES[:, 2] == 1, 120.5, 31.25)
    return csv("x,y,gamma_ray", np.column_stack([WORLD[:, :2], gamma]))


def gaps(missing: float) -> NDArray:
    grid = np.full((48, 64), missing)
    grid[BOREHOLES[:, 0], BOREHOLES[:, 1]] = BOREHOLES[:, 2]
    return grid


def eas(count: bool = False) -> bytes:
    rows = "\n".join(f"{x} {y} 0 {code:g}" for x, y, code in WORLD)
    return f"{len(WORLD) if count else 'boreholes'}\n4\nX\nY\nZ\nvar\n{rows}\n".encode()


def geojson() -> bytes:
    points = [
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [x, y]},
         "properties": {"well": f"B {k}", "facies": NAMES[int(code)]}}
        for k, (x, y, code) in enumerate(WORLD.tolist())
    ]  # fmt: skip
    return json.dumps({"type": "FeatureCollection", "features": points}).encode()


def by_gdal(ending: str) -> Callable[[], bytes]:
    def content() -> bytes:
        pyogrio = pytest.importorskip("pyogrio")
        shapes = [struct.pack("<BIdd", 1, 1, x, y) for x, y, _ in WORLD]
        with TemporaryDirectory() as there:
            path = Path(there) / f"boreholes.{ending}"
            columns = {"field_data": [BOREHOLES[:, 2].astype(np.int32)], "fields": ["facies"]}
            pyogrio.raw.write(
                path, np.array(shapes, object), geometry_type="Point", crs="EPSG:25832", **columns
            )
            return path.read_bytes()

    return content


DATA = [
    Case("cells.csv", lambda: csv("row,col,facies", BOREHOLES)),
    Case("places.csv", lambda: csv("x,y,facies", WORLD)),
    Case("german.csv", lambda: csv("Rechtswert,Hochwert,Fazies", WORLD, ";", ",")),
    Case("tabs.txt", lambda: csv("Easting,Northing,code", WORLD, "\t")),
    Case("spaces.txt", lambda: csv("x,y,value", WORLD, " ")),
    Case("far.csv", lambda: csv("UTM_E,UTM_N,facies", far()), BOREHOLES),
    Case("names.csv", lambda: csv("well,x,y,facies", named_rows())),
    Case("depths.csv", lambda: csv("x,y,z,facies", np.insert(WORLD, 2, 100, axis=1))),
    Case("upper.csv", lambda: csv("X,Y,CODE", WORLD)),
    Case("units.csv", lambda: csv("x,y,code", WORLD, "\t").replace(b"\n", b"\nm\tm\t-\n", 1)),
    Case("no_heading.csv", lambda: csv("x,y,facies", WORLD).split(b"\n", 1)[1]),
    Case("windows_1252.csv", lambda: with_heights().decode().encode("cp1252")),
    Case("petrel.prn", lambda: PETREL + csv("", WORLD, " ").split(b"\n", 1)[1]),
    Case("log.csv", log, BOREHOLES, (number("ask_threshold", 75.0),)),
    Case("rock.csv", lambda: csv("x,y,facies", named_rows_of("Ton", "Sand")), BOREHOLES,
         (select("ask_name_1", 0),)),
    Case("eas.dat", eas),
    Case("sgems_points.dat", lambda: eas(count=True)),
    Case("gaps.npy", lambda: sample.npy(gaps(np.nan))),
    Case("gaps.sgems", lambda: sample.sgems(gaps(-999))),
    Case("gaps.asc", lambda: sample.esri(gaps(-9999))),
    Case("list.npy", lambda: sample.npy(BOREHOLES)),
    Case("arrays.npz", lambda: sample.npz(cells=BOREHOLES[:, :2], facies=BOREHOLES[:, 2])),
    Case("gaps.mat", lambda: matlab(hd=gaps(np.nan))),
    Case("points.geojson", geojson),
    Case("points.gpkg", by_gdal("gpkg")),
    Case("points.zip", by_gdal("shz")),
]  # fmt: skip


SIMULATED = {
    "grid.sgems", "volume.npy", "layer.sgems", "two.mat", "colours.jpg", "elevation.tif",
    "places.csv", "far.csv", "rock.csv", "gaps.npy", "points.gpkg",
}  # fmt: skip
"""Files whose study is run: one of each kind of answer, facies, shape and coordinates. For the
rest, the image or the data of the study are compared with the file."""


def named_rows_of(*names: str) -> list[tuple[float, float, str]]:
    return [(x, y, names[int(code)]) for x, y, code in WORLD.tolist()]


def with_data(case: Case, choices: Choices) -> AppTest:
    app = opened("import", State(choices=choices)).run()
    app.button_group(key="import_subject").set_value("data").run()
    app.file_uploader(key="wells_file").upload(case.name, case.content(), "text/plain").run()
    assert not app.error
    for answer in case.answers:
        answer(app)
    assert not app.exception
    assert app.session_state[KEY].data_draft is None, texts(app)
    return app


@pytest.mark.parametrize("case", DATA, ids=lambda case: case.name)
def test_boreholes_become_the_data_of_the_study(case):
    study = Choices(**{**vars(STUDY), "image": ImageChoice(names=("mud", "sand"))})
    choices = with_data(case, study).session_state[KEY].choices
    data, wanted = data_of(choices), BOREHOLES
    if case.name == "far.csv":
        x, y, facies = far().T
        wanted = np.column_stack([choices.grid.cells_of(x, y), facies]).astype(int)
        assert choices.grid.holds(wanted[:, :2]).all()
    assert data.triples == tuple(sorted(map(tuple, wanted.tolist())))
    if case.name not in SIMULATED:
        return
    ensemble = simulated(choices).ensemble
    assert ensemble.hard_data.triples == data.triples
    assert not ensemble.n_mismatched.any()


def test_the_collection_is_as_large_as_it_is_said_to_be():
    assert len(IMAGES) + len(DATA) >= 60


PUBLISHED = {
    "A_WLreferenceCAT.sgems": (),
    "dunes_3facies.SGEMS": (),
    "ti_stonewall.sgems": (TAKE,),
    "ti_strebelle_250_250_1.dat": (),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_images_reach_a_simulation(name, data_dir):
    app = opened("import", State(choices=STUDY)).run()
    content = (data_dir / "formats" / name).read_bytes()
    app.file_uploader(key="import_image_file").upload(name, content, "text/plain").run()
    for answer in PUBLISHED[name]:
        answer(app)
    state = app.session_state[KEY]
    assert state.image_draft is None, texts(app)
    assert simulated(state.choices).ensemble.training_image.n_facies in (2, 3)


@pytest.mark.parametrize("name", ["B_WLCATsamples.sgems", "mps_2d_hard_data.dat"])
def test_published_data_are_honoured(name, data_dir):
    image = Choices(**{**vars(STUDY), "grid": Grid(300, 260)})
    app = opened("import", State(choices=image)).run()
    reference = (data_dir / "formats" / "A_WLreferenceCAT.sgems").read_bytes()
    app.file_uploader(key="import_image_file").upload("ti.sgems", reference, "text/plain").run()
    case = Case(name, (data_dir / "formats" / name).read_bytes)
    choices = with_data(case, app.session_state[KEY].choices).session_state[KEY].choices
    ensemble = simulated(choices).ensemble
    assert ensemble.hard_data.n > 0
    assert not ensemble.n_mismatched.any()
