"""Test that figures of the documents are those that the program computes.

One figure of each table of measurements is computed again from the settings that the text beside
the table states. The expected figure is read from the document, so a change of results that the
document does not have fails a test. Tables without such a figure are listed with the reason.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from benchmarks import (
    additions,
    anodi,
    cases,
    data_fit,
    fidelity,
    methods as comparison,
    others,
    quality,
    reproduction,
    secondary,
    values as continuous,
    verdicts,
    volumes,
)
from ccwsim import (
    Ensemble,
    Grid,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
    datasets,
    metrics,
    read_hard_data,
    simulate,
)
from ccwsim.flow import flow_efficiency
from ccwsim.metrics import check_ensemble
from tests.paper import test_published_code as published_code
from tools.datasets import generate_volume

ROOT = Path(__file__).parents[1]
NUMBER = re.compile(r"\d*\.?\d+")
START_OF_NUMBER = re.compile(r"[-−]?\d*\.?\d")


@dataclass(frozen=True)
class Table:
    """A table of a document: names of the columns, and cells of the rows.

    A name such as "chosen: default" has the group that a header cell on its left begins. An empty
    first cell of a row repeats the cell above.
    """

    columns: list[str]
    rows: list[list[str]]

    @property
    def is_measured(self) -> bool:
        """Whether most cells beside the first column begin with a number."""
        cells = [cell for row in self.rows for cell in row[1:] if cell]
        return 2 * sum(bool(START_OF_NUMBER.match(cell)) for cell in cells) > len(cells)

    def cell(self, labels: str, column: str) -> str:
        """Return the cell of the only row that begins with the labels."""
        leading = labels.split(" | ")
        (row,) = [row for row in self.rows if row[: len(leading)] == leading]
        return row[self.columns.index(column)]


def tables_of(document: str) -> dict[str, Table]:
    """Return the tables of a document by their header lines."""
    lines = (ROOT / document).read_text("utf-8").splitlines()
    tables = {}
    for k, line in enumerate(lines):
        if re.fullmatch(r"\|[-:| ]+\|", line):
            columns, group = [], ""
            for name in cells_of(lines[k - 1]):
                group = name.partition(": ")[0] if ": " in name else group
                columns.append(name if ": " in name or not group else f"{group}: {name}")
            rows: list[list[str]] = []
            for text in lines[k + 1 :]:
                if not text.startswith("|"):
                    break
                row = cells_of(text)
                rows.append([row[0] or (rows[-1][0] if rows else ""), *row[1:]])
            assert lines[k - 1] not in tables, "two tables of a document have equal headers"
            tables[lines[k - 1]] = Table(columns, rows)
    return tables


def cells_of(line: str) -> list[str]:
    """Return the cells of a line of a table."""
    return [cell.strip() for cell in line.strip().removeprefix("|").removesuffix("|").split("|")]


def numbers_in(text: str) -> list[tuple[float, int]]:
    """Return the numbers of a cell, each with the number of its decimals."""
    return [(float(n), len(n.partition(".")[2])) for n in NUMBER.findall(text)]


def bias(e: Ensemble, image: TrainingImage) -> float:
    """Return the largest difference of a mean proportion from the image, in points."""
    return 100 * float(np.abs(e.proportions.mean(axis=0) - image.proportions).max())


def bias_of_maps(named: Sequence[tuple[str, TrainingImage]], chosen: bool) -> float:
    """Return the mean bias of maps whose generators were used to choose settings, or not."""
    biases = [
        bias(simulate(image, image.shape, None, None, fidelity.N, seed=1), image)
        for name, image in named
        if len(image.shape) == 2 and (name in fidelity.CHOSEN) == chosen
    ]
    return float(np.mean(biases))


def bias_of_ms_ccsim() -> list[float]:
    """Return the biases of `channels` with the published and the default variant of MS-CCSIM."""
    image, p = datasets.load("channels"), Parameters(method="ms-ccsim")
    variants = [replace(p, **fidelity.WAYS[way]) for way in ("published", "default")]
    return [
        bias(simulate(image, image.shape, variant, None, fidelity.N, seed=1), image)
        for variant in variants
    ]


def bias_with_data() -> float:
    """Return the bias of realizations with four fifths of the data of 60 wells."""
    name = "channels_60_wells"
    image, data = datasets.load("channels"), datasets.load_hard_data(name)
    used = np.arange(data.n) % 5 != 4
    known = HardData(data.cells[used], data.facies[used])
    shape = datasets.hard_data_grid_shape(name)
    return bias(simulate(image, shape, None, known, fidelity.N_DATA, seed=1), image)


def difference_from_fields() -> float:
    """Return the mean largest difference of a proportion from fields without bodies on one side."""
    differences = []
    for group, image, truth, data in fidelity.trend_studies():
        if group == "chosen | 200 data":
            e = simulate(image, truth.shape, None, data, fidelity.N_DATA, seed=1)
            shares = np.bincount(truth.ravel(), minlength=image.n_facies) / truth.size
            differences.append(100 * np.abs(e.proportions.mean(axis=0) - shares).max())
    return float(np.mean(differences))


def ratio_of_dense_data() -> float:
    """Return the ratio of pattern distances of a study of the paper with 4000 data."""
    name = "the paper's channel, 4000 data"
    (study,) = [study for study in fidelity.studies() if study[0] == name]
    return fidelity.conditioned(*study[1:])["JS"]


def paper_image(name: str) -> TrainingImage:
    """Return a training image of the paper."""
    return TrainingImage(np.load(folder() / "paper" / f"{name}.npy"))


def folder() -> Path:
    """Return the folder of published data."""
    return Path(os.environ["CCWSIM_DATA"])


def patterns_with_dense_data() -> list[float]:
    """Return the pattern distances of the study with 3883 data at level 2."""
    (case,) = [case for case in quality.CASES if case.title == "channel, 3883 data"]
    image = TrainingImage(np.load(folder() / f"{case.image}.npy"))
    data = read_hard_data(folder() / f"{case.data}.csv", Grid(*case.shape))
    e = simulate(image, case.shape, None, data, quality.N_REALIZATIONS)
    return patterns(e, image)


def patterns(e: Ensemble, image: TrainingImage) -> list[float]:
    """Return the pattern distances at three resolutions."""
    return metrics.pattern_distance(e.realizations, image).mean(axis=0).tolist()


def copied_cells() -> float:
    """Return the mean size of the largest copied piece of `channels` by default."""
    image = datasets.load("channels")
    e = simulate(image, (256, 256), None, None, 10, keep_sources=True)
    assert e.sources is not None
    return float(np.mean([metrics.copying(s, image.shape).largest_block for s in e.sources]))


def patterns_of_ccwsim() -> list[float]:
    """Return the pattern distances of the comparison of methods at level 2, without data."""
    image = paper_image("ti_channel_256x256")
    return patterns(simulate(image, comparison.GRID, None, None, quality.N_REALIZATIONS), image)


def distances_between() -> list[float]:
    """Return the divergences between realizations of the first study of the table of ANODI."""
    case, n = anodi.CASES[0], 50
    image = paper_image(case.image)
    e = simulate(image, image.shape, Parameters(wavelet_level=case.level), None, n)
    return metrics.anodi({"ours": e}, image).between[0].tolist()


def efficiency_of_fractures() -> tuple[float, float]:
    """Return the mean flow efficiency of fractures from west to east, with its standard error."""
    image = datasets.load("fractures")
    e = simulate(image, image.shape, None, None, fidelity.N_FLOW, seed=1)
    rare = int(np.argmin(image.proportions))
    each = np.array([flow_efficiency(one == rare, 1) for one in e.indices])
    return float(each.mean()), float(each.std() / len(each) ** 0.5)


def unions_of_channels() -> float:
    """Return the unions of geobodies per 100 squares of realizations of `channels`."""
    image = datasets.load("channels")
    joins = metrics.fit_joins(
        simulate(image, image.shape, None, None, fidelity.N_DATA, seed=1), facies=1
    )
    assert joins is not None
    return float(joins.found[0])


def gamma_of_drawn_channels() -> float:
    """Return the mean Γ of realizations of five images from the generator of `channels`."""
    reaches = [
        fidelity.reach_of_realizations(image, Parameters())
        for image in fidelity.reach_images("channels")
    ]
    return float(np.mean([row["Γ"] for row in reaches]))


def worst_bins() -> list[float]:
    """Return the worst bins of the first row of the table of reliability."""
    *_, row = islice(secondary.rows_of_reliability(), 3)
    return [number for number, _ in numbers_in(row.split(" | ")[2])]


def direction_of_channels() -> tuple[float, float]:
    """Return the mean and the 90 % quantile of the direction error of channels turned by 37°."""
    image, margin = datasets.load("channels"), slice(40, -40)
    turned = Secondary(angle=37.0)
    e = simulate(image, (400, 400), None, None, 24, 0, n_workers=1, secondary=turned)
    errors = np.abs(metrics.direction_error(e)[margin, margin])
    return float(errors.mean()), float(np.quantile(errors, 0.9))


def wrong_data_of_published_code() -> list[float]:
    """Return the share of 397 data that the published CCWSIM does not honour, for three levels."""
    data = read_hard_data(folder() / "paper/hd_channel_400_grid512x512.csv", Grid(512, 512))
    files = [folder() / f"reference/CCWSIM_channel512_hd400_L{level}.npz" for level in (1, 2, 3)]
    return [
        100 * float(np.mean([data.n_mismatched(one) for one in np.load(file)["r"]])) / data.n
        for file in files
    ]


def distance_with_data() -> float:
    """Return the mean pattern distance of the comparison with other programs at level 2."""
    image, data = cases.load_study()
    run = others.ours(image, Parameters())
    maps = np.array([run(data, seed) for seed in range(others.N_REALIZATIONS)])
    return float(metrics.pattern_distance(maps, image)[:, 0].mean())


def bias_of_refinement() -> list[float]:
    """Return the mean biases without and with refinement, without data."""
    return [
        float(np.mean([
            bias(simulate(image, additions.SHAPE, p, None, 40, seed=4), image)
            for image in map(datasets.load, additions.IMAGES)
        ]))
        for p in (Parameters(refine=False), Parameters())
    ]  # fmt: skip


def wrong_data_of_our_variant() -> float:
    """Return the share of 397 data that our variant of the published code does not honour."""
    image = paper_image("ti_channel_256x256")
    data = read_hard_data(folder() / "paper/hd_channel_400_grid512x512.csv", Grid(512, 512))
    theirs = np.load(folder() / "reference/CCWSIM_channel512_hd400_L2.npz")["r"]
    p, seed = Parameters.published("code", wavelet_level=2), published_code.SEED
    e = simulate(image, (512, 512), p, data, published_code.N, seed=seed)
    directions = [published_code.random_numbers(seed, k).integers(8) for k in range(len(e))]
    ours = e.indices[np.array(directions) < len(theirs)]
    return 100 * published_code.measured(ours, image, data)[0]


def unseen_patterns_of_channels() -> float:
    """Return the share of unseen patterns of `sinuous_channels`, in percent."""
    image = datasets.load("sinuous_channels")
    e = simulate(image, (48, 100, 100), volumes.PARAMETERS, None, 4, n_workers=1)
    return 100 * float(metrics.unseen_patterns(e, image).mean())


def bias_of_wells() -> list[float]:
    """Return the mean bias of the volumes of wells of large channels, with its standard error."""
    biases = []
    for k in range(volumes.N_LARGE):
        image, truth = (
            generate_volume("sinuous_channels", shape=shape, seed=seed + k)
            for shape, seed in ((volumes.LARGE, 7000), (volumes.LARGE_GRID, 9000))
        )
        biases.append(100 * float(np.abs(truth.proportions - image.proportions).max()))
    text = volumes.ratio(biases, [1.0] * len(biases))
    return [number for number, _ in numbers_in(text)]


def variogram_of_stones() -> float:
    field = continuous.stones(continuous.SEEDS[0])
    image = TrainingImage.from_array(field, continuous=True)
    p, n = continuous.PARAMETERS, continuous.N
    e = simulate(image, continuous.GRID, p, n_realizations=n, seed=1)
    of_values = np.mean([continuous.variogram(one) for one in e.values_of()], axis=0)
    ratios = of_values / continuous.variogram(field)
    return float(ratios[[0, len(continuous.LAGS)]].mean())


def reported_barchans() -> tuple[int, int]:
    """Return how many single true fields of barchans the headline reports."""
    reported = [
        bool(reproduction.differing(verdicts.true_ensemble("barchans", seed, number, group)))
        for seed in range(verdicts.SEED, verdicts.SEED + 3)
        for number in (None, seed)
        for group in verdicts.GROUPS[1]
    ]
    return sum(reported), len(reported)


def unsure_curves() -> int:
    """Return how many checks of connectivity cannot tell, over the bundled maps."""
    images = [datasets.load(name) for name in datasets.names()]
    return sum(
        check.fit.cannot_tell
        for image in images
        for check in check_ensemble(simulate(image, (256, 256), n_realizations=12, seed=3))
        if check.kind == "connectivity"
    )


def rejected_fields() -> float:
    """Return the share of fields of channels whose 100 data contradict the image of fractures."""
    return float(np.mean(data_fit.rejected("channels", "fractures", 512, 100, 0, 9)))


@dataclass(frozen=True)
class Figure:
    """A cell of a table, and the function that computes its numbers.

    `header` is a part of the header line of the table. A number may differ from the printed one by
    `tolerance` units of its last digit.
    """

    document: str
    header: str
    labels: str
    column: str
    compute: Callable[[], float | Sequence[float]]
    tolerance: float = 0.5
    published: bool = False
    """Whether the function needs the folder of published data."""


QUALITY, METHOD, VOLUMES = "docs/quality.md", "docs/method.md", "docs/volumes.md"
COMPARED, MEASURES = "docs/compared.md", "docs/measures.md"
BIAS = "largest bias of a proportion, points"
FIGURES = [
    Figure(
        QUALITY, "| chosen: published", BIAS, "confirmed: default",
        lambda: bias_of_maps([*fidelity.images()], chosen=False), published=True,
    ),
    Figure(
        QUALITY, "chosen generators: published", BIAS, "chosen generators: default",
        lambda: bias_of_maps([*fidelity.drawn(1)], chosen=True),
    ),
    Figure(
        QUALITY, "calibration: without", "`channels_60_wells` (12 left-out data)",
        "bias, points: steered", bias_with_data,
    ),
    Figure(QUALITY, "JS: before", "chosen | 200", "difference: now", difference_from_fields),
    Figure(
        QUALITY, "dead ends × image", "`channels` | ms-ccsim", "bias, points",
        bias_of_ms_ccsim,
    ),
    Figure(
        QUALITY, "| study | dead ends", "the paper's channel, 4000 data", "JS",
        ratio_of_dense_data, published=True,
    ),
    Figure(
        QUALITY, "re-simulated", "channel, 3883 data | 2", "patterns 1, 1/2, 1/3",
        patterns_with_dense_data, published=True,
    ),
    Figure(QUALITY, "published draw: copy", "none | 20", "by default: copy", copied_cells),
    Figure(
        QUALITY, "| exact |", "none | – | ccwsim | 2", "patterns 1, 1/2, 1/3",
        patterns_of_ccwsim, published=True,
    ),
    Figure(
        QUALITY, "ratio of our ANODI", "channel 256², no data, level 2 | ours",
        "between 1, 1/2, 1/3", distances_between, published=True,
    ),
    Figure(QUALITY, "E W–E", "`fractures` | ours", "E W–E", efficiency_of_fractures),
    Figure(
        QUALITY, "loops: crops", "`channels`", "unions: realizations", unions_of_channels,
    ),
    Figure(QUALITY, "span W–E", "`channels` | default", "Γ", gamma_of_drawn_channels),
    Figure(QUALITY, "worst bin", "channels | 8", "worst bin", worst_bins),
    Figure(QUALITY, "in 80 %", "stones | 0 | CCWSIM", "γ(1)", variogram_of_stones),
    Figure(QUALITY, "| direction |", "channels | 37°", "direction", direction_of_channels),
    Figure(
        COMPARED, "published MS-CCSIM, level", "397", "published CCWSIM, level 1, 2, 3",
        wrong_data_of_published_code, published=True,
    ),
    Figure(
        COMPARED, "| s, no data |", "CCWSIM (this), level 2", "distance of patterns, full",
        distance_with_data, published=True,
    ),
    Figure(
        METHOD, "switched off by", "refinement | `refine=False` | none", "bias",
        bias_of_refinement,
    ),
    Figure(
        METHOD, "data wrong: theirs", "channel, 397 data | 2", "CCWSIM, data wrong: ours",
        wrong_data_of_our_variant, published=True,
    ),
    Figure(
        VOLUMES, "peak MB", "sinuous_channels | 100 × 100 × 48", "unseen (at data), %",
        unseen_patterns_of_channels,
    ),
    Figure(
        VOLUMES, "JS over crops", "sinuous_channels | the wells' volume", "bias, points",
        bias_of_wells,
    ),
    Figure(MEASURES, "| true fields of", "barchans", "1 field", reported_barchans),
    Figure(MEASURES, "| cannot tell |", "connectivity", "cannot tell", unsure_curves),
    Figure(MEASURES, "| data of |", "channels | fractures", "100 data", rejected_fields),
]  # fmt: skip
"""One figure of each table."""

TIMES = "times depend on the machine"
NO_IMAGES = "the crops and Gaussian fields are not kept, so no figure can be computed again"
EXCEPTIONS = {
    (QUALITY, "template 16"): NO_IMAGES,
    (QUALITY, "confirmed: template 32"): NO_IMAGES,
    (QUALITY, "relative to the earlier code"): TIMES,
    (QUALITY, "100 realizations, s"): TIMES,
    (QUALITY, "512², no data"): TIMES,
    (COMPARED, "| no data | 397 data |"): TIMES,
    (MEASURES, "| realizations | reported |"): "hundreds of ensembles, by benchmarks.verdicts",
    (MEASURES, "| realizations of values |"): "a hundred ensembles, by benchmarks.values",
    (MEASURES, "| true volumes of |"): "hundreds of ensembles, by benchmarks.verdicts",
    (COMPARED, "| method | level | CPU time |"): TIMES,
}
"""Tables without a figure: part of the header line, and the reason."""
DOCUMENTS = {
    "docs/latency.md": TIMES,
    "docs/speed.md": TIMES,
    "docs/server.md": "times, memory and limits depend on the machine",
    "docs/safety.md": "times, memory and numbers of files depend on the machine and its libraries",
}
"""Documents without a figure, and the reason."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "figure", FIGURES, ids=[f"{Path(f.document).stem}: {f.header}" for f in FIGURES]
)
def test_a_figure_of_each_table_is_computed_again(figure, request, monkeypatch):
    if figure.published:
        monkeypatch.setenv("CCWSIM_DATA", str(request.getfixturevalue("data_dir")))
    cell = table(figure.document, figure.header).cell(figure.labels, figure.column)
    computed = figure.compute()
    values = [computed] if isinstance(computed, int | float) else list(computed)
    printed = numbers_in(cell)
    assert len(values) == len(printed)
    for value, (expected, decimals) in zip(values, printed, strict=True):
        limit = figure.tolerance / 10**decimals + 1e-9
        assert math.isclose(value, expected, rel_tol=0, abs_tol=limit), f"{values}, not {cell}"


def table(document: str, header: str) -> Table:
    """Return the only table of a document whose header line contains a text."""
    (only,) = [each for line, each in tables_of(document).items() if header in line]
    return only


def measured_tables() -> Iterator[tuple[str, str]]:
    """Yield document and header line of each table of measurements."""
    for path in sorted((ROOT / "docs").rglob("*.md")):
        document = path.relative_to(ROOT).as_posix()
        if document not in DOCUMENTS:
            yield from (
                (document, line) for line, t in tables_of(document).items() if t.is_measured
            )


def test_each_measured_table_has_a_figure_or_a_reason():
    listed = [(f.document, f.header) for f in FIGURES] + [*EXCEPTIONS]
    for document, line in measured_tables():
        headers = [text for name, text in listed if name == document and text in line]
        assert len(headers) == 1, f"{document}: {line} has {len(headers)} rows in this file"


def test_each_listed_table_exists():
    for document, header in EXCEPTIONS:
        table(document, header)
    for figure in FIGURES:
        listed = table(figure.document, figure.header)
        assert listed.is_measured
        assert numbers_in(listed.cell(figure.labels, figure.column))
    assert all((ROOT / document).is_file() for document in DOCUMENTS)
