"""Compare CCWSIM with MS-CCSIM on two images, also by ANODI (sections 5.4, 5.5)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from ccwsim import Ensemble, HardData, TrainingImage
from ccwsim.figures import LIGHT, Group, mds_chart, mds_title
from ccwsim.metrics import Anodi, anodi
from ccwsim.metrics.stack import Stack
from ccwsim.model import Array, Bytes, Floats, Method, Variant
from ccwsim.paper import methods, verdicts
from ccwsim.paper.experiment import PAPER_IMAGES, PAPER_TEXTS, ExperimentRun, Outcome, said
from ccwsim.paper.methods import AUTHORS_SETTINGS, COLUMNS, COMPARED, TITLES
from ccwsim.paper.published_times import TABLE_1
from ccwsim.paper.verdicts import percent
from ccwsim.report.document import Block, Chart, Judgement, PictureRow, Table, Text

COMPARED_METHODS: tuple[Method, ...] = ("ccwsim", "ms-ccsim")
COMPARED_LEVELS = (1, 2, 3)
COMPARED_SIDE = 512  # side in cells of the grid of both figures
LIKE_TAU = 0.02  # relative connectivities count as alike up to this difference
LIKE_SHARE = 0.03  # shares of wrong data count as alike up to this difference
LIKE_DISTANCE = 1.1  # pattern distances count as alike if their ratio is at most this
ANODI_LEVEL = 2
METHOD_SYMBOLS = PAPER_TEXTS["symbols"]  # of methods in charts


@dataclass(frozen=True, eq=False)
class Case:
    """Realizations of one method at one wavelet level, with their measures."""

    method: str
    level: int
    column: str  # a key of `COLUMNS`: a variant, or "authors"
    images: Bytes
    distances: Floats
    tau: dict[int, float]
    wrong: float  # share of the data that are not honoured

    @property
    def name(self) -> str:
        """Name of the case in charts."""
        return f"{TITLES[self.method]}, {COLUMNS[self.column]}, level {self.level}"

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
class ComparedStudy:
    """The cases of one study by (method, level, column), with training image and data."""

    image: TrainingImage
    data: HardData
    cases: dict[tuple[str, int, str], Case] = field(default_factory=dict)

    def add(self, method: str, level: int, column: str, images: Array) -> None:
        """Add a case with its measures."""
        self.cases[method, level, column] = Case(
            method,
            level,
            column,
            images,
            distances=methods.mean_distances(images, self.image),
            tau=methods.relative_tau(images, self.image),
            wrong=methods.wrong_share(images, self.image, self.data),
        )

    def column(self, column: str) -> list[Case]:
        """Return the cases of a column."""
        return [case for case in self.cases.values() if case.column == column]

    def pairs(
        self, first: tuple[str, str], second: tuple[str, str]
    ) -> Iterator[tuple[int, Case, Case]]:
        """Yield (level, case, case) for each level that has both cases (method, column)."""
        for level in COMPARED_LEVELS:
            keys = [(method, level, column) for method, column in (first, second)]
            if all(key in self.cases for key in keys):
                yield level, self.cases[keys[0]], self.cases[keys[1]]


def compare_methods(name: str, numbers: tuple[int, ...], run: ExperimentRun) -> Outcome:
    """Compare CCWSIM with MS-CCSIM at all levels for some numbers of data (Figs. 10 and 11)."""
    if not run.extent.is_full:
        numbers = numbers[-1:]
    run.expect(len(numbers) * len(COMPARED_METHODS) * len(COMPARED_LEVELS) * len(COLUMNS))
    image, side = run.inputs.image(name), run.extent.side(COMPARED_SIDE)
    blocks: list[Block] = [PictureRow((methods.image_picture(image, run.inputs.describe(name)),))]
    judgements: list[Judgement] = []
    studies: list[ComparedStudy] = []
    for n_data in numbers:
        data, _ = run.data(name, image, n_data, (side, side), COMPARED_SIDE)
        study = ComparedStudy(image, data)
        stem = PAPER_IMAGES[name]["realizations"].get(str(n_data))
        for method, level in product(COMPARED_METHODS, COMPARED_LEVELS):
            last = _add_cases(study, run, (side, side), method, level, stem=stem)
        blocks += _blocks_of(study, last, run.extent.largest_lag)
        studies.append(study)
        judgements += [*_against_authors(study), *_same_rules(study)]
    return Outcome(tuple(blocks), (*_methods_compared(studies), *judgements))


def _add_cases(
    study: ComparedStudy,
    run: ExperimentRun,
    shape: tuple[int, int],
    method: Method,
    level: int,
    stem: str | None,
) -> Ensemble:
    """Add all cases of a method at a level; return our realizations."""
    file = f"{TITLES[method]}_{stem}_L{level}"
    authors = methods.published(run, study.image, file, shape) if stem else None
    if authors is not None:
        study.add(method, level, "authors", authors)
    variants: tuple[Variant, ...] = COMPARED if authors is None else ("paper", "code", "ours")
    for variant in variants:
        p = methods.paper_parameters(method, level, variant)
        e = run.simulate(study.image, shape, p, study.data, run.extent.n_few)
        study.add(method, level, variant, e.indices)
    return e


def _blocks_of(study: ComparedStudy, e: Ensemble, largest_lag: int) -> Iterator[Block]:
    """Return the maps, connectivity curves and measures of one number of data."""
    for column in COLUMNS:
        maps = [
            methods.paper_map(case.images[0], study.image, case.name, study.data)
            for case in study.column(column)
            if case.level in (1, 3)
        ]
        if maps:
            yield PictureRow(tuple(maps))
    lags = methods.lags_for(study.image.shape, e.grid.shape, largest=largest_lag)
    charts = [
        methods.connectivity_chart(
            {case.name: case.images for case in study.column(column) if case.level in (1, 3)},
            study.image,
            lags,
        )
        for column in COMPARED
    ]
    yield PictureRow(tuple(charts), methods.caption_of_cases(e))
    yield _table_of_cases(study, e)


def _table_of_cases(study: ComparedStudy, e: Ensemble) -> Table:
    """Return the measures of a study: a row for each method and level, columns side by side."""
    columns = [column for column in COLUMNS if study.column(column)]
    rows = []
    for method, level in product(COMPARED_METHODS, COMPARED_LEVELS):
        cases = [study.cases.get((method, level, column)) for column in columns]
        texts = [
            ["–" if case is None else text_of(case) for case in cases]
            for text_of in CASE_MEASURES.values()
        ]
        rows.append((TITLES[method], str(level), *(text for each in texts for text in each)))
    titles = (f"{measure}, {COLUMNS[column]}" for measure in CASE_MEASURES for column in columns)
    counts = {COLUMNS[c]: len(study.column(c)[0].images) for c in columns}
    caption = said(
        "cases",
        n=study.data.n,
        side=e.grid.nx,
        image=study.image.name,
        counts=", ".join(f"{n} {title}" for title, n in counts.items()),
    )
    return Table(("method", "level", *titles), tuple(rows), caption)


CASE_MEASURES: dict[str, Callable[[Case], str]] = {
    "data wrong": lambda case: percent(case.wrong),
    "pattern distance": lambda case: f"{case.distance:.4f}",
    "τ": lambda case: f"{case.connectivity:.2f}",
}
"""Measures of the table of cases, as texts."""


def _methods_compared(studies: list[ComparedStudy]) -> Iterator[Judgement]:
    """Judge the statement that CCWSIM beats MS-CCSIM in connectivity and patterns."""
    claim = "CCWSIM enhances facies connectivity and pattern reproduction (abstract)."
    for column, title in COLUMNS.items():
        methods_of_column = ("ccwsim", column), ("ms-ccsim", column)
        orders = np.array(
            [
                ours.compare(other)
                for study in studies
                for _, ours, other in study.pairs(*methods_of_column)
            ]
        )
        if not len(orders):
            continue
        (more, nearer), (less, farther) = (orders > 0).sum(axis=0), (orders < 0).sum(axis=0)
        finding = said(
            "methods",
            title=title.capitalize(),
            n=len(orders),
            more=more,
            less=less,
            nearer=nearer,
            farther=farther,
        )
        word = verdicts.judge_both(
            verdicts.sign_of(more - less), verdicts.sign_of(nearer - farther)
        )
        yield verdicts.judged(claim, finding, word)


def _against_authors(study: ComparedStudy) -> Iterator[Judgement]:
    """Judge our CCWSIM against realizations of the authors' code."""
    claim = "The authors' CCWSIM code, same data."
    for level, ours, theirs in study.pairs(("ccwsim", "ours"), ("ccwsim", "authors")):
        finding = said(
            "against",
            level=level,
            n=study.data.n,
            ours=ours,
            theirs=theirs,
            wrong=percent(ours.wrong),
            missed=percent(theirs.wrong),
        )
        orders = *ours.compare(theirs), verdicts.sign_of(theirs.wrong - ours.wrong)
        low, high = min(orders), max(orders)
        if low < 0 < high:
            yield verdicts.judged(claim, finding, verdicts.IN_PART)
        else:
            yield verdicts.judge_order(claim, finding, low or high)


def _same_rules(study: ComparedStudy) -> Iterator[Judgement]:
    """Judge whether the rules of the authors' code miss as many data as this code."""
    for method in COMPARED_METHODS:
        claim = f"The share of data that the authors' {TITLES[method]} code misses."
        for level, ours, theirs in study.pairs((method, "code"), (method, "authors")):
            finding = said(
                "search",
                level=level,
                n=study.data.n,
                wrong=percent(ours.wrong),
                missed=percent(theirs.wrong),
            )
            yield verdicts.judge_claim(claim, finding, abs(ours.wrong - theirs.wrong) <= LIKE_SHARE)


def variability(run: ExperimentRun) -> Outcome:
    """Run CCWSIM and MS-CCSIM on each image, and compare both with the published codes."""
    run.expect(5 * len(TABLE_1))
    blocks: list[Block] = []
    charts: list[Chart] = []
    judgements: list[Judgement] = []
    for image in TABLE_1:
        side = run.extent.side(PAPER_IMAGES[image]["anodi_side"])
        distances = _distances(run, image, side, PAPER_IMAGES[image]["anodi_published"])
        title = f"{image} image, {side} × {side} cells, level {ANODI_LEVEL}, no data"
        blocks.append(_anodi_table(distances, title))
        blocks.append(_table_1(distances, image))
        charts.append(_mds(distances, image))
        judgements += _anodi_judgements(distances, image)
    caption = said("variability", level=ANODI_LEVEL, settings=AUTHORS_SETTINGS, run=run)
    blocks += [PictureRow(tuple(charts), caption), Text(PAPER_TEXTS["patterns"], quiet=True)]
    return Outcome(tuple(blocks), tuple(judgements))


def _distances(run: ExperimentRun, image_name: str, side: int, files: list[str]) -> Anodi:
    image, n = run.inputs.image(image_name), run.extent.n_anodi
    stacks: dict[str, Array] = {}
    for variant, method in product(COMPARED, COMPARED_METHODS):
        p = methods.paper_parameters(method, ANODI_LEVEL, variant)
        e = run.simulate(image, (side, side), p, n=n)
        stacks[f"{TITLES[method]}, {COLUMNS[variant]}"] = e.indices
    for file in files:
        published_images = methods.published(run, image, file, (side, side))
        if published_images is not None:
            code = file.split("_")[0]
            is_authors = code in TITLES.values()
            stacks[f"{code}, {COLUMNS['authors']}" if is_authors else code] = published_images
    distances = anodi({name: Stack(images, image.codes) for name, images in stacks.items()}, image)
    run.step()
    return distances


def _anodi_table(result: Anodi, title: str) -> Table:
    rows = []
    for k, name in enumerate(result.names):
        each = [methods.format_distances(row[k]) for row in (result.between, result.within)]
        r = result.relative(result.names[0], name)[2]
        n = int(np.count_nonzero(result.owner == k))
        rows.append((name, str(n), *each, _each(result.ratio[0] / result.ratio[k]), f"{r:.2f}"))
    column_names = (f"{what}, at 1, 1/2, 1/3" for what in ("between", "within"))
    header = ("method", "n", *column_names, f"ratio of {result.names[0]} to this method", "r")
    return Table(header, tuple(rows), said("anodi", title=title[:1].upper() + title[1:]))


def _table_1(distances: Anodi, image: str) -> Table:
    """Return Table 1 (CCWSIM divided by MS-CCSIM) with numbers of the paper and of this run."""
    paper = TABLE_1[image]
    rows = [("the paper", *map(_each, paper[:2]), f"{paper.ratio:.2f}")]
    for who, name, other in _pairs(distances):
        a, b = distances.names.index(name), distances.names.index(other)
        each = (_each(row[a] / row[b]) for row in (distances.between, distances.within))
        rows.append((who, *each, f"{distances.relative(name, other)[2]:.2f}"))
    header = ("CCWSIM relative to MS-CCSIM", "between", "within", "r")
    return Table(header, tuple(rows), said("table_1", image=image))


def _each(values: Iterable[float]) -> str:
    return " ".join(f"{v:.2f}" for v in values)


def _pairs(distances: Anodi) -> list[tuple[str, str, str]]:
    """Return (column, CCWSIM name, MS-CCSIM name) for each column with both methods."""
    pairs = [(title, f"CCWSIM, {title}", f"MS-CCSIM, {title}") for title in COLUMNS.values()]
    return [p for p in pairs if p[1] in distances.names and p[2] in distances.names]


def _mds(distances: Anodi, image: str) -> Chart:
    scaling, colours = (
        distances.scaling(),
        [methods.method_colour(name) for name in distances.names],
    )
    groups = [
        Group(name, scaling.positions[distances.owner == k], colours[k], symbol)
        for k, (name, symbol) in enumerate(zip(distances.names, METHOD_SYMBOLS, strict=False))
    ]
    legend = (*zip(distances.names, colours, strict=True), ("training image", LIGHT.reference))
    title = f"Fig. 12 · {image} image, {mds_title(scaling.stress)}"
    return Chart(mds_chart(scaling.positions[0], groups, LIGHT, height=420), title, title, legend)


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
            yield verdicts.judge_ratio(claim, words, ours, theirs, error)
    pair = f"CCWSIM, {COLUMNS['ours']}", f"CCWSIM, {COLUMNS['authors']}"
    if pair[1] in distances.names:
        ratio, error = distances.relative(*pair)[2], distances.relative_errors(*pair)[2]
        words = f"{image.capitalize()} image: r = {ratio:.2f} ± {ratio * error:.2f}."
        claim = "The authors' CCWSIM code: r of our CCWSIM relative to this code."
        yield verdicts.judge_order(claim, words, verdicts.order_of(ratio, float(np.exp(2 * error))))
