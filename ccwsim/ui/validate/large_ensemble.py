"""A long run on the page: asked for, followed as it goes, and shown as it settles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.figures import Bundle, convergence_chart, curves_chart
from ccwsim.metrics import RunningSummary, connectivity, variogram
from ccwsim.model.bounds import MAX_LARGE_ENSEMBLE
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import failed
from ccwsim.ui.validate.conditioning import draw_e_type_maps
from ccwsim.ui.validate.large_ensemble_job import LargeEnsembleRun
from ccwsim.ui.validate.panel import Validation
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.fields import button, field
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import step_note
from ccwsim.ui.widgets.theme import chart_theme


def draw_large_ensemble(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the controls and what the latest large ensemble gave."""
    page_state = state.page(Validation)
    run = page_state.long_run
    step_note(
        "Simulates many realizations of the study of this page and keeps only what they say "
        "together: E-type, entropy, proportions and curves, in memory that does not grow."
    )
    going = run is not None and run.going
    with st.container(horizontal=True, vertical_alignment="bottom", gap="small", key="long_row"):
        field(
            st.number_input, "Realizations", key="n_long", value=page_state.n_long,
            min_value=10, max_value=MAX_LARGE_ENSEMBLE, step=100, width=180,
            help="More make the probabilities more exact: the error halves with four times as "
            "many.", write=lambda n: setattr(page_state, "n_long", int(n)),
        )  # fmt: skip
        if not going:
            button(
                "Start",
                key="long_start",
                type="primary",
                on_click=start,
                args=(state,),
            )
    if page_state.long_message:
        st.warning(plain(page_state.long_message))
    if run is not None and not belongs(run, ensemble):
        step_note("The latest long run was of another study.")
    elif run is not None and going:
        _follow(run, state, colours)
    elif run is not None:
        _show(run, state, colours)


def start(state: State) -> None:
    """Start a long run of the study that the realizations came from."""
    page_state = state.page(Validation)
    ensemble = state.ensemble
    assert ensemble is not None
    run = LargeEnsembleRun(
        ensemble.training_image, ensemble.grid, ensemble.parameters, ensemble.hard_data,
        ensemble.seed, page_state.n_long, state.facies,
    )  # fmt: skip
    page_state.long_message = ""
    try:
        page_state.long_run = run.start()
    except CCWSIMError as error:
        page_state.long_message = str(error)


def _follow(run: LargeEnsembleRun, state: State, colours: Sequence[str]) -> None:
    assert run.job is not None
    keys = ("long_progress", "long_stop")
    follow(run.job, draw=lambda: _show(run, state, colours), keys=keys, cancel="Stop")


def _show(run: LargeEnsembleRun, state: State, colours: Sequence[str]) -> None:
    if run.job is not None and run.job.error is not None:
        st.error(plain(f"The long run ended early: {failed(run.job.error)}"))
    summary = run.summary
    if summary is None:
        return
    step_note(said_long(run, summary))
    assert state.ensemble is not None
    draw_e_type_maps(summary.etype, state, state.ensemble, colours, prefix="long_")
    name = run.training_image.facies_names[run.facies]
    places = st.columns(4, gap="medium")
    for place, (way, sign, bands, top) in zip(
        places[:3],
        (
            ("E-W", "γ", summary.variograms, None),
            ("N-S", "γ", summary.variograms, None),
            ("E-W", "τ", summary.connectivity, (0, 1.04)),
        ),
        strict=True,
    ):
        with place:
            bundle = bundle_of_band(run, summary, bands, way, sign)
            title = f"{'Variogram' if sign == 'γ' else 'Connection'} {way.replace('-', '–')}"
            chart = curves_chart(bundle, chart_theme(), y_title=f"{sign} of {name}", y_range=top)
            word = f"long_{'variogram' if sign == 'γ' else 'connection'}_{way[0]}"
            titled_chart(title, f"{summary.n:,} realizations", chart, word, f"{title} of {name}")
    with places[3]:
        chart = convergence_chart(run.numbers, run.errors, run.n, chart_theme(), height=196)
        titled_chart(
            "How it settles", f"± {three_digits(run.errors[-1])} % now", chart, "convergence",
            "Error of the probabilities over the number of realizations",
        )  # fmt: skip


def said_long(run: LargeEnsembleRun, summary: RunningSummary) -> str:
    """Say what a long run has come to."""
    k, mean = run.facies, summary.proportions
    name = run.training_image.facies_names[k]
    data = ""
    if run.hard_data.n:
        data = (
            f" All {run.hard_data.n} data honoured in every one."
            if not run.n_wrong
            else f" {run.n_wrong:,} times a datum was not honoured."
        )
    return (
        f"After {summary.n:,} realizations: {name} {100 * mean.mean[k]:.2f} % "
        f"({100 * mean.low[k]:.1f}–{100 * mean.high[k]:.1f} % in nine of ten), in the training "
        f"image {100 * run.training_image.proportions[k]:.2f} %.{data} Statistics take "
        f"{run.nbytes / 1e6:.0f} MB."
    )


def bundle_of_band(
    run: LargeEnsembleRun, summary: RunningSummary, bands: dict, way: str, sign: str
) -> Bundle:
    """Return the band of a long run as a bundle without single curves."""
    found, lags = bands[run.facies, way], summary.lags
    image = run.training_image.indices
    reference: NDArray[np.float64]
    if sign == "γ":
        reference = variogram(image, run.facies, way, lags).gamma[0]
    else:
        reference = connectivity(image, run.facies, way, lags).tau[0]
    each = np.empty((0, len(lags)))
    return Bundle(lags.astype(float), reference, each, found.low, found.median, found.high)


def belongs(run: LargeEnsembleRun, ensemble: Ensemble) -> bool:
    """Return whether a long run is of the study of an ensemble."""
    return run.training_image.digest == ensemble.training_image.digest and run.grid == ensemble.grid
