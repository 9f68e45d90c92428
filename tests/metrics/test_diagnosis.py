"""Test the diagnosis of artificial images with known thickness, period and trend."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.ndimage import gaussian_filter
from skimage.morphology import footprint_rectangle, opening

from ccwsim import datasets
from ccwsim.metrics import (
    default_parameters,
    diagnose,
    feature_spacing,
    granulometry,
    local_direction,
    main_direction,
    proportions,
    stationarity,
    templates_that_fit,
    variogram,
    warn_of_edges,
    warn_of_level,
)
from ccwsim.metrics.direction import along_and_across
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from tests.small_images import facies_at_edges


def stripes(ny, nx, width, period):
    return np.tile((np.arange(ny) % period < width)[:, None], (1, nx)).astype(int)


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 10**6), ny=st.integers(3, 20), nx=st.integers(3, 20))
def test_granulometry_is_the_opening_of_scikit_image(seed, ny, nx):
    image = (np.random.default_rng(seed).random((ny, nx)) < 0.85).astype(np.uint8)
    found = granulometry(image, 1)
    padded = np.pad(image, 25)
    for size, kept in zip(found.sizes, found.kept, strict=True):
        opened = opening(padded, footprint_rectangle((int(size), int(size))))
        assert kept == pytest.approx(opened.sum() / image.sum())
    too_large = len(found.sizes) + 1
    assert not opening(padded, footprint_rectangle((too_large, too_large))).any()


@pytest.mark.parametrize(("width", "period"), [(1, 5), (3, 12), (6, 20)])
def test_stripes_are_as_thick_and_as_far_apart_as_they_were_made(width, period):
    image = stripes(120, 90, width, period)
    assert granulometry(image, 1).thickness() == width
    assert granulometry(image, 0).thickness() == period - width
    along, across = (feature_spacing(image, direction=d) for d in ("E-W", "N-S"))
    assert across.spacing == period
    assert across.strength > 1
    assert along.spacing is None
    found = diagnose(TrainingImage(image))
    assert any(f"every {period} cells north–south" in w for w in found.warnings)


def test_granulometry_stops_where_it_is_told():
    image = stripes(60, 60, 5, 20)
    assert len(granulometry(image, 1).sizes) == 5
    assert len(granulometry(image, 0, max_size=7).sizes) == 7
    image[::10, ::10] = 1
    stopped, whole = granulometry(image, 1, down_to=0.99), granulometry(image, 1)
    assert stopped.kept.tolist() == whole.kept[: len(stopped.kept)].tolist()
    assert stopped.kept[-1] < 0.99 <= stopped.kept[-2]
    assert granulometry(image > 1, 1).thickness() == 0


def test_quarters_are_measured_each_for_itself():
    image = np.random.default_rng(0).integers(0, 3, (30, 41))
    found = stationarity(image)
    quarter = image[15:, :20]
    whole = (image == 1).mean()
    np.testing.assert_allclose(found.proportions[2], proportions(quarter, range(3))[0])
    own = variogram(quarter, 1, "N-S", 7).gamma[0]
    np.testing.assert_allclose(found.variograms[2, 1, 1], own)
    distance = np.sqrt(np.mean((own - variogram(image, 1, "N-S", 7).gamma[0]) ** 2))
    assert found.variogram_shift[2, 1, 1] == pytest.approx(distance / (whole * (1 - whole)))


def truncated(side: int, scale: float, share: float, seed: int, slope: float = 0.0):
    """Return a truncated Gaussian field, smoothed over `scale` cells, with a trend of `slope`."""
    field = np.random.default_rng(seed).normal(size=(side, side))
    field = gaussian_filter(field, scale) if scale else field
    field = field / field.std() + slope * np.linspace(-0.85, 0.85, side)
    return (field > np.quantile(field, 1 - share)).astype(int)


@pytest.mark.parametrize(
    ("side", "scale", "share"),
    [(64, 0, 0.1), (64, 0, 0.4), (96, 2, 0.4), (128, 4, 0.1), (128, 8, 0.4), (160, 12, 0.1)],
)
def test_stationary_fields_are_told_stationary(side, scale, share):
    told = [stationarity(truncated(side, scale, share, seed)).stationary for seed in range(20)]
    assert np.mean(told) >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0, 1, 2, 4])
@pytest.mark.parametrize("turned", [False, True])
def test_a_trend_is_told_not_stationary(scale, turned):
    for seed in range(4):
        image = truncated(160, scale, 0.3, seed, slope=2.0)
        found = diagnose(TrainingImage(image.T if turned else image))
        assert not found.stationarity.stationary
        assert any("not stationary" in w and "chance explains ±" in w for w in found.warnings)


def test_the_error_of_a_quarter_is_what_realizations_show():
    each = [stationarity(truncated(96, 3, 0.4, seed)) for seed in range(40)]
    found = np.std([one.differences[:, 1] for one in each], axis=0)
    told = np.mean([one.errors[:, 1] for one in each], axis=0)
    np.testing.assert_allclose(told, found, rtol=0.35)


@pytest.mark.parametrize("name", ["channels", "stone_wall", "fractures", "barchans"])
def test_stationary_images_of_the_program_are_told_so(name):
    assert diagnose(datasets.load(name)).stationarity.stationary


def test_the_delta_is_told_not_stationary():
    found = diagnose(datasets.load("delta"))
    assert not found.stationarity.stationary
    assert any("not stationary" in w for w in found.warnings)


def test_published_images_are_told_stationary(data_dir):
    for path in sorted((data_dir / "paper").glob("ti_*.npy")):
        assert diagnose(TrainingImage(np.load(path))).stationarity.stationary, path.name


def test_bodies_cut_by_the_border_are_not_thin():
    image = np.zeros((60, 60), int)
    image[20:28, 20:40] = 1
    image[:1, 5:30] = 1  # one row of a body that extends beyond the southern edge
    image[40:60, :1] = 1
    assert granulometry(image, 1, down_to=0.95).thickness() == 1
    assert granulometry(image, 1, down_to=0.95, extend=True).thickness() == 8
    assert diagnose(TrainingImage(image)).thickness[1] == 8
    thin = image.copy()
    thin[30:50, 45] = 1  # thin, and not at the edge
    assert diagnose(TrainingImage(thin)).thickness[1] == 1
    assert granulometry(np.ones((30, 30), int), 1, extend=True).thickness() == 30


@pytest.mark.parametrize(
    ("period", "side", "template"), [(34, 256, 36), (33, 320, 36), (40, 256, 40)]
)
def test_the_template_holds_a_period_rounded_up(period, side, template):
    found = diagnose(TrainingImage(stripes(side, side, 5, period)))
    assert (found.feature_size, found.advised("wavelet_level")) == (period, 2)
    assert found.advised("template_size") == template >= period


def test_a_measured_period_beats_the_range():
    period = 30  # over a sixth of the image, so no template contains a period
    found = diagnose(TrainingImage(stripes(128, 128, 6, period)))
    assert found.feature_size == period
    reason = next(a.reason for a in found.advice if a.parameter == "template_size")
    said = "Features repeat about every 30 cells, though only 4 templates fit along 128 cells: 30"
    assert reason.startswith(said)
    assert found.advised("template_size") == 30
    found = diagnose(TrainingImage(stripes(128, 128, 6, 34)))  # fewer templates would fit
    reason = next(a.reason for a in found.advice if a.parameter == "template_size")
    assert "but 5 templates should fit" in reason
    assert found.advised("template_size") == 24


def test_a_drift_is_warned_of_with_quarter_and_facies():
    rng = np.random.default_rng(2)
    even = (rng.random((100, 100)) < 0.3).astype(int)
    assert stationarity(even).stationary
    drifting = even.copy()
    drifting[50:, 50:] = rng.random((50, 50)) < 0.6
    found = diagnose(TrainingImage(drifting, facies_names=("mud", "sand")))
    assert not found.stationarity.stationary
    assert any("north-east quarter" in w and "not stationary" in w for w in found.warnings)


def test_a_change_of_direction_is_warned_of():
    image = stripes(128, 128, 4, 8)
    image[:64, :64] = stripes(64, 64, 4, 8).T
    found = diagnose(TrainingImage(image))
    assert any("south-west quarter differs" in w for w in found.warnings)


@settings(deadline=None, max_examples=30)
@given(
    seed=st.integers(0, 10**6),
    ny=st.integers(8, 150),
    nx=st.integers(8, 150),
    n_facies=st.integers(1, 4),
    grain=st.integers(1, 20),
)
def test_advice_is_always_allowed_and_fits_the_image(seed, ny, nx, n_facies, grain):
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, n_facies, (ny // grain + 1, nx // grain + 1))
    ti = TrainingImage(coarse.repeat(grain, axis=0).repeat(grain, axis=1)[:ny, :nx])
    found = diagnose(ti)
    parameters = Parameters(**{a.parameter: a.value for a in found.advice})
    assert parameters.template_size == found.advised("template_size") <= min(ny, nx)
    assert found.n_templates == templates_that_fit((ny, nx), parameters.template_size)
    assert all(a.reason.endswith(".") for a in found.advice)


def test_authors_choices_are_advised_for_their_images(data_dir):
    for name in ("ti_channel_256x256", "ti_stonewall_200x200"):
        found = diagnose(TrainingImage(np.load(data_dir / "paper" / f"{name}.npy")))
        assert 32 <= found.advised("template_size") <= 40
        assert found.advised("template_size") >= found.feature_size
        assert found.advised("overlap_size") == 8
        assert 1 <= found.advised("wavelet_level") <= 3


def test_features_that_are_large_for_their_image_are_warned_of():
    blobs = (np.random.default_rng(0).random((8, 8)) < 0.5).astype(int)
    large = blobs.repeat(20, axis=0).repeat(20, axis=1)
    few, many = diagnose(TrainingImage(large)), diagnose(TrainingImage(np.tile(large, (3, 3))))
    assert few.feature_size > 160 / 6 >= few.advised("template_size")
    assert any(w.startswith("Only") for w in few.warnings)
    assert many.feature_size < 480 / 6
    assert not any(w.startswith("Only") for w in many.warnings)
    assert (few.advised("wavelet_level"), many.advised("wavelet_level")) == (1, 3)


@pytest.mark.parametrize("shape", [(72, 96), (130, 159), (90, 400)])
def test_the_default_of_a_small_map_is_what_is_advised(shape):
    image = TrainingImage((np.add.outer(*map(np.arange, shape)) // 5 % 3 == 0).astype(int))
    found, p = diagnose(image), default_parameters(image)
    sizes = (p.wavelet_level, p.template_size, p.overlap_size)
    assert sizes == tuple(a.value for a in found.advice) != (2, 32, 8)
    assert 4 * p.template_size <= min(shape)
    assert default_parameters(TrainingImage(np.tile(image.array, (3, 3)))) == Parameters()


def test_the_default_of_tiny_maps_and_of_volumes_is_the_usual_one():
    for shape in ((7, 90), (60, 60, 60)):
        assert default_parameters(TrainingImage(np.indices(shape).sum(axis=0) % 2)) == Parameters()


def test_images_that_are_too_small_are_said():
    with pytest.raises(CCWSIMError, match="7 × 9"):
        diagnose(TrainingImage(np.zeros((7, 9), int)))
    with pytest.raises(CCWSIMError, match="max_size = 0"):
        granulometry(np.zeros((7, 9), int), 0, 0)


@pytest.mark.parametrize(
    ("level", "n_data", "warned"), [(3, 2561, True), (3, 2559, False), (2, 9000, False)]
)
def test_a_coarse_level_is_warned_of_where_tiles_are_split_for_data(level, n_data, warned):
    words = warn_of_level(Parameters(32, 8, level), (512, 512), n_data)
    assert bool(words) is warned
    volume = Parameters((16, 32, 32), (4, 8, 8), (1, 2, level))
    n_cells, a_template = 48 * 512 * 512, 16 * 32 * 32
    n_data = round(n_data / 2560 * 10 * n_cells / a_template)
    assert bool(warn_of_level(volume, (48, 512, 512), n_data)) is warned


def test_a_facies_that_few_patches_contain_is_warned_of():
    image = TrainingImage(facies_at_edges())
    assert "facies 0 (18 %" in warn_of_edges(Parameters(32, 8, 2), image)
    assert warn_of_edges(Parameters(16, 4, 2), image) == ""
    small = TrainingImage(np.pad(np.zeros((40, 40), int), 6, constant_values=1))
    patches = np.lib.stride_tricks.sliding_window_view(small.array, (32, 32))
    assert patches.mean() < 0.75 * small.proportions[1]
    assert "facies 1" in warn_of_edges(Parameters(32, 8, 2), small)
    assert warn_of_edges(Parameters(32, 8, 2), datasets.load("stone_wall")) == ""
    layers = TrainingImage(
        np.broadcast_to(np.array([1, 0, 0, 0, 0, 1])[:, None, None], (6, 12, 40))
    )
    assert "facies 1" in warn_of_edges(Parameters((4, 4, 8), (1, 1, 2), 0), layers)


STRIPES = np.tile([[0], [0], [0], [1], [1], [1]], (8, 48))


def test_a_volume_with_gaps_has_the_direction_of_its_middle_layer():
    volume = np.stack([STRIPES] * 5).astype(float)
    volume[0, :3, :3] = np.nan  # only in the lowest layer
    assert main_direction(TrainingImage(volume)) == main_direction(STRIPES) == (90.0, 0.0)


def turned_stripes(azimuth, side=120):
    """Return stripes along an azimuth."""
    north, east = np.indices((side, side))
    across = east * np.cos(np.radians(azimuth)) - north * np.sin(np.radians(azimuth))
    return TrainingImage((across // 6 % 2).astype(int))


@pytest.mark.parametrize(
    ("azimuth", "directions"),
    [
        (90, ("E-W", "N-S")),
        (0, ("N-S", "E-W")),
        (42, (40.0, 130.0)),
        (143, (145.0, 55.0)),
        (179, ("N-S", "E-W")),
    ],
)
def test_curves_are_along_and_across_geobodies(azimuth, directions):
    assert along_and_across(turned_stripes(azimuth), 1) == directions


def test_only_the_middle_of_a_large_image_tells_the_direction():
    image = np.kron(np.ones((1, 10), int), stripes(540, 60, 6, 12))
    image[:14], image[-14:] = 0, 1
    assert along_and_across(TrainingImage(image), 1) == ("E-W", "N-S")


@pytest.mark.parametrize("image", [np.zeros((40, 40), int), np.resize([0, 1], (1, 30))])
def test_curves_have_no_direction_without_geobodies(image):
    assert along_and_across(TrainingImage(image), 0) is None


@pytest.mark.parametrize("side", [30, 300])
def test_curves_have_no_direction_in_noise(side):
    noise = gaussian_filter(np.random.default_rng(3).random((side, side)), 1.5) > 0.5
    assert along_and_across(TrainingImage(noise.astype(int)), 1) is None


@pytest.mark.parametrize("shape", [(1, 30), (30, 1), (3, 20, 20)])
def test_rows_of_cells_and_volumes_have_no_direction(shape):
    with pytest.raises(CCWSIMError, match="at least 2 × 2 cells"):
        local_direction(
            np.resize([0, 1], shape)
            if len(shape) == 2
            else TrainingImage(np.resize([0, 1, 1], shape))
        )
