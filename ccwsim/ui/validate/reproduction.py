"""Sections that compare realizations with the training image and show copied pieces."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from html import escape
from itertools import product

import numpy as np
import streamlit as st

from ccwsim import Ensemble, figures
from ccwsim.figures import Bundle, Strip
from ccwsim.io.formats.csv_table import csv_as_bytes
from ccwsim.metrics import Anodi, Copying, Diagnosis, FlowFit, Measured
from ccwsim.metrics.bands import STATISTICS, Statistic
from ccwsim.metrics.lags import Direction, axes_of
from ccwsim.model import MAX_CURVES, Floats, describe_shape, listing, three_digits
from ccwsim.report import verdicts
from ccwsim.report.pictures import bundle_of_curves
from ccwsim.ui.frontend.cells import CellMap, draw_cells
from ccwsim.ui.results import charts
from ccwsim.ui.session import State, study_part
from ccwsim.ui.study.diagnosis_panel import draw_diagnosis
from ccwsim.ui.study.run import describe_price
from ccwsim.ui.study.study_column import set_parameters
from ccwsim.ui.validate import statistics
from ccwsim.ui.validate.slices import middle_slice, slice_of
from ccwsim.ui.widgets import (
    bound_to,
    chart_theme,
    download,
    field,
    in_row,
    options_of,
    proportions_table,
    text,
)

CURVE_HEIGHT = 190
COUNTED_AREA, COUNTED_VOLUME = 10_000, 1_000_000
"""Counts are stated per this number of cells, because grid and image differ in size."""
TOUCHING = {26: "sides, edges, corners", 18: "sides, edges", 6: "sides"}
"""Descriptions of connected cells, by the number of neighbours of a cell in a volume."""
N_SIZES = 60  # number of geobody sizes at which the curve of shares is computed
MAX_TAILS = 3  # maximum number of facies for which transiograms of all pairs are drawn at once
MAX_HEADS = 6
COPYING_HEIGHT = 420
MAX_USES = 100  # number of uses of a cell above which all cells have the same colour


def draw_curves_row(state: State, ensemble: Ensemble) -> None:
    """Draw variograms and connectivity; for volumes, add proportions of layers and new patterns."""
    charts.draw_band_key(ensemble)
    names: tuple[Statistic, ...] = STATISTICS
    of: dict[Statistic, Ensemble] = {}
    if state.ensemble is not None and state.ensemble.values:
        names, of = ("values", "connectivity"), {"values": state.ensemble}
    pairs = product(names, axes_of(ensemble.grid.shape))  # variograms are first
    drawn = [partial(draw_curve, state, of.get(name, ensemble), name, way) for name, way in pairs]
    if ensemble.grid.is_volume:  # two rows of four
        drawn.insert(3, partial(_draw_layers, state, ensemble))
        drawn.append(partial(_draw_unseen, state, ensemble))
    with st.container(key="charts"):
        places = [place for _ in drawn[::4] for place in st.columns(4, gap="medium")]
    for draw, place in zip(drawn, places, strict=True):
        with place:
            draw()
    text.step_note(verdicts.HOW_JUDGED)


def _draw_layers(state: State, ensemble: Ensemble) -> None:
    draw = partial(charts.draw_layers, ensemble, state.facies)
    statistics.panel(state, "layers", statistics.layers(ensemble, state.facies), draw)


def _draw_unseen(state: State, ensemble: Ensemble) -> None:
    """Draw the share of each realization's patterns that are not in the training image."""

    def draw(compared: statistics.PatternsCompared) -> None:
        strips = [("unseen", "of all patterns (%)", compared.unseen)]
        if compared.unseen_at_data is not None:
            strips.append(
                ("unseen_at_data", "of patterns at hard data (%)", compared.unseen_at_data)
            )
        text.panel_title("Unseen patterns", describe_unseen_of(compared))
        for key, title, shares in strips:
            strip = Strip(title, 100 * shares, np.nan)
            chart = figures.strip_chart(strip, chart_theme(), colour=chart_theme().ink)
            charts.draw_chart(
                chart, key, f"Patterns that the training image does not contain, {title}"
            )

    statistics.panel(state, "unseen", statistics.volume_patterns(ensemble), draw)


def describe_unseen_of(compared: statistics.PatternsCompared) -> str:
    """Return, as text, the mean share of patterns that are not in the training image."""
    at_data = compared.unseen_at_data
    mean = None if at_data is None else float(np.nanmean(at_data))
    return verdicts.describe_unseen(
        float(compared.unseen.mean()), mean, describe_shape(compared.shape)
    )


def draw_curve(
    state: State,
    ensemble: Ensemble,
    statistic: Statistic,
    direction: Direction,
    height: int = CURVE_HEIGHT,
) -> None:
    """Draw a statistic of the chosen facies along a direction."""
    image = ensemble.training_image
    name, p = image.facies_names[state.facies], float(image.proportions[state.facies])
    # 1.5 × the sill is above most variograms; so charts of both directions have the same scale
    top = 1.5 * p * (1 - p) or 0.5
    if statistic == "values":
        name, top = image.variable, 1.5 * float(image.sorted_values.var())
    key = f"{statistic}_{direction[0] if isinstance(direction, str) else 'azimuth'}"

    def draw(compared: statistics.Compared[Bundle]) -> None:
        bundle = compared.value
        highest = max(np.nan_to_num(curves).max() for curves in (bundle.each, bundle.reference))
        y_range = (0, 1.04) if statistic == "connectivity" else (0, max(top, 1.05 * float(highest)))
        charts.draw_statistic(
            bundle,
            statistic,
            direction,
            name,
            note=verdicts.describe_curve(compared.fit, statistic),
            of_what=": training image, realizations, median and 5–95 % band",
            y_range=y_range,
            height=height,
            judged=charts.judged_curves(compared.fit),
        )

    statistics.panel(
        state, key, statistics.curves(ensemble, statistic, state.facies, direction), draw
    )


def draw_directions(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw variogram and connectivity along a chosen direction, and the variogram maps."""
    page_state = state.page(statistics.Validation)
    field(
        st.slider,
        "Direction, degrees from north to east",
        key="azimuth",
        help="0 is N–S, 45 is NE–SW, 90 is E–W, 135 is NW–SE. A dotted line marks the direction.",
        **bound_to(page_state, "azimuth", min_value=0, max_value=175, step=5, width=420),
    )
    azimuth = float(page_state.azimuth)
    for column, statistic in zip(st.columns(2, gap="medium"), STATISTICS, strict=True):
        with column:
            draw_curve(state, ensemble, statistic, azimuth, height=220)
    if ensemble.grid.is_volume:
        text.step_note("Directions are horizontal. Variogram maps are drawn only for maps.")
        return
    name = ensemble.training_image.facies_names[state.facies]
    task = statistics.lag_maps(ensemble, state.facies)
    statistics.panel(
        state, "lag_maps", task, lambda lag_maps: _draw_lag_maps(lag_maps, name, azimuth)
    )


def _draw_lag_maps(lag_maps: statistics.LagMaps, name: str, azimuth: float) -> None:
    columns = st.columns(3, gap="medium")
    largest = float(max(lag_maps.reference.max(), lag_maps.mean.max())) or 0.5
    difference = lag_maps.mean - lag_maps.reference
    widest = float(np.abs(difference).max()) or largest
    maps = (
        ("Training image", "variogram map", "lags_image", lag_maps.reference, largest),
        ("Realizations", "mean variogram map", "lags_mean", lag_maps.mean, largest),
        ("Difference", f"at most {three_digits(widest)}", "lags_apart", difference, widest),
    )
    for column, (title, note, key, values, top) in zip(columns, maps, strict=True):
        with column:
            chart = figures.lag_map_chart(
                lag_maps.lags,
                values,
                chart_theme(),
                name=f"γ of {name}",
                largest=top,
                azimuth=azimuth,
                difference=values is difference,
            )
            alt = f"{title}: variogram map of {name}, lags east and north"
            charts.titled_chart(title, note, chart, key, alt)


def draw_transitions(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the transiograms; with many facies, draw only transiograms from a chosen facies."""
    page_state, names = state.page(statistics.Validation), ensemble.training_image.facies_names
    n = len(names)
    tails = list(range(n))
    with in_row(align="bottom", gap="medium"):
        directions = axes_of(ensemble.grid.shape)
        page_state.along = page_state.along if page_state.along in directions else directions[0]
        field(
            st.segmented_control,
            "Along",
            key="transitions_along",
            **bound_to(
                page_state, "along", options=list(directions), format_func=verdicts.way_name
            ),
        )
        if n > MAX_TAILS:
            page_state.tail = min(page_state.tail, n - 1)
            field(
                st.selectbox,
                "From",
                key="transitions_tail",
                **bound_to(page_state, "tail", **options_of(dict(enumerate(names))), width=220),
            )
            tails = [page_state.tail]

    def draw(bundles: dict[tuple[int, int], Bundle]) -> None:
        chart = figures.transiogram_chart(
            bundles, tails, range(n)[:MAX_HEADS], names, chart_theme()
        )
        note = "probability of the second facies at a lag from a cell of the first facies"
        alt = "Transition probabilities between facies against the lag"
        charts.titled_chart("Transiograms", note, chart, "transiograms", alt)

    statistics.panel(state, "transitions", statistics.transitions(ensemble, page_state.along), draw)
    if n > MAX_HEADS:
        text.step_note(f"Only the first {MAX_HEADS} of {n} facies are shown.")


def draw_geobodies(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the proportions on the left and the geobodies of the chosen facies on the right."""
    image, k = ensemble.training_image, state.facies
    names = image.facies_names

    def draw_shares(compared: statistics.Compared[Floats]) -> None:
        chart = figures.proportions_chart(
            names, ensemble.image_proportions, compared.value, colours, chart_theme()
        )
        note = verdicts.describe_proportion(ensemble, k, short=True)
        alt = "Facies proportions of each realization and of the training image"
        charts.titled_chart("Facies proportions", note, chart, "proportions", alt)
        st.html(text.scrolled(proportions_table(ensemble), "Proportions"))

    def draw_strips(compared: statistics.GeobodiesCompared) -> None:
        columns = st.columns(2, gap="large") + st.columns(2, gap="large")
        for column, (title, key, strip) in zip(columns, strips_of(compared), strict=True):
            with column:
                chart = figures.strip_chart(strip, chart_theme(), colour=colours[k])
                alt = f"{title} of {names[k]}: {strip.title}"
                charts.titled_chart(title, f"of {names[k]}", chart, key, alt)
        text.step_note(describe_percolation(compared, names[k]))
        judged = verdicts.describe_geobodies(compared.fit, names[k])
        for verdict in judged + verdicts.describe_joins(compared.joins, names[k]):
            st.html(f'<p class="note">{text.verdict_html(verdict)}: {verdict.numbers}</p>')

    is_volume, page_state = ensemble.grid.is_volume, state.page(statistics.Validation)
    task = statistics.geobodies(ensemble, k, page_state.neighbours if is_volume else None)
    left, right = st.columns([1.0, 2.0], gap="large")
    with left:
        statistics.panel(
            state, "proportions", statistics.compare_proportions(ensemble), draw_shares
        )
        if is_volume:
            statistics.panel(state, "sizes", task, lambda compared: _draw_sizes(compared, names[k]))
    with right:
        if is_volume:
            field(
                st.segmented_control,
                "Cells are connected by",
                key="neighbours",
                **bound_to(page_state, "neighbours"),
                **options_of(TOUCHING),
            )
        statistics.panel(state, "geobodies", task, draw_strips)


def _draw_sizes(geobodies: statistics.GeobodiesCompared, name: str) -> None:
    """Draw the share of a facies in geobodies of at least a given size."""
    chart = figures.geobody_sizes_chart(sizes_of(geobodies), chart_theme(), y_title="share")
    alt = f"Share of {name} in geobodies of at least this size"
    note = f"share of {name} in geobodies of this size or larger"
    charts.titled_chart("Sizes of geobodies", note, chart, "sizes", alt)
    if geobodies.n_cells != geobodies.n_cells_reference:
        text.step_note(
            text.page_text(
                "Sizes of geobodies",
                image=f"{geobodies.n_cells_reference:,}",
                grid=f"{geobodies.n_cells:,}",
            )
        )


def sizes_of(geobodies: statistics.GeobodiesCompared) -> Bundle:
    """Return, for each size, the share of a facies in geobodies of this size or larger."""
    largest = [
        sizes[0] for sizes in (*geobodies.each.sizes, *geobodies.reference.sizes) if len(sizes)
    ]
    limits = np.unique(np.geomspace(1, max(largest, default=1) + 1, N_SIZES).round())
    each, reference = geobodies.each.share_in(limits), geobodies.reference.share_in(limits)[0]
    return bundle_of_curves(limits, reference, each[:MAX_CURVES])


def strips_of(geobodies: statistics.GeobodiesCompared) -> list[tuple[str, str, Strip]]:
    """Return the strip charts of geobodies, with titles and keys."""
    each, reference = geobodies.each, geobodies.reference
    unit = COUNTED_AREA if each.percolates_vertical is None else COUNTED_VOLUME
    per, per_image = unit / geobodies.n_cells, unit / geobodies.n_cells_reference
    shares = np.array([sizes[0] / sizes.sum() if len(sizes) else np.nan for sizes in each.sizes])
    image_sizes = reference.sizes[0]
    share = float(image_sizes[0] / image_sizes.sum()) if len(image_sizes) else np.nan
    area = f"per {unit:,} cells"
    number, euler = (values.astype(np.float64) for values in (each.n_geobodies, each.euler_number))
    number_of_image, euler_of_image = (
        float(reference.n_geobodies[0]),
        float(reference.euler_number[0]),
    )
    gamma = Strip("two random cells are connected", each.gamma, float(reference.gamma[0]))
    return [
        ("Γ", "gamma", gamma),
        ("Geobodies", "n_bodies", Strip(area, number * per, number_of_image * per_image)),
        ("Euler number", "euler", Strip(area, euler * per, euler_of_image * per_image)),
        ("Largest geobody", "largest", Strip("share of the facies", shares, share)),
    ]


def describe_percolation(geobodies: statistics.GeobodiesCompared, name: str) -> str:
    """Return a text that states in how many realizations a facies percolates."""
    each, reference, n = geobodies.each, geobodies.reference, len(geobodies.each.n_geobodies)
    percolation = {"E–W": (each.percolates_ew, reference.percolates_ew)}
    percolation["N–S"] = each.percolates_ns, reference.percolates_ns
    touching = "sides or corners"
    if each.percolates_vertical is not None and reference.percolates_vertical is not None:
        percolation["vertically"] = each.percolates_vertical, reference.percolates_vertical
        touching = " or ".join(TOUCHING[each.neighbours].rsplit(", ", 1))
    counts = listing(
        f"{direction} in {int(flags.sum())}" for direction, (flags, _) in percolation.items()
    )
    directions = [direction for direction, (_, flags) in percolation.items() if flags[0]]
    image_text = "not in the training image"
    if directions:
        image_text = f"in the training image {listing(directions)}"
    return text.page_text(
        "Percolation",
        n=n,
        touching=touching,
        name=f"{name[:1].upper()}{name[1:]}",
        counts=counts,
        image=image_text,
    )


def draw_measures(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw a table with all measures of the facies, with a verdict on each measure."""
    name = ensemble.training_image.facies_names[state.facies]

    def draw(measured: Measured) -> None:
        n = len(measured.each)
        text.panel_title(
            f"Measures of {name}", f"{'first ' if n < ensemble.n else ''}{n} realizations"
        )
        rows = []
        for row in verdicts.describe_measures(measured):
            title = f'<span title="{escape(row.definition)}">{escape(row.title)}</span>'
            verdict = f'<span class="{"fact" if row.good else "fact odd"}">{row.verdict}</span>'
            rows.append([title, row.image, row.realizations, verdict])
        table = text.numbers_table(rows, verdicts.MEASURES_HEAD, "measures")
        st.html(text.scrolled(table, f"Measures of {name}"))
        text.step_note(verdicts.HOW_MEASURED)
        content, file = partial(measures_csv, measured), f"{study_part(ensemble)}_measures.csv"
        download("Measures as CSV", content, file, key="download_measures", width="content")

    statistics.panel(state, "measures", statistics.measures(ensemble, state.facies), draw)


def draw_flow(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the flow efficiency of the facies along each axis, with a verdict."""
    k, name = state.facies, ensemble.training_image.facies_names[state.facies]

    def draw(flow_fit: FlowFit) -> None:
        axes = ("E–W", "N–S", "vertical")[: len(flow_fit.reference)]
        columns = st.columns(len(axes), gap="large")
        for axis, (column, direction) in enumerate(zip(columns, axes, strict=True)):
            with column:
                strip = Strip(
                    "effective K / mean K", flow_fit.each[:, axis], flow_fit.reference[axis]
                )
                chart = figures.strip_chart(strip, chart_theme(), colour=colours[k])
                verdict = verdicts.describe_flow(flow_fit, axis)
                key, alt = f"flow_{axis}", f"Flow efficiency {direction} of {name}"
                charts.titled_chart(f"Flow efficiency {direction}", verdict, chart, key, alt)
        text.step_note(text.page_text("Flow efficiency"))

    statistics.panel(state, "flow", statistics.flow_fit(ensemble, k), draw)


def measures_csv(measured: Measured) -> bytes:
    """Return CSV with a line per measure; columns: training image, crops, pieces, realizations."""
    head = ["measure", "training_image", "crops", "tolerance", "pieces"]
    lines = []
    for k, measure in enumerate(measured.measures):
        fit = measured.fit
        band = ("", "", "") if fit is None else (fit.reference[k], fit.tolerance[k], fit.found[k])
        numbers = [measured.reference[k], *band, *measured.each[:, k]]
        texts = (n if n == "" else f"{measure.factor * n:.6g}" for n in numbers)
        lines.append([measure.title, *texts])
    return csv_as_bytes(
        [*head, *(f"realization_{r + 1}" for r in range(len(measured.each)))], lines
    )


def draw_patterns(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw ANODI distances and ratios by resolution; for volumes, also distances of crops."""
    draw = partial(_draw_anodi, n_axes=ensemble.grid.n_dimensions)
    statistics.panel(state, "anodi", statistics.patterns(ensemble), draw)
    if ensemble.grid.is_volume:
        statistics.panel(state, "crops", statistics.volume_patterns(ensemble), _draw_distances)


def _draw_distances(patterns: statistics.PatternsCompared) -> None:
    """Draw the pattern distances of realizations, and of crops, from the training image."""
    text.panel_title("Distance from the training image", "Jensen–Shannon divergence, bits")
    for verdict in verdicts.describe_patterns(patterns.fit):
        st.html(f"<p>{text.verdict_html(verdict, 'fact')}</p>")
    if patterns.fit is not None:
        text.step_note(
            text.page_text("Pieces and crops", size=verdicts.crop_size_text(patterns.fit))
        )


def _draw_anodi(anodi: Anodi, n_axes: int) -> None:
    left, right = st.columns([1.6, 1.0], gap="large")
    between, within, ratios = anodi.between[0], anodi.within[0], anodi.ratio[0]
    with left:
        ratio = float(anodi.mean_ratio[0])
        note = "" if np.isnan(ratio) else f"between / within = {three_digits(ratio)}"
        chart = figures.divergence_chart(anodi.factors, between, within, chart_theme())
        alt = "Divergence between realizations, and from the training image, by resolution"
        charts.titled_chart("Distance of patterns", note, chart, "anodi", alt)
    with right:
        rows = [
            ["full" if factor == 1 else f"1 / {factor}", *(three_digits(v) for v in values)]
            for factor, *values in zip(anodi.factors, between, within, ratios, strict=True)
        ]
        st.html(text.numbers_table(rows, ("resolution", "between", "within", "ratio")))
        size = describe_shape((anodi.pattern_size,) * n_axes)
        weights = ", ".join(three_digits(w) for w in anodi.weights)
        text.step_note(text.page_text("ANODI", size=size, weights=weights))


def draw_copying(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the seams of a realization, its uses of the training image, and measures of copying."""
    r = state.shown

    def draw(copied: Copying) -> None:
        left, middle, right = st.columns([1.0, 1.0, 0.8], gap="medium")
        shown_slice, image_slice = (
            slice_of(state, ensemble),
            middle_slice(ensemble.training_image.shape),
        )
        with left:
            share = three_digits(100 * copied.seams.sum() / ensemble.n_active)
            text.panel_title("Seams", f"{share} % of the cells are at a seam{shown_slice.words}")
            seams = (
                copied.seams if shown_slice.axis is None else copied.seams_within(shown_slice.axis)
            )
            cut = replace(copied, seams=shown_slice.of(seams))
            cell_map = seam_map(
                cut, shown_slice.ensemble(ensemble), r, colours, chart_theme().reference
            )
            draw_cells(cell_map, "seams", link="grid", name="seams", max_height=COPYING_HEIGHT)
        with middle:
            note = f"uses of each cell of the training image{image_slice.words}"
            text.panel_title("Source of the cells", note)
            uses = use_map(replace(copied, uses=image_slice.of(copied.uses)))
            draw_cells(uses, "uses", name="uses", max_height=COPYING_HEIGHT)
        with right:
            text.panel_title("Copy meter", f"realization {ensemble.numbers[r] + 1}")
            st.html(text.numbers_table(meter_of(copied)))
            text.step_note(text.page_text("Copy meter"))
            if shown_slice.axis is not None:
                text.step_note("The share of seams refers to the volume; the map shows a slice.")

    statistics.panel(state, "reuse", statistics.copied(ensemble, r), draw)


def draw_image(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the diagnosis of the training image."""
    image = ensemble.training_image

    def draw(diagnosis: Diagnosis) -> None:
        use, price = partial(set_parameters, state), partial(describe_price, state.choices)
        parameters = state.choices.parameters
        draw_diagnosis(diagnosis, image, parameters, colours, use=use, price=price)

    statistics.panel(state, "diagnosis", statistics.diagnosis(image), draw)


def meter_of(copied: Copying) -> list[tuple[str, str]]:
    """Return the rows of the copy meter as pairs (name, value)."""
    n_axes = len(copied.square_at)
    size = describe_shape((copied.largest_square,) * n_axes)
    return [
        ("neighbours kept", f"{100 * copied.copied:.1f} %"),
        (f"largest {'square' if n_axes == 2 else 'cube'} copied", f"{size} cells"),
        ("largest piece copied", f"{copied.largest_block:,} cells"),
        ("training image used", f"{100 * copied.used:.0f} %"),
        ("set as single cells", f"{copied.n_unknown:,} cells"),
    ]


def seam_map(
    copied: Copying, ensemble: Ensemble, r: int, colours: Sequence[str], line: str
) -> CellMap:
    """Return a map of a realization with seams; hovering over a seam also shows the facies."""
    names = ensemble.training_image.facies_names
    n = len(names)
    seams = copied.seams if n <= 128 else np.zeros_like(copied.seams)
    return CellMap(
        indices=(ensemble.indices[r] + n * seams).astype(np.uint8),
        colours=[*colours, *[line] * n],
        labels=[*names, *(f"{name}, at a seam" for name in names)],
        alt=f"Seams between pieces of the training image in realization {r + 1}",
        keys=[*zip(names, colours, strict=True), ("seam", line)][-8:],
    )


def use_map(copied: Copying) -> CellMap:
    """Return a map that shows how often each cell of the training image was used."""
    most = max(int(copied.uses.max()), 1)
    n = min(most, MAX_USES)
    labels = [f"used {k} times" for k in range(n + 1)]
    if most > n:
        labels[-1] = f"used {n} times or more"
    return CellMap(
        indices=np.minimum(copied.uses, n).astype(np.uint8),
        colours=figures.ramp(figures.CIVIDIS, n + 1),
        labels=labels,
        alt="How often each cell of the training image was used",
        strip={"colours": list(figures.CIVIDIS), "low": "0", "high": f"{n} uses"},
    )
