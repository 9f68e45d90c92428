"""The step Guides: probabilities, active cells, variables, angles and further images."""

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
    """Draw the secondary information of the study in an expander, closed if there is none."""
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
        button(
            "Keep the guides as they were",
            key="guides_keep",
            on_click=setattr,
            args=(state, "guides_draft", None),
        )


def _choice(
    label: str, guide: Any, defaults: Mapping[str, Any], change: Callable[..., None], attribute: str
) -> None:
    """Draw the choice between None, other `defaults` of a guide by name, and uploaded files."""
    chosen = next((name for name, offered in defaults.items() if type(offered) is type(guide)), "")
    if files := GuideChoice(**{attribute: guide}).files:
        chosen = f"file {' and '.join(file.name for file in files)}"

    def write(name: str) -> None:
        change(**{attribute: defaults.get(name)})

    options = options_of({name: name for name in (*defaults, chosen)})
    field(st.selectbox, label, key=f"guides_{attribute}", value=chosen, write=write, **options)


def _probabilities(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    image, probabilities = image_of(state.choices.image), guides.probabilities
    defaults = {"none": None, "a gradient": Gradient(), "drawn on the map": ()}
    _choice("Probabilities of facies", probabilities, defaults, change, "probabilities")
    if probabilities is not None:
        field(
            st.selectbox,
            "Facies",
            key="guides_facies",
            value=min(guides.facies, image.n_facies - 1),
            write=lambda facies: change(facies=facies),
            **options_of(dict(enumerate(image.facies_names))),
        )
    if isinstance(probabilities, Gradient):
        _numbers(
            probabilities,
            change,
            "probabilities",
            ENDS,
            min_value=0.0,
            max_value=1.0,
            step=0.05,
        )
        _numbers(probabilities, change, "probabilities", TOWARDS, **AZIMUTH)
    tip = "Any grid, with variables named P_facies; for a volume also a table with z and P_facies."
    file_uploader(
        "or a map of probabilities",
        key="guides_soft_file",
        take=lambda upload: change(probabilities=upload),
        help=tip,
    )
    if probabilities is not None:
        field(
            st.slider,
            "Weight of the probabilities",
            key="guides_soft_weight",
            **bound_to(guides, "soft_weight", change, min_value=0.0, max_value=MAX_SOFT_WEIGHT),
        )


def _numbers(
    guide: Any, change: Callable[..., None], attribute: str, labels: Mapping[str, str], **look: Any
) -> None:
    """Draw number fields of a guide, side by side if there are two."""

    def write(**changes: Any) -> None:
        change(**{attribute: replace(guide, **changes)})

    places = pair() if len(labels) > 1 else [st.container()]
    for place, (name, label) in zip(places, labels.items(), strict=True):
        number = bound_to(guide, name, write, **look)
        field(place.number_input, label, key=f"guides_{attribute}_{name}", **number)


def _active(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    defaults = {"none": None, "inside an outline": frame(state.choices.grid)}
    _choice("Active cells", guides.active, defaults, change, "active")
    tip = "A grid with 0 or no value in inactive cells, or polygons in GeoJSON."
    file_uploader(
        "or a mask", key="guides_mask_file", take=lambda upload: change(active=upload), help=tip
    )


def frame(grid: Grid, first: float = 0.1, last: float = 0.9) -> Corners:
    """Return the corners of a rectangle in a grid; `first` and `last` are shares of its width."""
    x, y, *_ = grid.axes
    west, east = np.quantile(x, (first, last)).round(6).tolist()
    south, north = np.quantile(y, (0.1, 0.9)).round(6).tolist()
    return (west, south), (east, south), (east, north), (west, north)


def _auxiliary(guides: GuideChoice, change: Callable[..., None]) -> None:
    auxiliary = guides.auxiliary
    image, grid = auxiliary if isinstance(auxiliary, tuple) else (None, None)
    defaults = {"none": None, "position along a direction": Directions()}
    _choice("Auxiliary variable", auxiliary, defaults, change, "auxiliary")
    if isinstance(auxiliary, Directions):
        labels = {name: f"Azimuth, {name}" for name in ("image", "grid")}
        _numbers(auxiliary, change, "auxiliary", labels, **AZIMUTH)
    takes = {
        "image": lambda upload: change(auxiliary=(upload, grid)),
        "grid": lambda upload: change(auxiliary=(image, upload)),
    }
    for name, take in takes.items():
        tip = f"A grid of one variable with the cells of the {name}."
        file_uploader(f"or a map for the {name}", key=f"guides_{name}_file", take=take, help=tip)
    if auxiliary is not None:
        limits = {"min_value": 0.0, "max_value": MAX_AUXILIARY_WEIGHT}
        field(
            st.slider,
            "Weight of the variable",
            key="guides_auxiliary_weight",
            **bound_to(guides, "auxiliary_weight", change, **limits),
        )


def _copies(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    angle_choice = guides.angle
    defaults = {"none": None, "one angle": 45.0, "along drawn lines": ()}
    defaults |= {"turning across the grid": Gradient(90.0, 0.0, 90.0)}

    def turn(angle: Any) -> None:
        if not isinstance(angle, tuple):
            change(angle=angle)
            return
        azimuth, _ = main_direction(image_of(state.choices.image))
        change(
            angle=angle, flow_azimuth=float(round(azimuth))
        )  # geobodies follow the lines at first

    _choice("Turned image", angle_choice, defaults, turn, "angle")
    if isinstance(angle_choice, float):
        tip = "Azimuth to which the north of the image is turned, clockwise, in degrees."
        angle = bound_to(guides, "angle", change, **AZIMUTH | {"help": tip})
        field(st.number_input, "Angle", key="guides_one_angle", **angle)
    elif isinstance(angle_choice, Gradient):
        _numbers(angle_choice, change, "angle", ENDS, **AZIMUTH)
        _numbers(angle_choice, change, "angle", TOWARDS, **AZIMUTH)
    elif isinstance(angle_choice, tuple):
        tip = "Direction in the image that follows the lines; at first, the direction of geobodies."
        azimuth = bound_to(guides, "flow_azimuth", change, **AZIMUTH | {"help": tip})
        field(st.number_input, "Azimuth, image", key="guides_angle_azimuth", **azimuth)

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
    """Draw small pictures of the images in use, and describe their use."""
    image, colours = image_of(state.choices.image), colours_of(state)
    fitted = if_possible(lambda: secondary_of(replace(state.choices, guides=guides)))
    further = fitted.images if fitted else if_possible(lambda: [*map(image_of, guides.images)])
    colour_of = dict(zip(image.codes.tolist(), colours, strict=True))
    for k, used in enumerate((image, *further) if further else ()):
        palette = [colour_of.get(code, ACTIVE) for code in used.codes.tolist()]
        with st.container(horizontal=True, vertical_alignment="center", key=f"guides_image_{k}"):
            st.image(thumbnail(used, palette, 2 * THUMB), width=THUMB, alt=f"Image {k}, small")
            step_note(f"{k} {pretty(used.name)}\n{describe_shape(used.shape)}")
            if k and guides.images:
                kept = [index for index in range(len(guides.images)) if index != k - 1]
                button("Remove", key=f"guides_drop_{k}", on_click=_keep, args=(state, kept))
    if fitted and further and not guides.saved:
        step_note(fitted.describe())


def _keep(state: State, kept: Sequence[int], *new: ImageChoice) -> None:
    """Use the further images `kept` and new images; the kept images keep their zones."""
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
    grid, images = state.choices.grid, guides.images
    add = partial(_keep, state, range(len(images)))
    if len(images) < MAX_OTHERS:
        volume = grid.nz is not None
        names = datasets.volume_names() if volume else datasets.names()
        field(
            st.selectbox,
            "Further training image",
            key="guides_other",
            value=None,
            write=lambda name: add(ImageChoice(name)),
            placeholder="add one",
            help="Its facies are matched by name or by code.",
            **options_of({name: pretty(name) for name in names}),
        )
        file_uploader(
            "or an image of yours",
            key=f"guides_other_file_{len(images)}",
            take=lambda upload: add(image_of_file(upload, volume=volume)),
        )
    if not images:
        return
    n = len(images) + 1
    outlines = tuple(frame(grid, (k + 0.1) / n, (k + 0.9) / n) for k in range(1, n))
    defaults = {"all for each patch": None, "a share of patches": 0.5, "inside outlines": outlines}
    if grid.nz is not None:
        defaults["by layer"] = ZoneLayers(tuple(k * grid.nz // n for k in range(1, n)))
    _choice("Use of the images", guides.zones, defaults, change, "zones")
    if isinstance(guides.zones, float):
        field(
            st.slider,
            "Share of further images",
            key="guides_share",
            **bound_to(guides, "zones", change, min_value=0.0, max_value=1.0, step=0.05),
        )
    if isinstance(guides.zones, ZoneLayers):
        _zone_layers(guides.zones, grid.nz or 1, change)
    tip = "A grid with 0 for the training image, 1 for the next image …; or polygons in GeoJSON."
    file_uploader(
        "or a grid of zones",
        key="guides_zones_file",
        take=lambda upload: change(zones=upload),
        help=tip,
    )


def _zone_layers(zones: ZoneLayers, nz: int, change: Callable[..., None]) -> None:
    """Draw the number of the first layer of each further image."""

    def write(k: int, layer: float) -> None:
        change(zones=ZoneLayers((*zones.first[:k], int(layer), *zones.first[k + 1 :])))

    for k, first in enumerate(zones.first):
        field(
            st.number_input,
            f"Image {k + 1} from layer",
            key=f"guides_layer_{k}",
            value=first,
            write=partial(write, k),
            min_value=0,
            max_value=max(nz - 1, first),
            help="Layer 0 is the bottom layer. The image is used up to the next zone.",
        )


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

    def take(drawn: Mapping[str, Any]) -> None:
        take_drawing(state, drawn)
        start_run_if_needed(state, live=True)

    azimuth = guides.flow_azimuth if isinstance(guides.angle, tuple) else 0.0
    tools["arrows"] = _arrows(secondary, azimuth, choices.grid)
    content = map_content(ground, grid=choices.grid, name="guides", max_height=MAX_HEIGHT)
    content |= tools | {"axes": False}
    draw_component("guides", "guide_board", content, "drawn", take)
    if study is None or secondary is None:  # a guide without weight is no guide
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
    azimuths = middle_layer(np.broadcast_to(secondary.angle + azimuth, grid.shape))
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
    _change(state, **changes)


def _points(line: Sequence[Sequence[float]]) -> Corners:
    return tuple((float(x), float(y)) for x, y in line[:MAX_CORNERS])


def _ground(secondary: Secondary | None, image: TrainingImage, facies: int, grid: Grid) -> CellMap:
    """Return the first map of secondary information or, for a volume, the map's middle layer."""
    active = None if secondary is None else secondary.active
    active = np.ones(grid.shape, bool) if active is None else active
    if secondary is not None and secondary.probabilities is not None:
        values, name = secondary.probabilities[facies], f"P({image.facies_names[facies]}) ="
    elif secondary is not None and secondary.zones is not None:
        names = [pretty(used.name) for used in (image, *secondary.images)]
        shades = ramp(ENTROPY, len(names) + 1)[:-1]
        indices = middle_layer(np.where(active, secondary.zones, np.uint8(UNKNOWN)))
        keys = list(zip(names, shades, strict=True))
        return CellMap(indices, shades, names, "Guides: zones of the images", keys=keys)
    elif secondary is not None and secondary.auxiliary:
        values, name = secondary.auxiliary[0].grid, "variable, scaled to 1:"
        values = (values - values.min()) / max(values.max() - values.min(), 1e-300)
    else:
        indices = middle_layer(np.where(active, np.uint8(0), np.uint8(UNKNOWN)))
        return CellMap(indices, [ACTIVE], ["active"], "Active cells")
    shares = middle_layer(np.where(active, values, np.nan))
    return share_map(shares, name, f"Guides: {name.removesuffix(' =')}")
