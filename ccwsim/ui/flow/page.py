"""The page Flow: flow through one realization, solved live, and answers of all realizations."""

import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import Ensemble, figures
from ccwsim.flow import Edge, EffectiveK, Tracks
from ccwsim.flow.answers import at_percentiles
from ccwsim.flow.darcy import SIDES
from ccwsim.io import maps_as_bytes
from ccwsim.io.formats.csv_table import csv_as_bytes
from ccwsim.jobs.statistics import Failure
from ccwsim.model import (
    MAX_CONDUCTIVITY,
    MIN_CONDUCTIVITY,
    UNKNOWN,
    Floats,
    FromValues,
    cell_values,
    cells_of,
    duration,
    minus,
    plural,
    three_digits,
    with_power,
)
from ccwsim.report.settings import caption_of
from ccwsim.sharing.choices import MIN_POROSITY
from ccwsim.system.log import reason
from ccwsim.ui.flow import solving
from ccwsim.ui.flow.solving import FlowAnswers, FlowSettings, FlowState, Solution
from ccwsim.ui.frontend.cells import (
    CellMap,
    draw_cells,
    facies_map,
    map_content,
    number_map,
    volume_content,
)
from ccwsim.ui.frontend.component import draw_component, run_script
from ccwsim.ui.results import maps
from ccwsim.ui.results.charts import draw_caption, titled_chart
from ccwsim.ui.session import State, follow, follow_tasks, go_to, study_part
from ccwsim.ui.study.run import draw_news, draw_out_of_date, start_run_if_needed
from ccwsim.ui.widgets import (
    bound_to,
    button,
    chart_theme,
    download,
    draw_style,
    field,
    in_row,
    numbers_table,
    options_of,
    page_text,
    panel_title,
    plain,
    step_note,
    step_title,
    write_facts,
)

# seconds for which the page waits for a solution before it draws the earlier one
SOLUTION_SECONDS = 1.5
HEAD_MAP_HEIGHT, CAPTURE_MAP_HEIGHT, FLOW_CHART_HEIGHT = 420, 300, 250
N_BANDS = 20  # number of colours of a map of heads; their edges are lines of equal head
PERCENTILES = (10, 50, 90)
TRACK, PARTICLE = "#14181D", "#FFFFFF"
TIMES = figures.ramp(("#FFFFFF", "#F4A6CD", "#8E0152"), 12)
"""Colours of tracks in volumes, from the start to twice the median travel time."""
VALUES_ARE = {"classes": "classes", "K": "K", "log K": "log₁₀ K", "porosity": "porosity"}
GLASS = 0.3, 0.06  # opacity in volumes of the facies of highest conductivity, and of all others
ROUND_NUMBERS = [float(f"{m}e{e}") for e in range(-14, 4) for m in (1, 2, 5)]
CONDUCTIVITIES = [k for k in ROUND_NUMBERS if MIN_CONDUCTIVITY <= k <= MAX_CONDUCTIVITY]
"""Values of the logarithmic slider, in m/s or m/d."""


def draw_page(state: State) -> None:
    """Draw choices on the left, and the flow through the latest realizations on the right."""
    draw_style("flow/flow.css")
    start_run_if_needed(state, live=False)
    draw_news(state, parts=False)
    with st.container(key="results"):
        if state.ensemble is None:
            maps.ghost_panel(page_text("Flow without realizations"), "height: 392px", "Flow")
            return
        state.shown = min(state.shown, state.ensemble.n - 1)
        with st.sidebar:
            run_script("column", "flow_column")
            _draw_controls(state, state.ensemble)
        settings = solving.flow_settings(state.flow, state.ensemble)
        draw_caption(caption_of(state.ensemble))
        if problem := solving.flow_problem(settings):
            st.warning(plain(problem))
            _draw_map(state, state.ensemble, None, settings)
            return
        _draw_solution(state, state.ensemble, settings)
        _draw_answers(state, state.ensemble, settings)


def _draw_controls(state: State, ensemble: Ensemble) -> None:
    """Draw the steps: rocks, heads and well, all realizations."""
    page_state, choice, change = state.page(FlowState), state.flow, state.change_flow
    step_title(1, "Rocks")
    field(
        st.segmented_control,
        "Unit of conductivity",
        key="flow_unit",
        **bound_to(choice, "unit", change, options=list(solving.CONDUCTIVITY_UNITS)),
    )
    image = ensemble.training_image
    if image.values:
        field(
            st.segmented_control,
            plain(f"Use {image.variable} as"),
            key="flow_values",
            help=page_text("Rocks from values"),
            **bound_to(choice, "values_are", change),
            **options_of(VALUES_ARE),
        )
    names = dict(enumerate(image.facies_names))
    settings = solving.flow_settings(choice, ensemble)
    if isinstance(settings.conductivity, FromValues):
        names = {0: "all cells"}  # which have one porosity
    for k, name in names.items():
        with st.container(key=f"rock_{k}"):
            _draw_rock(state, ensemble, k, name)
    step_title(2, "Heads and well")
    axes = {"x": "W–E", "y": "S–N", "z": "vertical"}
    offered = {axis: axes[axis] for axis in "xyz"[: ensemble.grid.n_dimensions]}
    place = solving.heads_place(choice, ensemble)
    field(
        st.segmented_control,
        "Fixed heads",
        key="flow_axis",
        help="At two sides of the grid, or along the outline of the active cells.",
        **bound_to(choice, "axis", change, value=place),
        **options_of(offered | {"edge": "outline"}),
    )
    labels = [f"Head at the {side} side (m)" for side in SIDES[settings.axis]]
    if place == "edge":
        labels = _draw_outline(state, ensemble, settings)
    for name, label in zip(("high", "low"), labels, strict=False):
        head = bound_to(choice, name, change, step=0.1)
        field(st.number_input, label, key=f"flow_{name}", **head)
    if not ensemble.grid.is_volume:
        field(
            st.number_input,
            "Thickness (m)",
            key="flow_thickness",
            help="Thickness of the aquifer. Flow in m³/d is proportional to it.",
            **bound_to(choice, "thickness", change, min_value=0.001, max_value=1e5, format="%.4g"),
        )
    if ensemble.grid.is_volume:
        field(
            st.number_input,
            "Vertical / horizontal K",
            key="flow_anisotropy",
            **bound_to(choice, "anisotropy", change, min_value=0.001, max_value=1.0),
        )
    _draw_well(state, ensemble, settings)
    step_title(3, "All realizations")
    step_note(page_text("Answers of all realizations"))
    button(
        f"Solve all {plural(ensemble.n, 'realization')}",
        key="flow_all",
        on_click=solving.start_answers,
        args=(state,),
        type="primary",
        width="stretch",
        disabled=page_state.going or bool(solving.flow_problem(settings)),
    )
    if page_state.message:
        st.warning(plain(page_state.message))


def _draw_outline(state: State, ensemble: Ensemble, settings: FlowSettings) -> list[str]:
    """Draw how heads change along the outline, and return the labels of the heads."""
    choice = state.flow
    if choice.axis is None and choice.along == "x":
        step_note(page_text("Sides without active cells"))
    names = {"x": "W–E", "y": "S–N", "points": "two points", "constant": "constant"}
    field(
        st.segmented_control,
        "Heads change",
        key="flow_along",
        help="Heads are linear between two ends of the outline or two points.",
        **bound_to(choice, "along", state.change_flow),
        **options_of(names),
    )
    if choice.along == "constant":
        return ["Head along the outline (m)"]
    if choice.along != "points":
        return [f"Head at the {side} end (m)" for side in SIDES[settings.axis]]
    values = solving.outline_points(choice, ensemble)

    def write(k: int, value: float) -> None:
        state.change_flow(points=(*values[:k], value, *values[k + 1 :]))

    for k, (name, value) in enumerate(zip(("x 1", "y 1", "x 2", "y 2"), values, strict=True)):
        key = f"flow_point_{k}"
        field(st.number_input, name, key=key, value=value, write=partial(write, k))
    return ["Head at point 1 (m)", "Head at point 2 (m)"]


def _draw_rock(state: State, ensemble: Ensemble, k: int, name: str) -> None:
    """Draw the conductivity and the porosity of a facies."""
    image, unit = ensemble.training_image, state.flow.unit
    values_are = state.flow.values_are if image.values else "classes"
    conductivity, porosity = solving.rock_of(state.flow, image, k)
    factor = solving.CONDUCTIVITY_UNITS[unit]
    shown_k = float(f"{conductivity * factor:.3g}")

    def write(changed: dict[int, tuple[float, float]]) -> None:
        named = {solving.rock_name(image, facies): rock for facies, rock in changed.items()}
        state.change_flow(rocks=tuple({**dict(state.flow.rocks), **named}.items()))

    def write_porosity(value: float) -> None:
        alike = range(image.n_facies) if values_are in solving.K_BY_VALUES else [k]
        write({each: (solving.rock_of(state.flow, image, each)[0], value) for each in alike})

    if values_are not in solving.K_BY_VALUES:
        field(
            st.select_slider,
            plain(f"K of {name} ({unit})"),
            key=f"flow_k_{k}",
            options=sorted({*CONDUCTIVITIES, shown_k}),
            value=shown_k,
            format_func=with_power,
            write=lambda value: write({k: (value / factor, porosity)}),
        )
    if values_are != "porosity":
        field(
            st.number_input,
            plain(f"Porosity of {name}"),
            key=f"flow_porosity_{k}",
            write=write_porosity,
            min_value=MIN_POROSITY,
            max_value=1.0,
            step=0.01,
            value=porosity,
        )


def _draw_well(state: State, ensemble: Ensemble, settings: FlowSettings) -> None:
    """Draw the cell and the rate of the well."""
    volume = ensemble.grid.is_volume
    if settings.well is None:
        middle = tuple(n // 2 for n in ensemble.grid.shape)
        place = partial(solving.set_well, state, ensemble, middle)
        if volume:
            button("Place a well", key="flow_place", on_click=place, width="stretch")
        else:
            step_note("No well. Click a map to place one.")
        return
    names = ("layer", "row", "column")[-len(settings.well) :]
    cell = ", ".join(f"{name} {k}" for name, k in zip(names, settings.well, strict=True))
    step_note(f"Well in {cell}.{'' if volume else ' Drag it on a map, or click another cell.'}")
    if volume:
        field(
            st.toggle,
            "Cross hairs move the well",
            help="Drag the cross hairs in a slice, or press Enter there.",
            key="flow_follows",
            **bound_to(state.page(FlowState), "follows"),
        )
    field(
        st.number_input,
        "Pumped (m³/d)",
        key="flow_rate",
        help="More pumping widens the capture zone.",
        **bound_to(state.flow, "rate", state.change_flow, min_value=0.0, format="%.4g"),
    )
    remove = partial(state.change_flow, well=None)
    button("Remove the well", key="flow_remove", on_click=remove, width="stretch")


def _draw_solution(state: State, ensemble: Ensemble, settings: FlowSettings) -> None:
    """Draw the flow through the shown realization; until it is solved, dim the earlier flow."""
    page_state = state.page(FlowState)
    task = solving.solution(ensemble, state.shown, settings)
    worker = page_state.worker
    worker.forget()
    worker.ask(task)
    result = worker.wait_for(task, SOLUTION_SECONDS)
    if isinstance(result, Solution):
        page_state.latest = ensemble, result
    latest = page_state.latest
    # maps stay in their place, so that a well can be dragged on while the next flow is solved
    with st.container(key="flow_solution"):
        if latest is not None and latest[0] is ensemble:
            _draw_flow(state, ensemble, latest[1], settings)
        else:
            _draw_map(state, ensemble, None, settings)
    if isinstance(result, Solution):
        return
    with st.container(key="flow_unsolved"):
        if isinstance(result, Failure):
            st.warning(plain(f"{result.reason[:1].upper()}{result.reason[1:]}."))
            return
        step_note("Solving …")
    follow_tasks(worker, [task], time.monotonic())


def _draw_flow(
    state: State, ensemble: Ensemble, solution: Solution, settings: FlowSettings
) -> None:
    """Draw facts and maps of a solution."""
    page_state, flow = state.page(FlowState), solution.flow
    times = np.where(solution.tracks.status == 2, np.inf, solution.tracks.times)
    median = float(np.median(times))
    facts = [f"{three_digits(flow.inflow * solving.DAY)} m³/d flow in"]
    if not flow.wells:
        k = flow.effective_k * solving.CONDUCTIVITY_UNITS[state.flow.unit]
        facts.insert(0, f"effective K {with_power(k)} {state.flow.unit}")
    facts.append(f"half of the water needs more than {duration(median)}")
    facts.append(f"balance {with_power(flow.balance, 1)}, {plural(flow.iterations, 'iteration')}")
    with in_row("flow_tools"):
        write_facts(facts)
        _draw_downloads(state, ensemble, solution, settings)
    with st.container(key="flow_maps"):
        left, right = maps.map_columns((1.0, 1.0), 0, ensemble.grid)
    with left:
        _draw_map(state, ensemble, solution, settings)
    with right:
        _draw_heads(state, ensemble, solution, settings)
    if np.isfinite(median) and not ensemble.grid.is_volume:  # volumes show whole tracks
        field(
            st.slider,
            f"Particles after this share of {duration(median)} (%)",
            key="flow_particles",
            **bound_to(page_state, "particles", min_value=0, max_value=200, step=5, width=420),
        )
    note, by_hand = page_text("Flow of the shown realization"), page_text("Flow by hand")
    if isinstance(settings.ends, Edge):
        note = page_text("Flow within the outline")
    if ensemble.grid.is_volume:
        by_hand = page_text("Tracks in a volume", time=duration(2 * median))
    step_note(f"{note} {by_hand}")


def _draw_map(
    state: State, ensemble: Ensemble, solution: Solution | None, settings: FlowSettings
) -> None:
    page_state, r = state.page(FlowState), state.shown
    with in_row("shown_row"):
        title = f"Realization {ensemble.numbers[r] + 1} of {ensemble.n}"
        panel_title(title, "tracks of particles")
        maps.step_buttons("flow", state, ensemble.n)
    colours = maps.colours_of_ran(state)
    alt = f"Realization {r + 1} with tracks of particles"
    cell_map = maps.map_of(ensemble, r, colours, alt)
    cell_map = with_tracks(cell_map, solution, settings, page_state.particles)
    _draw_by_hand(state, ensemble, settings, cell_map, "flow")


def _draw_by_hand(
    state: State, ensemble: Ensemble, settings: FlowSettings, cell_map: CellMap, key: str
) -> None:
    """Draw a map or volume in which the user moves the well or, in a map of heads, the heads."""
    page_state = state.page(FlowState)
    options: dict[str, Any] = {"grid": ensemble.grid, "link": "grid", "max_height": HEAD_MAP_HEIGHT}
    options |= {"name": {"flow": "tracks"}.get(key, key), "body": key == "flow"}
    if ensemble.grid.is_volume:
        rocks = settings.conductivity
        assert not isinstance(rocks, FromValues)  # values are simulated in maps only
        fastest = max(rocks)
        take = partial(solving.take_strokes, state, ensemble)
        content = volume_content(
            cell_map,
            f"volume_{key}",
            mode="several",
            opacities=[GLASS[k < fastest] for k in rocks],
            picks=bool(settings.well and page_state.follows),
            ack=page_state.ack,
            **options,
        )
        draw_component("volume", f"volume_{key}", content, "edits", take)
        return
    content = map_content(cell_map, scale="maps", picks=True, **options) | {
        "well": settings.well,
        "well_colour": chart_theme().reference,
        "well_label": f"well, pumps {three_digits(settings.rate * solving.DAY)} m³/d",
        "heads": settings.heads if key == "heads" and settings.has_ends else None,
        "axis": settings.axis,
    }
    take = partial(solving.take_choice, state, ensemble)
    draw_component("flow", f"map_{key}", content, "chosen", take)


def _draw_heads(
    state: State, ensemble: Ensemble, solution: Solution, settings: FlowSettings
) -> None:
    heads = solution.flow.heads
    lowest, highest = np.nanmin(heads), np.nanmax(heads)
    lower_end, upper_end = sorted(settings.heads)
    # heads at a well in tight rock do not take all colours
    reach = upper_end - lower_end
    low, high = max(lowest, lower_end - reach), min(highest, upper_end + reach)
    if not reach:
        low, high = np.nanquantile(heads, (0.1, 0.9))
    with in_row("heads_row"):
        panel_title("Head", "each change of colour is a line of equal head")
    span = max(high - low, 1e-300)
    bands = np.clip((heads - low) / span * N_BANDS, 0, N_BANDS - 1)
    bands = np.where(np.isnan(heads), UNKNOWN, bands).astype(np.uint8)  # no colour, and no well
    middles = low + (np.arange(N_BANDS) + 0.5) / N_BANDS * span
    decimals = 2 - int(np.floor(np.log10(span)))  # the difference has three digits

    def format_head(head: float) -> str:
        return minus(f"{round(float(head), decimals) + 0.0:.9g} m")

    labels = [f"head {format_head(middle)}" for middle in middles]
    labels[0] += f" or less, down to {format_head(lowest)}" if lowest < low else ""
    labels[-1] += f" or more, up to {format_head(highest)}" if highest > high else ""
    strip = {"colours": list(figures.CIVIDIS), "low": format_head(low), "high": format_head(high)}
    colours = figures.ramp(figures.CIVIDIS, N_BANDS)
    cell_map = CellMap(bands, colours, labels, "Map of heads", strip=strip)
    cell_map = with_tracks(cell_map, solution, settings, 0)
    _draw_by_hand(state, ensemble, settings, cell_map, "heads")


def with_tracks(
    cell_map: CellMap, solution: Solution | None, settings: FlowSettings, particles: int
) -> CellMap:
    """Return a map with tracks and with particles after a share (%) of the median travel time.

    Tracks to the well are drawn in the last colour. A volume also shows the well, and tracks are
    coloured by time.
    """
    accent = chart_theme().reference
    if len(well := settings.well or ()) == 3:
        cell_map = replace(cell_map, points=[[*well, 0, 0]], point_colours=[accent])
        cell_map = replace(cell_map, wells=(("well", (well,)),), points_are=("well", "wells"))
    if solution is None:
        return cell_map
    grid, median = solution.flow.grid, float(np.median(solution.tracks.times))
    corner, size = np.array(grid.origin), np.array(grid.cell_size)
    colours = TIMES if grid.is_volume else [TRACK]
    lines, marks, n = [], [], len(colours)
    for tracks in (solution.tracks, solution.to_well):
        for path in tracks.paths if tracks is not None else ():
            path = thinned((path - [0.0, *corner]) / [2 * median / n, *size])
            steps = np.minimum(path[:, 0] // 1, n - 1)
            colour = steps if tracks is solution.tracks else np.full(len(path), n)
            lines.append(np.column_stack([path[:, :0:-1], colour]).round(2).tolist())
    seconds = particles / 100 * median
    for x, y in (particle_positions(solution.tracks, seconds) - corner) / size if particles else ():
        mark = {"kind": "disc", "row": y - 0.5, "column": x - 0.5, "height": 1, "width": 1}
        marks.append({**mark, "colour": PARTICLE, "label": f"after {duration(seconds)}"})
    return replace(cell_map, lines=lines, line_colours=[*colours, accent], marks=marks)


def thinned(path: Floats) -> Floats:
    """Return one point (time, x, y …) of a path for each cell, and the ends; cells are 1 wide."""
    kept = np.unique(np.floor(path[:, 1:]).astype(int), axis=0, return_index=True)[1]
    return path[np.unique([0, *kept, len(path) - 1])]


def particle_positions(tracks: Tracks, seconds: float) -> Floats:
    """Return the positions of particles at a time, without particles that ended earlier."""
    moving = (path.T for path in tracks.paths if path[-1, 0] >= seconds)
    places = [[np.interp(seconds, times, axis) for axis in axes] for times, *axes in moving]
    return np.array(places).reshape(-1, tracks.paths[0].shape[1] - 1)


def _draw_downloads(
    state: State, ensemble: Ensemble, solution: Solution, settings: FlowSettings
) -> None:
    """Draw a menu of files of the solution, and of models for other programs."""
    page_state, name = state.page(FlowState), study_part(ensemble)
    r, grid = state.shown, ensemble.grid
    with st.popover("Download", key="flow_downloads"):
        step_note(f"Heads and conductivity of realization {r + 1}")
        conductivity = cell_values(settings.conductivity, cells_of(ensemble, r))
        fields = {"head": solution.flow.heads, "conductivity": conductivity}
        with in_row():
            for kind, label in (("npz", "NumPy"), ("vti", "VTK"), ("gslib", "GSLIB")):
                content = partial(maps_as_bytes, fields, grid, kind)
                download(label, content, f"{name}_heads.{kind}", key=f"flow_heads_{kind}")
            content = partial(tracks_csv, solution.tracks)
            download("Tracks, CSV", content, f"{name}_tracks.csv", key="flow_tracks")
        for title, files in solving.model_downloads(state.flow, ensemble, r).items():
            step_note(title)
            with in_row():
                for file in files:
                    file.draw(name)
        run = page_state.run
        if run is not None and run.result is not None:
            result = run.result
            step_note("All realizations")
            with in_row():
                if result.k is not None:
                    content = partial(k_csv, result.k)
                    download("Effective K, CSV", content, f"{name}_k.csv", key="flow_k_csv")
                content = partial(times_csv, result)
                download("Travel times, CSV", content, f"{name}_times.csv", key="flow_times_csv")


def tracks_csv(tracks: Tracks) -> bytes:
    """Return CSV with a line per point of a track; times are in seconds."""
    head = ["track", "time_s", *"xyz"[: tracks.paths[0].shape[1] - 1]]
    lines = [[n, *point] for n, path in enumerate(tracks.paths, 1) for point in path.tolist()]
    return csv_as_bytes(head, lines)


def k_csv(effective: EffectiveK) -> bytes:
    """Return CSV with effective conductivities of the realizations and of the training image."""
    head, lines = effective.table()
    return csv_as_bytes(head, lines)


def times_csv(result: FlowAnswers) -> bytes:
    """Return CSV with a line per particle and a column per realization; times are in seconds."""
    head = ["share", *(f"realization_{r + 1}" for r in range(len(result.times)))]
    n = result.times.shape[1]
    lines = [[f"{(k + 0.5) / n:.4g}", *(f"{t:.6g}" for t in result.times[:, k])] for k in range(n)]
    return csv_as_bytes(head, lines)


def _draw_answers(state: State, ensemble: Ensemble, settings: FlowSettings) -> None:
    """Draw the answers of all realizations, or an outline before they are solved."""
    run = state.page(FlowState).run
    with st.container(key="flow_answers"):
        st.html('<h2 class="part">All realizations</h2>')
        if run is None:
            style = f"height: {FLOW_CHART_HEIGHT}px"
            maps.ghost_panel(page_text("Answers of all realizations"), style)
            return
        if run.going:
            assert run.job is not None
            follow(run.job, keys=("flow_progress", "flow_cancel"))
            return
        is_current = run.ensemble is ensemble and run.settings == settings
        if run.error is not None and is_current:
            st.warning(plain(f"Not solved: {reason(run.error)}."))
        if run.result is None:
            return
        if not is_current:
            draw_out_of_date("the realizations or the settings have changed. Solve all again.")
        _draw_result(state, run, run.result)


def _draw_result(state: State, run: solving.AnswersRun, result: FlowAnswers) -> None:
    if result.k is not None:
        _draw_conductivity(state, result, result.k)
    with st.container(key="flow_below"):
        if result.k is not None:
            _draw_representatives(state, run, result.k)
        if result.capture is not None:
            _draw_capture(state, run, result)
    step_note(page_text("Diagonal contacts"))


def _draw_conductivity(state: State, result: FlowAnswers, k: EffectiveK) -> None:
    """Draw the effective conductivities and the breakthrough without the well."""
    unit, theme = state.flow.unit, chart_theme()
    factor = solving.CONDUCTIVITY_UNITS[unit]
    left, right = st.columns(2, gap="medium")
    with left:
        marks = {
            "upper bound": (factor * float(k.arithmetic.mean()), theme.quiet),
            "training image": (factor * k.image, theme.reference),
        }
        chart = figures.conductivity_chart(
            factor * k.each, marks, theme, unit=unit, height=FLOW_CHART_HEIGHT
        )
        note = (
            f"flow efficiency {k.efficiency.mean():.2g}, image {k.image / k.image_arithmetic:.2g}"
        )
        titled_chart("Effective conductivity", note, chart, "flow_k", "Histogram with bounds")
    with right:
        days = result.times / solving.DAY
        chart = figures.breakthrough_chart(
            days, state.shown, theme, height=FLOW_CHART_HEIGHT, accent=theme.reference
        )
        note = f"red: realization {state.shown + 1}; without the well"
        titled_chart("Breakthrough", note, chart, "flow_times", "Arrived particles against time")


def _draw_representatives(state: State, run: solving.AnswersRun, effective: EffectiveK) -> None:
    """Draw the realizations at three percentiles of effective conductivity."""
    ensemble, unit = run.ensemble, state.flow.unit
    columns = st.columns(3, gap="medium")
    chosen = at_percentiles(effective.each, PERCENTILES).tolist()
    colours = maps.colours_of_ran(state)
    for column, percentile, r in zip(columns, PERCENTILES, chosen, strict=True):
        with column:
            k = float(effective.each[r]) * solving.CONDUCTIVITY_UNITS[unit]
            with in_row(f"flow_p_{percentile}"):
                panel_title(
                    f"{percentile} % are lower", f"realization {r + 1}, K {with_power(k)} {unit}"
                )
                show = partial(setattr, state, "shown", r)
                if button("Open", key=f"flow_open_{percentile}", on_click=show):
                    go_to("pages/simulate.py", f"Realization {r + 1} is shown now.")
            indices = maps.middle_cells(ensemble.indices[r])
            image, alt = ensemble.training_image, f"Realization {r + 1}"
            cell_map = facies_map(indices, image, colours, alt)
            draw_cells(
                cell_map,
                f"flow_p{percentile}",
                name=f"p{percentile}",
                max_height=CAPTURE_MAP_HEIGHT,
                tools=False,
            )


def _draw_capture(state: State, run: solving.AnswersRun, result: FlowAnswers) -> None:
    """Draw the probability of capture, and its skill."""
    capture = result.capture
    assert capture is not None
    left, right = st.columns(2, gap="medium")
    with left:
        panel_title("Probability of capture", "share of the realizations, by start")
        cell_map = number_map(capture.probability, "P(captured) =", "Probability of capture")
        draw_cells(cell_map, "capture", name="capture", max_height=CAPTURE_MAP_HEIGHT, tools=False)
    with right:
        panel_title("Skill of the map")
        shares = capture.probability[~np.isnan(capture.probability)]  # of active cells
        area = 100 * float(shares.mean())
        rows = [("captured area, mean", f"{area:.1f} %")]
        sure = 100 * float(np.isin(shares, (0.0, 1.0)).mean())
        rows.append(("same answer in all realizations", f"{sure:.1f} %"))
        st.html(numbers_table(rows))
        step_note(solving.worth(capture, solving.captured_in(state, run)))
