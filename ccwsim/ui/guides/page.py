"""The page Guides: five tasks, each with its controls, beside a map and a realization."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import streamlit as st
from streamlit.delta_generator import DeltaGenerator

from ccwsim import Grid, Secondary, TrainingImage, datasets, io
from ccwsim.figures import ENTROPY, ramp
from ccwsim.metrics import main_direction, warn_of_probabilities
from ccwsim.model import (
    MAX_AUXILIARY_WEIGHT,
    MAX_SCALE,
    MAX_SOFT_WEIGHT,
    MIN_SCALE,
    UNKNOWN,
    active_codes,
    describe_shape,
    match_of_image,
)
from ccwsim.sharing.choices import (
    MAX_CORNERS,
    Choices,
    Corners,
    Directions,
    Gradient,
    GuideChoice,
    ImageChoice,
    Stroke,
    Upload,
    ZoneLayers,
)
from ccwsim.ui.frontend.cells import CellMap, editor_points, map_content, number_map
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.results import maps
from ccwsim.ui.session import (
    State,
    cached,
    data_of,
    file_uploader,
    image_of,
    maps_of_probabilities,
    read_upload,
    study_of,
    wells_of,
)
from ccwsim.ui.study import asking, image_questions, questions, run
from ccwsim.ui.study.guides_step import (
    draw_guides_in_use,
    draw_problem_of_guides,
    problem_of_guides,
    settle_guides,
    use_guides,
)
from ccwsim.ui.study.image_step import image_thumbnail
from ccwsim.ui.widgets import (
    bound_to,
    button,
    draw_style,
    field,
    if_possible,
    in_row,
    options_of,
    page_labels,
    page_text,
    pair,
    panel_title,
    plain,
    problem_in,
    step_note,
)

TASKS = page_labels("tasks_of_guides")  # title and explanation of each task
LABELS, FILES = page_labels("guides"), page_labels("files_of_guides")  # label and help
GUIDES_OF_TASK = {
    "active": ("active",),
    "facies": ("probabilities", "auxiliary"),
    "direction": ("scale", "mirrored", "angle"),
    "images": ("images",),
    "zones": ("zones",),  # after the images, which have the zones
}
"""The guides, by their names in a `GuideChoice`, that each task sets."""
TOOL_OF_TASK = {"active": "outline", "facies": "brush", "direction": "line", "zones": "zone"}
"""The tool of the map for each task."""
WIDTHS = (0.9, 2.0, 1.0)  # relative widths of the controls, the map, and a realization
MAX_OTHERS = 3  # maximum number of further images that are chosen here
IMAGE_PIXELS = 44  # width of the picture of an image in pixels
ACTIVE = "#9AA9B8"  # colour of active cells, if the map shows nothing else
N_ARROWS = 14  # number of arrows along the longer side of the map
AZIMUTH: dict[str, Any] = {
    **{"min_value": -360.0, "max_value": 360.0, "step": 15.0, "format": "%g"},
    "help": "From north, clockwise, in degrees.",
}
SHARE = {"min_value": 0.0, "max_value": 1.0, "step": 0.05}
ENDS, TOWARDS = {"start": "From", "end": "To"}, {"azimuth": "Towards (azimuth)"}
_warnings = cached(max_entries=64)(warn_of_probabilities)


@dataclass
class GuidesPage:
    """The state of the page Guides."""

    task: str = ""  # the chosen task, or "" for the task of the first guide
    refused: tuple[str, str] = ("", "")  # the guide whose latest file cannot be read, and why
    fault: tuple[str, str] = ("", "")  # the guide that does not fit the study, and why


def change_guides(state: State, **changes: Any) -> None:
    """Change guides of the study, or of the draft that does not fit the study."""
    state.page(GuidesPage).refused = "", ""
    use_guides(state, replace(state.guides_draft or state.choices.guides, **changes))


def guides_page(state: State) -> None:
    """Draw the tasks and controls of guides, the map, and realizations that follow the guides."""
    draw_style("guides/guides.css")
    problem = settle_guides(state)
    run.start_run_if_needed(state, live=True)
    run.draw_news(state)
    asking.draw_fitted(state)
    page_state, guides = state.page(GuidesPage), state.guides_draft or state.choices.guides
    page_state.fault = _fault(state, guides) if problem else ("", "")
    task = page_state.task = page_state.task or _first_task(guides)
    with in_row("guides_top"):
        field(
            st.segmented_control,
            "What guides the simulation",
            key="guides_task",
            label_visibility="collapsed",
            **bound_to(page_state, "task"),
            **options_of({name: title for name, (title, _) in TASKS.items()}),
        )
        draw_guides_in_use(state)
    fault, reason = page_state.fault
    if problem and fault not in GUIDES_OF_TASK[task]:
        titles = [TASKS[other][0] for other, names in GUIDES_OF_TASK.items() if fault in names]
        draw_problem_of_guides(state, ": ".join([*titles, reason]))
    with st.container(key="maps"):
        controls, board, beside = maps.map_columns(WIDTHS, 1, state.grid)
    with controls, st.container(key="guides_controls"):
        step_note(TASKS[task][1])
        if guides.saved is None:
            CONTROLS[task](state, guides, partial(change_guides, state))
        else:
            step_note(page_text("Guides of a project"))
    with board:
        _draw_board(state, guides, task)
    is_map = not state.grid.is_volume
    with beside if is_map else st.container(), st.container(key="results"):
        _draw_results(state)


def _first_task(guides: GuideChoice) -> str:
    """Return the first task with a guide in use or, without guides, the first task."""
    usual, tasks = GuideChoice(), GUIDES_OF_TASK.items()
    used = [t for t, names in tasks if any(getattr(guides, k) != getattr(usual, k) for k in names)]
    return [*used, *TASKS][0]


def _fault(state: State, guides: GuideChoice) -> tuple[str, str]:
    """Return the guide, or its latest change, that does not fit the study, and the reason."""
    names = [name for guides_of_task in GUIDES_OF_TASK.values() for name in guides_of_task]
    valid = GuideChoice() if problem_of_guides(state.choices) else state.choices.guides
    tried = replace(guides, **{name: getattr(valid, name) for name in names} | {"zones": None})
    for name in names:
        tried = replace(tried, **{name: getattr(guides, name)})
        if reason := problem_of_guides(replace(state.choices, guides=tried)):
            return name, reason
    return "", problem_of_guides(replace(state.choices, guides=guides))


def _draw_results(state: State) -> None:
    """Draw a realization and the E-type."""
    ensemble = state.ensemble
    if ensemble is None:
        step_note("After the first run, realizations are shown here and follow every change.")
        return
    state.fit_shown(ensemble)
    colours = maps.colours_of_ran(state)
    maps.draw_realization(state, ensemble, colours, state.shown, ensemble.grid)
    maps.draw_e_type(state, ensemble, colours)


def _choice(
    guide: str, chosen: Any, defaults: Mapping[str, Any], change: Callable[..., None], key: str = ""
) -> None:
    """Draw the choice between None, other `defaults` of a guide by name, and uploaded files."""
    shown = next((name for name, offered in defaults.items() if type(offered) is type(chosen)), "")
    if files := GuideChoice(**{guide: chosen}).files:
        shown = f"file {' and '.join(file.name for file in files)}"
    label, tip = LABELS[key or guide]
    field(
        st.selectbox,
        label,
        key=f"guides_{key or guide}",
        value=shown,
        write=lambda name: change(**{guide: defaults.get(name)}),
        help=tip,
        **options_of({name: name for name in (*defaults, shown)}),
    )


def _files(
    state: State,
    guide: str,
    takes: Mapping[str, Callable[[Any], None]],
    end: str = "",
    **options: Any,
) -> None:
    """Draw uploaders and, below, why a file is refused or why the guide does not fit."""
    page_state = state.page(GuidesPage)

    def take_or_refuse(take: Callable[[Any], None], upload: Any) -> None:
        page_state.refused = guide, problem_in(partial(take, upload))

    for name, take in takes.items():
        (label, tip), key = FILES[name], f"guides_{name}_file{end}"
        file_uploader(label, key=key, take=partial(take_or_refuse, take), help=tip, **options)
    refused, reason = page_state.refused
    if refused == guide and reason:
        st.error(plain(f"{questions.IN_SCRIPTS.sub('', reason)}. The file is not used."))
    if page_state.fault[0] == guide:
        draw_problem_of_guides(state, page_state.fault[1])


def _numbers(
    guide: Any,
    change: Callable[..., None],
    attribute: str,
    labels: Mapping[str, str],
    **look: Any,
) -> None:
    """Draw number fields of a guide, side by side if there are two."""

    def write(**changes: Any) -> None:
        change(**{attribute: replace(guide, **changes)})

    places = pair() if len(labels) > 1 else [st.container()]
    for place, (name, label) in zip(places, labels.items(), strict=True):
        number = bound_to(guide, name, write, **look)
        field(place.number_input, label, key=f"guides_{attribute}_{name}", **number)


def _active(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    take = partial(change, active_codes=())
    outline = frame(state.grid)
    _choice("active", guides.active, {"none": None, "inside an outline": outline}, take)
    _files(state, "active", {"mask": lambda upload: take(active=upload)})
    if isinstance(guides.active, Upload):
        asking.ask(_mask_items(guides.active, guides.active_codes, state.grid), change)


def _mask_items(mask: Upload, chosen: tuple[float, ...], grid: Grid) -> list[asking.FormItem]:
    """Ask which values of a mask are active, if the values do not say it."""
    values = if_possible(lambda: read_upload(io.read_values, mask, grid))
    if values is None or not (chosen or problem_in(lambda: active_codes(values))):
        return []
    codes, counts = np.unique(values[~np.isnan(values)], return_counts=True)
    labels = {k: f"{k:g} ({n:,} cells)" for k, n in zip(codes.tolist(), counts, strict=True)}
    return [
        asking.Question(
            key="active_codes",
            text=f"Values of {plain(mask.name)} in active cells",
            value=[*chosen],
            options=dict([*labels.items()][: questions.MAX_ASKED_FACIES]),
            answers=lambda taken: {"active_codes": tuple(sorted(taken))},
            widget=st.pills,
            look={"selection_mode": "multi"},
        )
    ]


def frame(grid: Grid, first: float = 0.1, last: float = 0.9) -> Corners:
    """Return the corners of a rectangle in a grid; `first` and `last` are shares of its width."""
    x, y, *_ = grid.axes
    west, east = np.quantile(x, (first, last)).round(6).tolist()
    south, north = np.quantile(y, (0.1, 0.9)).round(6).tolist()
    return (west, south), (east, south), (east, north), (west, north)


def _facies(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    """Draw the choices of probabilities and of an auxiliary variable."""
    image, probabilities = state.image, guides.probabilities
    mapped = _mapped_facies(guides, state.grid, image)
    shown = guides.facies if guides.facies in mapped else [0, *mapped][-1]
    defaults = {"none": None, "a gradient": Gradient(), "drawn on the map": ()}
    _choice("probabilities", probabilities, defaults, change)
    if probabilities is not None and mapped:
        field(
            st.selectbox,
            "Facies",
            key="guides_facies",
            **bound_to(guides, "facies", change, value=shown),
            **options_of({k: image.facies_names[k] for k in mapped}),
        )
    if isinstance(probabilities, Gradient):
        _numbers(probabilities, change, "probabilities", ENDS, **SHARE)
        _numbers(probabilities, change, "probabilities", TOWARDS, **AZIMUTH)
    _files(
        state,
        "probabilities",
        {"soft": lambda files: change(probabilities=files)},
        accept_multiple_files=True,
    )
    if guides.probability_files:
        grid, main_choice = state.grid, state.choices.image
        in_files = if_possible(lambda: maps_of_probabilities(guides, grid, image))
        if in_files is not None:
            match, stated = in_files[1], guides.facies_names
            items = questions.facies_items(match, stated, main_choice, "soft_", match.likeliest)
            asking.ask(items, change, "soft_")
    if probabilities is not None:
        field(
            st.slider,
            "Weight of the probabilities",
            key="guides_soft_weight",
            **bound_to(guides, "soft_weight", change, min_value=0.0, max_value=MAX_SOFT_WEIGHT),
        )
    _auxiliary(state, guides, change)


def _mapped_facies(guides: GuideChoice, grid: Grid, image: TrainingImage) -> list[int]:
    """Return the facies whose probability can be shown, as indices; of files, those with a map."""
    in_files = if_possible(lambda: maps_of_probabilities(guides, grid, image))
    codes = in_files[1].codes.values() if in_files else ()
    mapped = [k for k, code in enumerate(image.codes.tolist()) if code in codes]
    return mapped if guides.probability_files else [*range(image.n_facies)]


def _auxiliary(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    auxiliary = guides.auxiliary
    image, grid = auxiliary if isinstance(auxiliary, tuple) else (None, None)
    defaults = {"none": None, "position along a direction": Directions()}
    _choice("auxiliary", auxiliary, defaults, change)
    if isinstance(auxiliary, Directions):
        labels = {name: f"Azimuth, {name}" for name in ("image", "grid")}
        _numbers(auxiliary, change, "auxiliary", labels, **AZIMUTH)
    takes = {
        "image": lambda upload: change(auxiliary=(upload, grid)),
        "grid": lambda upload: change(auxiliary=(image, upload)),
    }
    _files(state, "auxiliary", takes)
    if auxiliary is not None:
        field(
            st.slider,
            "Weight of the variable",
            key="guides_auxiliary_weight",
            min_value=0.0,
            max_value=MAX_AUXILIARY_WEIGHT,
            **bound_to(guides, "auxiliary_weight", change),
        )


def _direction(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    """Draw the choice of angles, scale and mirrored copies of the image."""
    chosen, defaults = guides.angle, {"as in the image": None, "one angle": 45.0}
    defaults |= {"turning across the grid": Gradient(90.0, 0.0, 90.0), "along drawn lines": ()}

    def turn(angle: Any) -> None:
        azimuth = guides.flow_azimuth
        if isinstance(angle, tuple):  # geobodies follow the lines at first
            azimuth = float(round(main_direction(state.image)[0]))
        change(angle=angle, flow_azimuth=azimuth)

    def take(upload: Upload) -> None:
        lines = read_upload(io.read_lines, upload, state.grid)
        turn(tuple(_points(k.tolist()) for k in lines) if lines else upload)

    _choice("angle", chosen, defaults, turn)
    if isinstance(chosen, Gradient):
        _numbers(chosen, change, "angle", ENDS, **AZIMUTH)
        _numbers(chosen, change, "angle", TOWARDS, **AZIMUTH)
    elif isinstance(chosen, (float, tuple)):
        name = "angle" if isinstance(chosen, float) else "flow_azimuth"
        label, tip = LABELS[f"one_{name}"]
        field(
            st.number_input,
            label,
            key=f"guides_one_{name}",
            **bound_to(guides, name, change, **AZIMUTH | {"help": tip}),
        )
    _files(state, "angle", {"angle": take})
    field(
        st.number_input,
        "Scale of the image",
        key="guides_scale",
        min_value=MIN_SCALE,
        max_value=MAX_SCALE,
        step=0.1,
        **bound_to(guides, "scale", change),
    )
    names = {"": "none", "x": "west–east", "y": "south–north", "xy": "both"}
    mirrored = guides.mirrored if guides.mirrored in names else "xy"  # z by a link
    field(
        st.selectbox,
        "Mirrored copies",
        key="guides_mirrored",
        help="Further patterns of a small image.",
        **bound_to(guides, "mirrored", change, value=mirrored),
        **options_of(names),
    )


def _images(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    """Draw the images in use, and the choice of their use or, for the task zones, their zones."""
    task, grid, zones = state.page(GuidesPage).task, state.grid, guides.zones
    with _picture_row(0):
        _draw_picture(state.image, maps.colours_of(state), 0)
    for k in range(len(guides.images)):
        _further_image(state, guides.images, k + 1, change)
    _add_image(state, len(guides.images))
    if not guides.images:
        return
    n, outlines = len(guides.images) + 1, _outlines(grid, len(guides.images))
    is_shared = zones is None or isinstance(zones, float)
    if task == "images":
        uses = {"all for each patch": None, "a share of patches": 0.5, "each in its zone": outlines}
        _choice("zones", zones if is_shared else outlines, uses, change, key="use")
    else:
        defaults: dict[str, Any] = {"none": None, "inside outlines": outlines}
        if grid.nz is not None:
            defaults["by layer"] = ZoneLayers(tuple(k * grid.nz // n for k in range(1, n)))
        _choice("zones", None if is_shared else zones, defaults, change)
        _files(state, "zones", {"zones": lambda upload: change(zones=upload)})
    if task == "images" and isinstance(zones, float):
        field(
            st.slider,
            "Share of further images",
            key="guides_share",
            **bound_to(guides, "zones", change, **SHARE),
        )
    layers = zones.first if task == "zones" and isinstance(zones, ZoneLayers) else ()
    for k, first in enumerate(layers):
        field(
            st.number_input,
            f"Image {k + 1} from layer",
            key=f"guides_layer_{k}",
            value=first,
            write=lambda layer, k=k: change(
                zones=ZoneLayers((*layers[:k], int(layer), *layers[k + 1 :]))
            ),
            min_value=0,
            max_value=max((grid.nz or 1) - 1, first),
            help="Layer 0 is the bottom layer. The image is used up to the next zone.",
        )


def _outlines(grid: Grid, n: int) -> tuple[Corners, ...]:
    """Return outlines of the zones of `n` further images, side by side."""
    return tuple(frame(grid, (k + 0.1) / (n + 1), (k + 0.9) / (n + 1)) for k in range(1, n + 1))


def _picture_row(k: int) -> DeltaGenerator:
    """Return a row for the picture of image `k` and a button."""
    return in_row(f"guides_image_{k}")


def _draw_picture(image: TrainingImage, palette: list[str], k: int) -> None:
    """Draw a small picture of image `k`, its name and its size."""
    png = image_thumbnail(image, palette, 2 * IMAGE_PIXELS)
    st.image(png, width=IMAGE_PIXELS, alt=f"Image {k}, small")
    step_note(f"{k} {maps.pretty(image.name)}\n{describe_shape(image.shape)}")


def _further_image(
    state: State, images: Sequence[ImageChoice], k: int, change: Callable[..., None]
) -> None:
    """Draw further image `k`, from 1, the open questions about it, and a button to remove it."""
    choice, part, main_choice = images[k - 1], f"image{k}_", state.choices.image

    def write(new: ImageChoice) -> None:
        change(images=(*images[: k - 1], new, *images[k:]))

    kept = [index for index in range(len(images)) if index != k - 1]
    image, items = if_possible(lambda: image_of(choice)), list[asking.FormItem]()
    with _picture_row(k):
        if image is not None:
            match = match_of_image(image, image_of(main_choice), choice.facies_names)
            colour_of = dict(zip(match.image.codes.tolist(), maps.colours_of(state), strict=True))
            codes = match.codes | match.likeliest
            _draw_picture(image, [colour_of.get(code, ACTIVE) for code in codes.values()], k)
            items = questions.facies_items(match, choice.facies_names, main_choice, part)
        button("Remove", key=f"guides_drop_{k}", on_click=_keep, args=(state, kept))
    volume = state.grid.is_volume
    image_questions.ask_about_image(choice, write, volume=volume, part=part)
    asking.ask(items, lambda **answers: write(replace(choice, **answers)), part)


def _add_image(state: State, n: int) -> None:
    """Draw the controls that add a further image to `n` images, unless there are enough."""
    volume, add = state.grid.is_volume, partial(_keep, state, range(n))
    if n < MAX_OTHERS:
        label, tip = LABELS["other"]
        names = datasets.volume_names() if volume else datasets.names()
        field(
            st.selectbox,
            label,
            key="guides_other",
            value=None,
            write=lambda name: add(ImageChoice(name)),
            placeholder="add one",
            help=tip,
            **options_of({name: maps.pretty(name) for name in names}),
        )
    takes = {"other": lambda upload: add(image_questions.image_of_file(upload, volume=volume))}
    _files(state, "images", takes if n < MAX_OTHERS else {}, f"_{n}")


def _keep(state: State, kept: Sequence[int], *new: ImageChoice) -> None:
    """Use the further images `kept` and new images; the kept images keep their zones."""
    guides, grid = state.guides_draft or state.choices.guides, state.grid
    images, zones = (*(guides.images[k] for k in kept), *new), guides.zones
    if isinstance(zones, tuple):
        zones = *(zones[k] for k in kept), *(frame(grid, 0.4, 0.6) for _ in new)
    elif isinstance(zones, ZoneLayers):
        above = min(zones.first[-1] + 1, (grid.nz or 1) - 1)
        zones = ZoneLayers((*(zones.first[k] for k in kept), *(above for _ in new)))
    elif new and zones is None and state.page(GuidesPage).task == "zones":
        zones = _outlines(grid, len(images))
    change_guides(state, images=images, zones=zones if images else None)


CONTROLS = {
    "active": _active,
    "facies": _facies,
    "direction": _direction,
    "zones": _images,
    "images": _images,
}
"""Functions that draw the controls of each task."""


def _draw_board(state: State, guides: GuideChoice, task: str) -> None:
    """Draw the map of a task with the tool to draw on it, and notes on the guides."""
    choices, image = state.choices, state.image
    study = if_possible(lambda: study_of(choices))
    secondary = study.secondary if study else None
    soft: Any = guides.probabilities
    corners = guides.active
    zones = guides.zones if isinstance(guides.zones, tuple) else ()
    outlines = {f"zone{k}": outline for k, outline in enumerate(zones, 1)}
    azimuth = guides.flow_azimuth if isinstance(guides.angle, tuple) else 0.0
    arrows = _arrows(secondary, azimuth, choices.grid)
    mapped = _mapped_facies(guides, choices.grid, image)
    shown = guides.facies if guides.facies in mapped else [0, *mapped][-1]
    ground = _ground(secondary, choices, shown, task)
    if secondary is None and guides.probability_files:  # which wait for an answer
        ground = if_possible(lambda: _map_in_file(guides, choices.grid, image)) or ground
    panel_title(ground.alt, "middle layer" if choices.grid.nz else "")
    content = map_content(_with_hard_data(state, ground), grid=choices.grid, name="guides") | {
        "axes": False,
        "arrows": arrows,
        "tool": TOOL_OF_TASK.get(task),
        "strokes": isinstance(soft, tuple)
        and not guides.probability_files
        and [(*astuple(s)[:3], s.points) for s in soft],
        "flow": isinstance(guides.angle, tuple) and guides.angle,
        "outlines": outlines | ({"outline": corners} if isinstance(corners, tuple) else {}),
    }
    draw_component("guides", "guide_board", content, "drawn", partial(take_drawing, state))
    if study is None or secondary is None:  # a guide without weight is no guide
        return
    notes = _warnings(secondary, image, choices.parameters)
    if arrows:
        notes = [f"arrows show where azimuth {azimuth:g}° of the image points", *notes]
    if n_left := study.inactive_data.n:
        notes = [f"{n_left} hard data are in inactive cells and are left out", *notes]
    for note in notes:
        st.caption(plain(f"{note[:1].upper()}{note[1:]}."))


def _map_in_file(guides: GuideChoice, grid: Grid, image: TrainingImage) -> CellMap:
    """Return the first map in files of probabilities."""
    name, values = next(iter(maps_of_probabilities(guides, grid, image)[0].items()))
    cells = values if values.ndim > 1 else values[:, None, None]
    shares = maps.middle_cells(np.broadcast_to(cells, grid.shape))
    return number_map(shares, f"P({name}) =", f"Probability of {name} in the file")


def _with_hard_data(state: State, ground: CellMap) -> CellMap:
    """Return a map with the hard data of the study; data of a volume are seen from above."""
    data, image = if_possible(lambda: data_of(state.choices)), state.image
    if data is None:
        return ground
    points = [point[-4:] for point in editor_points(data, image)]
    paths = {name: tuple(cell[-2:] for cell in cells) for name, cells in wells_of(state.choices)}
    colours = maps.colours_of(state)
    return replace(ground, points=points, point_colours=colours, wells=tuple(paths.items()))


def _arrows(secondary: Secondary | None, azimuth: float, grid: Grid) -> dict[str, Any] | None:
    """Return arrows (x, y, azimuth) for the canvas, and the distance between them in cells."""
    if secondary is None or secondary.angle is None:
        return None
    azimuths = maps.middle_cells(np.broadcast_to(secondary.angle + azimuth, grid.shape))
    every = max(max(azimuths.shape) // N_ARROWS, 1)
    drawn = slice(every // 2, None, every)
    x, y = (axis[drawn] for axis in grid.axes[:2])
    arrows = np.stack([*np.meshgrid(x, y), azimuths[drawn, drawn] % 360], axis=-1)
    return {"every": every, "at": arrows.reshape(-1, 3).tolist()}


def take_drawing(state: State, drawn: Mapping[str, Any]) -> None:
    """Use strokes (value, radius, softness, points), lines and outlines; false means not drawn."""
    guides, changes = state.guides_draft or state.choices.guides, dict[str, Any]()
    outlines = {name: _points(corners) for name, corners in drawn["outlines"].items()}
    if "outline" in outlines:
        changes["active"] = outlines.pop("outline")
    if outlines and isinstance(guides.zones, tuple):
        changes["zones"] = tuple(outlines[name] for name in sorted(outlines))
    if (strokes := drawn["strokes"]) is not False:
        changes["probabilities"] = tuple(
            Stroke(v, r, s, _points(line)) for v, r, s, line in strokes
        )
    if (lines := drawn["flow"]) is not False and isinstance(guides.angle, tuple):
        changes["angle"] = tuple(map(_points, lines))
    change_guides(state, **changes)


def _points(line: Sequence[Sequence[float]]) -> Corners:
    return tuple((float(x), float(y)) for x, y in line[:MAX_CORNERS])


def _ground(secondary: Secondary | None, choices: Choices, facies: int, task: str) -> CellMap:
    """Return the map of secondary information for a task or, for a volume, its middle layer."""
    image, grid, given = image_of(choices.image), choices.grid, secondary or Secondary()
    active = np.ones(grid.shape, bool) if given.active is None else given.active
    if task == "active" or not (given.guides or given.zones is not None):
        indices = maps.middle_cells(np.where(active, np.uint8(0), np.uint8(UNKNOWN)))
        title = "All cells of the grid" if given.active is None else "Active cells"
        return CellMap(indices, [ACTIVE], ["active"], title)
    if given.zones is not None and (task in ("zones", "images") or not given.guides):
        names = [maps.pretty(used.name) for used in (image, *given.images)]
        shades = ramp(ENTROPY, len(names) + 1)[:-1]
        indices = maps.middle_cells(np.where(active, given.zones, np.uint8(UNKNOWN)))
        keys = list(zip(names, shades, strict=True))
        return CellMap(indices, shades, names, "Zones of the images", keys=keys)
    if given.probabilities is not None:
        values, facies_name = given.probabilities[facies], image.facies_names[facies]
        label, title = f"P({facies_name}) =", f"Given probability of {facies_name}"
    else:
        values, label, title = given.auxiliary[0].grid, "variable, scaled to 1:", "Variable"
        values = (values - values.min()) / max(values.max() - values.min(), 1e-300)
    shares = maps.middle_cells(np.where(active, values, np.nan))
    return number_map(shares, label, title)
