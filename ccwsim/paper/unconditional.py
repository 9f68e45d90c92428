"""Unconditional realizations of the channel image (section 5.1, Fig. 6)."""

from __future__ import annotations

import numpy as np

from ccwsim.metrics import pattern_distance
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.methods import SAID, published, settings, stated_seconds
from ccwsim.paper.pictures import image_picture, map_picture, relative_tau
from ccwsim.paper.verdicts import AGREES, DIFFERS, OPEN, judged, of_time, percent, seconds
from ccwsim.report import Judgement, Row, Table, Text

SHOWN = 3
CLOSE_SHARE, CLOSE_TAU = 0.03, 0.85
"""Proportions and connection count as reproduced within these."""


def unconditional(run: Run) -> Outcome:
    """Simulate at levels 1 to 3, and compare proportions, patterns and connection."""
    run.expect(4)
    image, side = run.inputs.image("channel"), run.extent.side(512)
    runs = [
        run.simulate(image, (side, side), settings("ccwsim", level), n=run.extent.n_few, workers=1)
        for level in (1, 2, 3)
    ]
    rows = [_row(f"ours, level {e.parameters.level}", e.indices, image, e) for e in runs]
    other = published(run, image, "CCWSIM_channel256_uncond_L2", (256, 256))
    if other is not None:
        rows.append(_row("authors' code, level 2, 256 × 256", other, image))
    run.step()
    shown = runs[1]
    pictures = [image_picture(image, run.inputs.said("channel"))]
    pictures += [map_picture(shown.indices[r], image, f"Realization {r + 1}, level 2") for r in
                 range(min(SHOWN, shown.n))]  # fmt: skip
    header = ("realizations", f"{image.facies_names[-1]} (image: "
              f"{percent(float(image.proportions[-1]))})", "pattern distance 1, 1/2, 1/3",
              "τ E–W at 41 cells", "at 81 cells", "CPU time")  # fmt: skip
    caption = (
        f"{side} × {side} cells, {SAID}. Pattern distance: Jensen–Shannon divergence of 4 × 4 "
        "patterns (bits) from the training image; τ relative to the training image's."
    )
    blocks = (Row(tuple(pictures)), Table(header, tuple(rows), caption))
    return Outcome((*blocks, _remark(run)), (_reproduced(shown, image), _time(run, shown)))


def _row(
    name: str, images: np.ndarray, image: TrainingImage, ensemble: Ensemble | None = None
) -> tuple[str, ...]:
    distances = pattern_distance(images, image.indices, image.n_facies).mean(axis=0)
    share = float(np.mean(images == image.n_facies - 1))
    tau = list(relative_tau(images, image).values())
    near, far = (f"{tau[k]:.2f}" if k < len(tau) else "–" for k in (1, 3))
    time = seconds(float(np.median(ensemble.cpu_seconds))) if ensemble else "–"
    return name, percent(share), " ".join(f"{d:.4f}" for d in distances), near, far, time


def _reproduced(ensemble: Ensemble, image: TrainingImage) -> Judgement:
    own, reference = float(ensemble.proportions.mean(axis=0)[-1]), float(image.proportions[-1])
    lag, tau = list(relative_tau(ensemble.indices, image).items())[-1]
    name = image.facies_names[-1]
    found = (
        f"{name.capitalize()} takes {percent(own)} of the cells ({percent(reference)} in the "
        f"image); cells {lag} apart are connected {tau:.2f} times as often as in the image."
    )
    holds = abs(own - reference) <= CLOSE_SHARE and tau >= CLOSE_TAU
    claim = "Fig. 6: three realizations whose channels look like the training image's."
    return judged(claim, found, AGREES if holds else DIFFERS)


def _time(run: Run, ensemble: Ensemble) -> Judgement:
    ours = float(np.median(ensemble.cpu_seconds))
    if run.extent.name == "quick":
        claim = "Fig. 6: 6.52 s for a realization (mean)."
        return judged(claim, f"{seconds(ours)} on a smaller grid; not comparable.", OPEN)
    return of_time("a realization (mean); grid and level are not at hand", ours,
                   stated_seconds("Fig. 6"), "Fig. 6")  # fmt: skip


def _remark(run: Run) -> Text:
    return Text(
        "The grid of the paper's figure is not known to us; the one here is "
        f"{run.extent.side(512)} × {run.extent.side(512)}, as in its conditional runs.", quiet=True,
    )  # fmt: skip


UNCONDITIONAL = Experiment(
    "unconditional", "Unconditional realizations", "Section 5.1, Fig. 6",
    "Fig. 6 shows the channel training image and three unconditional realizations; mean CPU time "
    "6.52 s.", unconditional,
)  # fmt: skip
