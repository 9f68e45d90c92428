"""Compare CCWSIM with MS-CCSIM on two images, also by ANODI (sections 5.4, 5.5)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim import HardData, TrainingImage
from ccwsim.datasets.sampling import sample_random
from ccwsim.figures import LIGHT, Group, mds_chart, mds_title
from ccwsim.metrics import Anodi, anodi
from ccwsim.metrics.stack import Stack
from ccwsim.model.numbers import duration
from ccwsim.model.watch import Watch
from ccwsim.paper import methods, verdicts
from ccwsim.paper.experiment import IMAGES, TEXTS, ExperimentRun, Outcome, said
from ccwsim.paper.methods import DEFAULT, SETTINGS, TITLES
from ccwsim.paper.published_times import TABLE_1
from ccwsim.paper.verdicts import percent
from ccwsim.report.document import Block, Chart, Judgement, Row, Table, Text

METHODS = ("ccwsim", "ms-ccsim")
N_DATA = 1000
LEVELS = (1, 3)
LIKE_TAU = 0.02  # relative connectivities count as alike up to this difference
LIKE_SHARE = 0.03  # shares of wrong data count as alike up to this difference
LIKE_DISTANCE = 1.1  # pattern distances count as alike if their ratio is at most this
ANODI_LEVEL = 2
SYMBOLS = TEXTS["symbols"]  # of methods in charts
WHOSE = ("ours", "exact", "default")


class Case(NamedTuple):
    """Realizations of one method at one wavelet level, with their measures."""

    method: str
    level: int
    whose: str  # "ours" (published settings), "exact", "default" or "published" (authors' code)
    images: NDArray[np.uint8]
    distances: NDArray[np.float64]
    tau: dict[int, float]
    wrong: float  # share of the data that are not honoured

    @property
    def name(self) -> str:
        """Name of the case in charts."""
        who = "published " if self.whose == "published" else ""
        tail = {"exact": ", data exact", "default": f", {DEFAULT}"}.get(self.whose, "")
        return f"{who}{TITLES[self.method]}, level {self.level}{tail}"

    @property
    def connectivity(self) -> float:
        """Connectivity at the largest lag, relative to the training image's."""
        return list(self.tau.values())[-1]

    @property
    def distance(self) -> float:
        """Mean pattern distance over the resolutions, in bits."""
        return float(self.distances.mean())

    def compare(self, other: Case) -> tuple[int, int]:
        """Return −1 (worse than `other`), 0 (alike) or 1 (better) for connectivity and patterns."""
        more = verdicts.sign_of(self.connectivity - other.connectivity, LIKE_TAU)
        return more, verdicts.order_of(other.distance / self.distance, LIKE_DISTANCE)


@dataclass
class Sampled:
    """All cases with one training image and one set of data."""

    image: TrainingImage
    data: HardData
    cases: list[Case] = field(default_factory=list)

    def add(self, method: str, level: int, whose: str, images: NDArray | None) -> None:
        """Add a case, unless `images` is None."""
        if images is not None:
            distances = methods.mean_distances(images, self.image)
            tau = methods.relative_tau(images, self.image)
            wrong = methods.wrong_share(images, self.image, self.data)
            self.cases.append(
                Case(
                    method=method,
                    level=level,
                    whose=whose,
                    images=images,
                    distances=distances,
                    tau=tau,
                    wrong=wrong,
                )
            )

    def of(self, whose: str) -> list[Case]:
        """Return the cases whose `Case.whose` is `whose`."""
        return [case for case in self.cases if case.whose == whose]

    def pairs(
        self, first: tuple[str, str], second: tuple[str, str]
    ) -> Iterator[tuple[int, Case, Case]]:
        """Yield (level, case, case) for each level that has both cases (method, whose)."""
        by_key = {case[:3]: case for case in self.cases}
        for level in LEVELS:
            keys = [(method, level, whose) for method, whose in (first, second)]
            if all(key in by_key for key in keys):
                yield level, by_key[keys[0]], by_key[keys[1]]


def sampled_data(run: ExperimentRun) -> Outcome:
    """Simulate CCWSIM and MS-CCSIM at levels 1 and 3, with each kind of settings (`Case.whose`)."""
    run.expect(14)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    shape = side, side
    data = data_of(run, image, shape)
    sampled = Sampled(image, data)
    for method in METHODS:
        for level in LEVELS:
            for whose in WHOSE:
                p = methods.paper_parameters(
                    method, level, exact=whose != "ours", default=whose == "default"
                )
                e = run.simulate(image, shape, p, data, run.extent.n_few)
                sampled.add(method, level, whose, e.indices)
            name = f"{TITLES[method]}_channel512_t2_1000_L{level}"
            sampled.add(method, level, "published", methods.published(run, image, name, shape))
    lags = methods.lags_for(image.shape, shape, largest=run.extent.largest_lag)
    exact = {case.name: case.images for case in sampled.of("exact")}
    rough = {case.name: case.images for case in sampled.of("ours") + sampled.of("published")}
    groups = (
        sampled.of("exact"),
        sampled.of("default"),
        sampled.of("published") or sampled.of("ours"),
    )
    maps = [
        Row(tuple(methods.paper_map(case.images[0], image, case.name, data) for case in group))
        for group in groups
    ]
    charts = [methods.connectivity_chart(stacks, image, lags) for stacks in (exact, rough)]
    curves = Row(tuple(charts), methods.caption_of_cases(e))
    blocks = (*maps, curves, _table_of_cases(sampled, side), methods.DEFAULT_WORDS)
    run.step()
    judgements = (
        *_method_judgements(sampled),
        *_against_published(sampled),
        *_in_search_only(sampled),
    )
    return Outcome(blocks, judgements)


def data_of(run: ExperimentRun, image: TrainingImage, shape: tuple[int, int]) -> HardData:
    """Return the authors' data, or data of equal density from our own realization."""
    if run.inputs.is_own("channel"):
        return run.inputs.data("channel", N_DATA, shape)
    other_run = ExperimentRun(run.inputs, run.extent, run.seed + 1, Watch(cancel=run.watch.cancel))
    realization = other_run.simulate(
        image, shape, methods.paper_parameters("ccwsim", 1)
    ).realizations[0]
    return sample_random(realization, max(round(N_DATA * realization.size / 512**2), 1), run.seed)


def _table_of_cases(sampled: Sampled, side: int) -> Table:
    tau_names = (f"τ at {lag}" for lag in sampled.cases[0].tau)
    rows = []
    for case in sampled.cases:
        distances = methods.format_distances(case.distances)
        tau = (f"{v:.2f}" for v in case.tau.values())
        counts = str(len(case.images)), percent(case.wrong)
        rows.append((case.name, *counts, distances, *tau))
    caption = said("cases", n=sampled.data.n, side=side)
    header = ("realizations", "n", "data wrong", "pattern distance 1, 1/2, 1/3", *tau_names)
    return Table(header, tuple(rows), caption)


def _method_judgements(sampled: Sampled) -> Iterator[Judgement]:
    """Judge the statement that CCWSIM beats MS-CCSIM in connectivity and patterns."""
    claim = "CCWSIM enhances facies connectivity and pattern reproduction (abstract)."
    engines = {
        "published": "The authors' codes",
        "exact": "Our engine, data exact",
        "default": f"Our engine, {DEFAULT}",
    }
    for whose, who in engines.items():
        for level, ours, other in sampled.pairs(("ccwsim", whose), ("ms-ccsim", whose)):
            finding = said("methods", who=who, level=level, ours=ours, other=other)
            connectivity, patterns = ours.compare(other)
            yield verdicts.judged(claim, finding, verdicts.of_both(connectivity, patterns))


def _against_published(sampled: Sampled) -> Iterator[Judgement]:
    """Judge our CCWSIM against realizations of the authors' code."""
    claim = "The authors' CCWSIM code, same data."
    for level, ours, theirs in sampled.pairs(("ccwsim", "exact"), ("ccwsim", "published")):
        finding = said(
            "against",
            level=level,
            ours=ours,
            theirs=theirs,
            wrong=percent(ours.wrong),
            missed=percent(theirs.wrong),
        )
        orders = *ours.compare(theirs), verdicts.sign_of(theirs.wrong - ours.wrong)
        low, high = min(orders), max(orders)
        if low < 0 < high:
            yield verdicts.judged(claim, finding, verdicts.PART)
        else:
            yield verdicts.of_order(claim, finding, low or high)


def _in_search_only(sampled: Sampled) -> Iterator[Judgement]:
    """Judge whether our engine (published settings) misses as many data as the authors' codes."""
    for method in METHODS:
        claim = f"The share of data that the published {TITLES[method]} code misses."
        for level, ours, theirs in sampled.pairs((method, "ours"), (method, "published")):
            finding = said(
                "search", level=level, wrong=percent(ours.wrong), missed=percent(theirs.wrong)
            )
            yield verdicts.of_claim(claim, finding, abs(ours.wrong - theirs.wrong) <= LIKE_SHARE)


def stone_wall(run: ExperimentRun) -> Outcome:
    """Run CCWSIM and MS-CCSIM with about 300 data at levels 1 and 3, in two variants."""
    run.expect(9)
    image, side = run.inputs.image("stone wall"), run.extent.side(512)
    shape, n = (side, side), run.extent.n_few
    data = run.inputs.data("stone wall", 300, shape)
    sampled, times = Sampled(image, data), []
    for whose, method, level in product(("ours", "default"), METHODS, LEVELS):
        p = methods.paper_parameters(method, level, default=whose == "default")
        e = run.simulate(image, shape, p, data, n, workers=1)
        sampled.add(method, level, whose, e.indices)
        times.append(duration(methods.median_seconds(e)))
    for method in METHODS:
        name = f"{TITLES[method]}_stonewall512_hd300_L1"
        sampled.add(method, 1, "published", methods.published(run, image, name, shape))
    rows, pictures = [], []
    times += ["–"] * len(sampled.of("published"))
    for case, time in zip(sampled.cases, times, strict=True):
        name = case.name if case.whose == "published" else f"ours, {case.name}"
        numbers = methods.format_distances(case.distances), percent(case.wrong), time
        rows.append((name, str(len(case.images)), *numbers))
        if case.level == 1:
            pictures.append(methods.paper_map(case.images[0], image, name, data))
    header = ("realizations", "n", "pattern distance 1, 1/2, 1/3", "data wrong", "CPU time")
    table = Table(header, tuple(rows), f"{side} × {side} cells, {data.n} data, T 32, OR 8.")
    first = methods.image_picture(image, run.inputs.describe("stone wall"), share=0.5)
    run.step()
    theirs = (case.wrong for case in sampled.of("published") if case.method == "ccwsim")
    honoured = verdicts.of_data(sampled.cases[0].wrong, data.n, next(theirs, None))
    maps = Row((first, *pictures[:2])), Row(tuple(pictures[2:]))
    return Outcome((*maps, table, methods.DEFAULT_WORDS), (*_patterns(sampled), honoured))


def _patterns(sampled: Sampled) -> Iterator[Judgement]:
    """Compare pattern distances: CCWSIM with MS-CCSIM, and our CCWSIM with the authors' code."""
    claim = "CCWSIM is comparable to MS-CCSIM and enhances pattern reproduction (abstract)."
    engines = {
        "ours": "our engine",
        "default": f"our engine {DEFAULT}",
        "published": "the published codes",
    }
    for whose, who in engines.items():
        for level, ours, other in sampled.pairs(("ccwsim", whose), ("ms-ccsim", whose)):
            both = f"{ours.distance:.4f} against {other.distance:.4f} bits."
            finding = f"Mean pattern distance, {who}, level {level}: {both}"
            yield verdicts.of_claim(claim, finding, ours.distance <= LIKE_DISTANCE * other.distance)
    claim = "The authors' CCWSIM code, same data."
    for level, ours, theirs in sampled.pairs(("ccwsim", "ours"), ("ccwsim", "published")):
        near, far = ours.distance, theirs.distance
        finding = f"Level {level}: mean pattern distance {near:.4f} against {far:.4f} bits."
        yield verdicts.of_order(claim, finding, ours.compare(theirs)[1])


def variability(run: ExperimentRun) -> Outcome:
    """Run CCWSIM and MS-CCSIM on each image, and compare both with the published codes."""
    run.expect(5 * len(TABLE_1))
    blocks: list[Block] = []
    charts: list[Chart] = []
    judgements: list[Judgement] = []
    for image in TABLE_1:
        side = run.extent.side(IMAGES[image]["anodi_side"])
        distances = _distances(run, image, side, IMAGES[image]["anodi_published"])
        title = f"{image} image, {side} × {side} cells, level {ANODI_LEVEL}, no data"
        blocks.append(_anodi_table(distances, title))
        blocks.append(_table_1(distances, image))
        charts.append(_mds(distances, image))
        judgements += _anodi_judgements(distances, image)
    words = Text(TEXTS["patterns"], quiet=True), methods.DEFAULT_WORDS
    caption = said("variability", level=ANODI_LEVEL, settings=SETTINGS, run=run)
    return Outcome((*blocks, Row(tuple(charts), caption), *words), tuple(judgements))


def _distances(run: ExperimentRun, image_name: str, side: int, files: list[str]) -> Anodi:
    image, n = run.inputs.image(image_name), run.extent.n_anodi
    stacks: dict[str, NDArray] = {}
    for default, method in product((False, True), METHODS):
        p = methods.paper_parameters(method, ANODI_LEVEL, default=default)
        e = run.simulate(image, (side, side), p, n=n)
        stacks[TITLES[method] + (f", {DEFAULT}" if default else "")] = e.indices
    for file in files:
        published_images = methods.published(run, image, file, (side, side))
        if published_images is not None:
            code = file.split("_")[0]
            stacks[f"published {code}" if code in TITLES.values() else code] = published_images
    coded = {name: Stack(images, image.codes) for name, images in stacks.items()}
    distances = anodi(coded, image)
    run.step()
    return distances


def _anodi_table(result: Anodi, title: str) -> Table:
    rows = []
    for k, name in enumerate(result.names):
        each = [methods.format_distances(row[k]) for row in (result.between, result.within)]
        by_resolution = _each(result.ratio[0] / result.ratio[k])
        r = result.relative("CCWSIM", name)[2]
        n = int(np.count_nonzero(result.owner == k))
        rows.append((name, str(n), *each, by_resolution, f"{r:.2f}"))
    column_names = (f"{what}, at 1, 1/2, 1/3" for what in ("between", "within"))
    header = ("method", "n", *column_names, "ratio of CCWSIM to this method", "r")
    caption = said("anodi", title=title[:1].upper() + title[1:])
    return Table(header, tuple(rows), caption)


def _table_1(distances: Anodi, image: str) -> Table:
    """Return Table 1 (CCWSIM divided by MS-CCSIM) with numbers of the paper and of this run."""
    paper = TABLE_1[image]
    rows = [("the paper", *map(_each, paper[:2]), f"{paper.ratio:.2f}")]
    for who, name, other in _pairs(distances):
        a, b = distances.names.index(name), distances.names.index(other)
        each = (_each(row[a] / row[b]) for row in (distances.between, distances.within))
        rows.append((who, *each, f"{distances.relative(name, other)[2]:.2f}"))
    header = ("CCWSIM relative to MS-CCSIM", "between", "within", "r")
    caption = said("table_1", image=image)
    return Table(header, tuple(rows), caption)


def _each(values: Iterable[float]) -> str:
    return " ".join(f"{v:.2f}" for v in values)


def _pairs(distances: Anodi) -> list[tuple[str, str, str]]:
    """Return (engine, CCWSIM name, MS-CCSIM name) for each engine with both methods."""
    pairs = [
        ("our engine", "CCWSIM", "MS-CCSIM"),
        (f"our engine {DEFAULT}", f"CCWSIM, {DEFAULT}", f"MS-CCSIM, {DEFAULT}"),
        ("the authors' codes", "published CCWSIM", "published MS-CCSIM"),
    ]
    return [p for p in pairs if p[1] in distances.names and p[2] in distances.names]


def _mds(distances: Anodi, image: str) -> Chart:
    scaling, colours = distances.scaling(), [methods.colour_of(name) for name in distances.names]
    groups = [
        Group(name, scaling.positions[distances.owner == k], colours[k], SYMBOLS[k % len(SYMBOLS)])
        for k, name in enumerate(distances.names)
    ]
    figure = mds_chart(scaling.positions[0], groups, LIGHT, height=420)
    legend = (*zip(distances.names, colours, strict=True), ("training image", LIGHT.reference))
    title = f"Fig. 12 · {image} image, {mds_title(scaling.stress)}"
    return Chart(figure, title, title, legend)


def _anodi_judgements(distances: Anodi, image: str) -> Iterator[Judgement]:
    """Judge Table 1 for each engine, and our CCWSIM against the authors' code."""
    paper = TABLE_1[image]
    stated = float(distances.weights @ paper.within), paper.ratio
    for whose, name, other in _pairs(distances):
        ratios = distances.relative(name, other)[1:]
        errors = distances.relative_errors(name, other)[1:]
        for what, theirs, ours, error in zip(("within", "r"), stated, ratios, errors, strict=True):
            claim = f"Table 1: {what} of CCWSIM relative to MS-CCSIM, stone wall and channel image."
            image_of = f"{image.capitalize()} image, {whose}"
            words = f"{image_of}: {ours:.2f} ± {ours * error:.2f}, in the paper {theirs:.2f}."
            yield verdicts.of_ratio(claim, words, ours, theirs, error)
    if "published CCWSIM" in distances.names:
        ratio = distances.relative("CCWSIM", "published CCWSIM")[2]
        error = distances.relative_errors("CCWSIM", "published CCWSIM")[2]
        words = f"{image.capitalize()} image: r = {ratio:.2f} ± {ratio * error:.2f}."
        claim = "The authors' CCWSIM code: r of our CCWSIM relative to this code."
        yield verdicts.of_order(claim, words, verdicts.order_of(ratio, float(np.exp(2 * error))))
