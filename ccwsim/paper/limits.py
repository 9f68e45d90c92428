"""The limits that the paper names: nonstationary training images (section 5.9)."""

from __future__ import annotations

import numpy as np

from ccwsim import datasets
from ccwsim.metrics import Stationarity, stationarity
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import settings
from ccwsim.paper.pictures import image_picture, map_picture, share_picture
from ccwsim.paper.verdicts import AGREES, DIFFERS, judged, percent
from ccwsim.report import Block, Judgement, Row, Table, Text

IMAGES = ("delta", "bend")
LEVEL = 2
KEPT = 0.5
"""A trend of which realizations keep less than this share on average is lost."""


def limits(run: Run) -> Outcome:
    """Simulate bundled images whose quarters differ, and see what is left of the difference."""
    run.expect(2 * len(IMAGES))
    blocks: list[Block] = []
    judgements: list[Judgement] = []
    rows = []
    for name in IMAGES:
        image = datasets.load(name)
        ny, nx = (run.extent.side(side) for side in image.shape)
        e = run.simulate(image, (ny, nx), settings("ccwsim", LEVEL), n=run.extent.n_few)
        own = stationarity(image.indices, image.n_facies)
        each = [stationarity(one, image.n_facies) for one in e.indices]
        blocks.append(_maps(e, name))
        rows.append(_row(name, image, own, each))
        judgements.append(_judged(name, own, each))
        run.step()
    header = ("image", "facies", "share by quarter, image", "share by quarter, realizations")
    table = Table(header, tuple(rows), "Quarters SW, SE, NW, NE; mean of the realizations.")
    remark = Text(
        "The authors' nonstationary images are not at hand; ours are drawn by this program. The "
        "authors' page also shows the Ganges delta (7.7 s), which is not reproduced here.",
        quiet=True,
    )
    return Outcome((*blocks, table, remark), tuple(judgements))


def _maps(e: Ensemble, name: str) -> Row:
    image = e.training_image
    last = f"Mean of {e.n} realizations: probability of {image.facies_names[-1]}"
    return Row((
        image_picture(image, f"our bundled “{name}”", share=1.0),
        map_picture(e.indices[0], image, "Realization 1"),
        share_picture(e.probability(int(image.codes[-1])), last),
    ))  # fmt: skip


def _row(
    name: str, image: TrainingImage, own: Stationarity, each: list[Stationarity]
) -> tuple[str, ...]:
    """Return the shares of the facies that differs most between the quarters of the image."""
    k = int(np.argmax(own.proportions.std(axis=0)))
    kept = np.mean([one.proportions for one in each], axis=0)
    shown = [", ".join(percent(float(v)) for v in p[:, k]) for p in (own.proportions, kept)]
    return name, image.facies_names[k], *shown


def kept_share(own: Stationarity, each: list[Stationarity]) -> float:
    """Return how much of what sets the image's quarters apart realizations keep, mean.

    The variograms of the quarters, along both axes, less their mean over the quarters: what of the
    image's the realizations' contain, as the slope of the one over the other.

    Examples
    --------
    >>> image = stationarity(datasets.load("delta").indices, 3)
    >>> kept_share(image, [image])
    1.0
    """
    lags = min(own.variograms.shape[-1], *(one.variograms.shape[-1] for one in each))
    apart = own.variograms[..., :lags] - own.variograms[..., :lags].mean(axis=0)
    mean = np.mean([one.variograms[..., :lags] for one in each], axis=0)
    return float(np.sum(apart * (mean - mean.mean(axis=0))) / np.sum(apart**2))


def _judged(name: str, own: Stationarity, each: list[Stationarity]) -> Judgement:
    kept = kept_share(own, each)
    found = (
        f"Image “{name}”: realizations keep {percent(kept)} of what sets the variograms of its "
        "quarters apart."
    )
    claim = "Section 5.9: nonstationary training images are a limit of the method."
    return judged(claim, found, AGREES if kept < KEPT else DIFFERS)


LIMITS = Experiment(
    "limits", "Limits: nonstationary training images", "Section 5.9",
    "Section 5.9 speaks of the limits of the method, among them nonstationary training images; its "
    "figures are not at hand.", limits,
)  # fmt: skip
