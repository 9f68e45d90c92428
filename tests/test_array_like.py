"""Test that ensembles and images are used like arrays, or refuse with the remedy."""

from __future__ import annotations

import inspect
import warnings
from contextlib import suppress
from importlib import import_module
from io import BytesIO

import numpy as np
import pytest

import ccwsim
from ccwsim import (
    CCWSIMError,
    Ensemble,
    Grid,
    HardData,
    Parameters,
    TrainingImage,
    metrics,
    simulate as simulated,
)
from ccwsim.datasets.sampling import sample_random
from ccwsim.experiments.comparison import compare
from tests.flow.test_flow import ensemble

P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
IMAGE = TrainingImage(np.tile([[0], [0], [7], [7]], (16, 64)), facies_names=["mud", "sand"])


@pytest.fixture(scope="module")
def e() -> Ensemble:
    return simulated(IMAGE, (40, 50), P, n_realizations=2)


@pytest.mark.parametrize(
    "other", [1, 0.0, True, np.uint8(1), np.zeros((2, 40, 50)), np.zeros((64, 64))]
)
def test_a_comparison_with_numbers_is_refused_with_the_remedy(e, other):
    for whole, name in ((e, r"np.asarray\(e\) =="), (IMAGE, r"np.asarray\(t\) ==")):
        for comparison in (lambda a, b: a == b, lambda a, b: a != b):
            if isinstance(other, (np.generic, np.ndarray)):  # NumPy compares cell by cell
                continue
            with pytest.raises(TypeError, match=name):
                comparison(other, whole)
        with pytest.raises(TypeError, match=name):
            whole == other  # noqa: B015


def test_the_remedy_is_right_and_equality_by_content_stays(e):
    assert np.mean(np.asarray(IMAGE) == 7) == 0.5
    assert np.mean(np.asarray(e) == 7) == pytest.approx(e.proportions[:, 1].mean())
    same = TrainingImage(IMAGE.array, facies_names=["mud", "sand"])
    assert same == IMAGE
    assert hash(same) == hash(IMAGE)
    assert TrainingImage(IMAGE.array) != IMAGE
    for other in (None, "text", (), HardData()):
        assert e != other
        assert other != IMAGE
    assert e == e
    assert {e: 1}[e] == 1
    assert e != simulated(IMAGE, (40, 50), P)


def test_cells_are_indexed_like_those_of_an_array(e):
    assert e[0, 3, 4] == e.realizations[0, 3, 4]
    assert np.array_equal(e[:, 3:5, -1], e.realizations[:, 3:5, -1])
    assert np.array_equal(e[1, ...], e[1])
    assert isinstance(e[[1, 0]], Ensemble)
    assert isinstance(e[:1], Ensemble)


@pytest.mark.parametrize("kind", [np.random.default_rng, np.random.SeedSequence])
def test_a_generator_gives_one_seed_that_is_stored(kind):
    run = [simulated(IMAGE, (40, 50), P, seed=kind(5)) for _ in range(2)]
    assert run[0].seed == run[1].seed
    assert simulated(IMAGE, (40, 50), P, seed=run[0].seed).digest == run[0].digest
    assert (
        kind is np.random.SeedSequence
        or simulated(IMAGE, (40, 50), P, seed=kind(6)).seed != run[0].seed
    )
    assert sample_random(IMAGE.array, 9, seed=kind(5)) == sample_random(
        IMAGE.array, 9, seed=kind(5)
    )


def test_two_draws_of_one_generator_differ():
    rng = np.random.default_rng(1)
    seeds = {simulated(IMAGE, (40, 50), P, seed=rng).seed for _ in range(3)}
    assert len(seeds) == 3


def test_progress_is_shown_as_a_bar(capsys):
    simulated(IMAGE, (40, 50), P, n_realizations=2, progress=True)
    assert "100 %" in capsys.readouterr().err
    with pytest.raises(CCWSIMError, match="progress = 1 must be a function"):
        simulated(IMAGE, (40, 50), P, progress=1)
    with pytest.raises(CCWSIMError, match="cancel = True must be a function"):
        simulated(IMAGE, (40, 50), P, cancel=True)


@pytest.mark.parametrize("name", ["variogram", "connectivity", "anodi"])
def test_measures_show_their_progress_as_a_bar(name, capsys):
    e = simulated(IMAGE, (40, 50), P, n_realizations=2)
    getattr(metrics, name)(e, IMAGE if name == "anodi" else 7, progress=True)
    assert "100 %" in capsys.readouterr().err


ONE_IMAGE = "diagnose", "mean_thickness", "main_direction", "connected_geobodies", "granulometry"
CODES_ONLY = {"calibration", "ProbabilityBands"}
"""Functions of probabilities or of arrays that come later, which have no names of facies."""


def functions_of_facies() -> list[str]:
    """Return the public measures with an argument `facies`."""
    names = []
    for name in dir(metrics):
        function = getattr(metrics, name)
        if inspect.isfunction(function) and "facies" in inspect.signature(function).parameters:
            names.append(name)
    return names


@pytest.mark.parametrize("name", [n for n in functions_of_facies() if n not in CODES_ONLY])
def test_measures_take_the_name_of_a_facies_or_its_code(name, e):
    function, first = getattr(metrics, name), e
    options = inspect.signature(function).parameters
    more = {"statistic": "variogram"} if "statistic" in options else {}
    if name in ONE_IMAGE:
        first = IMAGE
    if name in ("direction_error", "reliability"):
        guide = {"angle": 10.0} if name == "direction_error" else {}
        guide = guide or {"probabilities": {"sand": np.full((40, 50), 0.5)}}
        first = simulated(IMAGE, (40, 50), P, secondary=ccwsim.Secondary(**guide))
    by_code, by_name = (function(first, facies=f, **more) for f in (7, "Sand"))
    assert repr(by_name) == repr(by_code)
    with pytest.raises(CCWSIMError, match=r"'gravel' must be one of mud, sand"):
        function(first, facies="gravel", **more)


def test_experiments_take_the_name_of_a_facies():
    settings = {"a": P, "b": Parameters(20, 4, 1)}
    by_code, by_name = (compare(IMAGE, (40, 50), settings, facies=f) for f in (7, "sand"))
    assert by_code.curves.keys() == by_name.curves.keys()


def test_an_array_has_no_names():
    with pytest.raises(CCWSIMError, match="'sand' must be one of 0, 1"):
        metrics.variogram(np.eye(40, dtype=int), "sand")


def test_notes_count_the_data_that_are_kept():
    points = b"x,y,facies\n2.5,0.5,0\n5.2,0.5,7\n99.3,0.5,7\n"
    report = ccwsim.io.import_hard_data(BytesIO(points), Grid(4, 8), IMAGE, on_outside="drop")
    assert report.n_off_centre == 1
    assert "1 of 2 data were not at the centre of their cell and were moved there." in report.notes


def test_warnings_point_to_the_line_of_the_user():
    pictures = TrainingImage(np.eye(40, dtype=int), numbering="colours")
    table = {"x": [1.2, 3.5], "y": [0.5, 0.5], "facies": [0, 1]}
    points = b"x,y,facies\n1.5,0.5,0\n3.5,0.5,1\n"
    calls = [
        lambda: HardData.of(table, Grid(4, 8), pictures),
        lambda: simulated(pictures, (40, 50), P, hard_data=table),
        lambda: ccwsim.read_hard_data(BytesIO(points), Grid(4, 8), pictures),
        lambda: ensemble(1).property({0: 1.0, 1: 2.0}),
        lambda: ccwsim.read_training_image(BytesIO(b"1,0,nan\n1,0,1\n"), classes="codes"),
    ]
    n_warnings = 0
    for call in calls:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            call()
        assert {warning.filename for warning in caught} <= {__file__}
        n_warnings += len(caught)
    assert n_warnings >= 4


@pytest.mark.parametrize("shape", [[40, 50], np.array([40, 50]), (np.int64(40), np.int64(50))])
def test_shapes_and_numbers_of_numpy_are_accepted(shape):
    run = simulated(IMAGE, shape, P, n_realizations=np.int64(2), seed=np.int64(3))
    assert run.shape == (2, 40, 50)


def test_help_names_arrays_instead_of_their_union():
    places = ("ccwsim", "ccwsim.metrics", "ccwsim.io", "ccwsim.flow", "ccwsim.figures")
    signatures = []
    for module in map(import_module, places):
        for name in dir(module):
            public = getattr(module, name)
            if not callable(public) or not getattr(public, "__module__", "").startswith("ccwsim"):
                continue
            methods = vars(public).values() if isinstance(public, type) else ()
            for function in (public, *filter(inspect.isfunction, methods)):
                with suppress(ValueError):  # an exception has no signature
                    signatures += [f"{name}{inspect.signature(function)}"]
    assert sum("ArrayLike" in text for text in signatures) > 40
    assert not [text for text in signatures if "_SupportsArray" in text]
