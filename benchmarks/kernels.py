"""What each kernel does for one patch, how long, and the limit: python -m benchmarks.kernels

Inner patches (L-shaped overlap) of a finished realization of channels on 512 × 512 cells, T 32,
OR 8, K 20, without data; levels 1 to 3; mean of 16 patches. The limit is the number of operations
over what this machine does in a second of the simplest loop of the same kind: multiply-add of small
integers that lie in the cache for the scores, comparison of two bytes for the rest. Times are the
best of many batches, so that other work on the machine disturbs them little; a call from Python
costs about a microsecond of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ccwsim import Grid, HardData, Parameters, datasets, simulate
from ccwsim.kernels import kernel
from ccwsim.prepared_image import PreparedImage, TurnedImage
from ccwsim.stages.candidates import best_places
from ccwsim.stages.cut import UNKNOWN, keep_old, paste
from ccwsim.stages.refinement import refine_place
from ccwsim.stages.similarity import L_SHAPE, overlap_terms, score_places
from ccwsim.study import Study

BATCHES = 30
TILES = [(24 * row, 24 * column) for row in (3, 8, 13, 18) for column in (2, 7, 12, 17)]
"""First cells of the patches."""


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
    for _ in range(100):
        for x in range(len(row)):
            row[x] -= 3 * a[0, x] + 5 * a[1, x] + 7 * a[2, x] + 9 * a[3, x]


@kernel
def compare(a, b):
    """The simplest loop like that of cut and refinement: how many bytes differ."""
    wrong = 0
    for _ in range(100):
        for x in range(len(a)):
            wrong += a[x] != b[x]
    return wrong


def seconds_of(call: Callable[[], object]) -> float:
    """Return the seconds of one call, the best of many."""
    call()
    best = np.inf
    for _ in range(BATCHES):
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return best


def rates(kind: np.dtype) -> tuple[float, float]:
    """Return multiply-adds and comparisons that this machine does in a second."""
    a, row = np.ones((4, 112), np.uint8), np.zeros(112, kind)
    b = np.ones(1024, np.uint8)
    products = 400 * row.size / seconds_of(lambda: multiply_add(a, row))
    c = b.copy()
    return products, 100 * b.size / seconds_of(lambda: compare(b, c))


def measure(level: int) -> list[Measured]:
    """Return a row for each kernel of an unconditional patch, the mean of all TILES."""
    ti, p = datasets.load("channels"), Parameters(wavelet_level=level, random_path=False)
    grid = np.array(simulate(ti, (512, 512), p).indices[0])
    turned = PreparedImage(Study(ti, Grid(512, 512), p, HardData(), 0)).turned(0, p.template_size)
    rate = rates(turned.energies.dtype)
    rows = [_measure_patch(p, grid, turned, y0, x0, rate) for y0, x0 in TILES]
    means = []
    for same in zip(*rows, strict=True):
        operations = round(np.mean([row.operations for row in same]))
        seconds = float(np.mean([row.seconds for row in same]))
        means.append(replace(same[0], operations=operations, seconds=seconds))
    return means


def _measure_patch(
    p: Parameters, grid: NDArray[np.uint8], turned: TurnedImage, y0: int, x0: int,
    rate: tuple[float, float],
) -> list[Measured]:  # fmt: skip
    t, overlap, unit = p.template_size, p.overlap_size, 2**p.level
    image, sums, _ = turned.pyramid
    energy = turned.energies[0, L_SHAPE]
    scores, row_best = np.zeros_like(energy), np.empty(len(energy), np.int64)
    terms, places = np.empty((4, t * t), np.int64), np.empty((p.n_candidates, 2), np.int64)
    data, kept = np.full(grid.shape, UNKNOWN, np.uint8), np.empty((t, t), np.bool_)
    counts, rng = np.zeros(2, np.int64), np.random.default_rng(0)
    n = overlap_terms(grid, y0, x0, t, overlap, unit, L_SHAPE, 1, terms)
    strip = 2 * t * overlap - overlap**2
    score_places(sums, terms, n, energy, scores)
    best_places(scores, p.n_candidates, rng, row_best, places)
    ty, tx = (int(v) * unit for v in places[0])
    patch, target = image[ty : ty + t, tx : tx + t], grid.copy()
    products, comparisons = rate
    calls: list[tuple[str, str, int, Callable[[], object], float]] = [
        ("overlap_terms", "cells of the overlap", strip,
         lambda: overlap_terms(grid, y0, x0, t, overlap, unit, L_SHAPE, 1, terms), comparisons),
        ("score_places", "places × coefficients that are not 0", scores.size * n,
         lambda: score_places(sums, terms, n, energy, scores), products),
        ("best_places", "places, looked at twice", 2 * scores.size,
         lambda: best_places(scores, p.n_candidates, rng, row_best, places), comparisons),
        ("refine_place", "shifts × cells of the overlap", (1 + 9 * p.level) * strip,
         lambda: refine_place(image, grid, data, False, y0, x0, t, overlap, L_SHAPE, unit, ty, tx),
         comparisons),
        ("keep_old (cut)", "boundaries × 3 ways", 2 * t * (overlap + 1) * 3,
         lambda: keep_old(grid, data, patch, y0, x0, overlap, L_SHAPE, kept), comparisons),
        ("paste", "cells of the patch", t * t,
         lambda: paste(patch, kept, L_SHAPE, overlap, counts, y0, x0, target), comparisons),
    ]  # fmt: skip
    return [
        Measured(p.level, name, what, operations, seconds_of(call), per_second)
        for name, what, operations, call, per_second in calls
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
