"""Test the properties of a simulation that hold for any image, grid and data."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ccwsim import (
    Cancelled,
    CCWSIMError,
    Ensemble,
    Grid,
    HardData,
    Parameters,
    TrainingImage,
    simulate,
)
from ccwsim.engine.prepared_image import PreparedImage
from tests.small_images import blobs, noise, places_of

SMALL = Parameters(template_size=16, overlap_size=4, wavelet_level=1, n_candidates=5)
TWO_FACIES = TrainingImage(blobs((45, 61), 2))
SIZES = [(16, 4, 0), (16, 4, 1), (16, 8, 2), (16, 8, 3), (32, 16, 4)]

shapes = st.tuples(st.integers(1, 60), st.integers(1, 60))


def some_data(shape: tuple[int, int], codes: np.ndarray, n: int, seed: int = 0) -> HardData:
    rng = np.random.default_rng(seed)
    flat = rng.choice(shape[0] * shape[1], min(n, shape[0] * shape[1]), replace=False)
    return HardData(np.stack(np.divmod(flat, shape[1]), axis=1), rng.choice(codes, len(flat)))


def same(one: Ensemble, other: Ensemble) -> bool:
    return np.array_equal(one.realizations, other.realizations)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(st.integers(4, 40), st.integers(4, 40)),
    shapes,
    st.integers(1, 5),
    st.sampled_from(SIZES),
    st.integers(0, 60),
    st.fixed_dictionaries(
        {
            "n_candidates": st.sampled_from([1, 20, 10**6]),
            "method": st.sampled_from(["ccwsim", "ccsim", "ms-ccsim"]),
            "similarity": st.sampled_from(["ssd", "correlation"]),
            "search_fraction": st.floats(1e-6, 1),
            "co_template": st.integers(1, 4),
            "random_path": st.booleans(),
            "template_variation": st.sampled_from([0.0, 0.1, 0.5]),
            "match_proportions": st.booleans(),
            "refine": st.booleans(),
        }
    ),
)
def test_any_valid_study_is_simulated_and_honours_its_data_or_says_why_not(
    image_shape, grid_shape, n_facies, sizes, n_data, options
):
    template, overlap, level = sizes
    p = Parameters(template, overlap, level, **options)
    ti = TrainingImage(noise(image_shape, n_facies))
    data = some_data(grid_shape, ti.codes, n_data)
    if template > min(image_shape):
        with pytest.raises(CCWSIMError, match="larger than the training image"):
            simulate(ti, grid_shape, p, data)
        return
    ensemble = simulate(ti, grid_shape, p, data, n_realizations=2)
    assert ensemble.realizations.shape == (2, *grid_shape)
    assert np.isin(ensemble.realizations, ti.codes).all()
    rows, columns = data.cells.T
    assert (ensemble.realizations[:, rows, columns] == data.facies).all()
    assert ensemble.n_mismatched.tolist() == [0, 0]


@pytest.mark.parametrize("code", [0, 7, -3])
@pytest.mark.parametrize("similarity", ["ssd", "correlation"])
@pytest.mark.parametrize(("template", "overlap", "level"), SIZES)
def test_a_constant_image_gives_constant_realizations(template, overlap, level, similarity, code):
    p = Parameters(template, overlap, level, similarity=similarity)
    ti = TrainingImage(np.full((35, 41), code))
    ensemble = simulate(ti, (50, 33), p, HardData([[4, 4]], [code]), n_realizations=2)
    assert (ensemble.realizations == code).all()


@settings(max_examples=40, deadline=None)
@given(shapes, st.sampled_from([(6, 1), (4, 2), (8, 3)]))
def test_patches_cover_every_cell_of_the_grid(shape, overlap_and_level):
    image = np.full((17, 17), 7)
    image[16, 16] = 0  # fills no block, so no patch contains the cell
    p = Parameters(16, *overlap_and_level, random_path=False, refine=False)
    assert (simulate(TrainingImage(image), shape, p).realizations == 7).all()


@pytest.mark.parametrize("shape", [(1, 1), (5, 3), (16, 2), (3, 16), (16, 16)])
def test_a_grid_within_one_template_is_a_piece_of_the_image(shape):
    ti = TrainingImage(noise((37, 29), 3))
    own = replace(SMALL, published_draw=True)  # otherwise the first patch begins before the grid
    for realization in simulate(ti, shape, own, n_realizations=8).realizations:
        assert len(places_of(realization, ti.array)) >= 1


@pytest.mark.parametrize(("template", "overlap", "level"), SIZES)
def test_an_image_of_just_the_template_is_laid_again_and_again(template, overlap, level):
    ti = TrainingImage(noise((template, template), 3))
    p = Parameters(template, overlap, level, random_path=False)
    realization = simulate(ti, (3 * template, 2 * template), p).realizations[0]
    step = template - overlap
    for y in range(0, 2 * template, step):
        inner = realization[y + overlap : y + step, overlap:step]
        np.testing.assert_array_equal(inner, ti.array[overlap:step, overlap:step])


@pytest.mark.parametrize("n_data", [0, 60])
@pytest.mark.parametrize("n_facies", [2, 3, 5])
@pytest.mark.parametrize("match", [False, True])
@pytest.mark.parametrize("level", [0, 2])
def test_realizations_do_not_depend_on_how_facies_are_numbered(n_facies, match, level, n_data):
    p = Parameters(16, 4, level, match_proportions=match)
    image = blobs((45, 61), n_facies)
    data = some_data((50, 47), np.arange(n_facies), n_data)
    names = np.array([7, -12, 1000, 2, -1][:n_facies])
    plain = simulate(TrainingImage(image), (50, 47), p, data, 4, seed=3)
    same_data = HardData(data.cells, names[data.facies])
    renamed = simulate(TrainingImage(names[image]), (50, 47), p, same_data, 4, seed=3)
    np.testing.assert_array_equal(names[plain.realizations], renamed.realizations)


@pytest.mark.parametrize("n_facies", [1, 2, 5])
def test_all_facies_of_a_balanced_image_are_simulated(n_facies):
    ti = TrainingImage(10 * blobs((64, 64), n_facies))
    ensemble = simulate(ti, (97, 121), SMALL, n_realizations=3)
    np.testing.assert_array_equal(np.unique(ensemble.realizations), ti.codes)
    assert np.abs(ensemble.proportions.mean(axis=0) - ti.proportions).max() < 0.15


VARIED = Parameters(16, 4, 1, template_variation=0.4, match_proportions=True)


@pytest.mark.parametrize("parameters", [SMALL, VARIED])
@pytest.mark.parametrize("n_data", [0, 60])
def test_the_number_of_workers_does_not_change_the_result(parameters, n_data):
    data = some_data((70, 53), TWO_FACIES.codes, n_data)
    one, two, three = (
        simulate(TWO_FACIES, (70, 53), parameters, data, 7, seed=5, n_workers=n) for n in (1, 2, 3)
    )
    assert same(one, two)
    assert same(one, three)
    np.testing.assert_array_equal(one.data_status, three.data_status)


def test_a_realization_does_not_depend_on_how_many_are_asked_for():
    few = simulate(TWO_FACIES, (70, 53), VARIED, n_realizations=3, seed=8)
    many = simulate(TWO_FACIES, (70, 53), VARIED, n_realizations=9, seed=8)
    np.testing.assert_array_equal(few.realizations, many.realizations[:3])


def test_seeds_and_numbers_give_different_realizations():
    one = simulate(TWO_FACIES, (70, 53), SMALL, n_realizations=4, seed=0)
    other = simulate(TWO_FACIES, (70, 53), SMALL, n_realizations=4, seed=1)
    assert len({r.tobytes() for r in (*one.realizations, *other.realizations)}) == 8


def test_a_grid_may_be_given_with_its_place_in_the_world():
    grid = Grid(20, 30, cell_size=(5.0, 5.0), origin=(100.0, 50.0))
    ensemble = simulate(TWO_FACIES, grid, SMALL)
    assert ensemble.grid == grid
    assert same(ensemble, simulate(TWO_FACIES, (20, 30), SMALL))


def test_the_inputs_are_not_changed():
    data = some_data((30, 30), TWO_FACIES.codes, 20)
    before = TWO_FACIES.array.copy(), data.cells.copy(), data.facies.copy()
    simulate(TWO_FACIES, (30, 30), SMALL, data, 2)
    after = TWO_FACIES.array, data.cells, data.facies
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one, other)


NONSENSE = {
    "n_realizations": (0, 2.0, None),
    "n_workers": (0, -1, "all"),
    "seed": (-1, 2.0),
    "grid_shape": ((0, 5), "large"),
    "parameters": ("ccwsim",),
    "hard_data": ("none",),
}


@pytest.mark.parametrize(
    ("name", "value"), [(name, value) for name, values in NONSENSE.items() for value in values]
)
def test_arguments_that_make_no_sense_are_refused_by_name(name, value):
    arguments = {"grid_shape": (20, 20), "parameters": SMALL, name: value}
    said = name.removesuffix("_shape").replace("hard_", "hard.")  # name in the message
    with pytest.raises(CCWSIMError, match=said):
        simulate(TWO_FACIES, **arguments)


@pytest.mark.parametrize(
    ("name", "value"),
    [("hard_data", np.zeros((3, 3))), ("hard_data", []), ("parameters", {}), ("parameters", 0)],
)
def test_empty_values_of_another_type_do_not_pass_for_none(name, value):
    arguments = {"grid_shape": (20, 20), "parameters": SMALL, name: value}
    with pytest.raises(CCWSIMError, match=name.replace("_", ".")):
        simulate(TWO_FACIES, **arguments)


@pytest.mark.parametrize("shape", [(10**8, 10**8), (10**30, 10)])
def test_a_grid_that_no_memory_holds_is_refused(shape):
    with pytest.raises(CCWSIMError, match=r"do not fit into memory|must be a whole number"):
        simulate(TWO_FACIES, shape, SMALL)


class TestProgress:
    @pytest.mark.parametrize("n_data", [0, 200])
    @pytest.mark.parametrize("workers", [1, 2])
    def test_it_never_goes_back_and_ends_at_all(self, workers, n_data):
        seen: list[tuple[float, int]] = []
        data = some_data((400, 400), TWO_FACIES.codes, n_data)
        study = TWO_FACIES, (400, 400), SMALL, data, 12
        simulate(*study, n_workers=workers, progress=lambda *now: seen.append(now))
        fractions, done = zip(*seen, strict=True)
        assert list(fractions) == sorted(fractions)
        assert list(done) == sorted(done)
        assert seen[-1] == (1.0, 12)
        assert min(fractions) >= 0

    @pytest.mark.slow
    def test_it_moves_within_one_large_realization(self):
        seen: list[float] = []
        simulate(
            TWO_FACIES, (3000, 3000), SMALL, progress=lambda fraction, _: seen.append(fraction)
        )
        assert any(0 < fraction < 1 for fraction in seen)

    def test_an_error_of_the_callback_reaches_the_caller(self):
        def broken(fraction: float, n_done: int) -> None:
            raise RuntimeError("the page was closed")

        with pytest.raises(RuntimeError, match="closed"):
            simulate(TWO_FACIES, (50, 50), SMALL, n_realizations=5, progress=broken)


class TestCancel:
    @pytest.mark.parametrize("n_data", [0, 50_000])
    def test_it_stops_within_one_large_realization(self, n_data):
        study = TWO_FACIES, (3000, 3000), SMALL, some_data((3000, 3000), TWO_FACIES.codes, n_data)
        seen: list[float] = []
        with pytest.raises(Cancelled, match="0 of 1") as stopped:
            simulate(*study, progress=lambda share, _: seen.append(share), cancel=lambda: True)
        assert stopped.value.ensemble is None
        assert len(seen) == 1

    @pytest.mark.slow
    def test_what_was_finished_is_handed_over(self):
        done = [0]

        def note(fraction: float, n_done: int) -> None:
            done[0] = n_done

        data = some_data((90, 80), TWO_FACIES.codes, 10)
        study = TWO_FACIES, (90, 80), SMALL, data
        with pytest.raises(Cancelled) as stopped:
            simulate(*study, 5000, 6, 1, progress=note, cancel=lambda: done[0] >= 2)
        ensemble = stopped.value.ensemble
        assert ensemble is not None
        assert 2 <= ensemble.n < 5000
        assert f"{ensemble.n} of 5000" in str(stopped.value)
        assert same(ensemble, simulate(*study, ensemble.n, seed=6))
        assert ensemble.cpu_seconds.shape == (ensemble.n,)
        assert ensemble.data_status.shape == (ensemble.n, data.n)

    def test_no_thread_goes_on_afterwards(self):
        before = set(threading.enumerate())  # of which some may end meanwhile
        with pytest.raises(Cancelled):
            simulate(TWO_FACIES, (2000, 2000), SMALL, n_realizations=50, cancel=lambda: True)
        assert set(threading.enumerate()) <= before

    def test_it_changes_nothing_where_it_is_never_true(self):
        one = simulate(TWO_FACIES, (50, 50), SMALL, n_realizations=3)
        assert same(one, simulate(TWO_FACIES, (50, 50), SMALL, None, 3, cancel=lambda: False))


def test_a_realization_counts_the_preparation_of_the_image(monkeypatch):
    """Test that the CPU time of a realization includes the preparation of the image.

    Only the CPU time of the simulating thread counts, so no other thread may prepare anything.
    """
    simulate(TWO_FACIES, (50, 50), SMALL)  # compiled
    threads, own = [], PreparedImage.part

    def part(image, key, make):
        threads.append(threading.current_thread())
        return own(image, key, make)

    monkeypatch.setattr(PreparedImage, "part", part)
    simulate(TWO_FACIES, (50, 50), SMALL, n_realizations=3, n_workers=1)
    assert threads
    assert len({*threads}) == 1
    assert threading.main_thread() not in threads
