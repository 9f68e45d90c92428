"""Test that the reference implementation of the benchmarks equals the kernels cell by cell."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from benchmarks import reference
from benchmarks.__main__ import main
from benchmarks.cases import CASES, Case, Row, measure
from benchmarks.quality import distance_of_all_phases
from benchmarks.table import load, save, table, warnings
from ccwsim import Parameters, TrainingImage, datasets, simulate
from ccwsim.engine.corrections.refinement import refine_place
from ccwsim.engine.stages.bits import make_strips, take_strips, to_square_bits
from ccwsim.engine.stages.cut import keep_old, make_cut
from ccwsim.engine.stages.path import UNKNOWN, Box
from ccwsim.engine.stages.pyramid import build_pyramid
from ccwsim.engine.stages.similarity import (
    make_terms,
    overlap_energies,
    overlap_terms,
    running_squares,
    running_sums,
    score_places,
    score_type,
)
from ccwsim.metrics import pattern_distance

SHAPES = st.sampled_from([(True, False), (False, True), (True, True)])
"""Overlap on the left, at the top, or both."""


def bits(left: bool, top: bool) -> int:
    return (1 if left else 0) | (2 if top else 0)


def kernel_scores(image, tile, level, template, overlap, shape, n_facies):
    sums = build_pyramid(image[None], (0, level, level), n_facies if n_facies > 2 else 1).sums
    size, width, unit = (1, template, template), (0, overlap, overlap), 2**level
    kind = score_type((0, level, level), size, width)
    n_places = (n - template // unit + 1 for n in sums[0, 0].shape)
    box = Box(0, 0, 0, *size, shape, *width)
    energy = np.empty((1, *n_places), kind)
    overlap_energies(running_squares(sums, kind), box, (1, unit, unit), energy)
    running = running_sums(sums, (0, level, level), size)
    terms = make_terms(running, size, width, (1, unit, unit))
    n_groups = overlap_terms(tile[None], box, (1, unit, unit), running, terms)
    scores = np.empty_like(energy)
    score_places(running, 0, np.zeros((0, 0, 2), np.int64), terms, n_groups, energy, scores)
    return scores[0]


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32), level=st.integers(0, 3), n_facies=st.integers(2, 4),
    sizes=st.sampled_from([(16, 8), (24, 8), (32, 8), (32, 16)]), sides=SHAPES,
    extra=st.tuples(st.integers(0, 21), st.integers(0, 21)),
)  # fmt: skip
def test_score_maps_are_those_of_the_kernels(seed, level, n_facies, sizes, sides, extra):
    (template, overlap), (left, top) = sizes, sides
    rng = np.random.default_rng(seed)
    image = rng.integers(0, n_facies, (template + extra[0], template + extra[1]), np.uint8)
    tile = rng.integers(0, n_facies, (template, template), np.uint8)
    unit = 2**level
    mask = reference.overlap_mask(template, overlap, left, top)
    ours = reference.score_map(
        reference.block_sums(image, level, n_facies),
        reference.block_sums(tile, level, n_facies),
        mask[::unit, ::unit],
    )
    theirs = kernel_scores(image, tile, level, template, overlap, bits(left, top), n_facies)
    np.testing.assert_array_equal(ours, theirs)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32), overlap=st.integers(1, 8), sides=SHAPES)
def test_cuts_are_those_of_the_kernels(seed, overlap, sides):
    rng = np.random.default_rng(seed)
    old, new = rng.integers(0, 2, (2, 16, 16), np.uint8)
    size, width = (1, 16, 16), (0, overlap, overlap)
    no_data, cut = np.full(size, UNKNOWN, np.uint8), make_cut(size, width)
    box = Box(0, 0, 0, *size, bits(*sides), *width)
    keep_old(old[None], no_data, new[None], (0, 0, 0), box, cut)
    expected = reference.kept_cells(old, new, overlap, *sides)
    np.testing.assert_array_equal(expected, cut.keep_mask[0])


@given(seed=st.integers(0, 2**32), level=st.integers(1, 3), sides=SHAPES)
def test_refined_places_are_those_of_the_kernel(seed, level, sides):
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 2, (40, 43), np.uint8)
    tile = rng.integers(0, 2, (16, 16), np.uint8)
    size, unit = (1, 16, 16), 2**level
    place = int(rng.integers(25)) // unit * unit, int(rng.integers(28)) // unit * unit
    mask = reference.overlap_mask(16, 8, *sides)
    words = to_square_bits(image[None])
    box, strips = Box(0, 0, 0, *size, bits(*sides), 0, 8, 8), make_strips(words, size)
    take_strips(tile[None], box, words, strips)
    _, *theirs = refine_place(
        *(image[None], words, box, (1, unit, unit), (0, *place), strips),
        *(np.zeros((0, 4), int), 0),
    )
    assert [0, *reference.refined(image, tile, mask, place, unit)] == theirs


@pytest.mark.slow
def test_the_reference_makes_realizations_as_good_as_the_kernels_of_the_published_method():
    ti, shape, n = datasets.load("channels"), (256, 200), 16
    p = Parameters(wavelet_level=2, repair_seams=False, published_draw=True)
    theirs = simulate(ti, shape, p, n_realizations=n)
    own = np.stack([reference.simulate_reference(ti, shape, p, seed)[0] for seed in range(n)])
    distances = [pattern_distance(r, ti).mean(axis=0) for r in (own, theirs)]
    np.testing.assert_allclose(distances[0], distances[1], rtol=0.4)  # about 4 standard errors


def test_a_constant_image_gives_a_constant_reference():
    for value in (0, 3):
        ti = TrainingImage(np.full((40, 40), value))
        image, seconds = reference.simulate_reference(ti, (50, 70), Parameters(), 1)
        assert image.shape == (50, 70)
        assert (image == 0).all()
        assert seconds > 0


@pytest.mark.slow
@pytest.mark.parametrize("conditional", [False, True])
def test_a_case_is_measured(conditional):
    row = measure(Case(3, conditional), n_realizations=1, n_reference=1)
    assert row.ms > 0
    assert (row.data > 0) == conditional
    assert (row.reference_ms is None) == conditional


def test_measurements_survive_the_file_and_are_compared_row_by_row(tmp_path):
    rows = [Row(0, c.level, 10.0, 500.0, None) for c in CASES if not c.conditional]
    rows += [Row(400, 1, 40.0, None, 250.0)]
    save(tmp_path / "b.json", "an image", rows)
    assert load(tmp_path / "b.json") == ("an image", rows)
    slower = [Row(r.data, r.level, 2 * r.ms, r.reference_ms, r.memory_mb) for r in rows]
    last = table(slower, rows).splitlines()[-1].split("|")
    assert [float(cell) for cell in last[-3:-1]] == [40.0, 0.5]
    assert warnings("an image", rows, "an image", rows) == []
    assert "another" in "".join(warnings("one", rows, "another", rows))


@pytest.mark.parametrize("content", ["", "[]", '{"rows": []}', '{"rows": [{"a": 1}]}'])
def test_a_file_that_holds_no_measurements_is_refused(tmp_path, capsys, content):
    file = tmp_path / "b.json"
    file.write_text(content)
    with pytest.raises(SystemExit) as stopped:
        main(["--against", str(file)])
    assert stopped.value.code == 2
    assert "no measurements" in capsys.readouterr().err


def test_in_all_phases_an_image_is_as_near_to_itself_wherever_it_begins():
    ti = datasets.load("stone_wall")
    array = np.asarray(ti.array)
    shifted = array[1:, :-1]
    apart = pattern_distance(shifted, ti, factors=(2, 3))[0]
    near = [distance_of_all_phases(shifted[None], ti, factor) for factor in (2, 3)]
    assert (np.array(near) < apart / 10).all()
    other = np.asarray(datasets.load("channels").array)
    same = pattern_distance(other, ti, factors=(1,))[0, 0]
    assert distance_of_all_phases(other[None], ti, 1) == pytest.approx(same)


@pytest.mark.parametrize(
    "path", sorted(Path(reference.__file__).parent.glob("*.py")), ids=lambda path: path.stem
)
def test_each_benchmark_finds_what_it_measures(path):
    importlib.import_module(f"benchmarks.{path.stem}")
