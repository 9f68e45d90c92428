"""The wavelet sub-bands of the training image, and of the drawn patch."""

from __future__ import annotations

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.engine.stages.pyramid import decompose
from ccwsim.engine.trace import Trace, TracedPatch
from ccwsim.figures import Theme
from ccwsim.figures.lag_maps import DIFFERENCE
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.how_it_works.maps import value_map
from ccwsim.ui.how_it_works.state import How
from ccwsim.ui.how_it_works.words import inverse_words, say
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import field
from ccwsim.ui.widgets.maps import draw_map
from ccwsim.ui.widgets.steps import panel_title

NAMES = {
    "cA": "approximation",
    "cH": "horizontal detail",
    "cV": "vertical detail",
    "cD": "diagonal detail",
}


def draw_bands(state: State, trace: Trace, step: TracedPatch, theme: Theme) -> None:
    """Draw the sub-bands of the image at the level of the search, with the drawn place marked."""
    page_state = state.page(How)
    image, level = trace.study.training_image, trace.study.parameters.level
    with st.container(horizontal=True, vertical_alignment="center", key="how_bands_row"):
        panel_title("The training image in wavelets", f"level {level}" if level else "level 0")
        if image.n_facies > 2:
            names = image.facies_names
            field(
                st.selectbox, "Facies", key="how_facies", value=page_state.facies, width=140,
                options=list(range(image.n_facies)), format_func=lambda k: names[k],
                label_visibility="collapsed",
                write=lambda k: setattr(page_state, "facies", k),
            )  # fmt: skip
    if not level:
        say(
            "At level 0 the image is compared as it is: there are no sub-bands. Choose level 1 or "
            "more to see them.", "section 3",
        )  # fmt: skip
        return
    bands = _bands(image.digest, page_state.facies, level, image)
    unit = step.unit
    box = trace.image_frame.box_to_world(*step.drawn_place, *step.cells.shape)
    mark = {
        "kind": "box", "row": box.row / unit, "column": box.column / unit,
        "height": box.height / unit, "width": box.width / unit, "colour": theme.reference,
        "label": "the drawn patch",
    }  # fmt: skip
    with st.container(key="how_bands"):
        for place, (name, words) in zip(st.columns(4, gap="medium"), NAMES.items(), strict=True):
            with place:
                panel_title(f"{name}{'₀₁₂₃₄₅₆'[level]}", words)
                shown = _band_map(name, bands[name], unit, theme)
                shown.marks.append(mark)
                draw_map(shown, f"how_map_{name}", max_height=300, scale="how_bands",
                         link="how_bands", name=name)  # fmt: skip
    say(
        f"Each block of {unit} × {unit} cells gives one number a band. The approximation is what "
        f"the search compares; the three details are what it leaves out, and what the inverse "
        f"transform puts back. {inverse_words(trace, step, _largest(state, trace, step))}",
        "section 3, Figs. 2 and 4 · Algorithm 1, lines 1 and 9",
    )


def _band_map(name: str, values: NDArray[np.float64], unit: int, theme: Theme):
    alt = f"{name}, {NAMES[name]}"
    if name == "cA":
        return value_map(values, name, theme, alt, low=0.0, high=float(unit))
    largest = float(abs(values).max()) or 1.0
    return value_map(values, name, theme, alt, low=-largest, high=largest, colours=DIFFERENCE)


@st.cache_resource(max_entries=16, show_spinner=False)
def _bands(
    digest: str, facies: int, level: int, _image: TrainingImage
) -> dict[str, NDArray[np.float64]]:
    approximation, details, *_ = decompose(_image.indices == facies, level)
    return dict(zip(NAMES, (approximation, *details), strict=True))


def _largest(state: State, trace: Trace, step: TracedPatch) -> float:
    """Return how far the inverse transform is from the slice of the image."""
    page_state = state.page(How)
    patch = trace.reconstructed(step, page_state.facies)
    (ty, tx), n = step.drawn_place, len(patch)
    own = trace.oriented.pyramid.image[ty : ty + n, tx : tx + n] == page_state.facies
    return float(abs(patch - own).max(initial=0.0))
