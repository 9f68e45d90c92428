"""Test that the paper's method gives the same cells as an independent program of 170 lines."""

from __future__ import annotations

import runpy
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import pywt

from ccwsim import (
    CCWSIMError,
    Grid,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
    datasets,
    simulate,
)
from ccwsim.engine.realization import random_numbers
from ccwsim.engine.trace import Trace
from ccwsim.model.study import Study

twin = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[2] / "docs" / "the_paper.py")))

SHAPE = (53, 60)


def image_of(n_facies: int) -> TrainingImage:
    """Return a piece of a bundled image whose sides are not multiples of a block."""
    name = {2: "channels", 3: "levees"}[n_facies]
    codes = np.asarray(datasets.load(name).array)[:75, :86]
    assert len(np.unique(codes)) == n_facies
    return TrainingImage(codes)


def data_of(image: TrainingImage, n: int, seed: int) -> HardData:
    """Return data that no single patch honours, because half of them are random."""
    rng = np.random.default_rng(seed)
    cells = np.unique(rng.integers(0, SHAPE, (n, 2)), axis=0)
    facies = image.codes[image.indices[tuple(cells.T)]]
    noise = rng.random(len(cells)) < 0.5
    return HardData(cells, np.where(noise, rng.choice(image.codes, len(cells)), facies))


def of_twin(study: Study, number: int = 0) -> np.ndarray:
    """Return a realization of the twin, from the random numbers of a realization."""
    p, data = study.parameters, study.hard_data
    rng = random_numbers(study.seed, number)
    direction = int(rng.integers(8)) if p.random_path else 0
    listed = [(*cell, facies) for cell, facies in zip(data.cells, data.facies, strict=True)]
    level = 0 if p.method == "ccsim" else p.wavelet_level
    sizes = p.template_size, p.overlap_size, level, p.n_candidates
    image = np.asarray(study.training_image.array)
    limits = p.search_fraction, p.co_template
    return twin.simulate(image, SHAPE, *sizes, direction, rng.random, listed, *limits)


LEVELS, N_DATA = (1, 2, 3), (0, 12, 90)


def cases_of_the_twin() -> Iterator[Any]:
    """Yield sizes, level, facies and data; a quarter, with all pairs of values, are fast tests."""
    sizes, n_facies = ((32, 8), (16, 8)), (2, 3)
    for case in product(range(2), range(3), range(2), range(3)):
        a, level, b, n = case
        is_fast = a == (level + n) % 2 and b == (n == (level + 1) % 3)
        values = sizes[a], LEVELS[level], n_facies[b], N_DATA[n]
        yield pytest.param(*values, marks=[] if is_fast else [pytest.mark.slow])


@pytest.mark.parametrize(("sizes", "level", "n_facies", "n_data"), cases_of_the_twin())
def test_paper_gives_the_cells_of_the_twin(sizes, level, n_facies, n_data):
    image = image_of(n_facies)
    data = data_of(image, n_data, seed=level)
    p = Parameters.published("paper", template_size=sizes[0], overlap_size=sizes[1],
                             wavelet_level=level, n_candidates=7)  # fmt: skip
    e = simulate(image, SHAPE, p, data, n_realizations=2, seed=level)
    study = Study(image, e.grid, p, data, level)
    for number, realization in enumerate(e.realizations):
        np.testing.assert_array_equal(realization, of_twin(study, number))


def test_cells_without_a_level_are_those_of_the_twin():
    image, data = image_of(2), data_of(image_of(2), 40, seed=5)
    p = Parameters.published("paper", template_size=16, overlap_size=4, method="ccsim")
    e = simulate(image, SHAPE, p, data, seed=5)
    study = Study(image, e.grid, p, data, 5)
    np.testing.assert_array_equal(e.realizations[0], of_twin(study))


@pytest.mark.parametrize("k", [1, 20])
@pytest.mark.parametrize("n_facies", [2, 3])
@pytest.mark.parametrize("level", [1, 2, 3])
def test_scores_of_pywavelets_rank_the_drawn_location_within_k(level, n_facies, k):
    image = image_of(n_facies)
    p = Parameters.published("paper", wavelet_level=level, n_candidates=k)
    trace = Trace(Study(image, Grid(*SHAPE[::-1]), p, seed=k))
    own = trace.oriented.pyramid.image[0]
    codes = np.asarray(image.codes)
    coefficients = pywt.wavedec2(cropped(codes[own], level), "haar", "periodization", level)[0]
    for number, patch in enumerate(trace.patches):
        step = trace.at(number)
        if not patch.shape:
            continue
        overlap = np.where(step.in_overlap, codes[np.minimum(step.old, len(codes) - 1)], 0)
        own = pywt.wavedec2(overlap.astype(float), "haar", "periodization", level)[0]
        windows = np.lib.stride_tricks.sliding_window_view(coefficients, own.shape)
        scores = (windows * own).sum(axis=(2, 3))
        row, column = step.place
        assert row % 2**level == column % 2**level == 0
        drawn = scores[row >> level, column >> level]
        assert (scores > drawn + 1e-6).sum() < k
        np.testing.assert_allclose(step.ccw, scores, atol=1e-6)
        for facies in range(len(codes)):
            inverse = trace.reconstructed(step, facies)
            np.testing.assert_allclose(inverse, step.cells == facies, atol=1e-9)


def cropped(cells: np.ndarray, level: int) -> np.ndarray:
    """Return cells without the rows and columns that do not fill a block."""
    rows, columns = (n >> level << level for n in cells.shape)
    return cells[:rows, :columns].astype(float)


def test_tiles_that_no_patch_honours_are_split():
    image = image_of(2)
    data = data_of(image, 90, seed=1)
    p = Parameters.published("paper", wavelet_level=1)
    e = simulate(image, SHAPE, p, data, keep_sources=True)
    whole = simulate(image, SHAPE, replace(p, variant="ours"), data, keep_sources=True)
    # cells of one patch keep their distance in the image
    pieces = [
        len(
            np.unique(rows - np.arange(SHAPE[0])[:, None] + 1000j * (columns - np.arange(SHAPE[1])))
        )
        for rows, columns in (np.divmod(one.sources[0], image.shape[1]) for one in (e, whole))
    ]
    assert pieces[0] > 2 * pieces[1]
    assert e.n_mismatched[0] < whole.n_mismatched[0]


@pytest.mark.parametrize("variant", ["paper", "code"])
def test_published_variants_are_for_maps_without_guides_and_known_codes(variant):
    p = Parameters.published(variant, template_size=8, overlap_size=4, wavelet_level=1)
    volume = TrainingImage(np.indices((8, 9, 10)).sum(axis=0) % 2)
    with pytest.raises(CCWSIMError, match=f"the variant {variant} is for maps"):
        simulate(volume, (8, 8, 8), p)
    image = image_of(2)
    with pytest.raises(CCWSIMError, match=f"the variant {variant} is for maps"):
        simulate(image, (20, 20), p, secondary=Secondary(probabilities={1: 0.5}))
    renumbered = TrainingImage(np.where(np.asarray(image.array) == image.codes[0], -1, 300))
    with pytest.raises(CCWSIMError, match="has -1, 300; change its codes"):
        simulate(renumbered, (20, 20), p)
    active = np.indices((40, 40)).sum(axis=0) < 50
    e = simulate(image, (40, 40), p, secondary=Secondary(active=active))
    assert set(np.unique(e.realizations[0][active])) <= set(image.codes)
