"""Test training images from files of many kinds: each file raises its questions with guesses."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image, ImageFilter
from scipy.ndimage import gaussian_filter

from ccwsim import Grid, Parameters
from ccwsim.metrics import diagnose
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload, WellTables
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.image_questions import asked_of
from ccwsim.ui.study.image_step import import_image
from tests.io import sample_files as sample
from tests.some import some
from tests.ui.widgets import html, named, opened, texts

STUDY = Choices(data=DataChoice(), grid=Grid(48, 48), parameters=Parameters(template_size=16))
SMOOTH = gaussian_filter(np.random.default_rng(0).normal(size=(60, 80)), 4)
FIELD = (SMOOTH - SMOOTH.min()) / np.ptp(SMOOTH)
COLOURS = np.array([(40, 60, 150), (235, 200, 90), (60, 150, 80)])


def rgb(soft: bool = True) -> bytes:
    image = Image.fromarray(COLOURS[np.digitize(FIELD, [0.4, 0.6])].astype(np.uint8))
    file = BytesIO()
    (image.filter(ImageFilter.GaussianBlur(1)) if soft else image).save(file, "PNG")
    return file.getvalue()


def grid(values: np.ndarray, names: str = "facies") -> bytes:
    rows = values.reshape(-1, len(names.split()))
    head = f"80 60 1\n{rows.shape[1]}\n" + "\n".join(names.split())
    return (head + "\n" + "\n".join(" ".join(f"{v:g}" for v in row) for row in rows)).encode()


CODES = (FIELD > 0.5).astype(int)
GAPS = np.where(FIELD > 0.9, np.nan, CODES)
FILES = {
    "codes.sgems": (grid(CODES), set()),
    "grey.sgems": (grid(FIELD), {"values"}),
    "two.gslib": (grid(np.stack([FIELD, CODES], axis=-1), "porosity facies"), {"variable"}),
    "table.dat": (b"t\n1\nfacies\n" + sample.text_values(CODES), {"shape"}),
    "volume.npy": (sample.npy(np.stack([CODES] * 7)), {"slice", "up"}),
    "grey_volume.npy": (sample.npy(np.stack([FIELD] * 7)), {"slice", "up", "values"}),
    "gaps.npy": (sample.npy(GAPS), {"gaps", "up"}),
    "soft.png": (rgb(), {"values"}),
    "clean.png": (rgb(soft=False), set()),
    "matlab.mat": (sample.mat(field=FIELD), {"up", "values"}),
    "large.npy": (sample.npy(np.tile(CODES, (40, 40)).astype(np.uint8)), {"part", "up"}),
}


def imported(name: str, content: bytes) -> State:
    state = State(choices=STUDY)
    import_image(state, Upload(name, content))
    return state


@pytest.mark.parametrize("name", some(FILES, always={*FILES} - {"large.npy"}))
def test_every_file_becomes_an_image_with_one_answer_at_most(name):
    content, asked = FILES[name]
    state = imported(name, content)
    choice = state.image_draft or state.choices.image
    assert set(asked_of(choice)) == asked
    app = opened("import", state).run()
    assert not app.exception
    assert texts(app) == ""
    if asked - {"up", "gaps"}:
        assert state.choices.image.upload is None  # the user has not confirmed the image yet
        named(app.button, "image_take").click().run()
    state = app.session_state[KEY]
    assert state.image_draft is None
    image = image_of(state.choices.image)
    assert image.name == name.rsplit(".", 1)[0]
    assert image.n_facies == (3 if name.endswith("png") else 2)
    assert "Advised values" in html(app)


def test_the_colours_of_a_picture_are_those_of_its_facies():
    for name in ("soft.png", "clean.png"):
        state = imported(name, FILES[name][0])
        found = dict((state.image_draft or state.choices.image).colours)
        rows = [[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in found.values()]
        far = np.abs(np.array(rows)[:, None] - COLOURS).max(axis=-1)
        assert sorted(far.argmin(axis=1)) == [0, 1, 2]
        assert far.min(axis=1).max() <= 12


def test_an_answer_changes_what_is_guessed_after_it_and_nothing_of_the_study():
    app = opened("import", imported("two.gslib", FILES["two.gslib"][0])).run()
    assert dict(app.session_state[KEY].image_draft.answers) == {"variable": "facies"}
    named(app.selectbox, "ask_variable").set_value("porosity").run()
    answers = dict(app.session_state[KEY].image_draft.answers)
    assert answers["variable"] == "porosity"
    assert 0.2 < answers["threshold"] < 0.8
    named(app.number_input, "ask_threshold").set_value(0.5).run()
    assert app.session_state[KEY].choices.image == ImageChoice()
    named(app.button, "image_take").click().run()
    taken = image_of(app.session_state[KEY].choices.image)
    assert taken.proportions[1] == pytest.approx((FIELD >= 0.5).mean(), abs=1e-3)


@pytest.mark.slow
def test_a_slice_a_piece_and_classes_can_be_chosen():
    app = opened("import", imported("grey_volume.npy", FILES["grey_volume.npy"][0])).run()
    app.button_group(key="ask_layers").set_value("one layer").run()
    named(app.slider, "ask_slice").set_value(2).run()
    app.button_group(key="ask_values").set_value("classes").run()
    named(app.number_input, "ask_classes").set_value(4).run()
    answers = dict(app.session_state[KEY].image_draft.answers)
    assert answers == {"slice_index": 1, "classes": 4}
    app = opened("import", imported("large.npy", FILES["large.npy"][0])).run()
    app.button_group(key="ask_part").set_value("a piece").run()
    row, column, ny, nx = dict(app.session_state[KEY].image_draft.answers)["crop"]
    assert 0 <= row < row + ny <= 2400
    assert 0 <= column < column + nx <= 3200
    named(app.number_input, "ask_cells_ew").set_value(100).run()
    assert image_of(app.session_state[KEY].image_draft).shape == (ny, 100)


@pytest.mark.slow
def test_a_volume_that_is_too_large_is_thinned_or_cut_right_there():
    volume = np.zeros((30, 400, 400), np.uint8)
    volume[:, :, 200:] = 1
    app = opened("import", imported("large.npy", sample.npy(volume))).run()
    assert image_of(app.session_state[KEY].image_draft).shape == (30, 200, 200)
    app.button_group(key="ask_part").set_value("a piece").run()
    assert image_of(app.session_state[KEY].image_draft).shape == (30, 200, 200)
    named(app.number_input, "ask_number_of_layers").set_value(4).run()
    named(app.number_input, "ask_cells_ew").set_value(250).run()
    named(app.number_input, "ask_lowest_layer").set_value(28).run()
    assert not app.exception
    assert image_of(app.session_state[KEY].image_draft).shape == (2, 200, 250)
    named(app.button, "image_take").click().run()
    assert app.session_state[KEY].choices.grid.nz == 2


def test_advised_values_take_the_image_with_them():
    state = imported("grey.sgems", FILES["grey.sgems"][0])
    app = opened("import", state).run()
    named(app.button, "use_advice").click().run()
    state = app.session_state[KEY]
    assert state.image_draft is None
    found = diagnose(image_of(state.choices.image))
    assert state.choices.parameters.template_size == found.advised("template_size")


def test_facies_of_a_file_can_be_merged():
    stripes = np.repeat(np.arange(4), 12)[:, None].repeat(40, axis=1)
    app = opened("import", imported("four.npy", sample.npy(stripes))).run()
    named(app.text_input, "image_name_3").set_value("gravel").run()
    named(app.selectbox, "image_merge_0").select("with facies 1").run()
    named(app.selectbox, "image_merge_1").select("with facies 2").run()
    image = image_of(app.session_state[KEY].choices.image)
    assert not app.exception
    assert image.facies_names == ("facies 2", "gravel")
    assert image.proportions.tolist() == [0.75, 0.25]
    named(app.button, "image_apart").click().run()
    image = image_of(app.session_state[KEY].choices.image)
    assert image.n_facies == 4
    named(app.selectbox, "image_merge_1").select("with the nearest").run()
    image = image_of(app.session_state[KEY].choices.image)
    assert image.proportions.tolist() == [0.375, 0.375, 0.25]


def test_names_of_wells_are_offered_for_the_facies_of_the_image():
    rows = b"x,y,facies\n" + b"".join(
        b"%d.5,%d.5,%s\n" % (k, k, b"clay" if k % 2 else b"sand") for k in range(8)
    )
    state = imported("two.npy", sample.npy(np.indices((32, 32)).sum(axis=0) // 8 % 2))
    state.data_draft = DataChoice("file", upload=Upload("wells.csv", rows))
    app = opened("import", state).run()
    app.button_group(key="import_subject").set_value("Training image").run()
    assert named(app.selectbox, "image_name_1").options == ["facies 1", "clay", "sand"]
    named(app.selectbox, "image_name_1").select("sand").run()
    named(app.selectbox, "image_name_0").select("clay").run()
    assert image_of(app.session_state[KEY].choices.image).facies_names == ("clay", "sand")
    assert not app.exception


def test_names_of_wells_are_offered_for_the_facies_of_a_volume():
    cells = np.indices((8, 32, 32)).sum(axis=0) // 8 % 2
    state = imported("two.npy", sample.npy(cells))
    app = opened("import", state).run()
    named(app.button, "image_take").click().run()
    collars = Upload("collars.csv", b"well,x,y,z\nA,1.5,1.5,8\n")
    rows = b"well,from,to,facies\nA,0,2,sand\nA,2,5,clay\n"
    state = app.session_state[KEY]
    assert state.choices.grid.nz is not None
    intervals, tables = Upload("intervals.csv", rows), WellTables(collars)
    state.data_draft = DataChoice("file", upload=intervals, tables=tables)
    app = opened("import", state).run()
    app.button_group(key="import_subject").set_value("Training image").run()
    assert named(app.selectbox, "image_name_1").options == ["facies 1", "clay", "sand"]


def test_facies_of_a_draft_keep_their_names_and_colours():
    app = opened("import", imported("grey.sgems", FILES["grey.sgems"][0])).run()
    named(app.text_input, "image_name_1").set_value("gravel").run()
    named(app.color_picker, "image_colour_1").set_value("#123456").run()
    named(app.button, "image_take").click().run()
    choice = app.session_state[KEY].choices.image
    assert image_of(choice).facies_names[1] == "gravel"
    assert dict(choice.colours)[1] == "#123456"


def test_points_are_told_from_an_image():
    app = opened("import", imported("wells.csv", b"x,y,facies\n1,2,1\n3,4,0\n")).run()
    assert "contains points" in texts(app)
    named(app.button, "image_keep").click().run()
    assert texts(app) == ""
    assert app.session_state[KEY].choices == STUDY


@pytest.mark.slow
def test_the_study_says_that_a_file_waits_and_keeps_its_image():
    app = opened("simulate", imported("grey.sgems", FILES["grey.sgems"][0]))
    app.run()
    assert "There are open questions about reading grey.sgems" in html(app)
    assert texts(app) == ""
    named(app.button, "image_keep").click().run()
    assert app.session_state[KEY].image_draft is None
    assert app.session_state[KEY].choices.image == STUDY.image


def test_a_draft_of_another_file_replaces_one_that_waits():
    state = imported("grey.sgems", FILES["grey.sgems"][0])
    import_image(state, Upload("codes.sgems", FILES["codes.sgems"][0]))
    assert state.image_draft is None
    assert state.choices.image.upload == Upload("codes.sgems", FILES["codes.sgems"][0])
    assert replace(state.choices, image=ImageChoice(), grid=STUDY.grid) == STUDY
