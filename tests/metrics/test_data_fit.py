"""Test the fit of data to an image: brute-force counts, calibration, contradicted images."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from benchmarks.data_fit import NAMES, SIDES, rejected
from ccwsim import CCWSIMError, HardData, Parameters, TrainingImage, simulate
from ccwsim.metrics import fit_data, leave_out, rank_images, rank_variants
from ccwsim.metrics.data_fit import (
    AS_GIVEN,
    ImageRank,
    _Events,
    _Family,
    _pair_shares,
    _reach,
    _variants,
    better_variant,
    well_numbers,
    winner,
)
from ccwsim.model.grid import Grid
from ccwsim.model.missing import UNKNOWN
from ccwsim.model.study import Study
from ccwsim.sharing.choices import ImageChoice
from ccwsim.ui.session.resolve import image_of
from tests.small_images import blobs

P = Parameters(16, 4, 1)
IMAGE = TrainingImage(blobs((64, 70), 3).astype(int) * 2 + 5, name="blobs")


STRIPES = np.tile([[0], [0], [0], [0], [1], [1], [2]], (16, 112)).astype(np.uint8)


def scattered(field: np.ndarray, n: int, seed: int = 0) -> HardData:
    flat = np.random.default_rng(seed).choice(field.size, n, replace=False)
    cells = np.column_stack(np.unravel_index(flat, field.shape))
    return HardData(cells, field[tuple(cells.T)])


@pytest.mark.parametrize("gaps", [0.0, 0.1])
@pytest.mark.parametrize("shape", [(9, 11), (4, 8, 7)])
def test_events_are_counted_as_one_by_one(shape, gaps):
    rng = np.random.default_rng(1)
    indices = rng.integers(0, 3, shape).astype(np.uint8)
    indices[np.random.default_rng(2).random(shape) < gaps] = UNKNOWN
    cells = np.column_stack([rng.integers(0, 5, 6) for _ in shape])
    events = _Events(indices, 3, cells, np.arange(6))
    near = np.array([4, 1])
    (found,) = events._counts(near, 2, events._whole)
    expected = np.zeros((3, 3, 3))
    for at in product(*map(range, shape)):
        places = [np.array(at) + cells[k] - cells[2] for k in (1, 4, 2)]
        if all((p >= 0).all() and (p < shape).all() for p in places):
            event = tuple(indices[tuple(p)] for p in places)
            if UNKNOWN not in event:
                expected[event] += 1
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("gaps", [0.0, 0.2, 0.8])
def test_pairs_are_counted_as_one_by_one(gaps):
    indices = np.random.default_rng(2).integers(0, 3, (9, 12)).astype(np.uint8)
    indices[np.random.default_rng(3).random((9, 12)) < gaps] = UNKNOWN
    shares = _pair_shares(indices, 3, np.array([2, 3]))
    for dy, dx in product(range(-2, 3), range(-3, 4)):
        pairs = [
            (indices[y, x], indices[y + dy, x + dx])
            for y, x in product(range(9), range(12))
            if 0 <= y + dy < 9 and 0 <= x + dx < 12
            if UNKNOWN not in (indices[y, x], indices[y + dy, x + dx])
        ]
        if not pairs:
            assert np.isnan(shares[:, :, dy + 2, dx + 3]).all()
            continue
        for k, m in product(range(3), range(3)):
            assert shares[k, m, dy + 2, dx + 3] == pytest.approx(
                np.mean([pair == (k, m) for pair in pairs]), abs=1e-5
            )


def test_a_difference_is_measured_against_all_other_sets():
    sets = np.random.default_rng(3).normal(size=(12, 4))
    found = _Family(sets).largest_difference()
    for row, value in enumerate(found):
        others = np.delete(sets, row, axis=0)
        z = np.abs(sets[row] - others.mean(axis=0)) / others.std(axis=0, ddof=1)
        assert value == pytest.approx(z.max())
    less = _Family(sets, np.array([[1.0] * 4, [0.0] * 4, [0.0] * 4, [0.0] * 4]))
    np.testing.assert_allclose(less.largest_difference()[1:], found[1:])
    assert less.largest_difference()[0] < found[0]


def test_probabilities_add_up_and_follow_the_counts():
    events = _Events(IMAGE.indices, 3, np.array([[0, 0], [0, 1], [3, 3]]), np.arange(3))
    sets = np.array([[a, b, c] for a, b, c in product(range(3), repeat=3)])
    logs = np.array([events.log_probabilities_of(each) for each in sets])
    for target in range(3):
        others = np.delete(np.arange(3), target)
        for values in product(range(3), repeat=2):
            same = (sets[:, others] == values).all(axis=1)
            assert np.exp(logs[same, target]).sum() == pytest.approx(1, abs=1e-3)
    beside = np.exp(events.log_probabilities_of(np.array([1, 1, 1])))
    assert beside[0] > IMAGE.proportions[1]  # neighbours of sand are sand


def test_data_of_a_realization_fit_and_data_of_noise_do_not():
    field = simulate(IMAGE, (120, 120), P, seed=5).realizations[0]
    own = fit_data(IMAGE, scattered(field, 300), (120, 120), parameters=P)
    assert not own.contradicts
    assert own.words == "Data do not contradict this training image"
    noise = np.random.default_rng(0).choice(IMAGE.codes, (120, 120), p=IMAGE.proportions)
    other = fit_data(IMAGE, scattered(noise, 300), (120, 120), parameters=P)
    assert other.contradicts
    assert other.words.startswith("Data contradict this training image: ")
    assert other.score < own.score
    assert other == fit_data(IMAGE, scattered(noise, 300), (120, 120), parameters=P)


@pytest.mark.parametrize("sides", [(200, 210), (6, 90, 90)])
def test_unknown_cells_around_images_change_no_rank(sides):
    images = [TrainingImage(blobs(sides, 2, seed=seed)) for seed in range(2)]
    wide = [(0, 0), (30, 20), (50, 0)][-len(sides) :]
    padded = [
        TrainingImage(np.pad(i.array.astype(float), wide, constant_values=np.nan)) for i in images
    ]
    data = scattered(images[0].array[..., :60, :60], 250)
    reach = np.min([_reach(i.shape) for i in images], axis=0)
    assert sides[0] == 6 or (reach == _reach(padded[0].shape)).all()
    for one, other in zip(rank_images(images, data), rank_images(padded, data), strict=True):
        assert images.index(one.image) == padded.index(other.image)
        assert len(sides) == 3 or (one.score, one.z) == (other.score, other.z)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("hole", [np.s_[:90, :60], np.s_[:, :75], np.s_[::21, ::21]])
def test_images_with_gaps_are_judged(hole):
    cells = blobs((128, 140), 3).astype(float)
    cells[hole] = np.nan
    gappy = TrainingImage(cells, name="gappy")
    field = simulate(gappy, (120, 120), P, seed=5).realizations[0]
    assert not fit_data(gappy, scattered(field, 300), (120, 120), parameters=P).contradicts
    noise = np.random.default_rng(0).integers(0, 3, (120, 120))
    assert fit_data(gappy, scattered(noise, 300), (120, 120), parameters=P).contradicts


@pytest.mark.filterwarnings("error")
def test_rare_facies_of_an_image_with_gaps_share_a_label():
    cells = blobs((60, 64), 11).astype(float)
    cells[:20, :10] = np.nan
    field = simulate(cells, (60, 60), Parameters(8, 2, 1)).realizations[0]
    fit = fit_data(TrainingImage(cells), scattered(field, 90), (60, 60), 10, parameters=P)
    assert np.isfinite([*fit.families.values(), fit.score, fit.gain]).all()


def test_of_many_data_a_random_part_is_compared():
    image = TrainingImage(np.tile(IMAGE.array, (3, 3)))
    many = scattered(image.array, 30_000)
    fit = fit_data(image, many, image.shape, n_null=10, parameters=P)
    assert fit.n == 2000
    assert not fit.contradicts
    assert rank_images([image], many)[0].n == 400


def test_wells_of_a_volume_are_the_independent_data():
    image = TrainingImage(np.repeat(IMAGE.indices[None, :40, :40], 6, axis=0))
    cells = np.array([(z, y, x) for z in range(6) for y, x in ((2, 3), (9, 30), (20, 8))])
    data = HardData(cells, image.array[tuple(cells.T)])
    assert well_numbers(data.cells).max() == 2
    fit = fit_data(image, data, (6, 40, 40), n_null=10)
    assert (fit.n, fit.words) == (3, "Too few data to judge the image")


def test_any_number_of_facies_will_do():
    rng = np.random.default_rng(4)
    field = np.repeat(np.repeat(rng.integers(0, 60, (16, 16)), 4, axis=0), 4, axis=1)
    image = TrainingImage(field)
    fit = fit_data(image, scattered(field, 60), field.shape, n_null=10, parameters=P)
    assert np.isfinite([fit.p, fit.score, fit.z_smoothing]).all()
    assert len(rank_images([image], scattered(field, 60))) == 1


@pytest.mark.parametrize(
    ("data", "shape", "words"),
    [
        (HardData([[1, 1], [2, 2]], [5, 7]), (60, 60), "give at least 3"),
        (HardData([[1, 1], [2, 2], [3, 3]], [5, 7, 8]), (60, 60), "8"),
        (HardData([[1, 1], [2, 2], [90, 3]], [5, 7, 7]), (60, 60), "90"),
        (HardData([[1, 1, 1]], [5]), (60, 60), "grid is a map"),
    ],
)
def test_data_that_do_not_go_with_the_image_are_refused(data, shape, words):
    with pytest.raises(CCWSIMError, match=words):
        fit_data(IMAGE, data, shape, parameters=P)


class TestRank:
    def test_an_image_without_a_facies_of_the_data_is_last(self):
        data = scattered(IMAGE.array, 40)
        other = TrainingImage(IMAGE.indices, name="other codes")
        ranks = rank_images([other, IMAGE], data)
        assert [rank.image.name for rank in ranks] == ["blobs", "other codes"]
        assert ranks[1].score == -np.inf
        assert ranks[1].z == np.inf

    def test_the_order_of_the_images_does_not_matter(self):
        turned = TrainingImage(IMAGE.array.T[::-1], name="turned")
        data = scattered(IMAGE.array, 60)
        one, two = rank_images([turned, IMAGE], data), rank_images([IMAGE, turned], data)
        assert [(r.image.name, r.score, r.z) for r in one] == [
            (r.image.name, r.score, r.z) for r in two
        ]

    def test_what_cannot_be_ranked_is_refused(self):
        data = scattered(IMAGE.array, 10)
        with pytest.raises(CCWSIMError, match="0 images"):
            rank_images([], data)
        with pytest.raises(CCWSIMError, match="axes"):
            rank_images([TrainingImage(np.zeros((3, 20, 20)))], data)


class TestLeaveOut:
    def study(self, data: HardData) -> Study:
        return Study(IMAGE, Grid(60, 60), P, data, seed=2)

    def test_each_datum_is_predicted_by_runs_without_it(self):
        data = scattered(np.tile(IMAGE.array, (2, 2)), 30)
        data = HardData(data.cells % 60, IMAGE.array[tuple((data.cells % 60).T)])
        found = leave_out(self.study(data), folds=data.n, n=3)
        alone = np.random.default_rng(2).permutation(data.n)
        for k in (0, 7):
            keep = np.arange(data.n) != k
            seed = 2 + int(alone[k])
            rest = HardData(data.cells[keep], data.facies[keep])
            e = simulate(IMAGE, (60, 60), P, rest, 3, seed)
            row, column = data.cells[k]
            expected = [(e.realizations[:, row, column] == code).mean() for code in IMAGE.codes]
            np.testing.assert_allclose(found.probability[k], expected)
        assert found.words == "Too few data to judge the probabilities"

    def test_the_skill_stands_beside_that_of_smoothing(self):
        data = scattered(STRIPES[:96, :96], 250)
        halves = HardData(data.cells, (data.cells[:, 1] > 47).astype(int))
        blobs_of_two = (IMAGE.array > 5).astype(int)
        cases = [
            (STRIPES, data, "Explains 1.00 of the uncertainty, smoothing 0."),
            (STRIPES.T, data, "Simulation predicts no better than proportions"),
            (blobs_of_two, halves, ": no gain from this image"),
        ]
        for image, left_out, words in cases:
            study = Study(TrainingImage(image), Grid(96, 96), P, left_out)
            assert words in leave_out(study, n=8).words

    def test_whole_wells_are_left_out(self):
        image = TrainingImage(np.repeat(IMAGE.indices[None, :40, :40], 4, axis=0))
        cells = np.array([(z, y, x) for z in range(4) for y, x in ((2, 3), (9, 30))])
        small = Parameters((4, 16, 16), (1, 4, 4), (0, 1, 1))
        study = Study(
            image, Grid.of((4, 40, 40)), small, HardData(cells, image.array[tuple(cells.T)])
        )
        shares = []
        found = leave_out(study, folds=2, n=2, by="well", progress=shares.append)
        assert found.probability.shape == (8, 3)
        assert shares[-1] == pytest.approx(1)
        assert shares == sorted(shares)

    @pytest.mark.parametrize(
        ("options", "words"),
        [({"by": "depth"}, "datum"), ({"folds": 1}, "folds"), ({"n": 1}, "n = "), ({}, "4 data")],
    )
    def test_bad_input_is_refused(self, options, words):
        data = scattered(IMAGE.array[:60, :60], 4)
        with pytest.raises(CCWSIMError, match=words):
            leave_out(self.study(data), **options)


@pytest.mark.slow
def test_the_right_image_is_seldom_rejected():
    """Test one field of each size; 3 false alarms in 10 would fail with a probability of .9."""
    found = [
        alarm
        for name in NAMES
        for side in SIDES
        for alarm in rejected(name, name, side, 400, 100, 1)
    ]
    assert len(found) == 12
    assert sum(found) <= 1


@pytest.mark.slow
def test_a_wrong_image_is_found():
    assert np.mean(rejected("channels", "fractures", 512, 400, 100, 5)) >= 0.8


def test_images_that_the_data_do_not_tell_apart_have_no_winner():
    first, second = TrainingImage([[0, 1]]), TrainingImage([[1, 0]])
    ranks = [ImageRank(first, -0.4, 0.0, 300), ImageRank(second, -0.5, 1.2, 300)]
    assert winner(ranks) is None
    assert winner([ranks[0], ImageRank(second, -0.5, 2.1, 300)]) is first


def preferring(field: np.ndarray, facies: int, times: float, n: int, seed: int = 0) -> HardData:
    """Return n data at random cells; a cell of the facies is chosen so many times as often."""
    weights = np.where(field.ravel() == facies, times, 1.0)
    rng = np.random.default_rng(seed)
    flat = rng.choice(field.size, n, replace=False, p=weights / weights.sum())
    cells = np.column_stack(np.unravel_index(flat, field.shape))
    return HardData(cells, field[tuple(cells.T)])


def test_wells_that_prefer_a_facies_do_not_contradict_the_image():
    image = TrainingImage(IMAGE.array, facies_names=["clay", "gravel", "silt"])
    field = simulate(image, (120, 120), P, seed=5).realizations[0]
    fit = fit_data(image, preferring(field, 7, 4.0, 300), field.shape, parameters=P)
    assert fit.p <= 0.025
    assert fit.words == "Wells prefer gravel, or the image lacks it; otherwise it fits"
    assert not fit.contradicts
    noise = np.random.default_rng(0).choice(image.codes, field.shape, p=image.proportions)
    wrong = fit_data(image, preferring(noise, 7, 4.0, 300), field.shape, parameters=P)
    assert wrong.contradicts
    assert not wrong.preferred


def test_a_turned_image_is_named_and_an_image_as_given_is_not():
    image = TrainingImage(STRIPES)
    like = scattered(np.tile(STRIPES, (1, 1)), 250)
    turned = HardData(like.cells[:, ::-1], like.facies)
    assert better_variant(rank_variants(image, like))[0] == AS_GIVEN
    name, z = better_variant(rank_variants(image, turned))
    assert "90°" in name or "270°" in name
    assert z > 4
    few = HardData(turned.cells[:150], turned.facies[:150])
    assert better_variant(rank_variants(image, few))[0] == AS_GIVEN
    recoloured = HardData(like.cells, np.array([1, 0, 2])[like.facies])
    assert better_variant(rank_variants(image, recoloured))[0] == "facies 0 and facies 1 exchanged"


@pytest.mark.parametrize("steps", [*product((False, True), range(4))])
def test_a_variant_is_the_image_that_its_choice_gives(steps):
    """Test all variants of the image in all eight positions in which it may be already."""
    flipped, quarters = steps
    choice = ImageChoice(flip_ew=flipped)
    for _ in range(quarters):
        choice = choice.rotated
    names = set()
    for variant in _variants(image_of(choice)):
        if (other := choice.variant(variant.name)) != choice or variant.name == AS_GIVEN:
            np.testing.assert_array_equal(image_of(other).array, variant.array)
            names.add(variant.name)
    assert len(names) == 8


def test_a_variant_of_a_volume_keeps_its_layers():
    image = TrainingImage(np.arange(24).reshape(2, 3, 4) % 5)
    assert {variant.array.shape[0] for variant in _variants(image)} == {2}
