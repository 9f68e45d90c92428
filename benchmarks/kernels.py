"""What each kernel does for one patch, how long, and the limit: python -m benchmarks.kernels

Inner patches (L-shaped overlap) of a finished realization of channels on 512 × 512 cells, T 32,
OR 8, K 20, without data; levels 1 to 3; the mean. The limit is the number of operations
over what this machine does in a second of the simplest loop of the same kind: multiply-add of small
integers that lie in the cache for the scores, comparison of two bytes for the rest. Each kernel
goes over all patches in compiled code, as a call from Python costs as much as many of them; times
are the CPU time of the best of many rounds, so that other work on the machine disturbs them little.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ccwsim import Grid, HardData, Parameters, datasets, simulate
from ccwsim.engine.kernels import kernel
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.stages.bits import make_strips
from ccwsim.engine.stages.candidates import best_places
from ccwsim.engine.stages.conditioning import place_data
from ccwsim.engine.stages.cut import keep_old, paste
from ccwsim.engine.stages.refinement import refine_place
from ccwsim.engine.stages.similarity import L_SHAPE, overlap_terms, score_places
from ccwsim.model.study import Study

ROUNDS = 30
REPEATS = 10_000
"""Of the simplest loops, in one call."""
CELLS_A_BYTE = 8
"""Cells of two facies that are compared with one byte."""
ROWS = COLUMNS = np.arange(24, 24 * 20, 24)
"""First cells of the patches: all that have an overlap on two sides."""


@dataclass(frozen=True)
class Measured:
    """One row: operations and seconds of a call, and operations a second of the simplest loop."""

    level: int
    name: str
    what: str
    operations: int
    seconds: float
    per_second: float


@kernel
def multiply_add(a, row):
    """The simplest loop like that of the scores: four products are added to each number."""
    for _ in range(REPEATS):
        for x in range(len(row)):
            row[x] -= 3 * a[0, x] + 5 * a[1, x] + 7 * a[2, x] + 9 * a[3, x]


@kernel
def compare(a, b):
    """The simplest loop like that of cut and refinement: how many bytes differ."""
    wrong = 0
    for _ in range(REPEATS):
        for x in range(len(a)):
            wrong += a[x] != b[x]
    return wrong


@kernel
def all_terms(grid, ys, xs, template, overlap, block_size, terms, n_terms):
    """Take the terms of each patch."""
    for i in range(len(ys)):
        n_terms[i] = overlap_terms(
            grid, ys[i], xs[i], template, overlap, block_size, L_SHAPE, 1, terms[i]
        )


@kernel
def all_scores(sums, terms, n_terms, energy, scores):
    """Score all locations for each patch."""
    for i in range(len(n_terms)):
        score_places(sums, terms[i], n_terms[i], energy, scores[i])


@kernel
def all_best(scores, k, rng, row_best, locations):
    """Find the best locations of each patch."""
    for i in range(len(scores)):
        best_places(scores[i], k, rng, row_best, locations[i])


@kernel
def all_refined(image, bits, grid, data, ys, xs, template, overlap, block_size, tys, txs, strips):
    """Refine the place of each patch; return something that depends on all."""
    total = 0
    for i in range(len(ys)):
        ty, tx = refine_place(
            image,
            bits,
            grid,
            data,
            ys[i],
            xs[i],
            template,
            overlap,
            L_SHAPE,
            block_size,
            tys[i],
            txs[i],
            strips,
        )
        total += ty + tx
    return total


@kernel
def all_cut(grid, data, image, ys, xs, tys, txs, template, overlap, kept):
    """Cut each patch."""
    for i in range(len(ys)):
        patch = image[tys[i] : tys[i] + template, txs[i] : txs[i] + template]
        keep_old(grid, data, patch, ys[i], xs[i], overlap, L_SHAPE, kept[i])


@kernel
def all_pasted(image, tys, txs, template, kept, overlap, counts, ys, xs, grid):
    """Paste each patch."""
    for i in range(len(ys)):
        patch = image[tys[i] : tys[i] + template, txs[i] : txs[i] + template]
        paste(patch, kept[i], L_SHAPE, overlap, counts, ys[i], xs[i], grid)


def seconds_of(call: Callable[[], object]) -> float:
    """Return the CPU seconds of one call, the best of many."""
    call()
    best = np.inf
    for _ in range(ROUNDS):
        start = time.thread_time()
        call()
        best = min(best, time.thread_time() - start)
    return best


def rates(kind: np.dtype) -> tuple[float, float]:
    """Return multiply-adds and comparisons that this machine does in a second."""
    a, row = np.ones((4, 112), np.uint8), np.zeros(112, kind)
    b = np.ones(1024, np.uint8)
    products = 4 * REPEATS * row.size / seconds_of(lambda: multiply_add(a, row))
    c = b.copy()
    return products, REPEATS * b.size / seconds_of(lambda: compare(b, c))


def measure(level: int) -> list[Measured]:
    """Return a row for each kernel of an unconditional patch, the mean of all."""
    ti, p = datasets.load("channels"), Parameters(wavelet_level=level, random_path=False)
    grid = np.array(simulate(ti, (512, 512), p).indices[0])
    study = Study(ti, Grid(512, 512), p, HardData(), 0)
    oriented = PreparedImage(study).oriented(0, p.template_size)
    ys, xs = (a.ravel() for a in np.meshgrid(ROWS, COLUMNS, indexing="ij"))
    n, block_size, k = len(ys), 2**level, p.n_candidates
    t, overlap = p.template_size, p.overlap_size
    image, bits, sums, _ = oriented.pyramid
    energy = oriented.energies[0, L_SHAPE]
    terms = np.zeros((n, 4, 2 * t * overlap // block_size**2), np.int64)
    n_terms = np.zeros(n, np.int64)
    scores, row_best = np.zeros((n, *energy.shape), energy.dtype), np.zeros(len(energy), np.int64)
    locations, rng = np.zeros((n, k, 2), np.int64), np.random.default_rng(0)
    no_data = place_data(np.empty((0, 2), int), np.empty(0, np.uint8), grid.shape)
    strips, kept = make_strips(bits, t), np.zeros((n, t, t), bool)
    target, counts = grid.copy(), np.zeros(0, np.int64)
    terms_of = seconds_of(lambda: all_terms(grid, ys, xs, t, overlap, block_size, terms, n_terms))
    scores_of = seconds_of(lambda: all_scores(sums, terms, n_terms, energy, scores))
    best_of = seconds_of(lambda: all_best(scores, k, rng, row_best, locations))
    tys, txs = locations[np.arange(n), rng.integers(0, k, n)].T * block_size
    at = ys, xs, t, overlap, block_size, tys, txs
    refined = seconds_of(lambda: all_refined(image, bits, grid, no_data, *at, strips))
    cut = seconds_of(lambda: all_cut(grid, no_data.kept, image, ys, xs, tys, txs, t, overlap, kept))
    pasted = seconds_of(
        lambda: all_pasted(image, tys, txs, t, kept, overlap, counts, ys, xs, target)
    )
    strip = 2 * t * overlap - overlap**2
    products, comparisons = rates(energy.dtype)
    n_products = energy.size * n_terms.mean()
    shifts = (1 + 9 * level) * strip / CELLS_A_BYTE
    rows = [
        ("overlap_terms", "cells of the overlap", strip, terms_of, comparisons),
        ("score_places", "locations × coefficients not 0", n_products, scores_of, products),
        ("best_places", "locations, visited twice", 2 * energy.size, best_of, comparisons),
        ("refine_place", "shifts × cells of the overlap, as bits", shifts, refined, comparisons),
        ("keep_old (cut)", "boundaries × 3 ways", 2 * t * (overlap + 1) * 3, cut, comparisons),
        ("paste", "cells of the patch", t * t, pasted, comparisons),
    ]
    return [
        Measured(level, name, what, round(operations), seconds / n, per_second)
        for name, what, operations, seconds, per_second in rows
    ]


def main() -> None:
    """Print the table."""
    print("| level | kernel | what it counts | operations | µs | limit, µs | limit / time |")
    print("|---|---|---|---|---|---|---|")
    for level in (1, 2, 3):
        for row in measure(level):
            limit = row.operations / row.per_second
            print(
                f"| {row.level} | {row.name} | {row.what} | {row.operations:,} "
                f"| {1e6 * row.seconds:.1f} | {1e6 * limit:.1f} | {limit / row.seconds:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
