"""A large grid with three facies and 400 data (section 5)."""

from __future__ import annotations

import numpy as np

from ccwsim.metrics import etype
from ccwsim.model.ensemble import Ensemble
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import CONDITIONING, settings, stated_seconds
from ccwsim.paper.pictures import image_picture, map_picture, share_picture
from ccwsim.paper.published_times import OCTAVE, published_time
from ccwsim.paper.verdicts import (
    AGREES,
    DIFFERS,
    OPEN,
    judged,
    of_data,
    of_time,
    percent,
    seconds,
)
from ccwsim.report import Judgement, Row, Table

LEVEL, TEMPLATE = 2, 48
CLOSE = 0.03


def three_facies(run: Run) -> Outcome:
    """Simulate the three-facies image with the authors' template of 48."""
    run.expect(2)
    image, side = run.inputs.image("three facies"), run.extent.side(1000)
    data = run.inputs.data("three facies", 400, (side, side))
    p = settings("ccwsim", LEVEL, template=TEMPLATE)
    e = run.simulate(image, (side, side), p, data, run.extent.n_few, workers=1)
    found = etype(e.indices, image.n_facies)
    pictures = (
        image_picture(image, run.inputs.said("three facies"), share=0.5),
        map_picture(e.indices[0], image, f"Realization 1, {data.n} data", data),
        share_picture(found.entropy, f"Entropy of {e.n} realizations: dark certain, yellow open"),
    )
    blocks = (Row(pictures), _proportions(e))
    run.step()
    return Outcome(blocks, _judgements(run, e))


def _proportions(e: Ensemble) -> Table:
    image = e.training_image
    rows = tuple(
        (name, percent(float(image.proportions[k])), percent(float(e.proportions[:, k].mean())),
         f"{percent(float(e.proportions[:, k].min()))} to "
         f"{percent(float(e.proportions[:, k].max()))}")
        for k, name in enumerate(image.facies_names)
    )  # fmt: skip
    header = ("facies", "training image", f"mean of {e.n} realizations", "from, to")
    return Table(
        header, rows, f"{e.grid.nx} × {e.grid.ny} cells, T {TEMPLATE}, OR 8, level {LEVEL}"
    )


def _judgements(run: Run, e: Ensemble) -> tuple[Judgement, ...]:
    image, ours = e.training_image, float(np.median(e.cpu_seconds))
    off = float(np.abs(e.proportions.mean(axis=0) - image.proportions).max())
    wrong = float(e.n_mismatched.mean() / e.hard_data.n)
    there = published_time(OCTAVE, "ccwsim", LEVEL, e.grid.nx * e.grid.ny, 400, "three facies")
    theirs = there.wrong_share if there and run.inputs.is_own("three facies") else None
    judgements = [
        judged("More than two facies can be simulated.",
               f"All {image.n_facies} facies occur, each within {percent(off)} of its share of the "
               "image.", AGREES if off <= CLOSE else DIFFERS),
        of_data(CONDITIONING, wrong, e.hard_data.n, theirs),
    ]  # fmt: skip
    if run.extent.name == "quick":
        words = f"{seconds(ours)} on a smaller grid; not comparable."
        judgements.append(judged("3.50 s for a realization of 1000 × 1000.", words, OPEN))
    else:
        where = "Three facies, 1000 × 1000 cells, 400 data"
        judgements.append(of_time("a realization", ours, stated_seconds("three facies"), where))
    return tuple(judgements)


THREE_FACIES = Experiment(
    "three-facies",
    "Three facies on a large grid",
    "Section 5",
    "The paper simulates three facies on 1000 × 1000 cells with 400 data; CPU time 3.50 s.",
    three_facies,
)
