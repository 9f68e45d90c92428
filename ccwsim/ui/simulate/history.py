"""The strip of the runs of this session, and what differs between two: a click goes back to one."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import fields
from typing import Any

import streamlit as st

from ccwsim.figures import contact_sheet, facies_colours, tile_size
from ccwsim.model.choices import Choices, DataChoice, ImageChoice
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters
from ccwsim.ui.results.maps import pretty
from ccwsim.ui.session.state import PastRun, State
from ccwsim.ui.study.run import stop_run
from ccwsim.ui.widgets.facts import seconds
from ccwsim.ui.widgets.maps import canvas_component
from ccwsim.ui.widgets.text import panel_title

KEY = "history_strip"
LONGEST = 72
"""Pixels of a picture's longer side."""
SHORT = {
    "template_size": "template",
    "overlap_size": "overlap",
    "wavelet_level": "level",
    "n_candidates": "K",
    "method": "",
}
"""What a parameter is called where room is short; the others by their own names."""


def draw_history(state: State) -> None:
    """Draw the strip, newest first, as soon as there is a run to go back to."""
    runs = state.runs.runs
    if len(runs) < 2:
        return
    panel_title("Runs of this session", "click to go back")

    def chosen() -> None:
        run = st.session_state[KEY].chosen
        if run is not None:
            go_back(state, str(run))

    data = {"runs": [entry(runs, k) for k in range(len(runs))], "shown": place_of(state)}
    canvas_component("history")(key=KEY, data=data, on_chosen_change=chosen)


def go_back(state: State, key: str) -> None:
    """Bring the study and the results of a run back; a run that is going is stopped.

    A `key` of a run that is gone by now changes nothing.
    """
    run = next((run for run in state.runs.runs if run.key == key), None)
    if run is None:
        return
    stop_run(state)
    state.message = ""
    state.choices = state.ran = state.tried = run.choices
    state.image_draft = state.data_draft = None
    state.ensemble, state.reference = run.ensemble, run.reference
    state.shown = min(state.shown, run.ensemble.n - 1)


def place_of(state: State) -> int:
    """Return which of the runs is on the page, −1 for none."""
    shown = [k for k, run in enumerate(state.runs.runs) if run.ensemble is state.ensemble]
    return shown[0] if shown else -1


def entry(runs: list[PastRun], k: int) -> dict[str, Any]:
    """Return run k as the strip takes it: picture, what changed, and when and how long it ran."""
    run = runs[k]
    ensemble = run.ensemble
    changes = changes_between(runs[k + 1].choices, run.choices) if k + 1 < len(runs) else []
    width, height = tile_size(ensemble.grid.shape, LONGEST)
    colours = facies_colours(ensemble.training_image, dict(run.choices.image.colours))
    missing = run.choices.n_realizations - ensemble.n
    stopped = f"{ensemble.n} of {run.choices.n_realizations} · " if missing else ""
    return {
        "key": run.key,
        "png": _picture(ensemble.digest, tuple(colours), ensemble),
        "width": width,
        "height": height,
        "label": " · ".join(changes) or study_name(run.choices),
        "note": f"{stopped}{run.at:%H:%M:%S} · {seconds(ensemble.wall_seconds)}",
    }


@st.cache_data(max_entries=64, show_spinner=False)
def _picture(digest: str, colours: tuple[str, ...], _ensemble: Ensemble) -> str:
    png, _ = contact_sheet(_ensemble.indices[:1], colours, longest=2 * LONGEST)
    return b64encode(png).decode()


def changes_between(before: Choices, after: Choices) -> list[str]:
    """Return each difference of two studies as a short phrase; none for equal ones.

    Examples
    --------
    >>> changes_between(Choices(), Choices(seed=3, parameters=Parameters(wavelet_level=1)))
    ['level 2 → 1', 'seed 0 → 3']
    """
    said = []
    if before.image != after.image:
        said.append(_image(before.image, after.image))
    if before.data != after.data:
        said.append(_data(before.data, after.data))
    if before.grid != after.grid:
        said.append(_grid(before.grid, after.grid))
    said += _parameters(before.parameters, after.parameters)
    if before.n_realizations != after.n_realizations:
        said.append(f"{before.n_realizations} → {after.n_realizations} realizations")
    if before.seed != after.seed:
        said.append(f"seed {before.seed} → {after.seed}")
    return said


def study_name(choices: Choices) -> str:
    """Return what a study is, in a few words.

    Examples
    --------
    >>> study_name(Choices())
    'channels, level 2, seed 0'
    """
    return f"{image_name(choices.image)}, level {choices.parameters.level}, seed {choices.seed}"


def image_name(choice: ImageChoice) -> str:
    """Return what a training image is called."""
    return choice.upload.name if choice.upload else pretty(choice.bundled)


def _image(before: ImageChoice, after: ImageChoice) -> str:
    old, new = image_name(before), image_name(after)
    if old != new:
        return f"{old} → {new}"
    return f"{new}, other colours" if before.digest == after.digest else f"{new}, read otherwise"


def _data(before: DataChoice, after: DataChoice) -> str:
    old, new = _data_name(before), _data_name(after)
    return f"{old} → {new}" if old != new else f"other {new}"


def _data_name(choice: DataChoice) -> str:
    if choice.source == "bundled":
        return pretty(choice.bundled)
    if choice.source == "file":
        return choice.upload.name if choice.upload else "a file"
    if choice.source == "sampled":
        return f"{choice.n_sampled} sampled data"
    if choice.source == "placed":
        n = choice.placed.n if choice.placed is not None else 0
        return f"{n} placed data"
    return "no data"


def _grid(before: Grid, after: Grid) -> str:
    if before.shape == after.shape:
        return "other world coordinates"
    return f"grid {before.nx} × {before.ny} → {after.nx} × {after.ny}"


def _parameters(before: Parameters, after: Parameters) -> list[str]:
    said = []
    for field in fields(Parameters):
        old, new = _value(before, field.name), _value(after, field.name)
        if old != new:
            name = SHORT.get(field.name, field.name.replace("_", " "))
            said.append(f"{name} {_shown(old)} → {_shown(new)}".strip())
    return said


def _value(p: Parameters, name: str) -> object:
    return p.level if name == "wavelet_level" else getattr(p, name)


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:g}" if isinstance(value, float) else str(value)
