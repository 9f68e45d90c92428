"""The diagnosis of the training image on the page of validation."""

from __future__ import annotations

from collections.abc import Sequence

from ccwsim.metrics import Diagnosis
from ccwsim.ui.session.state import State
from ccwsim.ui.study.diagnosis_panel import draw_diagnosis
from ccwsim.ui.study.image_step import use_advice
from ccwsim.ui.validate.panel import panel
from ccwsim.ui.validate.statistics import looks


def draw_image(state: State, colours: Sequence[str]) -> None:
    """Draw what the training image of the realizations is like."""
    ensemble = state.ensemble
    assert ensemble is not None
    image = ensemble.training_image

    def draw(found: Diagnosis) -> None:
        parameters = state.choices.parameters
        draw_diagnosis(found, image, parameters, colours, lambda new: use_advice(state, new))

    panel(state, "diagnosis", looks(image), draw)
