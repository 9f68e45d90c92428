"""The page Validate: its findings at the top, its first screen and its sections."""

from collections.abc import Sequence
from functools import partial
from html import escape
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import Ensemble
from ccwsim.figures import Group, facies_colours, mds_chart, mds_title
from ccwsim.jobs.statistics import Task
from ccwsim.metrics import Anodi, Fit
from ccwsim.model import MAX_REALIZATIONS, three_digits
from ccwsim.report import verdicts
from ccwsim.report.settings import caption_of
from ccwsim.report.verdicts import Verdict, describe_scaling
from ccwsim.ui.frontend.cells import draw_cells
from ccwsim.ui.frontend.component import run_script
from ccwsim.ui.results import maps
from ccwsim.ui.results.charts import draw_caption, draw_clickable_chart, titled_chart
from ccwsim.ui.session import State, error_boundary, facies_by_code
from ccwsim.ui.study.data_step import data_fit, flagged, is_judged
from ccwsim.ui.study.run import draw_news, run_button, start_run_if_needed
from ccwsim.ui.validate import statistics
from ccwsim.ui.validate.conditioning import (
    describe_zones,
    draw_data,
    draw_data_and_image,
    draw_reference,
    draw_uncertainty,
    names_of_zones,
)
from ccwsim.ui.validate.reproduction import (
    describe_unseen_of,
    draw_copying,
    draw_curves_row,
    draw_directions,
    draw_flow,
    draw_geobodies,
    draw_image,
    draw_measures,
    draw_patterns,
    draw_transitions,
)
from ccwsim.ui.validate.slices import ShownSlice, draw_slice_fields, slice_of, wells_on
from ccwsim.ui.widgets import (
    bound_to,
    chart_theme,
    draw_style,
    field,
    in_row,
    options_of,
    page_text,
    panel_title,
    verdict_html,
)

COMPARED_MAP_HEIGHT = 392
SLICED = {"reuse", "truth"}
"""Sections whose maps show the slice of a volume that is chosen at the top of the page."""
STEADY = ".st-key-summary, .st-key-maps, .st-key-charts, [class*=st-key-section_]"
"""CSS selectors of page parts that keep their height while being redrawn."""


def draw_page(state: State) -> None:
    """Draw the validation of the latest realizations; without realizations, start a run."""
    draw_style("validate/validate.css", f":root {{ --odd: {chart_theme().reference} }}")
    start_run_if_needed(state, live=False)
    draw_news(state, parts=False)
    with st.container(key="results"):
        if state.ensemble is not None:
            _draw_validation(state, maps.as_facies(state, state.ensemble))
        else:
            with st.container(key="maps"):
                places = maps.map_columns((0.5, 1.0, 1.0), 1, state.grid)
            maps.draw_ghost(state, places)
    with st.container(key="work"):
        statistics.draw_work(state)


def _draw_validation(state: State, ensemble: Ensemble) -> None:
    """Draw the first screen and all sections of the latest realizations."""
    page_state = state.page(statistics.Validation)
    statistics.begin(state)
    page_state.worker.forget()
    page_state.waiting.clear()
    state.fit_shown(ensemble)
    colours = maps.colours_of_ran(state)
    if state.ensemble is not ensemble:  # values above the threshold are judged
        state.facies, colours = 1, facies_colours(ensemble.training_image)
    draw_caption(caption_of(ensemble))
    with in_row("judge_row", "top"):
        top = st.container(key="judgement")
        _draw_controls(state, ensemble)
    summary = st.container(key="summary")
    _draw_first_screen(state, colours, _shown_elsewhere(state))
    st.html('<i id="curves"></i>')
    draw_curves_row(state, ensemble)
    with top:
        first, *others = findings(state, ensemble)
        first = first._replace(words=first.words[:1].upper() + first.words[1:])
        facts = " ".join(verdict_html(verdict, "fact") for verdict in (first, *others))
        st.html(f'<p class="facts judged" role="status">{facts}</p>')
    with summary:
        _draw_summary(state, ensemble)
    _draw_sections(state, ensemble, colours)
    run_script("steady", "steady", parts=STEADY)


def _draw_controls(state: State, ensemble: Ensemble) -> None:
    """Draw the choice of the facies and of the number of realizations."""
    with st.container(
        horizontal=True, vertical_alignment="bottom", gap="small", key="judge_what", width=420
    ):
        if state.ensemble is not None and state.ensemble.values:
            maps.draw_threshold_field(state, state.ensemble.training_image)
        else:
            field(
                st.selectbox,
                "Facies",
                key="judged",
                help="The facies whose curves and probability are shown.",
                value=state.facies,
                write=lambda k: maps.choose_statistic(state, k),
                width=140,
                **options_of(dict(enumerate(ensemble.training_image.facies_names))),
            )
        field(
            st.number_input,
            "Realizations",
            key="n_realizations",
            help="Number of realizations of the next run; a band of 5–95 % needs about 20 or more.",
            min_value=1,
            max_value=MAX_REALIZATIONS,
            **bound_to(state.choices, "n_realizations", state.change, width=140),
        )
        run_button(state, "run", width="content")


@st.fragment
def _draw_first_screen(state: State, colours: Sequence[str], elsewhere: tuple) -> None:
    """Draw maps and MDS plot; redraw the page if `elsewhere`, shown by other parts, changes."""
    with error_boundary():
        if _shown_elsewhere(state) != elsewhere:
            st.rerun()
        statistics.begin(state)
        ensemble = state.ensemble
        assert ensemble is not None
        shown_slice = slice_of(state, ensemble)
        slice_ensemble = shown_slice.ensemble(ensemble)
        draw_slice_fields(state, ensemble)
        with st.container(key="maps"):
            left, middle, right = maps.map_columns((1.0, 1.0, 1.0), 0, slice_ensemble.grid)
        with left:
            _draw_realization(state, slice_ensemble, colours, shown_slice)
        with middle:
            maps.draw_e_type(state, slice_ensemble, colours, wells_on(state, slice_ensemble))
        with right:
            task = statistics.patterns(maps.as_facies(state, ensemble))
            draw = partial(_draw_mds, state)
            statistics.panel(state, "mds", task, draw)


def _shown_elsewhere(state: State) -> tuple:
    """Return the choices that are made in the maps and affect other parts of the page."""
    unfolded, ensemble = state.page(statistics.Validation).unfolded, state.ensemble
    shown_slice = slice_of(state, ensemble) if ensemble is not None and unfolded & SLICED else None
    return state.facies, state.shown if "reuse" in unfolded else None, shown_slice


def _draw_realization(
    state: State, ensemble: Ensemble, colours: Sequence[str], shown_slice: ShownSlice
) -> None:
    r, wells = state.shown, wells_on(state, ensemble)
    with in_row("shown_row"):
        panel_title(f"Realization {ensemble.numbers[r] + 1} of {ensemble.n}", str(shown_slice))
        maps.step_buttons("shown", state, ensemble.n)
    cell_map = maps.realization_map(
        state, ensemble, colours, r, f"Realization {r + 1}", wells=wells
    )
    file = f"realization_{r + 1}"
    # the E-type below a section has coordinates, so the section needs the same left and right edge
    grid = ensemble.grid if shown_slice.axis is not None and maps.is_wide(ensemble.grid) else None
    draw_cells(
        cell_map,
        "realization",
        grid=grid,
        name=file,
        link="grid",
        scale="maps",
        max_height=COMPARED_MAP_HEIGHT,
    )


def _draw_mds(state: State, anodi: Anodi) -> None:
    ensemble = state.ensemble
    assert ensemble is not None
    n = len(anodi.owner) - 1
    first = f"first {n}; click a point to see the realization"
    note = first if ensemble.n > statistics.MAX_ANODI_REALIZATIONS else "click a point to see it"

    def click(k: int) -> None:
        state.shown = min(max(k, 0), n - 1)

    scaling, theme = anodi.scaling(), chart_theme()
    labels = [f"realization {r + 1}" for r in ensemble.numbers[:n]]
    image_position, positions = scaling.positions[0], scaling.positions[1:]
    ringed = state.shown if state.shown < n else None
    group = Group("realizations", positions, theme.ink, labels=labels, ringed=ringed)
    chart = mds_chart(image_position, [group], theme, height=COMPARED_MAP_HEIGHT + 26)
    alt = "MDS plot: distances between points represent distances between patterns of the images"
    draw = partial(draw_clickable_chart, choose=click)
    scaling_note = describe_scaling(scaling.stress, note)
    titled_chart(mds_title(scaling.stress), scaling_note, chart, "mds", alt, draw=draw)


SECTIONS = (
    ("uncertainty", "Uncertainty", "where the realizations agree", draw_uncertainty),
    ("bodies", "Proportions and geobodies", "amount and pieces of each facies", draw_geobodies),
    ("measures", "Measures", "single numbers, compared with crops of the image", draw_measures),
    ("flow", "Flow", "flow efficiency along each axis", draw_flow),
    ("patterns", "Patterns", "variety, and similarity to the training image", draw_patterns),
    ("data", "Hard data", "whether and how data are honoured", draw_data),
    ("fit", "Data and image", "whether the data contradict the image", draw_data_and_image),
    ("directions", "Any direction", "variograms over all lags", draw_directions),
    ("transitions", "Transiograms", "probabilities of facies at a lag", draw_transitions),
    ("reuse", "Copying", "pieces copied from the training image", draw_copying),
    ("truth", "Reference field", "scores against a known field", draw_reference),
    ("image", "Training image", "properties of the image, and suitable parameters", draw_image),
)
"""The sections of the page: anchor, title, subtitle, and drawing function of each section."""


SECTION_OF = {
    "proportions": "bodies",
    "geobodies": "bodies",
    "variogram": "curves",
    "connectivity": "curves",
}
"""Anchors of the parts of the page with the figures of a check, if they differ from its kind."""


def _draw_summary(state: State, ensemble: Ensemble) -> None:
    """Draw a line on each check, with a link to its figures."""
    checks = statistics.known(state, statistics.checks(ensemble)) or []
    _, lines = verdicts.describe_checks(checks, ensemble.training_image.facies_names)
    rows = "".join(
        f'<li><a href="#{SECTION_OF.get(kind, kind)}" target="_self">{escape(what)}</a> '
        f"{verdict_html(verdict)}<small>{escape(verdict.numbers)}</small></li>"
        for kind, what, verdict in lines
    )
    if rows:
        st.html(f'<ul class="checks" aria-label="Checks">{rows}</ul>')


def _draw_sections(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the titles of all sections, and the content of each section that a click unfolded."""
    page_state = state.page(statistics.Validation)
    for name, title, text, draw in SECTIONS:
        with st.container(key=f"section_{name}"):
            expanded = str(name in page_state.unfolded).lower()
            link = f'<a href="#{name}" target="_self" role="button" aria-expanded="{expanded}">'
            st.html(
                f'<h2 class="section fold" id="{name}">{link}{title}</a><span>{text}</span></h2>'
            )
            if name in page_state.unfolded:
                with error_boundary():
                    draw(state, ensemble, colours)

    def fold(told: tuple[str, bool]) -> None:
        """Unfold the section of a link; the link in the title of an open section folds it."""
        chosen = {told[0]} & {name for name, *_ in SECTIONS}
        change = set.symmetric_difference if told[1] else set.union
        page_state.unfolded = change(page_state.unfolded, chosen)

    run_script("fold", "fold", fold)


MOMENT_SECONDS = 0.1  # maximum seconds that the line of findings waits for the proportions
# with more facies than this number, only the proportions that deviate are listed
MAX_FACIES_LISTED = 4


def findings(state: State, ensemble: Ensemble) -> list[Verdict]:
    """Return the findings that follow from the statistics computed so far."""
    page_state = state.page(statistics.Validation)
    judged = [data_verdict(state.ensemble or ensemble)]
    tasks: dict[str, Task[Any]] = {"variety": statistics.variety(ensemble)}
    if zoned := names_of_zones(ensemble):  # each zone is judged by its own image
        tasks["zones"] = statistics.zones(ensemble)
    else:
        tasks["shares"] = statistics.compare_proportions(ensemble)
    if not ensemble.is_of_other_images:
        tasks["checks"] = statistics.checks(ensemble)
    if is_judged(ensemble.hard_data, ensemble.grid, ensemble.secondary):
        tasks["data_fit"] = data_fit(ensemble.training_image, ensemble.hard_data, ensemble.grid)
    for word, task in tasks.items():
        page_state.worker.ask(task)
        if page_state.worker.memo.get(task.key) is None:
            page_state.waiting[word] = task  # the finding is added when the page is drawn again
    page_state.worker.wait_for(tasks["zones" if zoned else "shares"], MOMENT_SECONDS)
    values: dict[str, Any] = {k: statistics.known(state, task) for k, task in tasks.items()}
    choices = state.ensemble_choices
    if choices is not None and (data_message := facies_by_code(choices)):
        judged.append(Verdict(f"data: {data_message}", good=False))
    if (agreement := values.get("data_fit")) and flagged(agreement):
        judged.insert(0, Verdict(agreement.words, good=False))
    if values.get("zones") is not None:
        judged += describe_zones(values["zones"], zoned)
    if ensemble.is_of_other_images:
        judged.append(Verdict(page_text("Other images"), good=None))
    if (checks := values.get("checks")) is not None:
        judged.append(verdicts.describe_checks(checks, ensemble.training_image.facies_names)[0])
    if values.get("shares"):
        judged += proportion_verdicts(ensemble, values["shares"].fit)
    volume_patterns = statistics.known(state, statistics.volume_patterns(ensemble))
    if ensemble.grid.is_volume and volume_patterns and not zoned:
        judged.append(Verdict(describe_unseen_of(volume_patterns), good=None))
    if values["variety"] is not None and ensemble.n > 1:
        judged.append(variety_verdict(ensemble, values["variety"]))
    anodi = statistics.known(state, statistics.patterns(ensemble))
    if anodi and not anodi.within[0].max() > 0:
        judged.append(Verdict("realizations are copies of the training image", good=False))
    return judged


def data_verdict(ensemble: Ensemble) -> Verdict:
    """Return a finding on whether the data are honoured."""
    n = ensemble.hard_data.n
    if not n:
        return Verdict("no hard data", good=None)
    share = ensemble.n_mismatched.mean() / n
    if not share:
        return Verdict(f"all {n} data honoured in all {ensemble.n} realizations")
    return Verdict(f"{three_digits(100 * share)} % of {n} data not honoured", good=False)


def proportion_verdicts(ensemble: Ensemble, fit: Fit | None) -> list[Verdict]:
    """Return findings on the proportions; deviations are marked as bad and include advice."""
    n = ensemble.training_image.n_facies
    off = fit.outside.copy() if fit is not None else np.zeros(n, bool)
    if (lost := verdicts.lost_at_edges(ensemble)) is not None:
        off[lost] = True
    listed = [k for k in range(1 if n == 2 else 0, n) if n <= MAX_FACIES_LISTED or off[k]]
    good = [None if fit is None else not missed for missed in off]
    describe = partial(verdicts.describe_proportion, ensemble)
    judged = [Verdict(describe(k, short=True), describe(k), good[k]) for k in listed]
    if n > MAX_FACIES_LISTED:
        others = "all" if not listed else "the other"
        judged.append(Verdict(f"{others} proportions within the scatter of TI crops"))
    advice = verdicts.advise_proportions(ensemble, fit)
    return [*judged, Verdict(advice, good=None)] if advice else judged


def variety_verdict(ensemble: Ensemble, differing: float) -> Verdict:
    """Return a finding on the differences between realizations; no difference is marked as bad."""
    shares = ensemble.proportions.mean(axis=0).tolist()
    return Verdict(
        verdicts.describe_variety(differing, shares), good=None if differing > 0 else False
    )
