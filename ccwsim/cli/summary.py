"""What came out of a simulation, in a few sentences."""

from __future__ import annotations

import numpy as np

from ccwsim.model.ensemble import Ensemble


def summary(ensemble: Ensemble) -> str:
    """Return what an ensemble is: how many, how long, the data honoured, the proportions.

    Examples
    --------
    >>> from ccwsim import HardData, Parameters, TrainingImage, simulate
    >>> ti, p = TrainingImage(np.eye(40), name="eye"), Parameters(template_size=8, overlap_size=4)
    >>> e = simulate(ti, (20, 30), p, HardData([[3, 4]], [1]), n_realizations=2)
    >>> print(summary(e))
    2 realizations of 30 × 20 cells (eye, seed 0): ... ms of CPU time each, ... s in all.
    Hard data: 1 of 1 honoured in every realization...
    Proportions (training image): facies 0 ... % (97.5 %), facies 1 ... % (2.5 %).
    """
    lines = [_counted(ensemble)]
    if ensemble.hard_data.n:
        lines.append(_honoured(ensemble))
    lines.append(_proportions(ensemble))
    return "\n".join(lines)


def _counted(e: Ensemble) -> str:
    name = e.training_image.name or "training image"
    return (
        f"{e.n} realization{'s' if e.n > 1 else ''} of {e.grid.nx} × {e.grid.ny} cells "
        f"({name}, seed {e.seed}): {1e3 * np.median(e.cpu_seconds):.0f} ms of CPU time each, "
        f"{e.wall_seconds:.1f} s in all."
    )


def _honoured(e: Ensemble) -> str:
    n = e.hard_data.n
    missed = int(e.n_mismatched.max())
    if missed:
        mean = e.n_mismatched.mean()
        return f"Hard data: {mean:.1f} of {n} NOT honoured on average, at most {missed}."
    forced = int(e.n_forced.max())
    tail = f"; of these at most {forced} by setting a single cell" if forced else ""
    return f"Hard data: {n} of {n} honoured in every realization{tail}."


def _proportions(e: Ensemble) -> str:
    ti = e.training_image
    shares = zip(ti.facies_names, e.proportions.mean(axis=0), ti.proportions, strict=True)
    said = ", ".join(f"{name} {100 * own:.1f} % ({100 * its:.1f} %)" for name, own, its in shares)
    return f"Proportions (training image): {said}."
