"""What a realization copied from the training image: copy meter, seams, and a map of re-use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import CIVIDIS, ramp
from ccwsim.metrics import Copying, copying
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError
from ccwsim.run.simulation import simulate
from ccwsim.ui.jobs.statistics import Fraction, Task
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.panel import panel
from ccwsim.ui.validate.statistics import study_key
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.maps import CellMap, draw_map
from ccwsim.ui.widgets.steps import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

MAP_HEIGHT = 420
MAX_USES = 100
"""Places used more often than this are drawn alike."""


def copied(ensemble: Ensemble, r: int) -> Task[Copying]:
    """Return the re-use of realization r, simulated again where its sources were not kept."""

    def work(progress: Fraction) -> Copying:
        return copying(sources_of(ensemble, r), ensemble.training_image.shape)

    key = ("reuse", *study_key(ensemble), ensemble.parameters.digest, ensemble.hard_data.digest,
           ensemble.seed, int(ensemble.numbers[r]), ensemble.sources is None)  # fmt: skip
    return Task(key, work)


def sources_of(ensemble: Ensemble, r: int) -> NDArray[np.int32]:
    """Return the flat index in the training image of each cell of realization r.

    Raises
    ------
    CCWSIMError
        Where the same run does not give the same realization, because it was edited since.
    """
    if ensemble.sources is not None:
        return ensemble.sources[r]
    again = simulate(
        ensemble.training_image, ensemble.grid, ensemble.parameters, ensemble.hard_data,
        n_realizations=1, seed=ensemble.seed, first_realization=int(ensemble.numbers[r]),
        keep_sources=True,
    )  # fmt: skip
    if again.sources is None or not np.array_equal(again.indices[0], ensemble.indices[r]):
        raise CCWSIMError(
            "this realization was mended around edits of the data since its run, so that its "
            "sources are not known; run the study again to see them"
        )
    return again.sources[0]


def draw_reuse(state: State, colours: Sequence[str]) -> None:
    """Draw the re-use of the realization that is shown."""
    ensemble = state.ensemble
    assert ensemble is not None
    r = state.shown
    panel(state, "reuse", copied(ensemble, r), lambda found: _draw(found, ensemble, r, colours))


def meter_of(found: Copying) -> list[tuple[str, str]]:
    """Return the copy meter: what is measured, and how much it is."""
    side = found.largest_square
    return [
        ("neighbours kept", f"{100 * found.copied:.1f} %"),
        ("largest square copied", f"{side} × {side} cells"),
        ("largest piece copied", f"{found.largest_block:,} cells"),
        ("training image used", f"{100 * found.used:.0f} %"),
        ("set by force", f"{found.n_unknown:,} cells"),
    ]


def _draw(found: Copying, ensemble: Ensemble, r: int, colours: Sequence[str]) -> None:
    left, middle, right = st.columns([1.0, 1.0, 0.8], gap="medium")
    with left:
        share = 100 * found.seams.mean()
        panel_title("Seams", f"{three_digits(share)} % of the cells lie at one")
        shown = seam_map(found, ensemble, r, colours, chart_theme().reference)
        draw_map(shown, "map_seams", link="grid", name="seams", max_height=MAP_HEIGHT)
    with middle:
        panel_title("Where it came from", "uses of each cell of the training image")
        draw_map(use_map(found), "map_uses", name="uses", max_height=MAP_HEIGHT)
    with right:
        panel_title("Copy meter", f"realization {ensemble.numbers[r] + 1}")
        rows = "".join(f"<tr><th>{k}</th><td>{v}</td></tr>" for k, v in meter_of(found))
        st.html(f'<table class="numbers">{rows}</table>')
        step_note(
            "Neighbours kept: pairs of touching cells that touch in the same way in the training "
            "image. All kept would be a copy; few kept would be noise. A piece is what holds "
            "together without a seam."
        )


def seam_map(
    found: Copying, ensemble: Ensemble, r: int, colours: Sequence[str], line: str
) -> CellMap:
    """Return a realization with its seams drawn over it; the hover still says the facies."""
    names = ensemble.training_image.facies_names
    n = len(names)
    seams = found.seams if n <= 128 else np.zeros_like(found.seams)
    return CellMap(
        indices=(ensemble.indices[r] + n * seams).astype(np.uint8),
        colours=[*colours, *[line] * n],
        labels=[*names, *(f"{name}, at a seam" for name in names)],
        alt=f"Seams between pieces of the training image in realization {r + 1}",
        keys=[*zip(names, colours, strict=True), ("seam", line)][-8:],
    )


def use_map(found: Copying) -> CellMap:
    """Return how often each cell of the training image was used."""
    most = max(int(found.uses.max()), 1)
    n = min(most, MAX_USES)
    labels = [f"used {k} times" for k in range(n + 1)]
    if most > n:
        labels[-1] = f"used {n} times or more"
    return CellMap(
        indices=np.minimum(found.uses, n).astype(np.uint8),
        colours=ramp(CIVIDIS, n + 1),
        labels=labels,
        alt="How often each cell of the training image was used",
        strip={"colours": list(CIVIDIS), "low": "0", "high": f"{n} uses"},
    )
