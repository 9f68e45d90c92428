"""Experiments on realizations of CCWSIM and their statistics (sections 5.1 to 5.3, 5.7 to 5.9)."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ccwsim import Ensemble, HardData, TrainingImage, datasets
from ccwsim.figures import Bundle
from ccwsim.metrics import Stationarity, etype, stationarity
from ccwsim.metrics.bands import STATISTICS, Statistic
from ccwsim.metrics.stack import Stack
from ccwsim.model.numbers import duration
from ccwsim.paper import methods, verdicts
from ccwsim.paper.experiment import TEXTS, ExperimentRun, Outcome, said
from ccwsim.paper.methods import SETTINGS
from ccwsim.paper.published_times import OCTAVE, published_time, stated_seconds
from ccwsim.paper.verdicts import percent
from ccwsim.report.document import Block, Judgement, Picture, Row, Table, Text
from ccwsim.report.pictures import bundle_chart, bundle_of, share_picture
from ccwsim.report.settings import caption_of

SHOWN = 3
LEVEL = 2
CLOSE_SHARE = 0.03  # a proportion is reproduced if it differs by at most this
CLOSE_TAU = 0.85  # connectivity is reproduced if its ratio to the image's is at least this
ENOUGH = 0.8  # minimum share of lags at which realizations surround the image's curve
SLACK = 0.02
RECOVERED = 0.9  # minimum share of reference cells that dense data recover
TEMPLATE = 48  # template size of the authors' runs with three facies
NONSTATIONARY = ("delta", "bend")
KEPT = 0.5  # a trend is lost if realizations keep a smaller mean share


def unconditional(run: ExperimentRun) -> Outcome:
    """Run the channel image at levels 1 to 3; compare proportions, patterns and connectivity."""
    run.expect(4)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    runs = [
        run.simulate(
            image,
            (side, side),
            methods.paper_parameters("ccwsim", level),
            n=run.extent.n_few,
            workers=1,
        )
        for level in (1, 2, 3)
    ]
    rows = [_measures(f"ours, level {e.parameters.level}", e.indices, image, e) for e in runs]
    published_images = methods.published(run, image, "CCWSIM_channel256_uncond_L2", (256, 256))
    if published_images is not None:
        rows.append(_measures("authors' code, level 2, 256 × 256 cells", published_images, image))
    run.step()
    shown = runs[1]
    first = methods.image_picture(image, run.inputs.describe("channel"))
    share = f"{image.facies_names[-1]} (image: {percent(float(image.proportions[-1]))})"
    distances = "pattern distance 1, 1/2, 1/3"
    header = ("realizations", share, distances, "τ E–W at 41 cells", "at 81 cells", "CPU time")
    caption = said("unconditional", side=side, settings=SETTINGS)
    remark = said("unknown_grid", side=side)
    table = Table(header, tuple(rows), caption)
    blocks = (Row((first, *_maps(shown, "level 2"))), table, Text(remark, quiet=True))
    what = "a realization (mean); grid and level are unknown"
    time = _judged_time(run, shown, what, "Fig. 6")
    return Outcome(blocks, (_reproduced(shown, image), time))


def _measures(
    name: str, images: NDArray, image: TrainingImage, ensemble: Ensemble | None = None
) -> tuple[str, ...]:
    share = float(np.mean(images == image.n_facies - 1))
    tau = list(methods.relative_tau(images, image).values())
    near, far = (f"{tau[k]:.2f}" if k < len(tau) else "–" for k in (1, 3))
    time = duration(methods.median_seconds(ensemble)) if ensemble else "–"
    distances = methods.format_distances(methods.mean_distances(images, image))
    return name, percent(share), distances, near, far, time


def _reproduced(ensemble: Ensemble, image: TrainingImage) -> Judgement:
    share, reference = float(ensemble.proportions.mean(axis=0)[-1]), float(image.proportions[-1])
    lag, tau = list(methods.relative_tau(ensemble.indices, image).items())[-1]
    name = image.facies_names[-1].capitalize()
    finding = said(
        "reproduced", name=name, lag=lag, tau=tau, own=percent(share), image=percent(reference)
    )
    holds = abs(share - reference) <= CLOSE_SHARE and tau >= CLOSE_TAU
    claim = "Fig. 6: three realizations whose channels look like the training image's."
    return verdicts.of_claim(claim, finding, holds)


def _judged_time(run: ExperimentRun, ensemble: Ensemble, what: str, where: str) -> Judgement:
    """Judge our CPU time of a realization against the time that the paper states for a figure."""
    ours, full = methods.median_seconds(ensemble), run.extent.is_full
    return verdicts.of_time(what, ours, stated_seconds(where), where, full)


def conditional(run: ExperimentRun) -> Outcome:
    """Simulate the channel image with 100, 300 and 400 hard data."""
    run.expect(5)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    shape, p, n = (side, side), methods.paper_parameters("ccwsim", LEVEL), run.extent.n_few
    sets = [run.inputs.data("channel", n_data, shape) for n_data in (100, 300, 400)]
    unconditioned = run.simulate(image, shape, p, n=n, workers=1)
    few = [run.simulate(image, shape, p, data, n, workers=1) for data in sets[:2]]
    many = run.simulate(image, shape, p, sets[2], run.extent.n_many)
    published_images = methods.published(run, image, f"CCWSIM_channel512_hd400_L{LEVEL}", shape)
    blocks = (
        *_conditional_maps(many, image, sets[2], published_images),
        _by_data(unconditioned, [*few, many]),
    )
    theirs = (
        None if published_images is None else methods.wrong_share(published_images, image, sets[2])
    )
    run.step()
    wrong = float(many.n_mismatched.mean() / many.hard_data.n)
    judgements = [verdicts.of_data(wrong, many.hard_data.n, theirs), _varied(many)]
    return Outcome(blocks, (*judgements, *_conditional_times(run, unconditioned, many)))


def _conditional_maps(
    ensemble: Ensemble, image: TrainingImage, data: HardData, published_images: NDArray | None
) -> tuple[Block, ...]:
    last = image.n_facies - 1
    caption = f"E-type of {ensemble.n} realizations: probability of {image.facies_names[last]}"
    shares = etype(ensemble).probability[last]
    average = [share_picture(shares, f"{caption}, from dark blue (0) to yellow (1)")]
    if published_images is not None:
        shares = etype(Stack(published_images, image.codes)).probability[last]
        average.append(
            methods.paper_map(published_images[0], image, "The authors' code, same study", data)
        )
        average.append(
            share_picture(shares, f"E-type of its {len(published_images)} available realizations")
        )
    return Row(_maps(ensemble, f"{data.n} data", data)), Row(tuple(average))


def _maps(e: Ensemble, what: str, data: HardData | None = None) -> tuple[Picture, ...]:
    """Return pictures of the first realizations, with hard data."""
    return tuple(
        methods.paper_map(indices, e.training_image, f"Realization {r}, {what}", data)
        for r, indices in enumerate(e.indices[:SHOWN], start=1)
    )


def _by_data(unconditioned: Ensemble, runs: list[Ensemble]) -> Table:
    rows: list[tuple[str, ...]]
    rows = [
        ("0", str(unconditioned.n), "–", "–", "–", duration(methods.median_seconds(unconditioned)))
    ]
    for e in runs:
        counts = (f"{n.mean():.1f}" for n in (e.n_mismatched, e.n_resimulated, e.n_forced))
        rows.append((str(e.hard_data.n), str(e.n), *counts, duration(methods.median_seconds(e))))
    header = ("data", "realizations", "wrong", "re-simulated", "forced", "CPU time (median)")
    caption = said(
        "by_data",
        nx=unconditioned.grid.nx,
        ny=unconditioned.grid.ny,
        level=LEVEL,
        settings=SETTINGS,
    )
    return Table(header, tuple(rows), caption)


def _varied(ensemble: Ensemble) -> Judgement:
    """Judge whether the E-type is certain at the data and uncertain far from them."""
    cells = ensemble.hard_data.cells
    shares = ensemble.probability(int(ensemble.training_image.codes[-1]))
    at_data = shares[cells[:, 0], cells[:, 1]]
    certain = float(np.mean((at_data == 0) | (at_data == 1)))
    open_cells = float(np.mean((shares > 0) & (shares < 1)))
    finding = said("e_type", certain=percent(certain), uncertain=percent(open_cells))
    claim = "Fig. 7: three distinct realizations and their average, which follows the data."
    return verdicts.of_claim(claim, finding, certain == 1 and open_cells > 0.5)


def _conditional_times(
    run: ExperimentRun, unconditioned: Ensemble, conditioned: Ensemble
) -> list[Judgement]:
    time = _judged_time(run, conditioned, "a realization (mean of 100)", "Fig. 7")
    if not run.extent.is_full:
        return [time]
    ratio = methods.median_seconds(conditioned) / methods.median_seconds(unconditioned)
    theirs = stated_seconds("Fig. 7") / stated_seconds("Fig. 6")
    claim = said("conditional_time", theirs=theirs)
    finding = (
        f"On the same grid and level, conditional realizations take {ratio:.2f} times as long."
    )
    return [time, verdicts.of_ratio(claim, finding, ratio, theirs)]


def statistics(run: ExperimentRun) -> Outcome:
    """Simulate as for Fig. 7; compare curves along both axes with the training image's curves."""
    run.expect(6)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    shape, code = (side, side), int(image.codes[-1])
    data = run.inputs.data("channel", 400, shape)
    ensemble = run.simulate(
        image, shape, methods.paper_parameters("ccwsim", LEVEL), data, run.extent.n_many
    )
    lags = methods.lags_for(image.shape, shape, largest=run.extent.largest_lag)
    blocks: list[Block] = []
    judgements = []
    for statistic in STATISTICS:
        charts, bundles = [], []
        for direction in ("E-W", "N-S"):
            bundle = bundle_of(
                statistic, ensemble, image, facies=code, direction=direction, lags=lags
            )
            top, name = 1.1 * float(np.nanmax(bundle.each)), image.facies_names[-1]
            charts.append(bundle_chart(bundle, statistic, direction, name, top=top, height=220))
            bundles.append(bundle)
            run.step()
        blocks.append(Row(tuple(charts), f"{caption_of(ensemble)}."))
        judgements.append(_surrounded(bundles, statistic))
    stacks = {"CCWSIM": ensemble.indices}
    for method in ("CCWSIM", "MS-CCSIM"):
        images = methods.published(run, image, f"{method}_channel512_hd400_L{LEVEL}", shape)
        if images is not None:
            stacks[f"published {method}"] = images
    tau = {name: methods.relative_tau(images, image) for name, images in stacks.items()}
    if len(stacks) > 1:
        chart = methods.connectivity_chart(stacks, image, lags)
        blocks.append(Row((chart,), methods.caption_of_cases(ensemble)))
    header = ("realizations", "n", *(f"τ at {lag} cells" for lag in tau["CCWSIM"]))
    rows = []
    for name, by_lag in tau.items():
        rows.append((name, str(len(stacks[name])), *(f"{v:.2f}" for v in by_lag.values())))
    caption = f"Connectivity E–W relative to the training image's, level {LEVEL}."
    blocks.append(Table(header, tuple(rows), caption))
    run.step()
    return Outcome(tuple(blocks), (*judgements, *_against_codes(tau)))


def _surrounded(bundles: list[Bundle], statistic: Statistic) -> Judgement:
    """Judge whether the image's curve is among the realizations' curves, E–W and N–S."""
    shares = []
    for bundle in bundles:
        low, high = np.nanmin(bundle.each, axis=0), np.nanmax(bundle.each, axis=0)
        slack = SLACK * float(np.nanmax(bundle.reference))
        among = (bundle.reference >= low - slack) & (bundle.reference <= high + slack)
        shares.append(float(among[1:].mean()))
    what = "variograms" if statistic == "variogram" else "probability of connection E–W"
    finding = said("surrounded", ew=percent(shares[0]), ns=percent(shares[1]))
    claim = f"Fig. 9: {what} of the image and of 100 realizations; the paper has no numbers."
    judged = shares if statistic == "variogram" else shares[:1]  # Fig. 9: connection E–W only
    return verdicts.judged(claim, finding, "surrounded" if min(judged) >= ENOUGH else "in part")


def _against_codes(tau: dict[str, dict[int, float]]) -> Iterator[Judgement]:
    """Judge our connectivity against the published codes' connectivity at the largest lag."""
    claim = "Connectivity of the authors' codes, same study."
    lag, ours = list(tau["CCWSIM"].items())[-1]
    for name, theirs_by_lag in tau.items():
        if name != "CCWSIM":
            theirs = theirs_by_lag[lag]
            words = f"Relative to the image's τ({lag}): ours {ours:.2f}, {name} {theirs:.2f}."
            yield verdicts.of_order(claim, words, verdicts.sign_of(ours - theirs, SLACK))


def dense_data(run: ExperimentRun) -> Outcome:
    """Simulate the channel image with dense data; compare the cells with the reference image."""
    run.expect(2)
    image, side = run.inputs.image("channel"), run.extent.side(256)
    shape = side, side
    data, reference = run.inputs.dense_reference(shape)
    truth = np.searchsorted(image.codes, reference.array).astype(np.uint8)
    p = methods.paper_parameters("ccwsim", LEVEL)
    e = run.simulate(image, shape, p, data, run.extent.n_few, workers=1)
    published_images = methods.published(run, image, f"CCWSIM_channel256_dense4000_L{LEVEL}", shape)
    pictures = [
        methods.paper_map(truth, image, "Reference image"),
        methods.paper_map(e.indices[0], image, f"Realization 1 of ours, {data.n} data"),
    ]
    if published_images is not None:
        pictures.append(
            methods.paper_map(published_images[0], image, "The authors' code, same data")
        )
    shares = e.probability(int(image.codes[-1]))
    caption = f"Probability of {image.facies_names[-1]}, {e.n} of ours"
    pictures.append(share_picture(shares, caption))
    stacks = {"ours": e.indices} | (
        {"authors' code": published_images} if published_images is not None else {}
    )
    rows = []
    for name, images in stacks.items():
        as_reference = percent(np.mean(images == truth))
        wrong = percent(methods.wrong_share(images, image, data))
        tau = (f"{v:.2f}" for v in methods.relative_tau(images, image).values())
        rows.append((name, str(len(images)), as_reference, wrong, *tau))
    lags = (f"τ at {lag}" for lag in methods.relative_tau(e.indices, image))
    header = ("realizations", "n", "cells as in the reference", "data wrong", *lags)
    caption = f"{side} × {side} cells, {data.n} data, level {LEVEL}; τ E–W "
    table = Table(header, tuple(rows), f"{caption}relative to the training image's.")
    run.step()
    return Outcome(
        (Row(tuple(pictures)), table), _dense_judgements(run, e, truth, published_images)
    )


def _dense_judgements(
    run: ExperimentRun, e: Ensemble, reference: NDArray, published_images: NDArray | None
) -> tuple[Judgement, ...]:
    image, data = e.training_image, e.hard_data
    share, missed = float(np.mean(e.indices == reference)), None
    finding = f"{percent(share)} of the cells agree with the reference image."
    claim = "Fig. 14: three simulations with 4000 data beside their reference image."
    judgement = verdicts.of_claim(claim, finding, share >= RECOVERED)
    if published_images is not None:
        theirs = np.mean(published_images == reference)
        missed = methods.wrong_share(published_images, image, data)
        finding += f" With the authors' code: {percent(theirs)}."
        judgement = verdicts.of_order(claim, finding, 1 if share > theirs else -1)
    honoured = verdicts.of_data(float(e.n_mismatched.mean() / data.n), data.n, missed)
    what = "a realization with about 4000 data (mean)"
    return judgement, honoured, _judged_time(run, e, what, "Fig. 14")


def three_facies(run: ExperimentRun) -> Outcome:
    """Simulate the three-facies image with the authors' template size of 48."""
    run.expect(2)
    image, side = run.inputs.image("three facies"), run.extent.side(1000)
    data = run.inputs.data("three facies", 400, (side, side))
    p = methods.paper_parameters("ccwsim", LEVEL, template=TEMPLATE)
    e = run.simulate(image, (side, side), p, data, run.extent.n_few, workers=1)
    entropy = etype(e).entropy
    pictures = (
        methods.image_picture(image, run.inputs.describe("three facies"), share=0.5),
        methods.paper_map(e.indices[0], image, f"Realization 1, {data.n} data", data),
        share_picture(entropy, f"Entropy of {e.n} realizations: 0 in dark blue, 1 in yellow"),
    )
    run.step()
    return Outcome((Row(pictures), _proportions(e)), _facies_judgements(run, e))


def _proportions(e: Ensemble) -> Table:
    image, rows = e.training_image, []
    for k, name in enumerate(image.facies_names):
        shares = e.proportions[:, k]
        ti, mean, low, high = map(
            percent, (image.proportions[k], shares.mean(), shares.min(), shares.max())
        )
        rows.append((name, ti, mean, f"{low} to {high}"))
    header = ("facies", "training image", f"mean of {e.n} realizations", "from, to")
    caption = f"{e.grid.nx} × {e.grid.ny} cells, T {TEMPLATE}, OR 8, level {LEVEL}"
    return Table(header, tuple(rows), caption)


def _facies_judgements(run: ExperimentRun, e: Ensemble) -> tuple[Judgement, ...]:
    image = e.training_image
    off = float(np.abs(e.proportions.mean(axis=0) - image.proportions).max())
    wrong = float(e.n_mismatched.mean() / e.hard_data.n)
    octave = published_time(
        OCTAVE, "ccwsim", LEVEL, n_cells=e.grid.nx * e.grid.ny, n_data=400, image="three facies"
    )
    theirs = octave.wrong_share if octave and run.inputs.is_own("three facies") else None
    claim = "Section 5.8: more than two facies can be simulated."
    finding = f"All {image.n_facies} facies occur, each within {percent(off)} of its share of the "
    what = "a realization of three facies on 1000 × 1000 cells"
    return (
        verdicts.of_claim(claim, f"{finding}image.", off <= CLOSE_SHARE),
        verdicts.of_data(wrong, e.hard_data.n, theirs),
        _judged_time(run, e, what, "Fig. 16"),
    )


def limits(run: ExperimentRun) -> Outcome:
    """Simulate nonstationary bundled images, and measure the share of their trends that is kept."""
    run.expect(2 * len(NONSTATIONARY))
    blocks: list[Block] = []
    judgements: list[Judgement] = []
    rows = []
    for name in NONSTATIONARY:
        image = datasets.load(name)
        ny, nx = (run.extent.side(side) for side in image.shape)
        e = run.simulate(
            image, (ny, nx), methods.paper_parameters("ccwsim", LEVEL), n=run.extent.n_few
        )
        of_image = stationarity(image)
        of_realizations = [stationarity(realization, image.codes) for realization in e]
        caption = f"Mean of {e.n} realizations: probability of {image.facies_names[-1]}"
        mean = share_picture(e.probability(int(image.codes[-1])), caption)
        first = methods.paper_map(e.indices[0], image, "Realization 1")
        whole = methods.image_picture(image, f"our bundled “{name}”", share=1.0)
        blocks.append(Row((whole, first, mean)))
        rows.append(_quarters(name, image, of_image, of_realizations))
        judgements.append(_trend(name, of_image, of_realizations))
        run.step()
    header = ("image", "facies", "share by quarter, image", "share by quarter, realizations")
    table = Table(header, tuple(rows), "Quarters SW, SE, NW, NE; mean of the realizations.")
    remark = Text(TEXTS["nonstationary"], quiet=True)
    return Outcome((*blocks, table, remark), tuple(judgements))


def _quarters(
    name: str, image: TrainingImage, of_image: Stationarity, of_realizations: list[Stationarity]
) -> tuple[str, ...]:
    """Return the share per quarter of the facies whose share differs most between quarters."""
    k = int(np.argmax(of_image.proportions.std(axis=0)))
    simulated = np.mean([realization.proportions for realization in of_realizations], axis=0)
    shown = [
        ", ".join(percent(float(v)) for v in p[:, k]) for p in (of_image.proportions, simulated)
    ]
    return name, image.facies_names[k], *shown


def _trend(name: str, of_image: Stationarity, of_realizations: list[Stationarity]) -> Judgement:
    """Judge the trend: regress the realizations' differences between quarters on the image's."""
    lags = min(one.variograms.shape[-1] for one in (of_image, *of_realizations))
    apart = of_image.variograms[..., :lags] - of_image.variograms[..., :lags].mean(axis=0)
    mean = np.mean([realization.variograms[..., :lags] for realization in of_realizations], axis=0)
    kept = float(np.sum(apart * (mean - mean.mean(axis=0))) / np.sum(apart**2))
    finding = said("kept", name=name, kept=percent(kept))
    claim = "Section 5.9: nonstationary training images are a limit of the method."
    return verdicts.of_claim(claim, finding, kept < KEPT)
