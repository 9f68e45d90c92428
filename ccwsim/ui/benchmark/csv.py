"""The times as CSV."""

from __future__ import annotations

from collections.abc import Sequence

from ccwsim.ui.benchmark.run import TimingRun
from ccwsim.ui.results.tables import as_csv

HEAD = (
    "image", "image_nx", "image_ny", "method", "level", "template", "overlap", "candidates",
    "exact_data", "nx", "ny", "n_data", "seed", "realization", "cpu_seconds",
    "data_not_honoured", "machine",
)  # fmt: skip


def timings_csv(runs: Sequence[TimingRun], machine: str) -> bytes:
    """Return one line a realization that was timed, with its setting and the machine."""
    lines = []
    for run in runs:
        image_ny, image_nx = run.training_image.shape
        for timing in list(run.timings):
            p, (ny, nx) = timing.parameters, timing.grid_shape
            lines += [
                [run.training_image.name, image_nx, image_ny, p.method, p.level, p.template_size,
                 p.overlap_size, p.n_candidates, p.exact_data, nx, ny, timing.n_data, run.seed,
                 r + 1, f"{timing.cpu_seconds[r]:.6g}", int(timing.n_mismatched[r]), machine]
                for r in range(len(timing.cpu_seconds))
            ]  # fmt: skip
    return as_csv(HEAD, lines)
