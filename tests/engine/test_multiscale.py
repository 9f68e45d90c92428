"""Test MS-CCSIM: coarsened images and data, and refinement of locations from scale to scale."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ccwsim import Cancelled, HardData, Parameters, TrainingImage, simulate
from ccwsim.engine.stages.pyramid import upgrid, upgrid_data
from ccwsim.metrics import connectivity, pattern_distance
from tests.small_images import blobs, noise

CODES = np.array([7, -12, 300])
THREE_FACIES = TrainingImage(CODES[blobs((45, 61), 3)])
SEEDS = st.integers(0, 2**20)


def multiscale(template: int = 16, overlap: int = 8, level: int = 2, **others) -> Parameters:
    return Parameters(template, overlap, level, method="ms-ccsim", **others)


def some_data(shape: tuple[int, int], n: int, seed: int = 0) -> HardData:
    rng = np.random.default_rng(seed)
    flat = rng.choice(shape[0] * shape[1], n, replace=False)
    return HardData(np.stack(np.divmod(flat, shape[1]), axis=1), rng.choice(CODES, n))


UNITS = st.tuples(st.integers(1, 4), st.integers(1, 4), st.integers(1, 4))


class TestUpgridding:
    @settings(deadline=None)
    @given(SEEDS, st.integers(1, 4), st.integers(1, 13), st.integers(1, 13), UNITS, st.booleans())
    def test_a_block_has_the_facies_of_most_of_its_cells(
        self, seed, n_facies, ny, nx, unit, volume
    ):
        rng = np.random.default_rng(seed)
        unit = unit if volume else (1, *unit[1:])
        nz = int(rng.integers(1, 9)) if volume else 1
        image = rng.integers(0, n_facies, (nz, ny, nx)).astype(np.uint8)
        coarse = upgrid(image, unit)
        assert coarse.shape == tuple(n // u for n, u in zip(image.shape, unit, strict=True))
        for at, facies in np.ndenumerate(coarse):
            own = tuple(slice(k * u, (k + 1) * u) for k, u in zip(at, unit, strict=True))
            block = image[own].ravel().tolist()
            counts = Counter(block)
            tied = [f for f in block if counts[f] == max(counts.values())]
            assert facies == tied[0]

    @pytest.mark.parametrize(
        ("shape", "unit"), [((1, 600, 600), (1, 2, 2)), ((60, 70, 80), (2, 2, 2))]
    )
    def test_no_facies_is_favoured_where_two_have_equally_many_cells(self, shape, unit):
        image = np.random.default_rng(0).integers(0, 2, shape).astype(np.uint8)
        assert upgrid(image, unit).mean() == pytest.approx(0.5, abs=0.01)
        np.testing.assert_array_equal(upgrid(1 - image, unit), 1 - upgrid(image, unit))

    @given(SEEDS, st.integers(0, 60), UNITS, st.booleans())
    def test_a_block_has_the_facies_of_most_of_its_data(self, seed, n, unit, volume):
        rng = np.random.default_rng(seed)
        shape, unit = ((6, 5, 9), unit) if volume else ((1, 12, 9), (1, *unit[1:]))
        flat = rng.choice(np.prod(shape), n, replace=False)
        cells = np.stack(np.unravel_index(flat, shape), axis=1)
        facies = rng.integers(0, 3, n).astype(np.uint8)
        blocks, own = upgrid_data(cells, facies, unit)
        found = dict(zip(map(tuple, blocks.tolist()), own.tolist(), strict=True))
        assert len(found) == len(blocks)
        for block, chosen in found.items():
            here = [k for k in range(n) if tuple(cells[k] // unit) == block]
            here.sort(key=lambda k: tuple(cells[k]))
            counts = Counter(facies[here].tolist())
            assert chosen == next(
                facies[k] for k in here if counts[facies[k]] == max(counts.values())
            )
        assert set(found) == {tuple(cell) for cell in (cells // unit).tolist()}


SIDES, SHARES = st.integers(1, 70), st.sampled_from([0.0, 0.02, 0.3, 1.0])
SIZES = st.sampled_from([(16, 8, 3), (16, 4, 2), (8, 2, 1)])


@pytest.mark.slow
@given(SEEDS, SIDES, SIDES, SHARES, SIZES, st.booleans())
def test_data_are_honoured_on_any_grid_however_they_contradict(seed, ny, nx, share, sizes, refine):
    n = round(share * ny * nx)
    data = some_data((ny, nx), n, seed)
    p = multiscale(*sizes, refine=refine)
    ensemble = simulate(THREE_FACIES, (ny, nx), p, data, n_realizations=2, seed=seed)
    assert ensemble.n_mismatched.tolist() == [0, 0]
    assert np.isin(ensemble.realizations, CODES).all()
    assert ensemble.n_wrong.tolist() == [0, 0]


@pytest.mark.parametrize("n_data", [0, 80])
def test_the_number_of_workers_does_not_change_the_result(n_data):
    data = some_data((70, 53), n_data)
    p = multiscale(template_variation=0.3)
    one, three = (simulate(THREE_FACIES, (70, 53), p, data, 5, seed=9, n_workers=n) for n in (1, 3))
    np.testing.assert_array_equal(one.indices, three.indices)
    np.testing.assert_array_equal(one.data_status, three.data_status)
    assert len({r.tobytes() for r in one.realizations}) == 5


@pytest.mark.parametrize("n_data", [0, 80])
def test_without_scales_it_is_ccsim(n_data):
    data = some_data((70, 53), n_data)
    cells = Parameters(16, 8, 2, method="ccsim")
    one = simulate(THREE_FACIES, (70, 53), multiscale(level=0), data, 3)
    other = simulate(THREE_FACIES, (70, 53), cells, data, 3)
    np.testing.assert_array_equal(one.indices, other.indices)


@pytest.mark.parametrize("n_data", [0, 40])
def test_realizations_do_not_depend_on_how_facies_are_numbered(n_data):
    data = some_data((50, 47), n_data)
    renamed = {7: 2, -12: 40, 300: -1}
    other_data = HardData(data.cells, [renamed[code] for code in data.facies.tolist()])
    other = TrainingImage(np.vectorize(renamed.get)(THREE_FACIES.array))
    one = simulate(THREE_FACIES, (50, 47), multiscale(), data, 3)
    two = simulate(other, (50, 47), multiscale(), other_data, 3)
    np.testing.assert_array_equal(np.vectorize(renamed.get)(one.realizations), two.realizations)


@pytest.mark.parametrize("level", [1, 2, 3])
def test_a_constant_image_gives_constant_realizations(level):
    ti = TrainingImage(np.full((35, 41), -3))
    ensemble = simulate(ti, (50, 33), multiscale(level=level), HardData([[4, 4]], [-3]))
    assert (ensemble.realizations == -3).all()


@pytest.mark.parametrize("shape", [(16, 16), (5, 3)])
def test_a_grid_within_one_template_is_a_piece_of_the_image_that_the_sources_tell(shape):
    ti = TrainingImage(noise((37, 29), 3))
    ensemble = simulate(ti, shape, multiscale(), n_realizations=6, keep_sources=True)
    assert ensemble.sources is not None
    np.testing.assert_array_equal(ti.array.ravel()[ensemble.sources], ensemble.realizations)


def test_sources_tell_where_each_cell_came_from_over_all_tiles():
    ensemble = simulate(THREE_FACIES, (90, 71), multiscale(), None, 4, keep_sources=True)
    assert ensemble.sources is not None
    taken = ensemble.sources >= 0
    assert taken.mean() > 0.94  # seam repair changes single cells
    np.testing.assert_array_equal(
        THREE_FACIES.array.ravel()[ensemble.sources[taken]], ensemble.realizations[taken]
    )


@pytest.mark.slow
def test_progress_never_goes_back_and_cancel_stops_within_a_realization():
    seen: list[float] = []
    study = THREE_FACIES, (700, 700), multiscale(), None, 2
    simulate(*study, progress=lambda share, _: seen.append(share))
    assert seen == sorted(seen)
    assert seen[-1] == 1
    with pytest.raises(Cancelled, match="0 of 1"):
        simulate(THREE_FACIES, (3000, 3000), multiscale(), cancel=lambda: True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("level", "most", "least"),
    [
        (1, (0.0025, 0.015, 0.045), 0.87),
        (2, (0.0040, 0.0180, 0.0525), 0.79),
        (3, (0.0075, 0.0265, 0.0700), 0.57),
    ],
)
def test_patterns_and_connection_are_in_the_range_of_the_published_code(
    data_dir: Path, level, most, least
):
    """Test against limits from published realizations and the variation of ten realizations."""
    ti = TrainingImage(np.load(data_dir / "paper" / "ti_channel_256x256.npy"))
    p = Parameters(wavelet_level=level, method="ms-ccsim")
    realizations = simulate(ti, (512, 512), p, n_realizations=10).indices
    assert (pattern_distance(realizations, ti).mean(axis=0) < most).all()
    own = connectivity(realizations, 1, "E-W", (81,)).tau.mean(axis=0)
    assert own / connectivity(ti.indices, 1, "E-W", (81,)).tau.mean(axis=0) > least
