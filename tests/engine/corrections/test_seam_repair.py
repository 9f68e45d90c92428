"""Test that seam repair reduces unseen patterns, keeps data, and copies cells from the image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from ccwsim import Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.engine.corrections.resimulation import Target
from ccwsim.engine.corrections.seam_repair import (
    MIN_UNSEEN,
    Repair,
    make_repair_workspace,
    prepare_repair,
    repair_seams,
    well_fitting_windows,
    window_lengths,
)
from ccwsim.engine.corrections.unseen_patterns import ROW_SPACING, n_unseen, unseen_places
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import Realization, simulate_realization, target_of
from ccwsim.engine.stages.bits import to_bits, to_square_bits
from ccwsim.engine.stages.path import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, UNKNOWN, Box
from ccwsim.model.sizes import Triple
from ccwsim.model.study import Study
from ccwsim.model.watch import Watch
from tests.small_images import blobs, noise

MAP, VOLUME = (1, 70, 83), (12, 30, 33)
SHAPES = [MAP, VOLUME]


def patterns_of(cells: NDArray[np.uint8], repair: Repair) -> NDArray[np.uint8]:
    """Return all patterns of an array in layers, one per row, by the position of the pattern."""
    p = repair.patterns
    span = tuple((n - 1) * p.spacing + 1 for n in p.size)
    steps = tuple(slice(None, None, p.spacing) for _ in span)
    windows = np.lib.stride_tricks.sliding_window_view(cells, span)
    return windows[(..., *steps)].reshape(*windows.shape[:3], -1)


def unseen(cells: NDArray[np.uint8], image: NDArray[np.uint8], repair: Repair) -> NDArray[np.bool_]:
    """Return the positions of the patterns that are absent from the image, found one by one."""
    known = {
        row.tobytes()
        for row in patterns_of(image, repair).reshape(-1, 16 if image.shape[0] == 1 else 27)
    }
    found = patterns_of(cells, repair)
    flat = [row.tobytes() not in known for row in found.reshape(-1, found.shape[-1])]
    return np.array(flat).reshape(found.shape[:3])


def prepared(shape: tuple[int, int, int], n_facies: int) -> tuple[NDArray[np.uint8], Repair]:
    image = blobs(shape, n_facies)
    template = (1, 24, 24) if shape[0] == 1 else (8, 16, 16)
    return image, repair_of(image, template, (shape[0], 60, 50), n_facies)


def repair_of(
    image: NDArray[np.uint8], template: Triple, grid_shape: Triple, n_facies: int
) -> Repair:
    room = tuple(min(a, b) for a, b in zip(image.shape, grid_shape, strict=True))
    no_gaps = np.zeros((0, 0, 0), np.int64)
    return prepare_repair(image, template, room, n_facies, len(image) > 1, no_gaps)  # type: ignore[arg-type]


def as_target(image: NDArray[np.uint8], grid: NDArray[np.uint8], data: NDArray[np.uint8]) -> Target:
    """Return a realization to correct, without sources."""
    bits = to_bits(image), to_square_bits(image)
    no_sources, balance = np.zeros((0, 0, 0), np.int32), np.zeros(int(image.max()) + 1, np.int64)
    return Target(image, *bits, data, grid, no_sources, balance, volume=len(image) > 1)


@pytest.mark.parametrize("n_facies", [2, 3, 5])
@pytest.mark.parametrize("shape", SHAPES)
def test_patterns_that_the_image_never_has_are_counted(shape, n_facies):
    image, repair = prepared(shape, n_facies)
    trial = make_repair_workspace(repair, as_target(image, image, image)).trial
    size = trial.facies.shape
    rng = np.random.default_rng(1)
    other = blobs((shape[0], 40, 41), n_facies, 7)
    other[rng.random(other.shape) < 0.02] = 0
    for _ in range(12):
        first = [
            int(rng.integers(0, max(n - m, 0) + 1)) for n, m in zip(other.shape, size, strict=True)
        ]
        n = [min(n, m) for n, m in zip(other.shape, size, strict=True)]
        part = other[tuple(slice(k, k + m) for k, m in zip(first, n, strict=True))]
        trial.facies[: n[0], : n[1], : n[2]] = part
        wanted = int(unseen(part, image, repair).sum())
        given = Box(0, 0, 0, *n, 0, 0, 0, 0), repair.patterns, trial.rows, trial.numbers
        found = n_unseen(trial.facies, *given, 1 << 30)
        exact = repair.patterns.shift == 0
        assert found <= wanted
        assert found == wanted if exact else found > 0.9 * wanted - 3
        assert n_unseen(trial.facies, *given, 3) >= min(found, 3)


@pytest.mark.parametrize("n_facies", [2, 4])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_image_has_all_its_own_patterns(shape, n_facies):
    image, repair = prepared(shape, n_facies)
    assert len(unseen_places(image, repair.patterns, repair.window, repair.least)) == 0


@pytest.mark.parametrize("shape", SHAPES)
def test_the_worst_places_come_first_and_lie_among_their_patterns(shape):
    image, repair = prepared(shape, 2)
    grid = blobs((shape[0], 60, 50), 2, 8)
    grid[:, 20:24, 10:14] = noise((shape[0], 4, 4), 2)
    bad = unseen(grid, image, repair)
    part = [max(n // 2, 1) for n in repair.window]
    reach = [(n - 1) * repair.patterns.spacing for n in repair.patterns.size]
    every = ROW_SPACING if shape[0] == 1 else 1
    wanted = {}
    for at in np.argwhere(bad):
        if at[1] % part[1] % every == 0:
            wanted.setdefault(tuple(at // part), []).append(at)
    wanted = {key: own for key, own in wanted.items() if every * len(own) >= repair.least}
    found = unseen_places(grid, repair.patterns, repair.window, repair.least)
    middles = {
        tuple((np.sum(own, axis=0) // len(own) + np.array(reach) // 2).tolist()): len(own)
        for own in wanted.values()
    }
    # if numbers are not unique, an unseen pattern may count as known
    counts = [middles[place] for place in map(tuple, found.tolist()) if place in middles]
    assert counts == sorted(counts, reverse=True)
    assert len(counts) > 0.95 * len(wanted)
    if repair.patterns.shift == 0:
        assert len(counts) == len(found) == len(wanted)


@pytest.mark.slow
@pytest.mark.parametrize("n_facies", [2, 3])
@pytest.mark.parametrize("shape", SHAPES)
def test_windows_are_compared_by_their_ring(shape, n_facies):
    """Test that scores are the squared differences of block sums in the ring of a window."""
    image, repair = prepared(shape, n_facies)
    grid = blobs((shape[0], 60, 50), n_facies, 9)
    rng = np.random.default_rng(0)
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    target = as_target(image, grid, data)
    work = make_repair_workspace(repair, target)
    (nz, ny, nx), (oz, oy, ox) = repair.window, repair.ring
    sides = LEFT | RIGHT | TOP | BOTTOM | (BELOW | ABOVE if oz else 0)
    box = Box(0, 11, 13, nz, ny, nx, sides, oz, oy, ox)
    assert well_fitting_windows(target, box, repair, rng, work) == len(work.ranking.places)
    old = grid[:nz, 11 : 11 + ny, 13 : 13 + nx]
    inside = np.ones(old.shape, bool)
    inside[oz : nz - oz, oy : ny - oy, ox : nx - ox] = False
    uz, uy, ux = repair.block

    def sums(cells: NDArray) -> NDArray:
        blocks = cells.reshape(nz // uz, uz, ny // uy, uy, nx // ux, ux)
        return blocks.sum(axis=(1, 3, 5))

    facies = [1] if n_facies == 2 else range(n_facies)
    energy = sum(int((sums((old == f) & inside) ** 2).sum()) for f in facies)
    for _ in range(20):
        at = [int(rng.integers(n)) for n in work.scores.shape]
        z, y, x = (k * b for k, b in zip(at, repair.block, strict=True))
        new = image[z : z + nz, y : y + ny, x : x + nx]
        ssd = sum(
            int((sums((old == f) & inside) - sums((new == f) & inside)).__pow__(2).sum())
            for f in facies
        )
        if work.scores.shape[0] == repair.energy.shape[0]:  # the whole image was searched
            assert work.scores[tuple(at)] + energy == ssd


def realized(study: Study) -> tuple[Realization, Realization]:
    """Return a realization without and with seam repair, after the same raster pass."""
    image = PreparedImage(study)
    off = replace(study, parameters=replace(study.parameters, repair_seams=False))
    watch = Watch()
    plain = simulate_realization(PreparedImage(off), 0, True, watch)
    return plain, simulate_realization(image, 0, True, watch)


@pytest.mark.parametrize("n_data", [0, 30, 300])
@pytest.mark.parametrize("shape", [(60, 70), (9, 30, 34)])
def test_repair_leaves_fewer_unseen_patterns_and_all_data(shape, n_data):
    volume = len(shape) == 3
    image = TrainingImage(blobs((15, 40, 44) if volume else (90, 110), 3))
    rng = np.random.default_rng(n_data)
    flat = rng.choice(int(np.prod(shape)), n_data, replace=False)
    cells = np.stack(np.unravel_index(flat, shape), axis=1)
    data = HardData(cells, image.codes[rng.integers(0, 3, n_data)])
    p = Parameters((4, 16, 16), (2, 4, 4), (0, 1, 1)) if volume else Parameters(16, 4, 1)
    study = Study(image, Grid.of(shape), p, data, 6)
    plain, own = realized(study)
    repair = PreparedImage(study).repair(p.along(shape).template)
    repair = repair._replace(patterns=repair.side_by_side)  # most changes are of single cells
    in_layers = (-1, *shape[-2:])
    source = image.indices.reshape(-1, *image.shape[-2:])
    before, after = (
        int(unseen(r.indices.reshape(in_layers), source, repair).sum()) for r in (plain, own)
    )
    assert after < before
    honoured = own.indices[tuple(study.hard_data.cells.T)]
    np.testing.assert_array_equal(honoured, study.facies_of_data)
    np.testing.assert_array_equal(own.data_status, plain.data_status)
    taken = own.sources >= 0
    np.testing.assert_array_equal(own.indices[taken], image.indices.ravel()[own.sources[taken]])
    assert (own.sources[plain.sources < 0] < 0).all()  # forced cells stay forced
    alone = (own.sources < 0) & (plain.sources >= 0)
    go_far = volume and n_data == 30  # few data that contradict the image, with long tabu searches
    assert alone.mean() < (0.2 if go_far else 0.12)
    assert not alone[tuple(study.hard_data.cells.T)].any()  # no cell with a datum has changed


@settings(max_examples=25, deadline=None)
@given(
    st.tuples(st.integers(1, 9), st.integers(1, 30), st.integers(1, 30)),
    st.tuples(st.integers(1, 9), st.integers(8, 30), st.integers(8, 30)),
    st.integers(1, 4),
    st.integers(0, 2**16),
)
def test_any_grid_and_any_image_will_do(grid_shape, image_shape, n_facies, seed):
    image = noise(image_shape, n_facies, seed)
    template = (min(image_shape[0], 4), 8, 8)
    repair = repair_of(image, template, grid_shape, n_facies)
    rng = np.random.default_rng(seed)
    grid = rng.integers(0, n_facies, grid_shape).astype(np.uint8)
    data = np.where(rng.random(grid_shape) < 0.1, grid, UNKNOWN).astype(np.uint8)
    target = as_target(image, grid, data)
    repair_seams(target, repair, 40, np.zeros((0, 3), np.int64), rng)
    assert (grid < n_facies).all()
    assert (grid[data != UNKNOWN] == data[data != UNKNOWN]).all()


@pytest.mark.slow
def test_windows_with_forced_cells_stay_as_they_are():
    image, repair = prepared(MAP, 2)
    grid = noise((1, 60, 50), 2)
    before = grid.copy()
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    target = as_target(image, grid, data)
    everywhere = np.argwhere(grid < 2)
    rng = np.random.default_rng(0)
    assert repair_seams(target, repair, 100, everywhere, rng) == 0
    np.testing.assert_array_equal(grid, before)
    assert repair_seams(target, repair, 100, everywhere[:0], rng) > 0


def test_it_can_be_stopped_and_tells_how_far_it_is():
    image, repair = prepared(MAP, 2)
    seen: list[float] = []

    def report(share: float, n_done: int) -> None:
        seen.append(share)
        if share > 0:
            raise InterruptedError

    grid = noise((1, 900, 900), 2)
    data = np.full(grid.shape, UNKNOWN, np.uint8)
    target = as_target(image, grid, data)
    with pytest.raises(InterruptedError):
        repair_seams(
            target,
            repair,
            10**6,
            np.zeros((0, 3), np.int64),
            np.random.default_rng(0),
            Watch(report),
        )
    assert seen == sorted(seen)


@pytest.mark.parametrize("t", [4, 6, 8, 12, 16, 20, 24, 32, 48, 64, 100])
def test_blocks_fill_windows_and_rings(t):
    for template in ((1, t, t), (t, t, t), (2, t, t)):
        for room in ((template[0], 200, 200), (template[0], t, t + 3)):
            window, ring, block = window_lengths(template, room)
            for w, r, b, most in zip(window, ring, block, room, strict=True):
                assert w % b == r % b == 0
                assert w <= most
                assert w > 2 * r


def test_nothing_is_repaired_where_it_is_switched_off_or_data_only_steer():
    image = TrainingImage(blobs((60, 60), 2))
    data = HardData([[5, 6], [30, 31]], [0, 1])
    steered = Parameters(16, 4, 1, exact_data=False)
    plain = replace(steered, repair_seams=False)
    for own in (data, None):
        a, b = (simulate(image, (70, 70), p, own, 3) for p in (steered, plain))
        assert np.array_equal(a.indices, b.indices) == (own is not None)
    assert MIN_UNSEEN > 1


def test_the_target_is_the_realization_itself():
    study = Study(
        TrainingImage(blobs((40, 40), 2)), Grid(20, 30), Parameters(16, 4, 1), HardData(), 0
    )
    indices = np.zeros((20, 30), np.uint8)
    target = target_of(PreparedImage(study), indices, np.zeros((0, 0), np.int32))
    target.grid[0, 3, 4] = 1
    assert indices[3, 4] == 1
