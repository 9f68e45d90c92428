"""Conditional realizations of the channel image and their E-type (Fig. 7)."""

from __future__ import annotations

import numpy as np

from ccwsim.metrics import etype
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import (
    CONDITIONING,
    SAID,
    published,
    settings,
    stated_seconds,
    wrong_share,
)
from ccwsim.paper.pictures import map_picture, share_picture
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
from ccwsim.report import Block, Judgement, Row, Table

SHOWN = 3
LEVEL = 2


def conditional(run: Run) -> Outcome:
    """Simulate the channel image with 100, 300 and 400 data; 100 realizations with 400."""
    run.expect(5)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    shape = side, side
    sets = [run.inputs.data("channel", n, shape) for n in (100, 300, 400)]
    free = run.simulate(image, shape, settings("ccwsim", LEVEL), n=run.extent.n_few, workers=1)
    few = [
        run.simulate(image, shape, settings("ccwsim", LEVEL), data, run.extent.n_few, workers=1)
        for data in sets[:2]
    ]
    many = run.simulate(image, shape, settings("ccwsim", LEVEL), sets[2], run.extent.n_many)
    other = published(run, image, f"CCWSIM_channel512_hd400_L{LEVEL}", shape)
    blocks = (*_maps(many, image, sets[2], other), _table(free, [*few, many]))
    theirs = None if other is None else wrong_share(other, image, sets[2])
    run.step()
    return Outcome(blocks, _judgements(run, free, few, many, theirs))


def _maps(
    many: Ensemble, image: TrainingImage, data: HardData, other: np.ndarray | None
) -> tuple[Block, ...]:
    shown = [map_picture(many.indices[r], image, f"Realization {r + 1}, {data.n} data", data)
             for r in range(min(SHOWN, many.n))]  # fmt: skip
    last = image.n_facies - 1
    shares = etype(many.indices, image.n_facies).probability[last]
    name = image.facies_names[last]
    average = [share_picture(shares, f"E-type of {many.n} realizations: probability of {name}, "
                             "dark never, yellow always")]  # fmt: skip
    if other is not None:
        shares = etype(other, image.n_facies).probability[last]
        average.append(map_picture(other[0], image, "The authors' code, same study", data))
        average.append(share_picture(shares, f"E-type of its {len(other)} realizations at hand"))
    return Row(tuple(shown)), Row(tuple(average))


def _table(free: Ensemble, runs: list[Ensemble]) -> Table:
    rows = [("0", str(free.n), "–", "–", "–", seconds(float(np.median(free.cpu_seconds))))]
    rows += [
        (str(e.hard_data.n), str(e.n), f"{e.n_mismatched.mean():.1f}",
         f"{e.n_resimulated.mean():.1f}", f"{e.n_forced.mean():.1f}",
         seconds(float(np.median(e.cpu_seconds))))
        for e in runs
    ]  # fmt: skip
    header = ("data", "realizations", "wrong", "mended", "forced", "CPU time (median)")
    grid = f"{free.grid.nx} × {free.grid.ny} cells, level {LEVEL}, {SAID}"
    return Table(header, tuple(rows), f"{grid}. Data: mean over realizations; mended: brought by "
                 "a window after the raster; forced: no window fitted.")  # fmt: skip


def _judgements(
    run: Run, free: Ensemble, few: list[Ensemble], many: Ensemble, theirs: float | None
) -> tuple[Judgement, ...]:
    n, wrong = many.hard_data.n, float(many.n_mismatched.mean() / many.hard_data.n)
    found = [of_data(CONDITIONING, wrong, n, theirs), _varied(many)]
    ours = float(np.median(many.cpu_seconds))
    if run.extent.name == "quick":
        what = f"{seconds(ours)} on a smaller grid; not comparable."
        return (*found, judged("Fig. 7: 2.42 s for a realization.", what, OPEN))
    found.append(of_time("a realization (mean of 100)", ours, stated_seconds("Fig. 7"), "Fig. 7"))
    ratio = ours / float(np.median(free.cpu_seconds))
    claim = "Conditional realizations (2.42 s, Fig. 7) take less than unconditional ones (6.52 s, "
    claim += "Fig. 6); grids and levels of the two are not at hand."
    said = f"On one grid and level, conditional ones take {ratio:.2g} times as long."
    return (*found, judged(claim, said, AGREES if ratio < 1 else DIFFERS))


def _varied(many: Ensemble) -> Judgement:
    """The data must be certain in the E-type, and what is far from them must not be."""
    cells = many.hard_data.cells
    code = int(many.training_image.codes[-1])
    shares = many.probability(code)
    at_data = shares[cells[:, 0], cells[:, 1]]
    certain = float(np.mean((at_data == 0) | (at_data == 1)))
    open_cells = float(np.mean((shares > 0) & (shares < 1)))
    found = (
        f"The E-type is certain at {percent(certain)} of the data and open at "
        f"{percent(open_cells)} of all cells."
    )
    claim = "Fig. 7: three distinct realizations and their average, which follows the data."
    return judged(claim, found, AGREES if certain == 1 and open_cells > 0.5 else DIFFERS)


CONDITIONAL = Experiment(
    "conditional", "Conditional realizations and their average", "Section 5, Fig. 7",
    "Fig. 7 shows three conditional realizations of the channel image and the average of 100; mean "
    "CPU time 2.42 s.", conditional,
)  # fmt: skip
