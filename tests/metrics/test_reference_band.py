"""Test that good realizations are seldom rejected, and poor ones are, for all sizes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from ccwsim import CCWSIMError, Parameters, TrainingImage, datasets, read_training_image, simulate
from ccwsim.metrics import (
    connectivity,
    fit_curve,
    fit_geobodies,
    fit_proportions,
    reference_band,
)
from ccwsim.metrics.checks import Check, check_ensemble
from ccwsim.metrics.lags import max_lag
from ccwsim.metrics.reference_band import (
    ERROR_LIMITS,
    MIN_CONNECTED_SPREAD,
    USEFUL_TOLERANCES,
    Fit,
    ReferenceBand,
    crop_shape,
    crops_of,
    pieces_of,
)
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.grid import Grid
from ccwsim.model.study import Study
from ccwsim.report.verdicts import describe_checks, describe_curve, describe_curves
from tests.small_images import blobs, noise

SEEN = ("channels", "levees", "stone_wall", "barchans")
"""Images from which the limits were chosen; the other images confirm the limits."""
UNSEEN = tuple(name for name in datasets.names() if name not in SEEN)
PUBLISHED = (
    "paper/ti_three_facies_400x400.npy",
    "paper/ti_channel_256x256.npy",
    "formats/ti_strebelle_250_250_1.dat",
    "formats/dunes_3facies.SGEMS",
)
AS_PUBLISHED = Parameters(published_draw=True, repair_seams=False)
BROKEN = replace(AS_PUBLISHED, template_size=8, overlap_size=4, n_candidates=500)
"""Parameters with small patches and many candidates, which give thin and broken channels."""
CURVES = [(s, way) for s in ("connectivity", "variogram") for way in ("E-W", "N-S")]


def ensemble_of(image: TrainingImage, indices: NDArray[np.uint8]) -> Ensemble:
    """Return images as realizations of a training image."""
    n, grid = len(indices), Grid.of(indices.shape[1:])
    no_data = np.zeros((n, 0), np.int16)
    study = Study(image, grid, checked=False)
    return Ensemble(study, indices, np.ones(n), 1.0, no_data, np.arange(n))


def facies_of(image: TrainingImage) -> range:
    return range(1 if image.n_facies == 2 else 0, image.n_facies)


def fits_of_other_crops(image: TrainingImage, grid_shape: tuple[int, int]) -> list[bool]:
    """Return for each crop whether it fits the other crops of the image."""
    shape = crop_shape(image.shape, grid_shape)
    assert shape is not None
    crops = crops_of(image.indices, shape)
    found = []
    for k in range(len(crops)):
        alone = ensemble_of(image, crops[k : k + 1].astype(np.uint8))
        for facies in facies_of(image):
            for statistic, way in CURVES:
                found.append(without(k, alone, fit_curve, statistic, facies, way))
            found.append(without(k, alone, fit_geobodies, facies))
        found.append(without(k, alone, fit_proportions))
    return found


def without(k: int, alone: Ensemble, function, *which) -> bool:
    """Return whether a crop fits the band of the other crops."""
    of_crops = reference_band.band_of_crops

    def others(*about, **limits) -> ReferenceBand:
        band = of_crops(*about, **limits)
        return replace(band, values=np.delete(band.values, k, axis=0))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference_band, "band_of_crops", others)
        return function(alone, *which).fits


@pytest.mark.slow
@pytest.mark.parametrize("side", [512, 100])
def test_crops_of_the_image_are_seldom_called_bad(side):
    found = []
    for name in UNSEEN:
        found += fits_of_other_crops(datasets.load(name), (side, side))
    assert len(found) > 400
    assert np.mean(found) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_crops_of_published_images_are_seldom_called_bad(data_dir, name):
    path = data_dir / name
    image = TrainingImage(np.load(path)) if path.suffix == ".npy" else read_training_image(path)
    assert np.mean(fits_of_other_crops(image, (512, 512))) > 0.9


def test_crops_are_not_judged_by_the_whole_image():
    """Test that crops fit although they are less connected than the whole image."""
    image = datasets.load("channels")
    for side in (64, 100, 128):
        crops = crops_of(image.indices, (side, side)).astype(np.uint8)
        lags = side // 2
        whole = np.nansum(connectivity(image.indices, 1, "N-S", lags).tau)
        assert np.nansum(connectivity(crops, 1, "N-S", lags).tau, axis=1).min() < 0.85 * whole
        for statistic, way in CURVES:
            assert fit_curve(ensemble_of(image, crops), statistic, 1, way).fits


@pytest.mark.parametrize("name", ["channels_400_data", "stone_wall_300_data"])
def test_a_field_drawn_as_the_image_was_fits(name):
    image = datasets.load(datasets.hard_data_training_image(name))
    field = datasets.load_reference_field(name)
    drawn = ensemble_of(image, np.searchsorted(image.codes, field.array).astype(np.uint8)[None])
    for statistic, way in CURVES:
        assert fit_curve(drawn, statistic, 1, way).fits
    assert fit_geobodies(drawn, 1).fits
    assert fit_proportions(drawn).fits


def test_levees_fail_with_opposite_signs_along_the_axes():
    """Test that channels of levees are too little connected E–W, and more than crops N–S.

    The two errors would cancel out in a sum over directions.
    """
    image = datasets.load("levees")
    river = image.facies_names.index("channel")
    found = simulate(image, (200, 200), AS_PUBLISHED, n_realizations=6, seed=1)
    along, across = (fit_curve(found, "connectivity", river, way) for way in ("E-W", "N-S"))
    assert not along.fits
    assert along.found[along.worst] < along.reference[along.worst] - 0.2
    assert across.found[across.worst] > across.reference[across.worst] + 0.2
    shares = fit_proportions(found)
    splay = image.facies_names.index("crevasse splay")
    assert shares.found[splay] < 0.75 * shares.reference[splay]


@pytest.mark.slow
def test_broken_channels_fail_although_they_scatter():
    image = datasets.load("channels")
    found = simulate(image, (256, 256), BROKEN, n_realizations=8, seed=1)
    fits = {key: fit_curve(found, key[0], 1, key[1]) for key in CURVES}
    assert fits["connectivity", "N-S"].cannot_tell  # τ of crops of 128 cells differs too much
    assert not fits["variogram", "E-W"].fits
    assert not fits["variogram", "N-S"].fits
    assert not fit_proportions(found).fits
    matched = replace(BROKEN, match_proportions=True)
    assert fit_proportions(simulate(image, (256, 256), matched, n_realizations=8, seed=1)).fits
    percolates = fit_geobodies(found, 1)
    assert percolates.outside[1]
    assert percolates.found[1] < percolates.reference[1]


def test_worse_realizations_do_not_excuse_themselves_by_their_own_spread():
    image = TrainingImage(blobs((64, 64), 2, seed=1))
    good = ensemble_of(image, np.array([blobs((64, 64), 2, seed) for seed in range(4)]))
    wild = ensemble_of(image, np.array([noise((64, 64), 2, 1), *[np.eye(64, dtype=np.uint8)] * 3]))
    for statistic, way in CURVES:
        one, other = (fit_curve(e, statistic, 1, way) for e in (good, wild))
        most = 2.001 if statistic == "variogram" else 2.25  # τ is missing in some pieces
        assert (other.tolerance <= most * one.tolerance).all()
    assert not fit_curve(wild, "variogram", 1, "E-W").fits


def test_the_tolerance_is_some_standard_errors_of_crops_and_pieces():
    image = TrainingImage(blobs((96, 128), 3, seed=2))
    found = ensemble_of(image, np.array([blobs((100, 100), 3, seed) for seed in range(5)]))
    shape = crop_shape(image.shape, (100, 100))
    assert shape == (48, 64)
    crops, pieces = crops_of(image.indices, shape), pieces_of(found, shape).indices
    assert len(crops) == 9
    assert len(pieces) == 10

    def tolerance(of_crops, of_pieces, kind: str, least: float, n_pieces: float):
        spread = np.maximum(of_crops.std(axis=0, ddof=1), least)
        spread = np.maximum(spread, np.minimum(of_pieces.std(axis=0, ddof=1), 2 * spread))
        freedom = 4 + n_pieces - 2
        widened = stdtrit(freedom, 0.9995) / ndtri(0.9995)
        return ERROR_LIMITS[kind][0] * spread * np.sqrt(1 / 4 + 1 / n_pieces) * widened

    lags = np.arange(1, 33)
    each, own = (connectivity(images, 2, "E-W", lags).tau for images in (crops, pieces))
    fit = fit_curve(found, "connectivity", 2, "E-W")
    np.testing.assert_allclose(fit.reference, each.mean(axis=0))
    wanted = tolerance(each, own, "connectivity", MIN_CONNECTED_SPREAD, 10)
    np.testing.assert_allclose(fit.tolerance, np.maximum(wanted, 0.1))
    np.testing.assert_allclose(fit.found, own.mean(axis=0))
    shares, own = (
        np.array([[(one == k).mean() for k in range(3)] for one in images])
        for images in (crops, pieces)
    )
    wanted = tolerance(shares, own, "proportions", 0.0, 5 * 100 * 100 / (48 * 64))
    least = 0.05 * image.proportions
    np.testing.assert_allclose(fit_proportions(found).tolerance, np.maximum(wanted, least))


@pytest.mark.parametrize(
    ("image", "grid", "wanted"),
    [
        ((256, 256), (512, 512), (128, 128)),
        ((256, 256), (100, 512), (100, 128)),
        ((4000, 3000), (3000, 3000), (512, 512)),
        ((15, 400), (100, 100), None),
        ((400, 400), (7, 100), None),
    ],
)
def test_a_crop_is_as_large_as_gives_several(image, grid, wanted):
    assert crop_shape(image, grid) == wanted


def test_crops_and_pieces_stay_inside_and_few():
    image = np.arange(90 * 700, dtype=np.int64).reshape(90, 700)
    crops = crops_of(image, (45, 20))
    assert crops.shape == (12, 45, 20)
    assert crops[0, 0, 0] == image[0, 0]
    assert crops[-1, -1, -1] == image[-1, -1]
    stack = np.zeros((50, 60, 60), np.uint8)
    stack[:, 59, 59] = 1
    image = TrainingImage(np.eye(60, dtype=int))
    pieces = pieces_of(ensemble_of(image, stack), (20, 20)).indices
    assert pieces.shape == (32, 20, 20)
    assert 0 < pieces.sum() < 32  # some pieces in the corner, others elsewhere
    assert len(pieces_of(ensemble_of(image, stack[:1]), (20, 20))) == 9


def test_lags_of_steps_of_several_cells_fit_the_crops():
    found = simulate(datasets.load("channels"), (100, 100), n_realizations=2)
    assert max_lag((2, 1), (100, 80)) == 25
    assert fit_curve(found, "variogram", 1, (2, 1)).at.max() <= np.hypot(50, 25)


def test_what_crops_do_not_have_is_not_judged():
    lonely = np.zeros((64, 64), int)
    lonely[30, 30] = 1
    image = TrainingImage(lonely)
    found = ensemble_of(image, np.zeros((2, 64, 64), np.uint8))
    fit = fit_curve(found, "connectivity", 1, "E-W")
    assert not fit.judged
    assert fit.fits
    constant = TrainingImage(np.full((40, 40), 5))
    same = ensemble_of(constant, np.zeros((2, 30, 30), np.uint8))
    assert fit_curve(same, "variogram", 5, "N-S").fits
    assert fit_proportions(same).fits
    small = ensemble_of(TrainingImage(noise((12, 12), 2)), np.zeros((1, 40, 40), np.uint8))
    assert fit_curve(small, "variogram", 0) is None
    assert fit_geobodies(small, 0) is None
    assert fit_proportions(small) is None


@pytest.mark.parametrize("direction", [[0, 1], np.array([0, 1]), 90.0])
def test_a_direction_in_numbers_gives_what_its_name_gives(direction):
    image = TrainingImage(blobs((40, 40), 2))
    found = ensemble_of(image, image.indices[None])
    named, given = (fit_curve(found, "variogram", 1, way) for way in ("E-W", direction))
    assert np.array_equal(given.found, named.found)
    assert np.array_equal(given.tolerance, named.tolerance)


def test_an_unknown_facies_or_statistic_is_an_error():
    image = TrainingImage(blobs((40, 40), 2))
    found = ensemble_of(image, np.zeros((1, 40, 40), np.uint8))
    with pytest.raises(CCWSIMError, match="facies = 2 must be one of 0, 1"):
        fit_curve(found, "variogram", 2)
    with pytest.raises(CCWSIMError, match="must be one of variogram, connectivity"):
        fit_curve(found, "madogram", 1)


def test_the_worst_is_counted_in_tolerances():
    reference, tolerance = np.full(4, 0.5), np.array([0.1, 0.2, 0.1, np.nan])
    fit = Fit(np.arange(4.0), np.array([0.45, 0.1, 0.65, 0.0]), reference, tolerance, (9, 9))
    assert fit.outside.tolist() == [False, True, True, False]
    assert fit.worst == 1
    assert fit.judged
    assert not fit.fits


def fit_with_tolerance(kind: str, tolerance: float) -> Fit:
    """Return a fit of equal values with one tolerance, judged as a kind of check."""
    values = np.full(3, 0.5)
    return Fit(
        at=np.arange(1.0, 4.0),
        found=values,
        reference=values,
        tolerance=np.full(3, tolerance),
        crop_shape=(64, 64),
        useful_tolerance=USEFUL_TOLERANCES[kind],
    )


@pytest.mark.parametrize("kind", USEFUL_TOLERANCES)
def test_agreement_within_a_wide_tolerance_confirms_nothing(kind):
    useful, is_relative = USEFUL_TOLERANCES[kind]
    limit = useful * (0.5 if is_relative else 1)
    narrow, wide = (fit_with_tolerance(kind, share * limit) for share in (0.99, 1.01))
    assert (narrow.cannot_tell, wide.cannot_tell) == (False, True)
    far = replace(wide, found=wide.reference + 2 * limit)
    assert not far.fits
    assert not far.cannot_tell
    checks = [Check(kind, None, None, fit) for fit in (narrow, wide, far)]
    headlines = [
        describe_checks(part, ["sand"])[0] for part in (checks[:1], checks[:2], checks[1:2])
    ]
    assert [each.words for each in headlines] == [
        "the only check fits the training image",
        "1 of 2 checks fit the training image, 1 cannot tell",
        "no check can tell",
    ]
    assert [each.good for each in headlines] == [True, True, None]


def test_a_tolerance_relative_to_nothing_has_no_size():
    wide = fit_with_tolerance("joins", 0.3)
    fit = replace(wide, found=np.zeros(3), reference=np.zeros(3))
    assert fit.cannot_tell
    assert describe_curve(fit, "variogram").words == "cannot tell"


def test_a_curve_that_nothing_could_leave_gets_no_tick():
    wide = fit_with_tolerance("connectivity", 0.45)
    assert describe_curve(wide, "connectivity").words == "cannot tell (± 45 %)"
    assert describe_curve(wide, "connectivity").good is None
    narrow = fit_with_tolerance("connectivity", 0.1)
    both = describe_curves({"E–W": narrow, "N–S": wide}, "connectivity")
    assert both.words == "E–W inside the band; N–S cannot tell (± 45 %)"
    assert both.good is None


@pytest.mark.slow
def test_most_checks_of_the_bundled_images_can_tell():
    fits = [
        check.fit
        for name in datasets.BUNDLED_IMAGES
        if (image := datasets.load(name)).n_dimensions == 2
        for check in check_ensemble(simulate(image, (256, 256), n_realizations=12, seed=3))
    ]
    assert np.mean([fit.cannot_tell for fit in fits]) <= 0.4


def test_a_value_that_few_crops_or_pieces_have_is_not_judged():
    crops = np.tile([0.4, 0.5, 0.6, 0.5], (2, 4)).T
    crops[:10, 1] = np.nan  # 6 of 16 crops have the value
    band = ReferenceBand(np.arange(2.0), crops, 4.0, 3.0, np.zeros(2), (64, 64))
    assert np.isnan(band.compare(np.full((8, 2), 0.1)).tolerance).tolist() == [False, True]
    pieces = np.full((8, 2), 0.1)
    pieces[:6, 0] = np.nan
    assert np.isnan(band.compare(pieces).tolerance).tolist() == [True, True]
    alone = ReferenceBand(np.arange(1.0), crops[:, :1], 4.0, 3.0, 0.0, (64, 64))
    some = np.full((8, 1), 0.3)
    some[:5] = np.nan
    assert alone.compare(some).tolerance > alone.compare(np.full((8, 1), 0.3)).tolerance
