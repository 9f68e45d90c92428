"""Guides, between hard data and grid: probabilities, active cells, variables, angles, images."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, replace
from functools import partial
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import Secondary, TrainingImage, datasets, io
from ccwsim.figures import ENTROPY, ramp
from ccwsim.metrics import main_direction, warn_of_probabilities
from ccwsim.model.arrays import describe_shape
from ccwsim.model.bounds import MAX_AUXILIARY_WEIGHT, MAX_SCALE, MAX_SOFT_WEIGHT, MIN_SCALE
from ccwsim.model.grid import Grid
from ccwsim.model.missing import UNKNOWN
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
from ccwsim.ui.frontend.cells import CellMap, map_content, share_map
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.results.maps import colours_of, middle_layer, pretty
from ccwsim.ui.session.cached import cached
from ccwsim.ui.session.resolve import image_of, read_upload, secondary_of, study_of
from ccwsim.ui.session.state import State
from ccwsim.ui.session.uploads import file_uploader
from ccwsim.ui.study.image_questions import image_of_file
from ccwsim.ui.study.image_step import thumbnail
from ccwsim.ui.study.run import start_run_if_needed
from ccwsim.ui.widgets.errors import if_possible, problem_in
from ccwsim.ui.widgets.fields import bound_to, button, field, options_of
from ccwsim.ui.widgets.text import pair, plain, step_note

_warnings = cached(max_entries=64)(warn_of_probabilities)
MAX_HEIGHT = 480  # maximum height of the map in pixels
ACTIVE = "#9AA9B8"  # colour of active cells, if there are no other guides
MAX_OTHERS = 3  # maximum number of further images that are chosen here
THUMB = 44  # width of the picture of an image in pixels
N_ARROWS = 14  # number of arrows along the longer side of the map
AZIMUTH: dict[str, Any] = {"min_value": -360.0, "max_value": 360.0, "step": 15.0, "format": "%g"}
AZIMUTH["help"] = "From north, clockwise, in degrees."
ENDS, TOWARDS = {"start": "From", "end": "To"}, {"azimuth": "Towards (azimuth)"}


def guides_step(state: State) -> None:
    """Draw the secondary information of the study in a frame that is closed until it is used."""
    guides = state.guides_draft or state.choices.guides
    change = partial(_change, state)
    with st.expander("Guides", not guides.is_empty, key="guides", on_change="rerun") as place:
        _draw_problem(state)
        if not place.open:
            return
        if not guides.is_empty:
            _draw_board(state, guides)
        _draw_images(state, guides)
        if guides.saved is not None:
            step_note(f"From the project: {guides.saved.describe()}")
        else:
            _probabilities(state, guides, change)
            _active(state, guides, change)
            _auxiliary(guides, change)
            _copies(state, guides, change)
            _images(state, guides, change)
        if not guides.is_empty:
            button("No guides", key="guides_none", on_click=use_guides, args=(state, GuideChoice()))


def use_guides(state: State, choice: GuideChoice) -> None:
    """Use a choice of guides in the study if it fits the study; otherwise keep it as a draft."""
    changed = replace(state.choices, guides=choice)
    fits = not problem_of_guides(changed)
    state.guides_draft = None if fits else choice
    if fits:
        state.choices = changed


def problem_of_guides(choices: Choices) -> str:
    """Return the reason why the guides of a study cannot be used, or an empty text."""
    return problem_in(lambda: secondary_of(choices))


def _change(state: State, **changes: Any) -> None:
    use_guides(state, replace(state.guides_draft or state.choices.guides, **changes))


def _draw_problem(state: State) -> None:
    draft, problem = state.guides_draft, problem_of_guides(state.choices)
    if draft is not None:
        problem = problem_of_guides(replace(state.choices, guides=draft)) or problem
        if not problem:  # the study has changed, and the guides fit now
            use_guides(state, draft)
    if problem:
        st.error(plain(problem))
    if draft is not None and problem:
        keep = {"on_click": setattr, "args": (state, "guides_draft", None)}
        button("Keep the guides as they were", key="guides_keep", **keep)


def _choice(
    label: str, given: Any, shapes: Mapping[str, Any], change: Callable[..., None], attribute: str
) -> None:
    """Draw the choice between named shapes with default values, or None, and uploaded files."""
    chosen = next((name for name, shape in shapes.items() if type(shape) is type(given)), "")
    if files := GuideChoice(**{attribute: given}).files:
        chosen = f"file {' and '.join(file.name for file in files)}"

    def write(name: str) -> None:
        change(**{attribute: shapes.get(name)})

    options = options_of({name: name for name in (*shapes, chosen)})
    field(st.selectbox, label, key=f"guides_{attribute}", value=chosen, write=write, **options)


def _probabilities(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    image, given = image_of(state.choices.image), guides.probabilities
    shapes = {"none": None, "a gradient": Gradient(), "drawn on the map": ()}
    _choice("Probabilities of facies", given, shapes, change, "probabilities")
    if given is not None:
        names = options_of(dict(enumerate(image.facies_names)))
        facies = bound_to(guides, "facies", change)
        facies["value"] = min(guides.facies, image.n_facies - 1)
        field(st.selectbox, "Facies", key="guides_facies", **facies, **names)
    if isinstance(given, Gradient):
        share = {"min_value": 0.0, "max_value": 1.0, "step": 0.05}
        _numbers(given, change, "probabilities", ENDS, **share)
        _numbers(given, change, "probabilities", TOWARDS, **AZIMUTH)
    tip = "Any grid, with variables named P_facies; for a volume also a table with z and P_facies."
    take = {"take": lambda upload: change(probabilities=upload), "help": tip}
    file_uploader("or a map of probabilities", key="guides_soft_file", **take)
    if given is not None:
        weight = bound_to(guides, "soft_weight", change, min_value=0.0, max_value=MAX_SOFT_WEIGHT)
        field(st.slider, "Weight of the probabilities", key="guides_soft_weight", **weight)


def _numbers(
    given: Any, change: Callable[..., None], attribute: str, labels: Mapping[str, str], **look: Any
) -> None:
    """Draw numbers of a shape, side by side if there are two."""

    def write(**changes: Any) -> None:
        change(**{attribute: replace(given, **changes)})

    places = pair() if len(labels) > 1 else [st.container()]
    for place, (name, label) in zip(places, labels.items(), strict=True):
        number = bound_to(given, name, write, **look)
        field(place.number_input, label, key=f"guides_{attribute}_{name}", **number)


def _active(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    shapes = {"none": None, "inside an outline": frame(state.choices.grid)}
    _choice("Active cells", guides.active, shapes, change, "active")
    tip = "A grid with 0 or no value in inactive cells, or polygons in GeoJSON."
    take = {"take": lambda upload: change(active=upload), "help": tip}
    file_uploader("or a mask", key="guides_mask_file", **take)


def frame(grid: Grid, first: float = 0.1, last: float = 0.9) -> Corners:
    """Return the corners of a rectangle in a grid, between two shares of the way to the east."""
    ends = (grid.axes[0], (first, last)), (grid.axes[1], (0.1, 0.9))
    (west, east), (south, north) = (np.quantile(k, q).round(6).tolist() for k, q in ends)
    return (west, south), (east, south), (east, north), (west, north)


def _auxiliary(guides: GuideChoice, change: Callable[..., None]) -> None:
    given = guides.auxiliary
    image, grid = given if isinstance(given, tuple) else (None, None)
    shapes = {"none": None, "position along a direction": Directions()}
    _choice("Auxiliary variable", given, shapes, change, "auxiliary")
    if isinstance(given, Directions):
        labels = {of: f"Azimuth, {of}" for of in ("image", "grid")}
        _numbers(given, change, "auxiliary", labels, **AZIMUTH)
    takes = {
        "image": lambda upload: change(auxiliary=(upload, grid)),
        "grid": lambda upload: change(auxiliary=(image, upload)),
    }
    for of, take in takes.items():
        tip = f"A grid of one variable with the cells of the {of}."
        file_uploader(f"or a map for the {of}", key=f"guides_{of}_file", take=take, help=tip)
    if given is not None:
        weight = bound_to(guides, "auxiliary_weight", change, min_value=0.0)
        weight["max_value"] = MAX_AUXILIARY_WEIGHT
        field(st.slider, "Weight of the variable", key="guides_auxiliary_weight", **weight)


def _copies(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    given = guides.angle
    shapes = {"none": None, "one angle": 45.0, "along drawn lines": ()}
    shapes |= {"turning across the grid": Gradient(90.0, 0.0, 90.0)}

    def turn(angle: Any) -> None:
        if not isinstance(angle, tuple):
            change(angle=angle)
            return
        azimuth, _ = main_direction(image_of(state.choices.image))
        change(angle=angle, flow_azimuth=float(round(azimuth)))  # bodies follow the lines at first

    _choice("Turned image", given, shapes, turn, "angle")
    if isinstance(given, float):
        tip = "Azimuth to which the north of the image is turned, clockwise, in degrees."
        number = bound_to(guides, "angle", change, **AZIMUTH | {"help": tip})
        field(st.number_input, "Angle", key="guides_one_angle", **number)
    elif isinstance(given, Gradient):
        _numbers(given, change, "angle", ENDS, **AZIMUTH)
        _numbers(given, change, "angle", TOWARDS, **AZIMUTH)
    elif isinstance(given, tuple):
        tip = "Direction in the image that follows the lines; at first, that of its bodies."
        number = bound_to(guides, "flow_azimuth", change, **AZIMUTH | {"help": tip})
        field(st.number_input, "Azimuth, image", key="guides_angle_azimuth", **number)

    def take(upload: Upload) -> None:
        lines = read_upload(io.read_lines, upload)
        turn(tuple(_points(k.tolist()) for k in lines) if lines else upload)

    tip = "A grid of azimuths to which the north of the image is turned, or lines in GeoJSON."
    file_uploader("or a map of angles", key="guides_angle_file", take=take, help=tip)
    scale = bound_to(guides, "scale", change, min_value=MIN_SCALE, max_value=MAX_SCALE, step=0.1)
    field(st.number_input, "Scale of the image", key="guides_scale", **scale)
    names = {"": "none", "x": "west–east", "y": "south–north", "xy": "both"}
    mirrored = bound_to(guides, "mirrored", change, help="Further patterns of a small image.")
    mirrored["value"] = guides.mirrored if guides.mirrored in names else "xy"  # z by a link
    field(st.selectbox, "Mirrored copies", key="guides_mirrored", **mirrored, **options_of(names))


def _draw_images(state: State, guides: GuideChoice) -> None:
    """Draw small pictures of the images in use, and say how they are used."""
    image, colours = image_of(state.choices.image), colours_of(state)
    fitted = if_possible(lambda: secondary_of(replace(state.choices, guides=guides)))
    others = fitted.images if fitted else if_possible(lambda: [*map(image_of, guides.images)])
    of_code = dict(zip(image.codes.tolist(), colours, strict=True))
    for k, each in enumerate((image, *others) if others else ()):
        own = [of_code.get(code, ACTIVE) for code in each.codes.tolist()]
        with st.container(horizontal=True, vertical_alignment="center", key=f"guides_image_{k}"):
            st.image(thumbnail(each, own, 2 * THUMB), width=THUMB, alt=f"Image {k}, small")
            step_note(f"{k} {pretty(each.name)}\n{describe_shape(each.shape)}")
            if k and guides.images:
                rest = [other for other in range(len(guides.images)) if other != k - 1]
                button("Remove", key=f"guides_drop_{k}", on_click=_keep, args=(state, rest))
    if fitted and others and not guides.saved:
        step_note(fitted.describe())


def _keep(state: State, kept: Sequence[int], *new: ImageChoice) -> None:
    """Use some of the further images and new ones; images keep their outlines."""
    guides, grid = state.guides_draft or state.choices.guides, state.choices.grid
    images, zones = (*(guides.images[k] for k in kept), *new), guides.zones
    if isinstance(zones, tuple):
        zones = *(zones[k] for k in kept), *(frame(grid, 0.4, 0.6) for _ in new)
    elif isinstance(zones, ZoneLayers):
        above = min(zones.first[-1] + 1, (grid.nz or 1) - 1)
        zones = ZoneLayers((*(zones.first[k] for k in kept), *(above for _ in new)))
    _change(state, images=images, zones=zones if images else None)


def _images(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    """Draw the choice of further images and of their use."""
    grid, given = state.choices.grid, guides.images
    add = partial(_keep, state, range(len(given)))
    if len(given) < MAX_OTHERS:
        volume = grid.nz is not None
        names = datasets.volume_names() if volume else datasets.names()
        options: dict[str, Any] = options_of({name: pretty(name) for name in names})
        options |= {"value": None, "write": lambda name: add(ImageChoice(name))}
        options |= {"placeholder": "add one", "help": "Its facies are matched by name or by code."}
        field(st.selectbox, "Further training image", key="guides_other", **options)
        take: dict[str, Any] = {"take": lambda up: add(image_of_file(up, volume=volume))}
        file_uploader("or an image of yours", key=f"guides_other_file_{len(given)}", **take)
    if not given:
        return
    n = len(given) + 1
    outlines = tuple(frame(grid, (k + 0.1) / n, (k + 0.9) / n) for k in range(1, n))
    shapes = {"all for each patch": None, "a share of patches": 0.5, "inside outlines": outlines}
    if grid.nz is not None:
        shapes["by layer"] = ZoneLayers(tuple(k * grid.nz // n for k in range(1, n)))
    _choice("Use of the images", guides.zones, shapes, change, "zones")
    if isinstance(guides.zones, float):
        share = bound_to(guides, "zones", change, min_value=0.0, max_value=1.0, step=0.05)
        field(st.slider, "Share of further images", key="guides_share", **share)
    if isinstance(guides.zones, ZoneLayers):
        _zone_layers(guides.zones, grid.nz or 1, change)
    tip = "A grid with 0 for the training image, 1 for the next image …; or polygons in GeoJSON."
    take = {"take": lambda upload: change(zones=upload), "help": tip}
    file_uploader("or a grid of zones", key="guides_zones_file", **take)


def _zone_layers(zones: ZoneLayers, nz: int, change: Callable[..., None]) -> None:
    """Draw the number of the first layer of each further image."""

    def write(k: int, layer: float) -> None:
        change(zones=ZoneLayers((*zones.first[:k], int(layer), *zones.first[k + 1 :])))

    for k, first in enumerate(zones.first):
        layer: dict[str, Any] = {"value": first, "min_value": 0, "max_value": max(nz - 1, first)}
        layer["help"] = "Layer 0 is the bottom layer. The image is used up to the next zone."
        layer |= {"key": f"guides_layer_{k}", "write": partial(write, k)}
        field(st.number_input, f"Image {k + 1} from layer", **layer)


def _draw_board(state: State, guides: GuideChoice) -> None:
    """Draw the first map of the guides with the tools to draw on it, and notes on the guides."""
    choices, image = state.choices, image_of(state.choices.image)
    study = None if problem_in(lambda: study_of(choices)) else study_of(choices)
    secondary = study.secondary if study else None
    soft, corners = guides.probabilities, guides.active
    zones = guides.zones if isinstance(guides.zones, tuple) else ()
    outlines = {f"zone{k}": outline for k, outline in enumerate(zones, 1)}
    tools: dict[str, Any] = {
        "strokes": isinstance(soft, tuple) and [(*astuple(s)[:3], s.points) for s in soft],
        "flow": isinstance(guides.angle, tuple) and guides.angle,
        "outlines": outlines | ({"outline": corners} if isinstance(corners, tuple) else {}),
    }
    ground = _ground(secondary, image, min(guides.facies, image.n_facies - 1), choices.grid)
    options: dict[str, Any] = {"grid": choices.grid, "name": "guides", "max_height": MAX_HEIGHT}

    def take(drawn: Mapping[str, Any]) -> None:
        take_drawing(state, drawn)
        start_run_if_needed(state, live=True)

    azimuth = guides.flow_azimuth if isinstance(guides.angle, tuple) else 0.0
    tools["arrows"] = _arrows(secondary, azimuth, choices.grid)
    content = map_content(ground, **options) | tools | {"axes": False}
    draw_component("guides", "guide_board", content, "drawn", take)
    if study is None or secondary is None:  # without a weight, nothing guides
        return
    notes = _warnings(secondary, image, choices.parameters)
    if tools["arrows"]:
        notes = [f"arrows show where azimuth {azimuth:g}° of the image points", *notes]
    if n_left := study.inactive_data.n:
        notes = [f"{n_left} hard data are in inactive cells and are left out", *notes]
    for note in notes:
        st.caption(plain(f"{note[:1].upper()}{note[1:]}."))


def _arrows(secondary: Secondary | None, azimuth: float, grid: Grid) -> dict[str, Any] | None:
    """Return arrows (x, y, azimuth) for the canvas, and the distance between them in cells."""
    if secondary is None or secondary.angle is None:
        return None
    ways = middle_layer(np.broadcast_to(secondary.angle + azimuth, grid.shape))
    every = max(max(ways.shape) // N_ARROWS, 1)
    some = slice(every // 2, None, every)
    x, y = (k[some] for k in grid.axes[:2])
    each = np.stack([*np.meshgrid(x, y), ways[some, some] % 360], axis=-1)
    return {"every": every, "at": each.reshape(-1, 3).tolist()}


def take_drawing(state: State, drawn: Mapping[str, Any]) -> None:
    """Take strokes (value, radius, softness, points), lines and outlines, false if not drawn."""
    guides, shapes = state.guides_draft or state.choices.guides, dict[str, Any]()
    outlines = {name: _points(own) for name, own in drawn["outlines"].items()}
    if "outline" in outlines:
        shapes["active"] = outlines.pop("outline")
    if outlines and isinstance(guides.zones, tuple):
        shapes["zones"] = tuple(outlines[name] for name in sorted(outlines))
    if (strokes := drawn["strokes"]) is not False:
        shapes["probabilities"] = tuple(Stroke(v, r, s, _points(line)) for v, r, s, line in strokes)
    if (lines := drawn["flow"]) is not False and isinstance(guides.angle, tuple):
        shapes["angle"] = tuple(map(_points, lines))
    _change(state, **shapes)


def _points(given: Sequence[Sequence[float]]) -> Corners:
    return tuple((float(x), float(y)) for x, y in given[:MAX_CORNERS])


def _ground(secondary: Secondary | None, image: TrainingImage, facies: int, grid: Grid) -> CellMap:
    """Return the first map of secondary information; of a volume, the middle layer."""
    active = None if secondary is None else secondary.active
    active = np.ones(grid.shape, bool) if active is None else active
    if secondary is not None and secondary.probabilities is not None:
        values, name = secondary.probabilities[facies], f"P({image.facies_names[facies]}) ="
    elif secondary is not None and secondary.zones is not None:
        names = [pretty(each.name) for each in (image, *secondary.images)]
        shades = ramp(ENTROPY, len(names) + 1)[:-1]
        shown = middle_layer(np.where(active, secondary.zones, np.uint8(UNKNOWN)))
        keys = list(zip(names, shades, strict=True))
        return CellMap(shown, shades, names, "Guides: zones of the images", keys=keys)
    elif secondary is not None and secondary.auxiliary:
        values, name = secondary.auxiliary[0].grid, "variable, scaled to 1:"
        values = (values - values.min()) / max(values.max() - values.min(), 1e-300)
    else:
        shown = np.where(active, np.uint8(0), np.uint8(UNKNOWN))
        return CellMap(middle_layer(shown), [ACTIVE], ["active"], "Active cells")
    shown = middle_layer(np.where(active, values, np.nan))
    return share_map(shown, name, f"Guides: {name.removesuffix(' =')}")
