"""Operations, time and limit of each kernel for one patch: python -m benchmarks.kernels

Numbers are means over the inner patches (L-shaped overlap) of an unconditional realization of
channels on 512 × 512 cells with T 32, OR 8, K 20, at levels 1 to 3. The limit is the number of
operations divided by the speed of the simplest loop of the same kind on this machine. For scores,
this loop adds one number per coefficient, in the cache and in the smallest type of block sums. For
other kernels, the loop compares two bytes. Each kernel loops over all patches in compiled code,
because calls from Python are slow. Times are the smallest CPU times of many rounds, so that other
work on the machine has little influence.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ccwsim import Grid, Parameters, datasets, simulate
from ccwsim.engine.corrections.refinement import data_at_stake, refine_place
from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.lengths import lengths_of
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.stages.bits import make_strips, take_strips
from ccwsim.engine.stages.candidates import best_places, make_ranking
from ccwsim.engine.stages.conditioning import SPARSE, place_data
from ccwsim.engine.stages.cut import keep_old, make_cut, paste
from ccwsim.engine.stages.path import LEFT, TOP, Box, overlap_cells
from ccwsim.engine.stages.similarity import (
    make_terms,
    overlap_energies,
    overlap_terms,
    score_places,
)
from ccwsim.model.study import Study

ROUNDS = 30
REPEATS = 10_000
"""Number of repetitions of the simplest loop in one call."""
CELLS_A_BYTE = 8
"""Number of cells of two facies in one byte."""
ROWS = COLUMNS = np.arange(24, 24 * 20, 24)
"""First rows and columns of the inner patches, which have an overlap on two sides."""


@dataclass(frozen=True)
class Measured:
    """One row: operations and seconds of a call, and operations per second of the simplest loop."""

    level: int
    name: str
    what: str
    operations: int
    seconds: float
    per_second: float


@kernel
def add(a, b, c, d, row):
    """Run the simplest loop of the same kind as the scores: add four numbers to each number."""
    for _ in range(REPEATS):
        for x in range(np.uint64(len(row))):
            row[x] += a[x] + b[x] + c[x] + d[x]


@kernel
def compare(a, b):
    """Run the simplest loop of the same kind as cut and refinement: count different bytes."""
    wrong = 0
    for _ in range(REPEATS):
        for x in range(len(a)):
            wrong += a[x] != b[x]
    return wrong


@part_of_kernel
def box_of(b):
    """Return a row of numbers as a box."""
    return Box(b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7], b[8], b[9])


@kernel
def all_terms(grid, boxes, block, running, terms, n_terms):
    """Compute the overlap terms of each patch."""
    for i in range(len(boxes)):
        n_groups = overlap_terms(grid, box_of(boxes[i]), block, running, terms)
        n_terms[i] = terms.ends[n_groups - 1]


@kernel
def all_energies(squares, boxes, block, energy):
    """Compute the overlap energies of each patch."""
    for i in range(len(boxes)):
        overlap_energies(squares, box_of(boxes[i]), block, energy)


@kernel
def all_scores(grid, boxes, block, running, spans, terms, energy, scores):
    """Compute the terms of each patch, and its scores at all locations."""
    for i in range(len(boxes)):
        n_groups = overlap_terms(grid, box_of(boxes[i]), block, running, terms)
        score_places(running, 0, spans, terms, n_groups, energy, scores[i])


@kernel
def all_best(scores, rng, ranking, places):
    """Find the best locations of each patch."""
    for i in range(len(scores)):
        best_places(scores[i].reshape(-1), rng, ranking)
        for k in range(len(ranking.places)):
            places[i, k] = ranking.places[k]


@kernel
def all_refined(image, square_bits, grid, data, missed, boxes, block, at, strips, at_stake):
    """Refine the location of each patch.

    The result depends on all locations, so that the compiler cannot omit a call.
    """
    total = 0
    for i in range(len(boxes)):
        place, box = (at[i, 0], at[i, 1], at[i, 2]), box_of(boxes[i])
        take_strips(grid, box, square_bits, strips)
        lost = at_stake[: data_at_stake(grid, data, box, at_stake)]
        _, z, y, x = refine_place(image, square_bits, box, block, place, strips, lost, missed)
        total += z + y + x
    return total


@kernel
def all_cut(grid, data, image, boxes, at, cut):
    """Cut each patch."""
    for i in range(len(boxes)):
        place = at[i, 0], at[i, 1], at[i, 2]
        keep_old(grid, data, image, place, box_of(boxes[i]), cut)


@kernel
def all_pasted(image, at, boxes, keep_mask, counts, grid, sources):
    """Paste each patch."""
    for i in range(len(boxes)):
        place = at[i, 0], at[i, 1], at[i, 2]
        paste(image, place, box_of(boxes[i]), keep_mask, counts, grid, sources)


def seconds_of(call: Callable[[], object]) -> float:
    """Return the smallest CPU seconds of many calls."""
    call()
    best = np.inf
    for _ in range(ROUNDS):
        start = time.thread_time()
        call()
        best = min(best, time.thread_time() - start)
    return best


def rates(kind: np.dtype) -> tuple[float, float]:
    """Return the numbers of additions of a type and of comparisons per second on this machine."""
    row, *others = (np.ones(1024, kind) for _ in range(5))
    additions = len(others) * REPEATS * row.size / seconds_of(lambda: add(*others, row))
    b, c = np.ones(1024, np.uint8), np.ones(1024, np.uint8)
    return additions, REPEATS * b.size / seconds_of(lambda: compare(b, c))


def measure(level: int) -> list[Measured]:
    """Return a row for each kernel: means over all unconditional patches."""
    ti, p = datasets.load("channels"), Parameters(wavelet_level=level, random_path=False)
    grid = np.array(simulate(ti, (512, 512), p).indices)
    lengths = lengths_of(p, (512, 512))[0]
    template, width, block = lengths.template, lengths.overlap, lengths.block
    oriented = PreparedImage(Study(ti, Grid(512, 512), p)).oriented(0, template)
    ys, xs = (a.ravel() for a in np.meshgrid(ROWS, COLUMNS, indexing="ij"))
    n, t, overlap, k = len(ys), template[2], width[2], p.n_candidates
    boxes = np.zeros((n, 10), np.int64)
    boxes[:, 1], boxes[:, 2], boxes[:, 3:] = ys, xs, (*template, LEFT | TOP, *width)
    (image, square_bits, _, _), running = oriented.pyramid, oriented.running
    energy = np.zeros(oriented.places, oriented.squares.dtype)
    all_energies(oriented.squares, boxes[:1], block, energy)
    terms, n_terms = make_terms(running, template, width, block), np.zeros(n, np.int64)
    scores = np.zeros((n, *energy.shape), energy.dtype)
    ranking = make_ranking(energy.size, k, energy.dtype)
    places, rng = np.zeros((n, k), np.int64), np.random.default_rng(0)
    no_data = place_data(np.empty((0, 3), int), np.empty(0, np.uint8), grid.shape)
    strips, at_stake = make_strips(square_bits, template), np.zeros((0, 4), np.int64)
    cut, sources = make_cut(template, width), np.zeros((0, 0, 0), np.int32)
    target, counts = grid.copy(), np.zeros(0, np.int64)
    terms_of = seconds_of(lambda: all_terms(grid, boxes, block, running, terms, n_terms))
    scores_of = seconds_of(lambda: all_scores(
        grid, boxes, block, running, np.zeros((0, 0, 2), np.int64), terms, energy, scores
    )) - terms_of  # fmt: skip
    best_of = seconds_of(lambda: all_best(scores, rng, ranking, places))
    drawn = places[np.arange(n), rng.integers(0, k, n)]
    at = np.stack(np.unravel_index(drawn, energy.shape), axis=1) * np.array(block)
    refined = seconds_of(lambda: all_refined(
        image, square_bits, grid, no_data, SPARSE.missed, boxes, block, at, strips, at_stake
    ))  # fmt: skip
    cut_of = seconds_of(lambda: all_cut(grid, no_data.required, image, boxes, at, cut))
    pasted = seconds_of(lambda: all_pasted(
        image, at, boxes, cut.keep_mask, counts, target, sources
    ))  # fmt: skip
    strip = overlap_cells(template, width)
    additions, comparisons = rates(running.dtype)
    rows = [
        ("overlap_terms", "cells of the overlap", strip, terms_of, comparisons),
        ("score_places", "locations × terms",
         energy.size * n_terms.mean(), scores_of, additions),
        ("best_places", "locations, read twice", 2 * energy.size, best_of, comparisons),
        ("refine_place", "shifts × cells of the overlap, as bits",
         (1 + 9 * level) * strip / CELLS_A_BYTE, refined, comparisons),
        ("keep_old (cut)", "boundaries × 3 ways", 2 * t * (overlap + 1) * 3, cut_of, comparisons),
        ("paste", "cells of the patch", t * t, pasted, comparisons),
    ]  # fmt: skip
    return [
        Measured(level, name, what, round(operations), seconds / n, per_second)
        for name, what, operations, seconds, per_second in rows
    ]


def main() -> None:
    """Print the table."""
    print("| level | kernel | operations counted | number | µs | limit, µs | limit / time |")
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
