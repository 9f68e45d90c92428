"""Test that a refused upload gives a message, and that the study does not change."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, Parameters
from ccwsim.sharing.choices import Choices, DataChoice, Upload
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.image_questions import image_of_file
from tests.fuzz.builders import npy_header, packed_mat, pickled, png_of_remarks
from tests.fuzz.evil import EVIL
from tests.fuzz.mutations import zipped
from tests.io import sample_files as sample
from tests.ui.widgets import named, open_menus

ROOT = Path(__file__).parents[2]
STUDY = Choices(
    data=DataChoice(), grid=Grid(48, 64), parameters=Parameters(template_size=16, overlap_size=4),
    n_realizations=1,
)  # fmt: skip
NAME = "../../**x**<script>alert(1)</script>$m$:material:home:.{}"
BAD = {
    "image": {
        "npy": npy_header("(1000000, 1000)"), "npz": zipped([("ti.npy", pickled())]),
        "mat": packed_mat(b"", 100), "dat": b"100000 100000 100\n1\nfacies\n0\n",
        "png": EVIL["png of 3.6e9 pixels"](), "csv": b"sand, and mud\n",
    },
    "data": {
        "csv": b"x,y,facies\nsand,and,mud\n", "npy": npy_header("(1,)" * 3),
        "dat": b"ncols 1e999\nnrows 2\n0 0\n",
    },
}  # fmt: skip


def launched(path: str = "app.py") -> AppTest:
    app = open_menus(AppTest.from_file(str(ROOT / path), default_timeout=120))
    app.session_state[KEY] = State(choices=STUDY)
    app.run()
    return app


def told(app: AppTest) -> str:
    assert not app.exception
    return " ".join(element.value for element in app.error)


def kept(app: AppTest) -> bool:
    state = app.session_state[KEY]
    return state.choices == STUDY


@pytest.mark.parametrize("kind", BAD["image"])
def test_a_training_image_that_is_refused(kind):
    app = launched()
    file = app.file_uploader(key="image_file")
    file.upload(NAME.format(kind), BAD["image"][kind], "text/plain").run()
    assert "keeps its present image" in told(app)
    assert kept(app)


@pytest.mark.slow
@pytest.mark.parametrize("kind", BAD["data"])
def test_hard_data_that_are_refused(kind):
    app = launched()
    file = app.file_uploader(key="data_file")
    file.upload(NAME.format(kind), BAD["data"][kind], "text/plain").run()
    assert "keeps its present data" in told(app)
    assert kept(app)


@pytest.mark.parametrize("kind", BAD["data"])
def test_hard_data_that_are_refused_in_the_editor(kind):
    app = launched("pages/data.py")
    file = app.file_uploader(key="import_file")
    file.upload(NAME.format(kind), BAD["data"][kind], "text/plain").run()
    assert "keeps its present data" in told(app)
    assert kept(app)


def test_the_owners_limit_is_held(monkeypatch):
    monkeypatch.setenv("CCWSIM_MAX_UPLOAD_CELLS", "1000")
    monkeypatch.setenv("CCWSIM_MAX_UPLOAD_WHOLE_CELLS", "1000")
    app = launched()
    content = sample.sgems(np.eye(41, dtype=np.uint8))
    app.file_uploader(key="image_file").upload("eye.dat", content, "text/plain").run()
    assert "1 × 41 × 41 values are more than 1000" in told(app).replace("\\", "")
    assert kept(app)
    monkeypatch.setenv("CCWSIM_MAX_UPLOAD_CELLS", "many")
    app.file_uploader(key="image_file").upload("other.dat", content, "text/plain").run()
    assert "must be a number above 0" in told(app)
    assert kept(app)


@pytest.mark.slow
def test_a_picture_of_remarks_is_taken():
    app = launched()
    app.file_uploader(key="image_file").upload("a.png", png_of_remarks(), "image/png").run()
    assert not app.exception
    assert app.session_state[KEY].choices.image.upload is not None


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(1, 100_000), (100_000, 1), (1, 1), (3000, 2, 2)])
def test_an_image_of_a_strange_shape_breaks_no_page(shape):
    app = launched()
    content = sample.npy(np.resize([0, 1], shape).astype(np.uint8))
    app.file_uploader(key="image_file").upload("a.npy", content, "text/plain").run()
    assert not app.exception
    if len(shape) == 3:
        app.button_group(key="ask_layers").set_value("one layer").run()
        named(app.number_input, "ask_slice").set_value(7).run()
        app.button(key="image_take").click().run()
        assert not app.exception
        assert dict(app.session_state[KEY].choices.image.answers) == {"slice_index": 6}


@pytest.mark.slow
def test_a_column_of_many_values_is_asked_for_its_width():
    app = launched()
    content = b"t\n1\nfacies\n" + b"0\n1\n" * 72_000
    app.file_uploader(key="image_file").upload("a.dat", content, "text/plain").run()
    assert app.session_state[KEY].image_draft is not None
    named(app.selectbox, "ask_columns").set_value(400).run()
    app.button(key="image_take").click().run()
    assert image_of(app.session_state[KEY].choices.image).shape == (360, 400)
    assert app.session_state[KEY].image_draft is None
    assert not app.exception


ENDINGS = (
    *("", ".vti", ".grd", ".eas", ".prn", ".tsv", ".xyz", ".nc", ".grdecl", ".xlsx", ".las"),
    *(".tif", ".asc", ".mat", ".npy", ".sgems", ".h5", ".irap", ".geojson", ".gpkg"),
)


def test_no_uploader_refuses_a_file_by_its_ending():
    app = launched()
    assert "image_file" in {file.key for file in app.file_uploader}
    for file in app.file_uploader:
        assert list(file.proto.type) == ([".ccwsim"] if file.key == "share_open" else []), file.key
    calls = re.findall(r"file_uploader\((.*?)\)\n", "\n".join(sources()), re.DOTALL)
    assert [call for call in calls if "type=" in call and "share_open" not in call] == []


def sources() -> list[str]:
    return [path.read_text("utf-8") for path in (ROOT / "ccwsim/ui").rglob("*.py")]


@pytest.mark.parametrize("ending", ENDINGS)
def test_an_image_of_any_ending_is_known_by_its_content(ending):
    choice = image_of_file(Upload(f"facies{ending}", sample.esri()))
    assert image_of(choice).array.tolist() == sample.FACIES.tolist()
