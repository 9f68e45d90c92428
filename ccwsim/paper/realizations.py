"""Realizations of the channel image and their statistics (sections 5.1 to 5.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.figures import Bundle
from ccwsim.metrics import etype
from ccwsim.metrics.bands import Statistic
from ccwsim.metrics.stack import Stack
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.hard_data import HardData
from ccwsim.model.numbers import seconds
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.experiment import ExperimentRun, Outcome
from ccwsim.paper.methods import (
    SETTINGS,
    connectivity_chart,
    format_distances,
    image_picture,
    lags_for,
    mean_distances,
    median_seconds,
    paper_map,
    paper_parameters,
    published,
    relative_tau,
    wrong_share,
)
from ccwsim.paper.published_times import stated_seconds
from ccwsim.paper.verdicts import (
    judged,
    of_claim,
    of_data,
    of_ratio,
    of_time,
    percent,
    word_of,
)
from ccwsim.report.document import Block, Judgement, Row, Table, Text
from ccwsim.report.pictures import bundle_chart, bundle_of, share_picture

STATISTICS: tuple[Statistic, ...] = ("variogram", "connectivity")
SHOWN = 3
LEVEL = 2
CLOSE_SHARE, CLOSE_TAU = 0.03, 0.85
"""Limits of a reproduced proportion (difference) and connectivity (ratio)."""
ENOUGH = 0.8
"""Share of the lags at which the image's curve must be among the realizations'."""
SLACK = 0.02


def unconditional(run: ExperimentRun) -> Outcome:
    """Simulate at levels 1 to 3, and compare proportions, patterns and connectivity."""
    run.expect(4)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    runs = [
        run.simulate(
            image, (side, side), paper_parameters("ccwsim", level), n=run.extent.n_few, workers=1
        )
        for level in (1, 2, 3)
    ]
    rows = [_measures(f"ours, level {e.parameters.level}", e.indices, image, e) for e in runs]
    other = published(run, image, "CCWSIM_channel256_uncond_L2", (256, 256))
    if other is not None:
        rows.append(_measures("authors' code, level 2, 256 × 256", other, image))
    run.step()
    shown = runs[1]
    pictures = [image_picture(image, run.inputs.describe("channel"))]
    pictures += [
        paper_map(one, image, f"Realization {r}, level 2")
        for r, one in enumerate(shown.indices[:SHOWN], start=1)
    ]
    share = f"{image.facies_names[-1]} (image: {percent(float(image.proportions[-1]))})"
    distances = "pattern distance 1, 1/2, 1/3"
    header = ("realizations", share, distances, "τ E–W at 41 cells", "at 81 cells", "CPU time")
    caption = (
        f"{side} × {side} cells, {SETTINGS}. Pattern distance: Jensen–Shannon divergence of 4 × 4 "
        "patterns (bits) from the training image; τ relative to the training image's."
    )
    remark = (
        f"The grid of the paper's figure is not known to us; the one here is {side} × {side}, as "
        "in its conditional runs."
    )
    table = Table(header, tuple(rows), caption)
    blocks = (Row(tuple(pictures)), table, Text(remark, quiet=True))
    return Outcome(blocks, (_reproduced(shown, image), _unconditional_time(run, shown)))


def _measures(
    name: str, images: NDArray, image: TrainingImage, ensemble: Ensemble | None = None
) -> tuple[str, ...]:
    share = float(np.mean(images == image.n_facies - 1))
    tau = list(relative_tau(images, image).values())
    near, far = (f"{tau[k]:.2f}" if k < len(tau) else "–" for k in (1, 3))
    time = seconds(median_seconds(ensemble)) if ensemble else "–"
    distances = format_distances(mean_distances(images, image))
    return name, percent(share), distances, near, far, time


def _reproduced(ensemble: Ensemble, image: TrainingImage) -> Judgement:
    own, reference = float(ensemble.proportions.mean(axis=0)[-1]), float(image.proportions[-1])
    lag, tau = list(relative_tau(ensemble.indices, image).items())[-1]
    found = (
        f"{image.facies_names[-1].capitalize()} takes {percent(own)} of the cells "
        f"({percent(reference)} in the image); cells {lag} apart are connected {tau:.2f} times as "
        "often as in the image."
    )
    holds = abs(own - reference) <= CLOSE_SHARE and tau >= CLOSE_TAU
    claim = "Fig. 6: three realizations whose channels look like the training image's."
    return of_claim(claim, found, holds)


def _unconditional_time(run: ExperimentRun, ensemble: Ensemble) -> Judgement:
    what = "a realization (mean); grid and level are not at hand"
    stated = stated_seconds("Fig. 6")
    return of_time(what, median_seconds(ensemble), stated, "Fig. 6", run.extent.is_full)


def conditional(run: ExperimentRun) -> Outcome:
    """Simulate the channel image with 100, 300 and 400 data; 100 realizations with 400."""
    run.expect(5)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    shape, p, n = (side, side), paper_parameters("ccwsim", LEVEL), run.extent.n_few
    sets = [run.inputs.data("channel", n_data, shape) for n_data in (100, 300, 400)]
    free = run.simulate(image, shape, p, n=n, workers=1)
    few = [run.simulate(image, shape, p, data, n, workers=1) for data in sets[:2]]
    many = run.simulate(image, shape, p, sets[2], run.extent.n_many)
    other = published(run, image, f"CCWSIM_channel512_hd400_L{LEVEL}", shape)
    blocks = (*_conditional_maps(many, image, sets[2], other), _by_data(free, [*few, many]))
    theirs = None if other is None else wrong_share(other, image, sets[2])
    run.step()
    wrong = float(many.n_mismatched.mean() / many.hard_data.n)
    found = [of_data(wrong, many.hard_data.n, theirs), _varied(many)]
    return Outcome(blocks, (*found, *_conditional_times(run, free, many)))


def _conditional_maps(
    many: Ensemble, image: TrainingImage, data: HardData, other: NDArray | None
) -> tuple[Block, ...]:
    shown = [
        paper_map(one, image, f"Realization {r}, {data.n} data", data)
        for r, one in enumerate(many.indices[:SHOWN], start=1)
    ]
    last = image.n_facies - 1
    caption = f"E-type of {many.n} realizations: probability of {image.facies_names[last]}"
    shares = etype(many).probability[last]
    average = [share_picture(shares, f"{caption}, dark never, yellow always")]
    if other is not None:
        shares = etype(Stack(other, image.codes)).probability[last]
        average.append(paper_map(other[0], image, "The authors' code, same study", data))
        average.append(share_picture(shares, f"E-type of its {len(other)} realizations at hand"))
    return Row(tuple(shown)), Row(tuple(average))


def _by_data(free: Ensemble, runs: list[Ensemble]) -> Table:
    rows: list[tuple[str, ...]]
    rows = [("0", str(free.n), "–", "–", "–", seconds(median_seconds(free)))]
    for e in runs:
        counts = (f"{n.mean():.1f}" for n in (e.n_mismatched, e.n_resimulated, e.n_forced))
        rows.append((str(e.hard_data.n), str(e.n), *counts, seconds(median_seconds(e))))
    header = ("data", "realizations", "wrong", "re-simulated", "forced", "CPU time (median)")
    caption = (
        f"{free.grid.nx} × {free.grid.ny} cells, level {LEVEL}, {SETTINGS}. Data: mean over "
        "realizations; re-simulated: honoured by local re-simulation after the raster pass; "
        "forced: no window fitted."
    )
    return Table(header, tuple(rows), caption)


def _varied(many: Ensemble) -> Judgement:
    """Judge whether the E-type is certain at the data and open far from them."""
    cells = many.hard_data.cells
    shares = many.probability(int(many.training_image.codes[-1]))
    at_data = shares[cells[:, 0], cells[:, 1]]
    certain = float(np.mean((at_data == 0) | (at_data == 1)))
    open_cells = float(np.mean((shares > 0) & (shares < 1)))
    found = (
        f"The E-type is certain at {percent(certain)} of the data and open at "
        f"{percent(open_cells)} of all cells."
    )
    claim = "Fig. 7: three distinct realizations and their average, which follows the data."
    return of_claim(claim, found, certain == 1 and open_cells > 0.5)


def _conditional_times(run: ExperimentRun, free: Ensemble, many: Ensemble) -> list[Judgement]:
    ours, stated = median_seconds(many), stated_seconds("Fig. 7")
    full, what = run.extent.is_full, "a realization (mean of 100)"
    time = of_time(what, ours, stated, "Fig. 7", full)
    if not full:
        return [time]
    ratio, theirs = ours / median_seconds(free), stated / stated_seconds("Fig. 6")
    claim = (
        f"Conditional realizations (2.42 s, Fig. 7) take {theirs:.2f} times as long as "
        "unconditional ones (6.52 s, Fig. 6); grids and levels of the two are not at hand."
    )
    found = f"On one grid and level, conditional ones take {ratio:.2f} times as long."
    return [time, of_ratio(claim, found, ratio, theirs)]


def statistics(run: ExperimentRun) -> Outcome:
    """Simulate as for Fig. 7 and compare curves along both axes with the training image's."""
    run.expect(6)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    shape, code = (side, side), int(image.codes[-1])
    data = run.inputs.data("channel", 400, shape)
    many = run.simulate(image, shape, paper_parameters("ccwsim", LEVEL), data, run.extent.n_many)
    lags = lags_for(image.shape, shape, largest=run.extent.largest_lag)
    blocks: list[Block] = []
    judgements = []
    for statistic in STATISTICS:
        charts, bundles = [], []
        for way in ("E-W", "N-S"):
            bundle = bundle_of(statistic, many, image, code, way, lags)
            top, name = 1.1 * float(np.nanmax(bundle.each)), image.facies_names[-1]
            charts.append(bundle_chart(bundle, statistic, way, name, top, 220))
            bundles.append(bundle)
            run.step()
        blocks.append(Row(tuple(charts)))
        judgements.append(_surrounded(bundles, statistic))
    stacks = {"CCWSIM": many.indices}
    for code in ("CCWSIM", "MS-CCSIM"):
        found = published(run, image, f"{code}_channel512_hd400_L{LEVEL}", shape)
        if found is not None:
            stacks[f"published {code}"] = found
    tau = {name: relative_tau(images, image) for name, images in stacks.items()}
    if len(stacks) > 1:
        blocks.append(Row((connectivity_chart(stacks, image, "E-W", lags),)))
    blocks.append(_tau_table(tau, stacks))
    run.step()
    return Outcome(tuple(blocks), (*judgements, *_against_codes(tau)))


def _tau_table(tau: dict[str, dict[int, float]], stacks: dict[str, NDArray]) -> Table:
    lags = next(iter(tau.values())).keys()
    header = ("realizations", "n", *(f"τ at {lag} cells" for lag in lags))
    rows = tuple(
        (name, str(len(stacks[name])), *(f"{v:.2f}" for v in found.values()))
        for name, found in tau.items()
    )
    return Table(header, rows, f"Connectivity E–W relative to the training image's, level {LEVEL}.")


def _surrounded(bundles: list[Bundle], statistic: Statistic) -> Judgement:
    """Judge whether the image's curve is among those of the realizations, E–W and N–S."""
    shares = [_among(bundle) for bundle in bundles]
    what = "variograms" if statistic == "variogram" else "probabilities of connection"
    found = (
        f"The image's curve is among the realizations' at {percent(shares[0])} of the lags E–W "
        f"and {percent(shares[1])} N–S."
    )
    claim = f"Fig. 9: {what} of the image and of 100 realizations; its curves are not at hand."
    return judged(claim, found, "surrounded" if min(shares) >= ENOUGH else "in part")


def _among(bundle: Bundle) -> float:
    low, high = np.nanmin(bundle.each, axis=0), np.nanmax(bundle.each, axis=0)
    slack = SLACK * float(np.nanmax(bundle.reference))
    among = (bundle.reference >= low - slack) & (bundle.reference <= high + slack)
    return float(among[1:].mean())


def _against_codes(tau: dict[str, dict[int, float]]) -> list[Judgement]:
    """Judge our connectivity against the published codes', at the largest lag."""
    judgements = []
    lag, ours = list(tau["CCWSIM"].items())[-1]
    for name, found in tau.items():
        if name == "CCWSIM":
            continue
        theirs = found[lag]
        words = f"At {lag} cells {ours:.2f} of the image's connectivity; {name}: {theirs:.2f}."
        word = word_of(int(ours - theirs > SLACK) - int(theirs - ours > SLACK))
        judgements.append(judged(f"Connectivity of {name}, same study.", words, word))
    return judgements
