"""Dense data, three facies on a large grid, nonstationary images (sections 5.7 to 5.9)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim import datasets
from ccwsim.metrics import Stationarity, etype, stationarity
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.experiment import ExperimentRun, Outcome
from ccwsim.paper.methods import (
    image_picture,
    median_seconds,
    paper_map,
    paper_parameters,
    published,
    relative_tau,
    wrong_share,
)
from ccwsim.paper.published_times import OCTAVE, published_time, stated_seconds
from ccwsim.paper.verdicts import (
    judged,
    of_claim,
    of_data,
    of_time,
    percent,
    word_of,
)
from ccwsim.report.document import Block, Judgement, Row, Table, Text
from ccwsim.report.pictures import share_picture

LEVEL = 2
RECOVERED = 0.9
"""Share of the cells of the reference image that dense data must recover."""
TEMPLATE = 48
CLOSE = 0.03
"""Allowed difference of a proportion from the training image's."""
NONSTATIONARY = ("delta", "bend")
KEPT = 0.5
"""A trend is lost if realizations keep a smaller share of it on average."""


def dense_data(run: ExperimentRun) -> Outcome:
    """Simulate the channel image with dense data and compare cells with the reference image."""
    run.expect(2)
    image, side = run.inputs.image("channel"), run.extent.side(256)
    shape = side, side
    data, reference = run.inputs.dense_reference(shape)
    truth = np.searchsorted(image.codes, reference.array).astype(np.uint8)
    p = paper_parameters("ccwsim", LEVEL)
    e = run.simulate(image, shape, p, data, run.extent.n_few, workers=1)
    other = published(run, image, f"CCWSIM_channel256_dense4000_L{LEVEL}", shape)
    pictures = [
        paper_map(truth, image, "Reference image"),
        paper_map(e.indices[0], image, f"Realization 1 of ours, {data.n} data"),
    ]
    if other is not None:
        pictures.append(paper_map(other[0], image, "The authors' code, same data"))
    shares = e.probability(int(image.codes[-1]))
    caption = f"Probability of {image.facies_names[-1]}, {e.n} of ours"
    pictures.append(share_picture(shares, caption))
    stacks = {"ours": e.indices} | ({"authors' code": other} if other is not None else {})
    rows = []
    for name, images in stacks.items():
        as_reference = percent(recovered(images, truth))
        wrong = percent(wrong_share(images, image, data))
        tau = (f"{v:.2f}" for v in relative_tau(images, image).values())
        rows.append((name, str(len(images)), as_reference, wrong, *tau))
    lags = (f"τ at {lag}" for lag in relative_tau(e.indices, image))
    header = ("realizations", "n", "cells as in the reference", "data wrong", *lags)
    caption = f"{side} × {side} cells, {data.n} data, level {LEVEL}; τ E–W "
    table = Table(header, tuple(rows), f"{caption}relative to the training image's.")
    run.step()
    return Outcome((Row(tuple(pictures)), table), _dense_judgements(run, e, truth, other))


def recovered(images: NDArray, reference: NDArray) -> float:
    """Return the share of cells that agree with the reference image, mean over realizations.

    Examples
    --------
    >>> recovered(np.array([[[0, 0]]]), np.array([[0, 1]]))
    0.5
    """
    return float(np.mean(images == reference))


def _dense_judgements(
    run: ExperimentRun, e: Ensemble, reference: NDArray, other: NDArray | None
) -> tuple[Judgement, ...]:
    image, data = e.training_image, e.hard_data
    share = recovered(e.indices, reference)
    wrong = float(e.n_mismatched.mean() / data.n)
    found = f"{percent(share)} of the cells are those of the reference image."
    claim = "Fig. 14: a simulation with 4000 data beside its reference image."
    if other is None:
        judgements = of_claim(claim, found, share >= RECOVERED), of_data(wrong, data.n, None)
    else:
        theirs, missed = recovered(other, reference), wrong_share(other, image, data)
        found += f" With the authors' code {percent(theirs)}."
        word = word_of(1 if share > theirs else -1)
        judgements = judged(claim, found, word), of_data(wrong, data.n, missed)
    ours, stated = median_seconds(e), stated_seconds("Fig. 14")
    what = "a realization with about 4000 data (mean)"
    return (*judgements, of_time(what, ours, stated, "Fig. 14", run.extent.is_full))


def three_facies(run: ExperimentRun) -> Outcome:
    """Simulate the three-facies image with the authors' template of 48."""
    run.expect(2)
    image, side = run.inputs.image("three facies"), run.extent.side(1000)
    data = run.inputs.data("three facies", 400, (side, side))
    p = paper_parameters("ccwsim", LEVEL, template=TEMPLATE)
    e = run.simulate(image, (side, side), p, data, run.extent.n_few, workers=1)
    entropy = etype(e).entropy
    pictures = (
        image_picture(image, run.inputs.describe("three facies"), share=0.5),
        paper_map(e.indices[0], image, f"Realization 1, {data.n} data", data),
        share_picture(entropy, f"Entropy of {e.n} realizations: dark certain, yellow open"),
    )
    run.step()
    return Outcome((Row(pictures), _proportions(e)), _facies_judgements(run, e))


def _proportions(e: Ensemble) -> Table:
    image, rows = e.training_image, []
    for k, name in enumerate(image.facies_names):
        own = e.proportions[:, k]
        ti, mean, low, high = map(percent, (image.proportions[k], own.mean(), own.min(), own.max()))
        rows.append((name, ti, mean, f"{low} to {high}"))
    header = ("facies", "training image", f"mean of {e.n} realizations", "from, to")
    caption = f"{e.grid.nx} × {e.grid.ny} cells, T {TEMPLATE}, OR 8, level {LEVEL}"
    return Table(header, tuple(rows), caption)


def _facies_judgements(run: ExperimentRun, e: Ensemble) -> tuple[Judgement, ...]:
    image, ours = e.training_image, median_seconds(e)
    off = float(np.abs(e.proportions.mean(axis=0) - image.proportions).max())
    wrong = float(e.n_mismatched.mean() / e.hard_data.n)
    there = published_time(OCTAVE, "ccwsim", LEVEL, e.grid.nx * e.grid.ny, 400, "three facies")
    theirs = there.wrong_share if there and run.inputs.is_own("three facies") else None
    claim = "Section 5.8: more than two facies can be simulated."
    found = f"All {image.n_facies} facies occur, each within {percent(off)} of its share of the "
    judgements = (
        of_claim(claim, f"{found}image.", off <= CLOSE),
        of_data(wrong, e.hard_data.n, theirs),
    )
    what, stated = "a realization of three facies on 1000 × 1000 cells", stated_seconds("Fig. 16")
    return (*judgements, of_time(what, ours, stated, "Fig. 16", run.extent.is_full))


def limits(run: ExperimentRun) -> Outcome:
    """Simulate bundled images whose quarters differ, and measure the difference that remains."""
    run.expect(2 * len(NONSTATIONARY))
    blocks: list[Block] = []
    judgements: list[Judgement] = []
    rows = []
    for name in NONSTATIONARY:
        image = datasets.load(name)
        ny, nx = (run.extent.side(side) for side in image.shape)
        e = run.simulate(image, (ny, nx), paper_parameters("ccwsim", LEVEL), n=run.extent.n_few)
        own = stationarity(image)
        each = [stationarity(one, image.codes) for one in e]
        blocks.append(_quarter_maps(e, name))
        rows.append(_quarters(name, image, own, each))
        judgements.append(_trend(name, own, each))
        run.step()
    header = ("image", "facies", "share by quarter, image", "share by quarter, realizations")
    table = Table(header, tuple(rows), "Quarters SW, SE, NW, NE; mean of the realizations.")
    remark = Text(
        "The paper's nonstationary image (Sundarbans, Fig. 17) and its Ganges image (Fig. 8; 7.7 s "
        "a realization) are not at hand; the images here are drawn by this program.",
        quiet=True,
    )
    return Outcome((*blocks, table, remark), tuple(judgements))


def _quarter_maps(e: Ensemble, name: str) -> Row:
    image = e.training_image
    last = f"Mean of {e.n} realizations: probability of {image.facies_names[-1]}"
    mean = share_picture(e.probability(int(image.codes[-1])), last)
    first = paper_map(e.indices[0], image, "Realization 1")
    return Row((image_picture(image, f"our bundled “{name}”", share=1.0), first, mean))


def _quarters(
    name: str, image: TrainingImage, own: Stationarity, each: list[Stationarity]
) -> tuple[str, ...]:
    """Return the shares of the facies that differs most between the quarters of the image."""
    k = int(np.argmax(own.proportions.std(axis=0)))
    kept = np.mean([one.proportions for one in each], axis=0)
    shown = [", ".join(percent(float(v)) for v in p[:, k]) for p in (own.proportions, kept)]
    return name, image.facies_names[k], *shown


def kept_share(own: Stationarity, each: list[Stationarity]) -> float:
    """Return the share of the differences between the image's quarters that realizations keep.

    It is the slope of the realizations' mean variograms of the quarters over the image's, both less
    their mean over the quarters, along both axes.

    Examples
    --------
    >>> image = stationarity(datasets.load("delta").indices, range(3))
    >>> kept_share(image, [image])
    1.0
    """
    lags = min(own.variograms.shape[-1], *(one.variograms.shape[-1] for one in each))
    apart = own.variograms[..., :lags] - own.variograms[..., :lags].mean(axis=0)
    mean = np.mean([one.variograms[..., :lags] for one in each], axis=0)
    return float(np.sum(apart * (mean - mean.mean(axis=0))) / np.sum(apart**2))


def _trend(name: str, own: Stationarity, each: list[Stationarity]) -> Judgement:
    kept = kept_share(own, each)
    found = (
        f"Image “{name}”: realizations keep {percent(kept)} of the differences between the "
        "variograms of its quarters."
    )
    claim = "Section 5.9: nonstationary training images are a limit of the method."
    return of_claim(claim, found, kept < KEPT)
