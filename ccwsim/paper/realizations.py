"""Figures of realizations, and their statistics (sections 5.1 to 5.3 and 5.7 to 5.9)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ccwsim import Ensemble, HardData, TrainingImage
from ccwsim.figures import Bundle
from ccwsim.metrics import Stationarity, etype, main_direction, stationarity
from ccwsim.metrics.bands import STATISTICS, Statistic, curves_of
from ccwsim.metrics.stack import Stack
from ccwsim.model import Bytes, Variant, duration
from ccwsim.paper import methods, verdicts
from ccwsim.paper.experiment import PAPER_TEXTS, ExperimentRun, Outcome, said, sample_as_dense
from ccwsim.paper.methods import AUTHORS_SETTINGS, COLUMNS, COMPARED
from ccwsim.paper.published_times import stated_seconds
from ccwsim.paper.verdicts import percent
from ccwsim.report.document import Block, Judgement, Picture, PictureRow, Table, Text
from ccwsim.report.pictures import bundle_chart, bundle_of_curves, share_picture
from ccwsim.report.settings import caption_of

SHOWN = 3
CLOSE_SHARE = 0.03  # a proportion is reproduced if it differs by at most this
CLOSE_TAU = 0.85  # connectivity is reproduced if its ratio to the image's is at least this
ENOUGH = 0.8  # minimum share of lags at which realizations surround the image's curve
TAU_TOLERANCE = 0.02
RECOVERED = 0.9  # minimum share of reference cells that dense data recover
MIN_KEPT_TREND = 0.5  # a trend is lost if realizations keep a smaller mean share


@dataclass(frozen=True)
class MapFigure:
    """A study whose realizations a figure of the paper shows."""

    where: str  # the figure
    image: str  # name of the training image in the texts
    side: int  # side of the square grid in cells
    what: str = "a realization (mean); grid and level are unknown"  # what a stated time is of
    n_data: int = 0
    level: int = 2
    template: int = 32
    sampled: bool = False  # whether data are sampled from the image itself, not from another field
    many: bool = False  # whether the paper has 100 realizations
    curves: bool = False  # whether the report shows variograms and connectivity
    shows_truth: bool = False  # whether the figure shows the field from which data are sampled
    stored: str = ""  # file of the authors' realizations of the study
    judged: tuple[str, ...] = ()  # keys of `JUDGES`


@dataclass(eq=False)
class FigureResults:
    """The realizations of a figure's study as published and by our method, and its inputs."""

    run: ExperimentRun
    figure: MapFigure
    image: TrainingImage
    data: HardData | None
    truth: Bytes | None  # facies indices of the field from which data are sampled
    authors: Bytes | None  # stored realizations of the authors' code
    ensembles: dict[Variant, Ensemble] = field(default_factory=dict)

    @property
    def stacks(self) -> dict[str, Bytes]:
        """Facies indices of all realizations, by the title of their column."""
        stacks = {COLUMNS[variant]: e.indices for variant, e in self.ensembles.items()}
        return stacks if self.authors is None else stacks | {COLUMNS["authors"]: self.authors}

    @cached_property
    def curves(self) -> dict[tuple[Variant, Statistic], dict[Any, Bundle]]:
        """Curves of the last facies by direction; charts and verdicts share them."""
        image = self.image
        code, shape = int(image.codes[-1]), self.ensembles["ours"].grid.shape
        lags = methods.lags_for(image.shape, shape, largest=self.run.extent.largest_lag)
        along = float(round(main_direction(image, code)[0]))
        connected = ("E-W", "N-S") if along % 90 == 0 else ("E-W", along)
        ways = {"variogram": ("E-W", "N-S"), "connectivity": connected}
        return {
            (variant, statistic): {
                way: bundle_of_curves(
                    lags.astype(float),
                    curves_of(statistic, image, code, way, lags)[0],
                    curves_of(statistic, e, code, way, lags),
                )
                for way in ways[statistic]
            }
            for variant, e in self.ensembles.items()
            for statistic in STATISTICS
        }


def show_figure(figure: MapFigure, run: ExperimentRun) -> Outcome:
    """Repeat a figure of realizations with the published method and with ours."""
    run.expect(3)
    results = _simulated(figure, run)
    blocks = [*_pictures(results)]
    if figure.curves:
        blocks += _curves(results)
    blocks.append(_three_columns(results))
    if note := PAPER_TEXTS["notes"].get(figure.image):
        blocks.append(Text(note, quiet=True))
    run.step()
    judgements = [judgement for name in figure.judged for judgement in JUDGES[name](results)]
    return Outcome(tuple(blocks), tuple(judgements))


def _simulated(figure: MapFigure, run: ExperimentRun) -> FigureResults:
    """Simulate a figure's study with each of the compared variants."""
    image, side = run.inputs.image(figure.image), run.extent.side(figure.side)
    shape = (side, side)
    if figure.sampled:
        shape = (min(side, image.shape[0]), min(side, image.shape[1]))
    data, truth = figure_data(figure, run, image, shape)
    authors = methods.published(run, image, figure.stored, shape) if figure.stored else None
    results = FigureResults(run, figure, image, data=data, truth=truth, authors=authors)
    n = run.extent.n_many if figure.many else run.extent.n_few
    for variant in COMPARED:
        p = methods.paper_parameters("ccwsim", figure.level, variant, figure.template)
        results.ensembles[variant] = run.simulate(
            image, shape, p, data, n, workers=None if figure.many else 1
        )
    return results


def figure_data(
    figure: MapFigure, run: ExperimentRun, image: TrainingImage, shape: tuple[int, int]
) -> tuple[HardData | None, Bytes | None]:
    """Return a figure's data, and the facies indices of the field they are from, if it is shown.

    The data are the authors' or, if these are not available, data sampled as in section 5.2.
    """
    if not figure.n_data:
        return None, None
    if figure.sampled:
        truth = image.array[: shape[0], : shape[1]]
        data = sample_as_dense(truth, figure.n_data, image.array.size, run.seed)
    else:
        data, truth = run.data(figure.image, image, figure.n_data, shape, figure.side)
    if truth is None or not figure.shows_truth:
        return data, None
    return data, np.searchsorted(image.codes, truth).astype(np.uint8)


def _pictures(results: FigureResults) -> Iterator[Block]:
    """Return rows of pictures: training image and reference, realizations, and E-types."""
    image, data, run = results.image, results.data, results.run
    first = [methods.image_picture(image, run.inputs.describe(results.figure.image))]
    if results.truth is not None:
        first.append(methods.paper_map(results.truth, image, "Reference image"))
    yield PictureRow(tuple(first))
    for title, images in results.stacks.items():
        captions = (f"{title.capitalize()}, realization {r}" for r in range(1, SHOWN + 1))
        maps = [
            methods.paper_map(one, image, caption, data)
            for one, caption in zip(images, captions, strict=False)
        ]
        yield PictureRow(tuple(maps))
    if data is not None:
        yield PictureRow(tuple(_average(results, *each) for each in results.stacks.items()))


def _average(results: FigureResults, title: str, images: Bytes) -> Picture:
    """Return the E-type of a column or, for more than two facies, its entropy."""
    image = results.image
    of = etype(Stack(images, image.codes))
    if image.n_facies > 2:
        words = f"{title.capitalize()}: entropy of {len(images)} realizations"
        return share_picture(of.entropy, f"{words}, 0 in dark blue, 1 in yellow")
    words = f"{title.capitalize()}: E-type of {len(images)} realizations"
    caption = f"{words}, probability of {image.facies_names[-1]}, from dark blue (0) to yellow (1)"
    return share_picture(of.probability[-1], caption)


def _curves(results: FigureResults) -> Iterator[PictureRow]:
    """Return variograms E–W and N–S, and connectivity E–W and along the bodies (Fig. 9)."""
    for (variant, statistic), bundles in results.curves.items():
        charts = [
            bundle_chart(
                bundle,
                statistic,
                way,
                results.image.facies_names[-1],
                top=1.1 * float(np.nanmax(bundle.each)),
                height=220,
            )
            for way, bundle in bundles.items()
        ]
        yield PictureRow(tuple(charts), f"{caption_of(results.ensembles[variant])}.")


def _three_columns(results: FigureResults) -> Table:
    """Return the measures of a figure: the paper's, as published, and ours."""
    figure, image = results.figure, results.image
    seconds = {COLUMNS[v]: methods.median_seconds(e) for v, e in results.ensembles.items()}
    columns = {
        title: _column(results, images, seconds.get(title))
        for title, images in results.stacks.items()
    }
    stated = stated_seconds(figure.where)
    paper = {"CPU time": "–" if stated is None else duration(stated)}
    names = list(next(iter(columns.values())))
    rows = [
        (name, paper.get(name, "–"), *(column[name] for column in columns.values()))
        for name in names
    ]
    ny, nx = next(iter(results.ensembles.values())).grid.shape
    caption = said(
        "three_columns",
        nx=nx,
        ny=ny,
        n_data="no" if results.data is None else results.data.n,
        level=figure.level,
        settings=AUTHORS_SETTINGS.replace("T 32", f"T {figure.template}"),
        image=image.name,
    )
    return Table(("", "the paper", *columns), tuple(rows), caption)


def _column(results: FigureResults, images: Bytes, seconds: float | None) -> dict[str, str]:
    """Return the measures of some realizations as texts, by name."""
    image, data = results.image, results.data
    column = {"realizations": str(len(images))}
    for k, name in enumerate(image.facies_names):
        own = percent(float(image.proportions[k]))
        column[f"{name} ({own} in the image)"] = percent(float(np.mean(images == k)))
    distances = methods.mean_distances(images, image)
    column["pattern distance at 1, 1/2, 1/3"] = methods.format_distances(distances)
    for lag, tau in list(methods.relative_tau(images, image).items())[1::2]:
        column[f"τ E–W at {lag} cells, relative to the image"] = f"{tau:.2f}"
    if data is not None:
        column["data wrong"] = percent(methods.wrong_share(images, image, data))
    if results.truth is not None:
        column["cells as in the reference"] = percent(float(np.mean(images == results.truth)))
    column["CPU time"] = "–" if seconds is None else duration(seconds)
    return column


def _by_column(results: FigureResults) -> Iterator[tuple[str, Ensemble]]:
    """Return the title and the realizations of each column that this run has simulated."""
    for variant, e in results.ensembles.items():
        yield COLUMNS[variant].capitalize(), e


def _judge_shapes(results: FigureResults) -> Iterator[Judgement]:
    """Judge proportion and connectivity of the last facies."""
    image = results.image
    reference, claim = float(image.proportions[-1]), said("shapes", where=results.figure.where)
    for title, e in _by_column(results):
        own = float(e.proportions.mean(axis=0)[-1])
        lag, tau = list(methods.relative_tau(e.indices, image).items())[-1]
        finding = said(
            "reproduced",
            title=title,
            name=image.facies_names[-1],
            lag=lag,
            tau=tau,
            own=percent(own),
            image=percent(reference),
        )
        holds = abs(own - reference) <= CLOSE_SHARE and tau >= CLOSE_TAU
        yield verdicts.judge_claim(claim, finding, holds)


def _judge_time(results: FigureResults) -> Iterator[Judgement]:
    """Judge the CPU time of the published method against the time that the paper states."""
    figure, where = results.figure, results.figure.where
    stated = stated_seconds(where)
    if stated is not None:
        ours, full = methods.median_seconds(results.ensembles["paper"]), results.run.extent.is_full
        yield verdicts.judge_time(figure.what, ours, stated, where, full)


def _judge_data(results: FigureResults) -> Iterator[Judgement]:
    """Judge the share of data that are not honoured."""
    assert results.data is not None
    theirs = None
    if results.authors is not None:
        theirs = methods.wrong_share(results.authors, results.image, results.data)
    for title, e in _by_column(results):
        wrong = float(e.n_mismatched.mean() / e.hard_data.n)
        yield verdicts.judge_data(wrong, e.hard_data.n, theirs, title)


def _judge_average(results: FigureResults) -> Iterator[Judgement]:
    """Judge whether the E-type is certain at the data and uncertain far from them."""
    claim = said("average", where=results.figure.where)
    for title, e in _by_column(results):
        rows, columns = e.hard_data.cells.T
        shares = e.probability(int(e.training_image.codes[-1]))
        at_data = shares[rows, columns]
        certain = float(np.mean((at_data == 0) | (at_data == 1)))
        open_cells = float(np.mean((shares > 0) & (shares < 1)))
        finding = said(
            "e_type", title=title, certain=percent(certain), uncertain=percent(open_cells)
        )
        yield verdicts.judge_claim(claim, finding, certain == 1 and open_cells > 0.5)


def _judge_curves(results: FigureResults) -> Iterator[Judgement]:
    """Judge whether the image's curves are among the curves of realizations."""
    for (variant, statistic), bundles in results.curves.items():
        what = "variograms" if statistic == "variogram" else "probability of connection"
        claim = said("curves", where=results.figure.where, what=what)
        shares = [_among(bundle) for bundle in bundles.values()]
        title = COLUMNS[variant].capitalize()
        finding = said("surrounded", title=title, shares=" and ".join(map(percent, shares)))
        word = "surrounded" if min(shares) >= ENOUGH else verdicts.IN_PART
        yield verdicts.judged(claim, finding, word)


def _among(bundle: Bundle) -> float:
    """Return the share of lags at which the image's curve is among those of realizations."""
    low, high = np.nanmin(bundle.each, axis=0), np.nanmax(bundle.each, axis=0)
    slack = TAU_TOLERANCE * float(np.nanmax(bundle.reference))
    among = (bundle.reference >= low - slack) & (bundle.reference <= high + slack)
    return float(among[1:].mean())


def _judge_authors(results: FigureResults) -> Iterator[Judgement]:
    """Judge our connectivity against that of the authors' code at the largest lag."""
    if results.authors is None:
        return
    lag, theirs = list(methods.relative_tau(results.authors, results.image).items())[-1]
    for title, e in _by_column(results):
        ours = methods.relative_tau(e.indices, results.image)[lag]
        finding = f"{title}: {ours:.2f} of the image's τ({lag}), the authors' code {theirs:.2f}."
        order = verdicts.sign_of(ours - theirs, TAU_TOLERANCE)
        yield verdicts.judge_order("Connectivity of the authors' code, same study.", finding, order)


def _judge_reference(results: FigureResults) -> Iterator[Judgement]:
    """Judge how many cells of the reference image dense data recover."""
    claim = said("recovered", where=results.figure.where, n=results.figure.n_data)
    for title, e in _by_column(results):
        share = float(np.mean(e.indices == results.truth))
        finding = f"{title}: {percent(share)} of the cells agree with the reference image."
        yield verdicts.judge_claim(claim, finding, share >= RECOVERED)


def _judge_facies(results: FigureResults) -> Iterator[Judgement]:
    """Judge whether all facies occur in their proportions."""
    for title, e in _by_column(results):
        off = float(np.abs(e.proportions.mean(axis=0) - results.image.proportions).max())
        finding = said("facies", title=title, n=results.image.n_facies, off=percent(off))
        yield verdicts.judge_claim(PAPER_TEXTS["claims"]["facies"], finding, off <= CLOSE_SHARE)


def _judge_trend(results: FigureResults) -> Iterator[Judgement]:
    """Judge by the slope of the realizations' differences between quarters on the image's."""
    own = stationarity(results.image)
    for title, e in _by_column(results):
        kept = _kept_trend(own, [stationarity(one, results.image.codes) for one in e])
        finding = said("kept", title=title, kept=percent(kept))
        yield verdicts.judge_claim(PAPER_TEXTS["claims"]["trend"], finding, kept < MIN_KEPT_TREND)


def _kept_trend(own: Stationarity, each: list[Stationarity]) -> float:
    """Return the share of the differences between an image's quarters that realizations keep."""
    lags = min(own.variograms.shape[-1], *(one.variograms.shape[-1] for one in each))
    apart = own.variograms[..., :lags] - own.variograms[..., :lags].mean(axis=0)
    mean = np.mean([one.variograms[..., :lags] for one in each], axis=0)
    return float(np.sum(apart * (mean - mean.mean(axis=0))) / np.sum(apart**2))


JUDGES: dict[str, Callable[[FigureResults], Iterator[Judgement]]] = {
    "shapes": _judge_shapes,
    "time": _judge_time,
    "data": _judge_data,
    "average": _judge_average,
    "curves": _judge_curves,
    "authors": _judge_authors,
    "reference": _judge_reference,
    "facies": _judge_facies,
    "trend": _judge_trend,
}
"""Judgements of a figure, by the names in the texts of the experiments."""
