"""The stone wall image by CCWSIM and MS-CCSIM (section 5)."""

from __future__ import annotations

import numpy as np

from ccwsim.metrics import pattern_distance
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import CONDITIONING, TITLES, published, settings, wrong_share
from ccwsim.paper.pictures import image_picture, map_picture
from ccwsim.paper.verdicts import AGREES, BETTER, DIFFERS, judged, of_data, percent, seconds
from ccwsim.report import Judgement, Row, Table

LEVELS = (1, 3)
ALIKE = 1.1


def stone_wall(run: Run) -> Outcome:
    """Simulate both methods with about 300 data at levels 1 and 3."""
    run.expect(5)
    image, side = run.inputs.image("stone wall"), run.extent.side(512)
    data = run.inputs.data("stone wall", 300, (side, side))
    rows, pictures, distance, shares = [], [], {}, []
    for method in ("ccwsim", "ms-ccsim"):
        for level in LEVELS:
            e = run.simulate(image, (side, side), settings(method, level), data, run.extent.n_few,
                             workers=1)  # fmt: skip
            distance[method, level] = near = _distance(e.indices, image)
            name = f"{TITLES[method]}, level {level}"
            shares.append(float(e.n_mismatched.mean() / data.n))
            rows.append((f"ours, {name}", str(e.n), _shown(near), percent(shares[-1]),
                         seconds(float(np.median(e.cpu_seconds)))))  # fmt: skip
            if level == 1:
                pictures.append(map_picture(e.indices[0], image, f"{name}, ours", data))
    theirs, missed = {}, None
    for code, method in (("CCWSIM", "ccwsim"), ("MS-CCSIM", "ms-ccsim")):
        found = published(run, image, f"{code}_stonewall512_hd300_L1", (side, side))
        if found is None:
            continue
        theirs[method] = near = _distance(found, image)
        share = wrong_share(found, image, data)
        missed = share if method == "ccwsim" else missed
        rows.append((f"published {code}, level 1", str(len(found)), _shown(near),
                     percent(share), "–"))  # fmt: skip
        pictures.append(map_picture(found[0], image, f"{code}, level 1, published code", data))
    header = ("realizations", "n", "pattern distance 1, 1/2, 1/3", "data wrong", "CPU time")
    table = Table(header, tuple(rows), f"{side} × {side} cells, {data.n} data, T 32, OR 8.")
    said = image_picture(image, run.inputs.said("stone wall"), share=0.5)
    run.step()
    honoured = of_data(CONDITIONING, shares[0], data.n, missed)
    blocks = Row((said, *pictures)), table
    return Outcome(blocks, (*_judgements(distance, theirs), honoured))


def _distance(images: np.ndarray, image) -> np.ndarray:
    return pattern_distance(images, image.indices, image.n_facies).mean(axis=0)


def _shown(distances: np.ndarray) -> str:
    return " ".join(f"{d:.4f}" for d in distances)


def _judgements(distance: dict, theirs: dict) -> tuple[Judgement, ...]:
    judgements: list[Judgement] = []
    claim = "CCWSIM is comparable to MS-CCSIM and enhances pattern reproduction (abstract)."
    pairs = [(f"our engine, level {level}", distance["ccwsim", level], distance["ms-ccsim", level])
             for level in LEVELS]  # fmt: skip
    if len(theirs) == 2:
        pairs.append(("the published codes, level 1", theirs["ccwsim"], theirs["ms-ccsim"]))
    for who, own, other in pairs:
        near, far = float(own.mean()), float(other.mean())
        found = f"Mean pattern distance, {who}: {near:.4f} against {far:.4f} bits."
        judgements.append(judged(claim, found, AGREES if near <= ALIKE * far else DIFFERS))
    if "ccwsim" in theirs:
        near, far = float(distance["ccwsim", 1].mean()), float(theirs["ccwsim"].mean())
        found = f"Mean pattern distance {near:.4f} against {far:.4f} bits."
        word = BETTER if near < far / ALIKE else AGREES if near <= ALIKE * far else "behind"
        judgements.append(judged("The authors' CCWSIM code at level 1, same data.", found, word))
    return tuple(judgements)


STONE_WALL = Experiment(
    "stone-wall", "The stone wall", "Section 5",
    "The paper shows conditional simulations of the stone wall image by CCWSIM and MS-CCSIM; no "
    "numbers of them are at hand.", stone_wall,
)  # fmt: skip
