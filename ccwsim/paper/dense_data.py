"""About 4000 data on a small grid, beside the image they were read from (section 5)."""

from __future__ import annotations

import numpy as np

from ccwsim.model.ensemble import Ensemble
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import CONDITIONING, published, settings, stated_seconds, wrong_share
from ccwsim.paper.pictures import map_picture, relative_tau, share_picture
from ccwsim.paper.verdicts import (
    AGREES,
    BEHIND,
    BETTER,
    DIFFERS,
    OPEN,
    judged,
    of_data,
    of_time,
    percent,
    seconds,
)
from ccwsim.report import Judgement, Picture, Row, Table

LEVEL = 2
RECOVERED = 0.9


def dense_data(run: Run) -> Outcome:
    """Simulate the channel image with dense data and compare cells with the reference image."""
    run.expect(2)
    image, side = run.inputs.image("channel"), run.extent.side(256)
    data, truth = run.inputs.dense_reference((side, side))
    e = run.simulate(image, (side, side), settings("ccwsim", LEVEL), data, run.extent.n_few,
                     workers=1)  # fmt: skip
    other = published(run, image, f"CCWSIM_channel256_dense4000_L{LEVEL}", (side, side))
    pictures = [
        map_picture(image_of(truth, image), image, "Reference image"),
        map_picture(e.indices[0], image, f"Realization 1 of ours, {data.n} data"),
    ]
    if other is not None:
        pictures.append(map_picture(other[0], image, "The authors' code, same data"))
    pictures.append(_probability(e, image))
    stacks = {"ours": e.indices} | ({"authors' code": other} if other is not None else {})
    rows = tuple(
        (name, str(len(images)), percent(recovered(images, truth, image)),
         percent(wrong_share(images, image, data)),
         *(f"{v:.2f}" for v in relative_tau(images, image).values()))
        for name, images in stacks.items()
    )  # fmt: skip
    lags = relative_tau(e.indices, image)
    header = ("realizations", "n", "cells as in the reference", "data wrong",
              *(f"τ at {lag}" for lag in lags))  # fmt: skip
    table = Table(header, rows, f"{side} × {side} cells, {data.n} data, level {LEVEL}; τ E–W "
                  "relative to the training image's.")  # fmt: skip
    run.step()
    return Outcome((Row(tuple(pictures)), table), _judgements(run, e, truth, other))


def image_of(truth: TrainingImage, image: TrainingImage) -> np.ndarray:
    """Return the reference image as places in the training image's codes."""
    return np.searchsorted(image.codes, truth.array).astype(np.uint8)


def recovered(images: np.ndarray, truth: TrainingImage, image: TrainingImage) -> float:
    """Return the share of cells that agree with the reference image, mean over realizations.

    Examples
    --------
    >>> ti = TrainingImage([[0, 1]])
    >>> recovered(np.array([[[0, 0]]]), ti, ti)
    0.5
    """
    return float(np.mean(images == image_of(truth, image)))


def _probability(e: Ensemble, image: TrainingImage) -> Picture:
    name = image.facies_names[-1]
    return share_picture(
        e.probability(int(image.codes[-1])), f"Probability of {name}, {e.n} of ours"
    )


def _judgements(
    run: Run, e: Ensemble, truth: TrainingImage, other: np.ndarray | None
) -> tuple[Judgement, ...]:
    image, data = e.training_image, e.hard_data
    share = recovered(e.indices, truth, image)
    wrong = float(e.n_mismatched.mean() / data.n)
    found = f"{percent(share)} of the cells are those of the reference image."
    claim = "The paper shows a simulation with 4000 data beside its reference image."
    word = AGREES if share >= RECOVERED else DIFFERS
    if other is not None:
        theirs = recovered(other, truth, image)
        found += f" With the authors' code {percent(theirs)}."
        word = BETTER if share > theirs else BEHIND
    missed = None if other is None else wrong_share(other, image, data)
    judgements = [judged(claim, found, word),
                  of_data(CONDITIONING, wrong, data.n, missed)]  # fmt: skip
    ours = float(np.median(e.cpu_seconds))
    if run.extent.name == "quick":
        words = f"{seconds(ours)} on a smaller grid; not comparable."
        return (*judgements, judged("1.06 s for a realization.", words, OPEN))
    where = "4000 data on 256 × 256 (the authors' page)"
    return (*judgements, of_time("a realization (mean)", ours, stated_seconds("4000 data"), where))


DENSE_DATA = Experiment(
    "dense-data", "Dense data, beside the reference image", "Section 5",
    "The paper shows a reference image and one simulation with about 4000 of its cells as data; "
    "mean CPU time 1.06 s (the authors' page).", dense_data,
)  # fmt: skip
