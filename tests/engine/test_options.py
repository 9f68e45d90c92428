"""Test that every option has its documented effect."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ccwsim import Ensemble, Grid, HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.datasets.sampling import sample_random
from ccwsim.engine.stages.conditioning import SPARSE
from ccwsim.engine.trace import Trace
from ccwsim.metrics import judge
from ccwsim.model.parameters import parameter_table
from ccwsim.model.study import Study
from tests.small_images import noise, places_of
from tools.datasets import generate

CHANNELS = datasets.load("channels")
NOISE = TrainingImage(noise((57, 71), 2))
N = 20


@pytest.fixture(scope="module")
def well_data() -> HardData:
    """Return scattered data from another image of the same kind."""
    truth = generate("channels", seed=77)
    cells = np.unique(np.random.default_rng(0).integers(0, 256, (400, 2)), axis=0)
    return HardData(cells, np.asarray(truth.array)[cells[:, 0], cells[:, 1]])


def simulated(data: HardData | None = None, **options: object) -> Ensemble:
    return simulate(CHANNELS, (256, 256), Parameters(**options), data, N, seed=1)  # type: ignore[arg-type]


def patterns(image: NDArray) -> NDArray[np.int64]:
    """Return every 4 × 4 pattern of two facies as a number."""
    windows = np.lib.stride_tricks.sliding_window_view(image, (4, 4)).reshape(-1, 16)
    return windows @ (1 << np.arange(16))


def broken_share(ensemble: Ensemble) -> NDArray[np.float64]:
    """Return the share of 4 × 4 patterns that are absent from the training image."""
    known = np.unique(patterns(ensemble.training_image.indices))
    return np.array([1 - np.isin(patterns(r), known).mean() for r in ensemble.indices])


def off_target(ensemble: Ensemble) -> NDArray[np.float64]:
    return np.abs(ensemble.proportions - ensemble.training_image.proportions).sum(axis=1)


def first_corner(parameters: Parameters, n: int = 40, data: HardData | None = None):
    """Return, for each realization, the south-west corner, which only the first patch covers."""
    side, own = parameters.step, replace(parameters, repair_seams=False)
    return simulate(NOISE, (60, 50), own, data, n).indices[:, :side, :side]


def test_matched_proportions_are_much_nearer_to_those_of_the_image():
    plain, matched = simulated(), simulated(match_proportions=True)
    assert off_target(matched).mean() < 0.6 * off_target(plain).mean()


@pytest.mark.slow
@pytest.mark.parametrize("level", [2, 3])
def test_refining_breaks_fewer_shapes(level):
    plain = simulated(wavelet_level=level, refine=False)
    refined = simulated(wavelet_level=level, refine=True)
    assert broken_share(refined).mean() < 0.85 * broken_share(plain).mean()


@pytest.mark.slow
def test_a_finer_level_breaks_fewer_shapes():
    shares = [broken_share(simulated(wavelet_level=j, refine=False)).mean() for j in (1, 2, 3)]
    assert shares[0] < shares[1] < shares[2]


def test_fewer_candidates_are_more_faithful():
    plain = {"published_draw": True, "repair_seams": False}
    few, many = (simulated(n_candidates=k, **plain) for k in (1, 100))
    assert broken_share(few).mean() < 0.6 * broken_share(many).mean()


@pytest.mark.slow
def test_candidates_matter_little_where_data_are_dense():
    truth = simulate(CHANNELS, (128, 128), Parameters(wavelet_level=1), seed=99).realizations[0]

    def judged(data: HardData | None, k: int):
        p = Parameters(n_candidates=k, published_draw=True)
        options = {"n_realizations": 5, "seed": 1, "keep_sources": True}
        return judge(simulate(CHANNELS, (128, 128), p, data, **options))

    free = [judged(None, k) for k in (1, 20, 500)]
    dense = [judged(sample_random(truth, 1000, 3), k) for k in (1, 20, 500)]
    assert free[0].largest_copied > 2 * free[1].largest_copied
    assert free[2].pattern_distance > 1.3 * free[0].pattern_distance
    assert dense[0].largest_copied < 1.3 * dense[1].largest_copied
    assert abs(dense[2].pattern_distance / dense[0].pattern_distance - 1) < 0.2


def test_few_of_the_candidates_are_drawn_from_where_data_are_dense():
    truth = simulate(CHANNELS, (128, 128), Parameters(wavelet_level=1), seed=99).realizations[0]
    study = Study(CHANNELS, Grid(128, 128), Parameters(), sample_random(truth, 1000, 3), 1)
    trace = Trace(study, 0)
    steps = [trace.at(k) for k in range(0, len(trace.patches), 4)]
    left = [step.n_candidates for step in steps if step.data is not None]
    assert len(left) > 10
    assert np.median(left) <= 3
    help_ = next(row["meaning"] for row in parameter_table() if row["name"] == "n_candidates")
    assert f"Near hard data the limit is {SPARSE.slack} cells" in help_
    assert "only one or two locations remain, and K has little effect" in help_


def test_a_wider_overlap_joins_shapes_better():
    narrow, wide = simulated(overlap_size=4), simulated(overlap_size=16)
    assert broken_share(wide).mean() < 0.8 * broken_share(narrow).mean()


@pytest.mark.slow
def test_searching_more_places_fits_more_data(well_data):
    little = simulated(well_data, search_fraction=0.001)
    much = simulated(well_data, search_fraction=1.0)
    assert (much.data_status == 0).sum(axis=1).mean() > (little.data_status == 0).sum(
        axis=1
    ).mean() + 10


def test_ccsim_is_a_search_without_wavelet():
    p = {"template_size": 16, "overlap_size": 4}
    ccsim = simulate(NOISE, (40, 50), Parameters(method="ccsim", **p), n_realizations=3)
    level_0 = simulate(NOISE, (40, 50), Parameters(wavelet_level=0, **p), n_realizations=3)
    np.testing.assert_array_equal(ccsim.realizations, level_0.realizations)


def test_correlation_prefers_places_with_more_of_the_facies_in_the_overlap():
    plain = {"n_candidates": 1, "published_draw": True, "repair_seams": False}
    ssd, correlation = simulated(**plain), simulated(**plain, similarity="correlation")
    assert not np.array_equal(ssd.realizations, correlation.realizations)
    assert broken_share(ssd).mean() < broken_share(correlation).mean()


def test_without_random_path_every_realization_starts_in_the_south_west():
    p = Parameters(16, 4, 2, random_path=False, refine=False)
    for corner in first_corner(p):
        places = places_of(corner, NOISE.indices)
        assert len(places) == 1
        assert (places % 4 == 0).all()


def test_a_random_path_starts_elsewhere_as_often_as_symmetry_says():
    p = Parameters(16, 4, 2, random_path=True, refine=False, published_draw=True)
    whole = [len(places_of(corner, NOISE.indices)) == 1 for corner in first_corner(p, 200)]
    assert 0.25 - 0.1 < np.mean(whole) < 0.25 + 0.1


@pytest.mark.slow
def test_first_patches_come_from_everywhere_in_the_image():
    p = Parameters(16, 4, 2, random_path=False, refine=False)
    places = [tuple(places_of(c, NOISE.indices)[0].tolist()) for c in first_corner(p, 400)]
    rows, columns = (set(range(0, length - 15, 4)) for length in (57 - 57 % 4, 71 - 71 % 4))
    assert {y for y, _ in places} == rows
    assert {x for _, x in places} == columns
    assert len(set(places)) > 0.9 * len(rows) * len(columns)


def sizes_of_first_patches(variation: float) -> list[int]:
    """Return the side of the largest south-west square of each realization that is in the image."""
    plain = {"published_draw": True, "repair_seams": False}
    p = Parameters(16, 2, 1, random_path=False, template_variation=variation, **plain)
    realizations = simulate(NOISE, (60, 60), p, n_realizations=40).indices
    return [
        max(s for s in range(4, 30) if len(places_of(r[:s, :s], NOISE.indices)))
        for r in realizations
    ]


@pytest.mark.slow
def test_without_template_variation_all_patches_have_the_template_size():
    sizes = sizes_of_first_patches(0.0)
    assert min(sizes) >= 14
    assert max(sizes) <= 18


@pytest.mark.slow
def test_template_variation_draws_smaller_and_larger_patches_within_its_share():
    sizes = sizes_of_first_patches(0.5)
    assert min(sizes) <= 10
    assert max(sizes) >= 20
    assert min(sizes) >= 8 - 2
    assert max(sizes) <= 24 + 2
    assert len(set(sizes)) >= 6


def share_that_continue_to(datum: tuple[int, int], co_template: int) -> float:
    """Return how often the image has the facies of a datum ahead at the continued first patch."""
    p = Parameters(16, 4, 1, 5, random_path=False, refine=False, co_template=co_template)
    leads = []
    for corner in first_corner(p, 60, HardData([datum], [1])):
        y, x = places_of(corner, NOISE.indices)[0] + datum
        if y < NOISE.shape[0] and x < NOISE.shape[1]:
            leads.append(NOISE.indices[y, x] == 1)
    return float(np.mean(leads))


@pytest.mark.slow
@pytest.mark.parametrize("datum", [(5, 20), (25, 3), (30, 31)])
def test_the_co_template_looks_at_data_ahead(datum):
    assert share_that_continue_to(datum, 1) < 0.75
    assert share_that_continue_to(datum, 2) == 1.0


@pytest.mark.slow
def test_the_co_template_leaves_fewer_data_to_mend(well_data):
    draw = {"published_draw": True}  # steering reduces the effect: 14.0 against 15.3
    alone = simulated(well_data, co_template=1, **draw)
    ahead = simulated(well_data, co_template=2, **draw)
    assert ahead.n_resimulated.mean() < 0.9 * alone.n_resimulated.mean()
