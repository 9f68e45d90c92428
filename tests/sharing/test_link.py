"""Test that a link restores the study that it describes, and that faults are reported."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import fields, replace
from difflib import get_close_matches
from typing import get_args
from urllib.parse import parse_qs, urlencode

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from ccwsim import CCWSIMError, Grid, HardData, Parameters, datasets
from ccwsim.model.bounds import MAX_LINK_DATA, MAX_LINK_VALUES
from ccwsim.model.parameters import METHODS, SIMILARITIES
from ccwsim.model.published import VARIANTS
from ccwsim.model.sizes import legal_sizes
from ccwsim.sharing import link
from ccwsim.sharing.choices import (
    Choices,
    CompareChoice,
    DataChoice,
    Directions,
    EMap,
    FlowChoice,
    Gradient,
    GuideChoice,
    ImageChoice,
    Shown,
    Stroke,
    SweepChoice,
    Upload,
    ZoneLayers,
)
from ccwsim.sharing.codec import parts_of
from ccwsim.sharing.link import KEYS, StudyReader, link_of, link_settings, parts_left_out, read_link
from ccwsim.sharing.parts import json_text
from ccwsim.sharing.words import packed, unpacked
from ccwsim.ui.session.resolve import study_of

LETTERS = st.characters(exclude_categories=("Cs",))
NAMES = st.text(LETTERS, min_size=1, max_size=40).filter(str.strip)
CODES = st.integers(-(10**9), 10**9)
COLOURS = st.from_regex(r"\A#[0-9a-f]{6}\Z")
ORIGINS = st.floats(-1e12, 1e12, allow_nan=False)
SIZES = st.floats(1e-9, 1e12, allow_nan=False)
SIDES = st.integers(1, 10_000)
SEEDS = st.integers(0, 2**31 - 1)
CELLS = st.tuples(st.integers(0, 9999), st.integers(0, 9999))


@st.composite
def hard_data(draw) -> HardData:
    cells = draw(st.lists(CELLS, max_size=MAX_LINK_DATA, unique=True))
    facies = draw(st.lists(CODES, min_size=len(cells), max_size=len(cells)))
    if cells and draw(st.booleans()):
        values = draw(st.lists(st.floats(-1e30, 1e30), min_size=len(cells), max_size=len(cells)))
        return HardData(cells, values={"porosity, %": values})
    return HardData(cells, facies)


@st.composite
def images(draw) -> ImageChoice:
    choice = draw(built(ImageChoice))
    n = datasets.load(choice.bundled).n_facies
    return replace(choice, names=choice.names[:n] if len(choice.names) >= n else ())


@st.composite
def data_choices(draw) -> DataChoice:
    choice = draw(built(DataChoice))
    return choice if choice.source == "bundled" else replace(choice, bundled="")


@st.composite
def guides(draw) -> GuideChoice:
    choice = draw(built(GuideChoice))
    return choice if len(choice.points) <= MAX_LINK_DATA else GuideChoice()


@st.composite
def parameters(draw) -> Parameters:
    method, level = draw(st.sampled_from(METHODS)), draw(st.integers(0, 6))
    used = 0 if method == "ccsim" else level
    template = draw(st.sampled_from(legal_sizes(used, max(4, 2 * 2**used), 1024)))
    overlap = draw(st.sampled_from(legal_sizes(used, 1, template // 2)))
    sizes = {"template_size": template, "overlap_size": overlap, "wavelet_level": level}
    own = replace(draw(built(Parameters)), method=method, **sizes)
    return own.as_in(draw(st.sampled_from(VARIANTS)))


def built(kind: type) -> st.SearchStrategy:
    """Return random objects; a field without a row in `VALUES` is an error."""
    names = [f.name for f in fields(kind) if f.name not in FROM_FILES.get(kind, ())]
    return st.builds(kind, **{name: VALUES[kind][name] for name in names})


WKT = 'PROJCS["WGS 84 / UTM zone 32N",GEOGCS["WGS 84",' + 'AUTHORITY["EPSG","4326"],' * 80 + "]]"
CRS = st.sampled_from(["", "EPSG:32632", "urn:ogc:def:crs:EPSG::32632", "+proj=utm +zone=32", WKT])
MAPS = st.sampled_from(get_args(EMap))
MATCHES = st.dictionaries(NAMES, CODES, min_size=1, max_size=3).map(lambda m: tuple(m.items()))
ANSWERS = (
    st.just(("on_outside", "drop"))
    | st.just(("on_collision", "majority"))
    | MATCHES.map(lambda matches: ("facies_names", matches))
)
WELLS = st.tuples(NAMES, st.lists(CELLS, min_size=1, max_size=3).map(tuple))
SHARES, DEGREES = st.floats(0, 1), st.floats(-360, 360)
POINTS = st.tuples(ORIGINS, ORIGINS)
CORNERS = st.lists(POINTS, min_size=3, max_size=6).map(tuple)
STROKES = st.builds(Stroke, SHARES, SIZES, SHARES, CORNERS)
OTHER_IMAGES = st.builds(
    ImageChoice,
    st.sampled_from(datasets.names()),
    flip_ew=st.booleans(),
    facies_names=st.just(()) | MATCHES,
)
ROCKS = st.dictionaries(NAMES, st.tuples(st.floats(1e-14, 1e3), st.floats(0.01, 1)), max_size=3)
HEADS = st.floats(-1e30, 1e30)
RAMPS = st.builds(Gradient, DEGREES, SHARES, SHARES)
FROM_FILES = {
    ImageChoice: ("upload", "answers", "facies_names"),
    DataChoice: ("upload", "tables"),
    GuideChoice: ("saved", "facies_names", "active_codes"),
    Parameters: ("method", "template_size", "overlap_size", "wavelet_level", "variant"),
}
"""Fields that a link cannot contain, and parameters that are drawn together by `parameters`."""
VALUES: dict[type, dict[str, st.SearchStrategy]] = {
    ImageChoice: {
        "bundled": st.sampled_from(datasets.names()),
        **dict.fromkeys(("flip_ew", "flip_ns", "transpose"), st.booleans()),
        "names": st.lists(NAMES, max_size=4).map(tuple),
        "colours": st.dictionaries(CODES, COLOURS, max_size=4).map(lambda c: tuple(c.items())),
    },
    DataChoice: {
        "source": st.sampled_from(["none", "bundled", "sampled", "placed"]),
        "bundled": st.sampled_from(datasets.hard_data_names()),
        "answers": st.lists(ANSWERS, max_size=2).map(tuple),
        "wells": st.lists(WELLS, max_size=3).map(tuple),
        "n_sampled": st.integers(1, 100_000),
        "seed_sampled": SEEDS,
        "placed": st.none() | hard_data(),
    },
    Grid: {
        **dict.fromkeys(("ny", "nx"), SIDES),
        "nz": st.none() | SIDES,
        "cell_size": st.tuples(SIZES, SIZES),
        "origin": st.tuples(ORIGINS, ORIGINS),
        "crs": CRS,
    },
    Parameters: {
        "n_candidates": st.integers(1, 10**6),
        "similarity": st.sampled_from(SIMILARITIES),
        "search_fraction": st.floats(0, 1, exclude_min=True),
        "co_template": st.integers(1, 4),
        "template_variation": st.floats(0, 0.5),
        "location_weight": st.floats(0, 10),
    }
    | {f.name: st.booleans() for f in fields(Parameters) if isinstance(f.default, bool)},
    GuideChoice: {
        "probabilities": st.none() | RAMPS | st.lists(STROKES, max_size=3).map(tuple),
        "facies": st.integers(0, 253),
        "soft_weight": st.floats(0, 5),
        "active": st.none() | CORNERS,
        "auxiliary": st.none() | st.builds(Directions, DEGREES, DEGREES),
        "auxiliary_weight": st.floats(0, 10),
        "angle": st.none() | DEGREES | RAMPS | st.lists(CORNERS, max_size=3).map(tuple),
        "flow_azimuth": DEGREES,
        "scale": st.floats(0.2, 5),
        "mirrored": st.sampled_from(["", "x", "y", "z", "xy", "xyz"]),
        "images": st.lists(OTHER_IMAGES, max_size=2).map(tuple),
        "zones": st.none()
        | SHARES
        | st.lists(CORNERS, max_size=3).map(tuple)
        | st.builds(ZoneLayers, st.lists(st.integers(0, 99), min_size=1, max_size=3).map(tuple)),
    },
    FlowChoice: {
        "rocks": ROCKS.map(lambda rocks: tuple(rocks.items())),
        "values_are": st.sampled_from(["classes", "K", "log K", "porosity"]),
        "unit": st.sampled_from(["m/s", "m/d"]),
        "axis": st.sampled_from([None, "x", "y", "z", "edge"]),
        "along": st.sampled_from(["x", "y", "points", "constant"]),
        "points": st.just(()) | st.tuples(HEADS, HEADS, HEADS, HEADS),
        "thickness": st.floats(0.001, 1e5),
        **dict.fromkeys(("high", "low"), HEADS),
        "anisotropy": st.floats(0.001, 1),
        "well": st.none() | CELLS,
        "rate": st.floats(0, 1e30),
    },
}
VALUES |= {
    CompareChoice: {
        "others": st.lists(st.none() | parameters(), min_size=1, max_size=3).map(tuple),
        "n": st.none() | st.integers(1, 100),
        "beside": st.sampled_from(["", "two-point"]) | OTHER_IMAGES,
    },
    SweepChoice: {
        "ranges": st.sampled_from([(), (("template_size", (16, 24)), ("method", ("ccsim",)))]),
        "n_realizations": st.integers(1, 50),
        "error": st.sampled_from(["patterns", "proportions"]),
    },
}
VALUES[Shown] = {
    "threshold": st.none() | st.floats(-1e30, 1e30),
    "realization": st.integers(0, 999),
    "facies": st.integers(0, 253),
    "e_type": MAPS,
    "flow": built(FlowChoice),
    "compare": built(CompareChoice),
    "sweep": built(SweepChoice),
}
VALUES[Choices] = {
    "image": images(),
    "data": data_choices(),
    "grid": built(Grid),
    "parameters": parameters(),
    "n_realizations": st.integers(1, 1000),
    "seed": SEEDS,
    "guides": guides(),
}
STUDIES, SHOWN = built(Choices), built(Shown)


ODD = st.sampled_from(
    [
        *(None, True, -1, 1, 0.5, 360, 1e300, 1e999, float("nan"), 10**400, "x", [], {}, [[0]]),
        *([[1, 2]], [[[1, 2], [3, 4]]], [[[1, 2], [30, 4], [5, 60]]], [[1e300, 0]] * 3),
        *({"first": []}, {"first": [10**30]}, {"first": [-1]}, {"azimuth": 1e308}, {"end": -9}),
        *([{"bundled": "mars"}], [{"bundled": "delta", "names": ["a"]}], {"saved": {}}),
    ]
)
"""Values in the JSON of guides, most of which a link refuses."""
SHAPES = "40x50", "20x20x6", "1x1", "6x300"


@st.composite
def texts_of_guides(draw) -> str:
    changed = json.loads(json_text(draw(guides())))
    names = st.sampled_from([f.name for f in fields(GuideChoice)])
    changed |= draw(st.dictionaries(names, ODD, max_size=2))
    return json.dumps(changed)


def as_address(query: dict[str, list[str]]) -> dict[str, list[str]]:
    """Return a query as a browser changes it."""
    return parse_qs(urlencode(query, doseq=True), keep_blank_values=True)


@given(STUDIES, SHOWN)
def test_what_is_read_from_a_link_is_what_was_written(choices, shown):
    query = link_of(choices, shown)
    assert set(query) <= set(KEYS)
    read, seen, notes = read_link(as_address(query))
    assert (read, seen, notes) == (choices, shown, ())


@given(STUDIES)
def test_what_is_read_from_a_project_is_what_was_written(choices):
    settings = link_settings(choices, ["image", "data", "grid", "parameters", "study", "guides"])
    reader = StudyReader(json.loads(json.dumps(settings)), project=True)
    usual = parts_of(Choices(), Shown())
    image, data, grid, p = (
        reader.part(name, usual[name]) for name in ("image", "data", "grid", "parameters")
    )
    read = Choices(image, data, grid, p)
    assert reader.part("guides", reader.part("study", read)) == choices


@given(
    st.dictionaries(
        st.one_of(st.sampled_from(KEYS), st.text(max_size=8)),
        st.lists(st.text(max_size=30), min_size=1, max_size=3),
        max_size=8,
    )
)
def test_any_address_gives_a_study(query):
    choices, shown, _ = read_link(query)
    again, seen, notes = read_link(as_address(link_of(choices, shown)))
    assert (again, seen, notes) == (choices, shown, ())


@given(texts_of_guides(), st.sampled_from(SHAPES))
def test_any_text_of_guides_gives_a_study_or_is_refused(text, grid):
    address = {"guides": [text], "grid": [grid], "data": ["none"], "template": ["16"]}
    choices, shown, _ = read_link(address)
    again, _, notes = read_link(as_address(link_of(choices, shown)))
    assert (again, notes) == (choices, ())
    with suppress(CCWSIMError):
        study_of(choices)


@given(hard_data())
def test_data_survive_packing(data):
    assume(not data.values)  # data with values are written as JSON
    assert unpacked(packed(data)).digest == data.digest


@given(st.text(max_size=60))
def test_packed_data_that_were_changed_are_said_or_are_data(text):
    with suppress(CCWSIMError):
        assert unpacked(text).n <= MAX_LINK_DATA


def test_two_hundred_data_fit_into_an_address():
    cells = np.random.default_rng(0).choice(512 * 512, MAX_LINK_DATA, replace=False)
    data = HardData(np.column_stack(np.divmod(cells, 512)), np.arange(MAX_LINK_DATA) % 3)
    assert len(packed(data)) < 1200
    with pytest.raises(CCWSIMError, match="201 hard data are more than the 200"):
        packed(HardData([[k, k] for k in range(201)], [0] * 201))


def test_a_usual_study_needs_no_words_and_an_unusual_one_few():
    assert link_of(Choices()) == {}
    choices = Choices(
        ImageChoice("dunes"),
        DataChoice(),
        parameters=Parameters(template_size=48, wavelet_level=3),
        seed=7,
    )
    text = "ti=dunes&template=48&level=3&seed=7"
    assert urlencode(link_of(choices), doseq=True) == text


def test_bundled_data_are_those_of_their_image_unless_the_link_names_them():
    assert read_link({"ti": ["dunes"]})[0].data == DataChoice()
    assert read_link({"ti": ["channels"]})[0].data == Choices().data
    for image in (ImageChoice("dunes"), ImageChoice("channels")):
        for data in (DataChoice(), Choices().data, DataChoice("bundled", "channels_60_wells")):
            choices = Choices(image, data)
            assert read_link(link_of(choices))[0] == choices


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ({"ti": ["mars"]}, "ti = mars is not a bundled training image"),
        ({"ti": ["own"]}, "does not have the training image own of this link"),
        ({"data": ["own-1a-a-b.csv"]}, "does not have the hard data a-b.csv of this link"),
        ({"data": ["oil"]}, "data = oil is none of"),
        ({"data": ["placed"], "points": ["0_0_3D_A~1_2_1H"]}, "copy the entire link again"),
        ({"grid": ["0x5"]}, "grid = 0x5 is not two or three numbers in range"),
        ({"template": ["big"]}, "template = big is not a number"),
        ({"template": ["33"]}, "Template 33 must be a multiple of 4 at level 2"),
        ({"refine": ["maybe"]}, "refine = maybe is none of yes, no"),
        ({"method": ["magic"]}, "must be one of ccwsim"),
        ({"seed": ["-1"]}, "seed = -1 is not a whole number"),
        ({"templte": ["48"]}, "There is no setting templte. Did you mean template?"),
        ({"turn": ["up"]}, "turn = up is not made of ew, ns and transpose"),
        ({"name": ["mud"]}, "1 names for 2 facies"),
        ({"colour": ["red"]}, "colour = red is not a code"),
        ({"crs": ["UTM 32"]}, "crs = UTM 32 is not a coordinate system; give a code such as EPSG"),
        ({"crs": ["EPSG:3263x"]}, "is not a coordinate system"),
        ({"crs": ['PROJCS["WGS 84",GEOGCS["WG']}, "is not a coordinate system"),
        ({"crs": ["A:" + "b" * 9000]}, "has 9002 letters; a coordinate system has at most 8000"),
    ],
)
def test_a_bad_value_is_said_and_the_rest_is_taken(query, said):
    choices, shown, notes = read_link({**query, "realizations": ["3"], "show": ["2"]})
    assert (choices.n_realizations, shown.realization) == (3, 1)
    assert [said in note for note in notes] == [True]


def test_names_of_others_are_passed_over():
    assert read_link({"utm_source": ["mail"], "embed": ["true"]})[2] == ()


@pytest.mark.parametrize(
    ("query", "left"),
    [
        ({"seed": ["7"], **{f"templte{k}": ["1"] for k in range(9999)}}, "templte199"),
        ({"seed": ["7"], "colour": ["red"] * 9999, "levl": ["1"]}, "colour"),
        ({"seed": ["7"], "x" * 99_999: ["1"], "levl": ["1"]}, "x" * 40),
        ({"seed": ["7"], "ti": ["x" * 99_999], "levl": ["1"]}, "ti"),
    ],
    ids=["names", "values", "letters of a name", "letters of a value"],
)
def test_of_a_long_address_the_first_values_are_read(query, left, monkeypatch):
    compared: list[str] = []

    def closest(name, *_, **__):
        compared.append(name)
        return []

    monkeypatch.setattr(link, "get_close_matches", closest)
    link._closest.cache_clear()
    for _ in range(3):
        choices, _, notes = read_link(query)
        assert choices == replace(Choices(), seed=7)
        assert notes == (f"The address is too long: {left} and everything after it is ignored.",)
    assert len(compared) == len(set(compared)) < MAX_LINK_VALUES
    link._closest.cache_clear()


@pytest.mark.parametrize("known", KEYS)
def test_every_name_that_resembles_a_known_one_is_short_enough_to_be_compared(known):
    for n in range(1, 60):
        for name in (known + "-" * n, known * n):
            assert bool(link.meant(name)) == bool(get_close_matches(name, KEYS, 1, link.LIKENESS))


def test_what_a_link_cannot_carry_is_named():
    many = HardData([[k, 0] for k in range(300)], [0] * 300)
    file = Upload("a.npy", b"")
    assert parts_left_out(Choices(ImageChoice(upload=file))) == ("the training image a.npy",)
    assert parts_left_out(Choices(data=DataChoice("file", upload=file))) == ("the hard data a.npy",)
    assert "set by hand" in parts_left_out(Choices(data=DataChoice("placed", placed=many)))[0]
    for choices in (
        Choices(ImageChoice(upload=file)),
        Choices(data=DataChoice("placed", placed=many)),
    ):
        assert "This server does not have the" in read_link(link_of(choices))[2][0]
