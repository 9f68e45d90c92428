"""Variograms and probability of connection of 100 realizations (section 5)."""

from __future__ import annotations

import numpy as np

from ccwsim.figures import Bundle
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import published, settings
from ccwsim.paper.pictures import bundle_chart, connection_chart, lags_for, relative_tau
from ccwsim.paper.verdicts import AGREES, BEHIND, BETTER, judged, percent
from ccwsim.report import Block, Judgement, Row, Table

LEVEL = 2
ENOUGH = 0.8
"""Share of the lags at which the image's curve must lie among the realizations'."""
SLACK = 0.02


def statistics(run: Run) -> Outcome:
    """Simulate as for Fig. 7 and compare curves along both axes with the training image's."""
    run.expect(6)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    data = run.inputs.data("channel", 400, (side, side))
    many = run.simulate(image, (side, side), settings("ccwsim", LEVEL), data, run.extent.n_many)
    lags = lags_for(image.shape, (side, side), largest=run.extent.largest_lag)
    charts, bundles = [], {}
    for statistic in ("variogram", "connection"):
        for way in ("E-W", "N-S"):
            chart, bundle = bundle_chart(statistic, many.indices, image, way, lags)
            charts.append(chart)
            bundles[statistic, way] = bundle
            run.step()
    stacks = {"CCWSIM": many.indices}
    for code in ("CCWSIM", "MS-CCSIM"):
        found = published(run, image, f"{code}_channel512_hd400_L{LEVEL}", (side, side))
        if found is not None:
            stacks[f"published {code}"] = found
    blocks: list[Block] = [Row(tuple(charts[:2])), Row(tuple(charts[2:]))]
    tau = {name: relative_tau(images, image) for name, images in stacks.items()}
    if len(stacks) > 1:
        blocks.append(Row((connection_chart(stacks, image, "E-W", lags),)))
    blocks.append(_table(tau, stacks))
    run.step()
    return Outcome(tuple(blocks), (_follows(bundles, "variogram"), _follows(bundles, "connection"),
                                   *_beside(tau)))  # fmt: skip


def _table(tau: dict[str, dict[int, float]], stacks: dict[str, np.ndarray]) -> Table:
    lags = next(iter(tau.values())).keys()
    header = ("realizations", "n", *(f"τ at {lag} cells" for lag in lags))
    rows = tuple(
        (name, str(len(stacks[name])), *(f"{v:.2f}" for v in found.values()))
        for name, found in tau.items()
    )
    return Table(header, rows, f"Connection E–W relative to the training image's, level {LEVEL}.")


def _follows(bundles: dict[tuple[str, str], Bundle], statistic: str) -> Judgement:
    """Judge whether the image's curve lies among those of the realizations."""
    shares = [_among(bundle) for (kind, _), bundle in bundles.items() if kind == statistic]
    what = "variograms" if statistic == "variogram" else "probabilities of connection"
    found = (
        f"The image's curve lies among the realizations' at {percent(shares[0])} of the lags E–W "
        f"and {percent(shares[1])} N–S."
    )
    claim = (
        f"The paper shows {what} of the image and of 100 realizations; its curves are not at hand."
    )
    return judged(claim, found, "surrounded" if min(shares) >= ENOUGH else "in part")


def _among(bundle: Bundle) -> float:
    low, high = np.nanmin(bundle.each, axis=0), np.nanmax(bundle.each, axis=0)
    slack = SLACK * float(np.nanmax(bundle.reference))
    among = (bundle.reference >= low - slack) & (bundle.reference <= high + slack)
    return float(among[1:].mean())


def _beside(tau: dict[str, dict[int, float]]) -> list[Judgement]:
    """Judge our connection against the published codes', at the largest lag."""
    judgements = []
    lag, ours = list(tau["CCWSIM"].items())[-1]
    for name, found in tau.items():
        if name == "CCWSIM":
            continue
        theirs = found[lag]
        words = f"At {lag} cells {ours:.2f} of the image's connection; {name}: {theirs:.2f}."
        word = AGREES if abs(ours - theirs) <= SLACK else BETTER if ours > theirs else BEHIND
        judgements.append(judged(f"Connection of {name}, same study.", words, word))
    return judgements


STATISTICS = Experiment(
    "statistics", "Variograms and probability of connection", "Section 5",
    "The paper shows variograms and the probability of connection of the channel image and of 100 "
    "realizations (E–W and N–S); it speaks of an enhancement in facies connectivity.", statistics,
)  # fmt: skip
