"""The diagnosis of a training image, and advice on template, overlap and level."""

from collections.abc import Callable, Sequence
from html import escape

import numpy as np
import streamlit as st

from ccwsim import Parameters, TrainingImage
from ccwsim.figures import proportions_chart, repetition_chart
from ccwsim.metrics import QUARTERS, Diagnosis
from ccwsim.model import plural
from ccwsim.report.settings import describe_value
from ccwsim.ui.results.charts import titled_chart
from ccwsim.ui.study.study_column import STEP_LABELS
from ccwsim.ui.widgets import button, chart_theme, panel_title, step_note

UseAdvice = Callable[..., None]
"""A function that puts advised values of parameters, by name, into the study."""
Price = Callable[..., str]
"""A function that describes the time of a realization with advised values."""


def draw_diagnosis(
    diagnosis: Diagnosis,
    image: TrainingImage,
    parameters: Parameters,
    colours: Sequence[str],
    use: UseAdvice,
    price: Price,
) -> None:
    """Draw a diagnosis and its advice with its price; a button uses the advised values."""
    left, middle, right = st.columns([1.6, 1.0, 1.0], gap="large")
    with left:
        draw_advice(diagnosis, image, parameters, use, price)
    with middle:
        template = parameters.template_size
        horizontal = template[1:] if isinstance(template, tuple) else (template,)
        marks = {f"T {size}": size for size in horizontal}
        ew, ns = diagnosis.spacing_ew, diagnosis.spacing_ns
        chart = repetition_chart(ew.lags, ew.correlation, ns.correlation, marks, chart_theme())
        alt = "Correlation of the training image with itself against lag, E–W and N–S"
        titled_chart("Repetition", describe_repetition(diagnosis), chart, "repetition", alt)
        step_note("Solid: E–W; dashed: N–S; dotted: the present template size.")
    with right:
        stationarity = diagnosis.stationarity
        differ = "no quarter differs" if stationarity.stationary else "quarters differ"
        quarters, whole = stationarity.proportions, image.proportions
        chart = proportions_chart(image.facies_names, whole, quarters, colours, chart_theme())
        alt = "Facies proportions of the four quarters and of the whole image"
        titled_chart(
            "Stationarity", f"{differ} by more than chance explains", chart, "quarters", alt
        )
        chance = 200 * float(stationarity.errors[:4].max())
        step_note(
            f"Dots: the quarters {', '.join(QUARTERS)}; red: the whole image. By chance, the "
            f"proportion in a quarter deviates by up to ±{chance:.2g} % (two standard errors)."
        )


def draw_advice(
    diagnosis: Diagnosis, image: TrainingImage, parameters: Parameters, use: UseAdvice, price: Price
) -> None:
    """Draw only warnings and advice; the arguments are as in `draw_diagnosis`."""
    panel_title("Advised values", f"{diagnosis.n_templates} templates of that size fit")
    for warning in diagnosis.warnings:
        st.html(f'<p class="odd">{escape(warning)}</p>')
    st.html(advice_table(diagnosis, parameters))
    thin = int(np.argmin(diagnosis.thickness))
    thickness = plural(diagnosis.thickness[thin], "cell")
    step_note(f"Thinnest feature: {image.two_facies.facies_names[thin]}, {thickness} thick.")
    advised = {advice.parameter: advice.value for advice in diagnosis.advice}
    differs = any(getattr(parameters, name) != value for name, value in advised.items())
    if differs:
        tip = "Uses the advised values in the study. Run the study to see their effect."
        step_note(f"With these values: {price(**advised)}.")
        button("Use these values", key="use_advice", on_click=use, kwargs=advised, help=tip)


def advice_table(diagnosis: Diagnosis, parameters: Parameters) -> str:
    """Return the advised values, the present values and the reasons as an HTML table."""
    rows = "<tr><th></th><th>advised</th><th>set</th><th>why</th></tr>"
    for advice in diagnosis.advice:
        name = advice.parameter
        rows += (
            f"<tr><th>{STEP_LABELS.get(name, name.replace('_', ' ').capitalize())}</th>"
            f'<td class="size"><b>{describe_value(name, advice.value)}</b></td>'
            f'<td class="size">{describe_value(name, getattr(parameters, name))}</td>'
            f'<td class="reason">{escape(advice.reason)}</td></tr>'
        )
    return f'<table class="numbers">{rows}</table>'


def describe_repetition(diagnosis: Diagnosis) -> str:
    """Describe the distance between features."""
    axes = (("E–W", diagnosis.spacing_ew), ("N–S", diagnosis.spacing_ns))
    spacings = [
        f"every {axis.spacing} cells {name}" for name, axis in axes if axis.spacing is not None
    ]
    if diagnosis.vertical_spacing is not None and diagnosis.vertical_spacing.spacing is not None:
        spacings.append(f"every {diagnosis.vertical_spacing.spacing} layers")
    return ", ".join(spacings) if spacings else "no rhythm"
