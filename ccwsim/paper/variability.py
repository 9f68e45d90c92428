"""Analysis of distances of CCWSIM and MS-CCSIM (Table 1), and its MDS plot (Fig. 12)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.figures import LIGHT, Group, mds_chart
from ccwsim.metrics import Anodi, anodi
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import image_named, published, settings
from ccwsim.paper.pictures import colour_of
from ccwsim.paper.verdicts import AGREES, BEHIND, BETTER, DIFFERS, judged
from ccwsim.report import Block, Chart, Judgement, Row, Table, Text

LEVEL = 2
SYMBOLS = ("circle", "square", "triangle-up", "cross", "x", "star")
STUDIES = (
    ("channel", 256, ("CCWSIM_channel256_uncond_L2", "MS-CCSIM_channel256_uncond_L2",
                      "DeeSse_channel256_uncond", "SNESIM_MPSLIB_channel256_uncond")),
    ("stone wall", 200, ("CCWSIM_stonewall200_uncond_L2", "MS-CCSIM_stonewall200_uncond_L2")),
)  # fmt: skip
COMPARABLE = 1.15
"""Ratios from 1 / this to this count as comparable."""


def variability(run: Run) -> Outcome:
    """Simulate both methods on each image and compare them with those of the published codes."""
    run.expect(3 * len(STUDIES))
    blocks: list[Block] = []
    charts: list[Chart] = []
    judgements: list[Judgement] = []
    for name, side, files in STUDIES:
        found, said = _study(run, name, run.extent.side(side), files)
        table, chart = _blocks(found, said)
        blocks.append(table)
        charts.append(chart)
        judgements += _judgements(found, name)
    remark = (
        "The values of the paper's Table 1 are not at hand, so its statement is judged, not its "
        "numbers. The paper takes 8 × 8 patterns in three resolutions; here all 4 × 4 patterns "
        "are counted exactly, because nearly every 8 × 8 pattern occurs once."
    )
    return Outcome((*blocks, Row(tuple(charts)), Text(remark, quiet=True)), tuple(judgements))


def _study(run: Run, name: str, side: int, files: tuple[str, ...]) -> tuple[Anodi, str]:
    image, n = run.inputs.image(name), run.extent.n_anodi
    stacks: dict[str, NDArray] = {
        title: run.simulate(image, (side, side), settings(method, LEVEL), n=n).indices
        for title, method in (("CCWSIM", "ccwsim"), ("MS-CCSIM", "ms-ccsim"))
    }
    for file in files:
        assert image_named(file) == name
        there = published(run, image, file, (side, side))
        if there is not None:
            code = file.split("_")[0]
            stacks[f"published {code}" if "CCSIM" in code or "CCWSIM" in code else code] = there
    found = anodi(stacks, image.indices, image.n_facies)
    run.step()
    return found, f"{name} image, {side} × {side} cells, level {LEVEL}, no data"


def _blocks(found: Anodi, said: str) -> tuple[Table, Chart]:
    rows = []
    for k, name in enumerate(found.names):
        between, within, ratio = found.relative("CCWSIM", name)
        shown = [" ".join(f"{v:.4f}" for v in row[k]) for row in (found.between, found.within)]
        per = " ".join(f"{v:.2f}" for v in found.ratio[0] / found.ratio[k])
        n = int(np.count_nonzero(found.owner == k))
        rows.append((name, str(n), *shown, per, f"{between:.2f}", f"{within:.2f}", f"{ratio:.2f}"))
    header = ("method", "n", "between, at 1, 1/2, 1/3", "within, at 1, 1/2, 1/3",
              "ratio by resolution", "between", "within", "ratio")  # fmt: skip
    caption = (
        f"Table 1 · {said}. Mean Jensen–Shannon divergence between realizations and to the "
        "training image (bits); on the right our CCWSIM relative to each method: above 1 in "
        "“ratio” CCWSIM is the more varied for its distance to the image."
    )
    scaling = found.scaling()
    colours = [colour_of(name) for name in found.names]
    groups = [
        Group(name, scaling.positions[found.owner == k], colours[k], SYMBOLS[k % len(SYMBOLS)])
        for k, name in enumerate(found.names)
    ]
    figure = mds_chart(scaling.positions[0], groups, scaling.explained, LIGHT, height=420)
    legend = (*zip(found.names, colours, strict=True), ("training image", LIGHT.reference))
    title = f"Fig. 12 · MDS, {said.split(',')[0]}"
    return Table(header, tuple(rows), caption), Chart(figure, title, title, legend)


def _judgements(found: Anodi, image: str) -> list[Judgement]:
    """Judge the paper's statement for each pair, and our CCWSIM against the authors' code."""
    judgements = []
    claim = "CCWSIM is comparable to MS-CCSIM and enhances pattern reproduction (abstract)."
    for name, other, whose in (
        ("CCWSIM", "MS-CCSIM", "our engine"),
        ("published CCWSIM", "published MS-CCSIM", "the authors' codes"),
    ):
        if name in found.names and other in found.names:
            between, within, ratio = found.relative(name, other)
            words = (
                f"{image.capitalize()}, {whose}: between {between:.2f}, within {within:.2f}, ratio "
                f"{ratio:.2f} of CCWSIM against MS-CCSIM."
            )
            fair, near = ratio >= 1 / COMPARABLE, within <= 1
            word = AGREES if fair and near else "in part" if fair or near else DIFFERS
            judgements.append(judged(claim, words, word))
    for other in found.names:
        if other.startswith("published CCWSIM"):
            between, within, ratio = found.relative("CCWSIM", other)
            words = f"Between {between:.2f}, within {within:.2f}, ratio {ratio:.2f} of theirs."
            low = 1 / COMPARABLE
            word = BETTER if ratio > COMPARABLE else AGREES if ratio >= low else BEHIND
            judgements.append(
                judged(f"The authors' CCWSIM code on the {image} image.", words, word)
            )
    return judgements


VARIABILITY = Experiment(
    "variability", "Variability within and between realizations", "Table 1 and Fig. 12",
    "Table 1 gives ANODI's between, within and their ratio of CCWSIM to MS-CCSIM in three "
    "resolutions; Fig. 12 shows realizations and training image by multidimensional scaling. The "
    "paper calls the two methods comparable, with better pattern reproduction for CCWSIM.",
    variability,
)  # fmt: skip
