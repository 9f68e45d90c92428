"""Test each entry in the table of measures against plain loops, and the verdicts."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.ndimage import label

from ccwsim import CCWSIMError, Ensemble, Parameters, TrainingImage, simulate
from ccwsim.metrics import MEASURES, Measure, measure
from ccwsim.metrics.measures import OfFacies
from ccwsim.metrics.stack import Stack
from ccwsim.report.verdicts import describe_measures
from tests.small_images import blobs

P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
BY_TITLE = {m.title.removesuffix(" per 1,000,000 cells").partition(", ")[0]: m for m in MEASURES}


def value(title: str, image: np.ndarray, code: int = 1) -> float:
    of = OfFacies(Stack(image[None].astype(np.uint8), np.arange(2)), code, TrainingImage(image))
    return float(BY_TITLE[title].values(of)[0])


def runs(lines: np.ndarray) -> list[int]:
    """Return the lengths of runs of ones in lines along the last axis."""
    return [
        len([*run])
        for line in lines.reshape(-1, lines.shape[-1])
        for inside, run in groupby(line.tolist())
        if inside
    ]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**16), st.booleans(), st.floats(0.2, 0.8))
def test_measures_are_what_plain_loops_count(seed, volume, share):
    rng = np.random.default_rng(seed)
    image = (rng.random((5, 9, 8) if volume else (9, 8)) < share).astype(int)
    image.flat[0], image.flat[1] = 0, 1
    assert value("Proportion", image) == image.mean()
    assert value("Chord E–W", image) == pytest.approx(np.mean(runs(image)))
    assert value("Chord N–S", image) == pytest.approx(np.mean(runs(image.swapaxes(-1, -2))))
    if volume:
        assert value("Chord vertical", image) == pytest.approx(np.mean(runs(image.T)))
    unequal = [np.abs(np.diff(image, axis=axis)).ravel() for axis in range(image.ndim)]
    assert value("Boundary", image) == pytest.approx(np.concatenate(unequal).mean())
    labels, n = label(image, np.ones((3,) * image.ndim))
    sizes = np.bincount(labels.ravel())[1:]
    assert value("Geobodies", image) == pytest.approx(1_000_000 * n / image.size)
    assert value("Geobodies per 10,000 cells", image) == pytest.approx(10_000 * n / image.size)
    assert value("Largest geobody", image) == pytest.approx(sizes.max() / image.sum())
    assert value("Γ", image) == pytest.approx((sizes**2).sum() / image.sum() ** 2)


def test_a_ring_has_one_hole():
    ring = np.ones((10, 10), int)
    ring[3:6, 3:6] = 0
    assert value("Euler number", ring) == 0  # one geobody, one hole
    assert value("Euler number per 10,000 cells", 1 - ring) == pytest.approx(
        100
    )  # one in 100 cells


def test_a_facies_that_is_missing_has_no_length_and_no_geobody():
    empty = np.zeros((9, 9), int)
    image = blobs((40, 40), 2)
    stack = Stack(np.stack([empty, empty + 1]).astype(np.uint8), np.arange(2))
    of = OfFacies(stack, 1, TrainingImage(image))
    for title in ("Chord E–W", "Largest geobody", "Γ"):
        found = BY_TITLE[title].values(of)
        assert np.isnan(found[0])
        assert np.isfinite(found[1])
    assert BY_TITLE["Γ"].text(np.nan) == "–"


def of_maps(image: np.ndarray, maps: list[np.ndarray]) -> Ensemble:
    """Return an ensemble of the given maps, as if simulated from an image."""
    made = simulate(TrainingImage(image), maps[0].shape, P)
    return replace(made, indices=np.array(maps, np.uint8), numbers=np.arange(len(maps)),
                   cpu_seconds=np.zeros(len(maps)),
                   data_status=np.zeros((len(maps), 0), np.int16))  # fmt: skip


def test_pieces_of_the_image_itself_are_as_its_crops_and_noise_is_not():
    image = blobs((120, 120), 2)
    rng = np.random.default_rng(1)
    crops = [image[y : y + 60, x : x + 60] for y, x in rng.integers(0, 60, (8, 2))]
    good = describe_measures(measure(of_maps(image, crops), 1))
    assert all(row.good for row in good)
    noise = [rng.permuted(crop.ravel()).reshape(60, 60) for crop in crops]
    bad = {row.title: row for row in describe_measures(measure(of_maps(image, noise), 1))}
    assert bad["Proportion, %"].good  # the same cells
    assert bad["Boundary, %"].verdict.startswith("too rough: ")
    assert bad["Chord E–W, cells"].verdict.startswith("too short: ")
    assert bad["Unseen patterns, %"].verdict.startswith("too many: ")


def test_unseen_patterns_of_crops_are_counted_in_the_rest_of_the_image():
    image = TrainingImage(blobs((40, 40), 2))
    corner = image.indices[:20, 20:]
    stack = Stack(corner[None], image.codes)
    places = [(y, x) for y in range(38) for x in range(38)]
    windows = {(y, x): image.indices[y : y + 3, x : x + 3].tobytes() for y, x in places}
    inside = [w for (y, x), w in windows.items() if y <= 17 and x >= 20]
    others = {w for (y, x), w in windows.items() if y > 17 or x < 20}
    share = np.mean([w not in others for w in inside])
    assert 0 < share < 1
    unseen = BY_TITLE["Unseen patterns"].values
    assert unseen(OfFacies(stack, 1, image, are_crops=True)) == pytest.approx([share])
    assert unseen(OfFacies(stack, 1, image)) == [0.0]


def test_fewer_unseen_patterns_than_in_crops_are_good():
    image = blobs((120, 120), 2, seed=3)
    same = of_maps(image, [image[:60, :60], image[60:, 60:]])
    (row,) = [r for r in describe_measures(measure(same, 1)) if r.title == "Unseen patterns, %"]
    assert row.good
    assert row.verdict.startswith("0.00, crops ")


def test_volumes_have_a_measure_more_and_small_images_are_not_judged():
    volume = TrainingImage(blobs((60, 50), 2)[None].repeat(10, axis=0))
    p = Parameters((8, 16, 16), (2, 4, 4), 1)
    found = measure(simulate(volume, (10, 24, 20), p), 1)
    assert found.measures == tuple(m for m in MEASURES if m.volumes is not False)
    tiny = TrainingImage(blobs((17, 12), 2))
    found = measure(simulate(tiny, (17, 12), Parameters(8, 2, 1)), 1)
    assert found.fit is None
    assert found.measures == tuple(m for m in MEASURES if not m.volumes)
    assert {row.verdict for row in describe_measures(found)} == {"not judged"}


def test_an_unknown_facies_is_refused():
    with pytest.raises(CCWSIMError, match="facies = 7 must be one of 0, 1"):
        measure(simulate(TrainingImage(blobs((40, 40), 2)), (20, 20), P), 7)


def test_an_entry_of_the_table_is_all_that_a_measure_needs(monkeypatch):
    def edges(of: OfFacies) -> np.ndarray:
        return of.inside[:, :, 0].mean(axis=(1, 2))

    own = Measure("First row, %", "Share of the southern row.", edges, 0.5, factor=100, digits=0)
    monkeypatch.setattr("ccwsim.metrics.measures.MEASURES", (*MEASURES, own))
    ensemble = simulate(TrainingImage(blobs((60, 60), 2)), (40, 40), P, n_realizations=3)
    row = describe_measures(measure(ensemble, 1))[-1]
    assert row.title == "First row, %"
    mean = 100 * (ensemble.indices[:, 0] == 1).mean()
    assert row.realizations.startswith(f"{mean:.0f} (")
