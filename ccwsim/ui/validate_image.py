"""The diagnosis of the training image on the page of validation."""

from __future__ import annotations

from collections.abc import Sequence

from ccwsim.metrics import Diagnosis
from ccwsim.ui.diagnosis_panel import draw_diagnosis
from ccwsim.ui.image_step import use_advice
from ccwsim.ui.state import State
from ccwsim.ui.validate_panel import panel
from ccwsim.ui.validate_statistics import looks


def draw_image(state: State, colours: Sequence[str]) -> None:
    """Draw what the training image of the realizations is like."""
    ensemble = state.ensemble
    assert ensemble is not None
    image = ensemble.training_image

    def draw(found: Diagnosis) -> None:
        parameters = state.choices.parameters
        draw_diagnosis(found, image, parameters, colours, lambda new: use_advice(state, new))

    panel(state, "diagnosis", looks(image), draw)
