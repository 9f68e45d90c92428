"""The runs of this session and their differences; a click restores a run."""

from base64 import b64encode
from typing import Any

from ccwsim.figures import contact_sheet, facies_colours, tile_size
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.numbers import seconds
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.results.maps import middle_layers
from ccwsim.ui.session.cached import cached
from ccwsim.ui.session.state import PastRun, State
from ccwsim.ui.study.changes import changes_between, study_name
from ccwsim.ui.study.run import stop_run
from ccwsim.ui.widgets.text import panel_title

KEY = "history_strip"
LONGEST = 72
"""Length of the longer side of a picture in pixels."""


def draw_history(state: State) -> None:
    """Draw the runs, newest first, if there are two or more."""
    runs = state.runs.runs
    if len(runs) < 2:
        return
    panel_title("Runs of this session", "click to restore a run")

    data = {"runs": [entry(runs, k) for k in range(len(runs))], "shown": place_of(state)}
    draw_component("history", KEY, data, "chosen", lambda key: go_back(state, str(key)))


def go_back(state: State, key: str) -> None:
    """Stop the present run, and restore study and results of a past run that is still stored."""
    run = next((run for run in state.runs.runs if run.key == key), None)
    if run is None:
        return
    stop_run(state)
    state.message = ""
    state.choices = state.ensemble_choices = state.last_attempt = run.choices
    state.image_draft = state.data_draft = None
    state.ensemble, state.reference = run.ensemble, run.reference
    state.shown = min(state.shown, run.ensemble.n - 1)


def place_of(state: State) -> int:
    """Return the index of the run whose results are on the page, or −1 if none is."""
    latest = state.ensemble and state.ensemble.indices  # facies may have been renamed since
    shown = [k for k, run in enumerate(state.runs.runs) if run.ensemble.indices is latest]
    return shown[0] if shown else -1


def entry(runs: list[PastRun], k: int) -> dict[str, Any]:
    """Return the entry of run k in the list: picture, differences, time of day, and duration."""
    run = runs[k]
    ensemble = run.ensemble
    changes = changes_between(runs[k + 1].choices, run.choices) if k + 1 < len(runs) else []
    width, height = tile_size(ensemble.grid.shape[-2:], LONGEST)
    colours = facies_colours(ensemble.training_image, dict(run.choices.image.colours))
    missing = run.choices.n_realizations - ensemble.n
    stopped = f"{ensemble.n} of {run.choices.n_realizations} · " if missing else ""
    return {
        "key": run.key,
        "png": _picture(ensemble, tuple(colours)),
        "width": width,
        "height": height,
        "label": " · ".join(changes) or study_name(run.choices),
        "note": f"{stopped}{run.at:%H:%M:%S} · {seconds(ensemble.wall_seconds)}",
    }


@cached(max_entries=64)
def _picture(ensemble: Ensemble, colours: tuple[str, ...]) -> str:
    png, _ = contact_sheet(middle_layers(ensemble.indices[:1]), colours, longest=2 * LONGEST)
    return b64encode(png).decode()
