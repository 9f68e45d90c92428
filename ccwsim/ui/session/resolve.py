"""Conversion of choices to arguments of `simulate`; files are read once and cached by content."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

from ccwsim import (
    Auxiliary,
    CCWSIMError,
    Grid,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
    datasets,
    io,
    simulate,
)
from ccwsim.datasets.sampling import sample_random, values_in_cells
from ccwsim.experiments.timing import typical_seconds
from ccwsim.io.formats.rasters import code_and_wkt
from ccwsim.io.hard_data.placing import CONVERSION_CHOICES, ROW_CHOICES, far_away
from ccwsim.io.isolated import IsolatedFile
from ccwsim.io.limits import limited, upload_limits
from ccwsim.jobs.job import result_in_turn
from ccwsim.jobs.limits import UNASKED_SECONDS, free_bytes, limits_of_environment
from ccwsim.metrics import default_parameters
from ccwsim.model import (
    MAX_GRID_SIDE_OFFERED,
    PER_AXIS,
    Array,
    FaciesMatch,
    Floats,
    Shape,
    Study,
    cells_in_polygon,
    duration,
    fitted,
    format_bytes,
    maps_by_code,
    match_of_image,
    match_of_probabilities,
    recoded_image,
    refused,
)
from ccwsim.run.footprint import demand_of
from ccwsim.sharing.choices import (
    Answers,
    CellsOfWells,
    Choices,
    DataChoice,
    Directions,
    Gradient,
    GuideChoice,
    ImageChoice,
    Stroke,
    Upload,
    WellTables,
    ZoneLayers,
)
from ccwsim.ui.session.cached import CONTENT, cached, kept_with
from ccwsim.ui.widgets import if_possible

Value = TypeVar("Value")
Made = TypeVar("Made", io.PointColumns, io.WellColumns, io.Conversion)
Moved = dict[str, tuple[Any, Any]]
"""Requested and used values of the parameters that are too large for the image, by name."""
VOLUME_ROLES = ("z", "depth_from", "depth_to", "depth", "z_up")
SURVEY_COLUMNS = tuple(name for name in vars(io.WellColumns()) if name.startswith("survey"))
SETTLING = ("on_collision", "on_outside", "on_unknown")
"""Names of the answers that concern volumes, surveys, and data that do not fit, respectively."""
BUT_NAMES = {**CONTENT, TrainingImage: lambda image: image.digest}
"""The functions of `CONTENT`, changed so that names of facies are ignored."""
Names = tuple[tuple[str, ...], tuple[tuple[str, int], ...]]
CHOOSE = "choose which"  # part of messages about an open question
NO_FILE_YET = "yet; choose a file"  # end of messages about a file that is not uploaded yet
GUIDE_BYTES = 40  # bytes per cell of a map of a guide: the map and its copies while it is checked
USUAL_SIDES = range(32, 1001)  # cells along the longer side of a fitted grid that keeps its cells
UNITS = {"metre": "m", "meter": "m", "degree": "°"}
USUAL_VOLUME = 100, 100
"""Default rows and columns of a volume's grid; the number of layers is that of the image."""


def study_of(choices: Choices, checked: bool = True) -> Study:
    """Return the study described by choices; raise `CCWSIMError` if parts do not fit together."""
    return Study(**study_inputs(choices), checked=checked)


def study_inputs(choices: Choices) -> dict[str, Any]:
    """Return the inputs of a study by name; raise `CCWSIMError` if one of them cannot be read."""
    return {
        "training_image": image_of(choices.image),
        "grid": choices.grid,
        "parameters": choices.parameters,
        "hard_data": data_of(choices),
        "seed": choices.seed,
        "secondary": secondary_of(choices),
    }


def secondary_of(choices: Choices) -> Secondary | None:
    """Return the secondary information of a study; raise `CCWSIMError` if it does not fit."""
    if choices.guides.is_empty:
        return None
    return _secondary(choices.guides, choices.grid, image_of(choices.image))


@cached(max_entries=16)
def _secondary(choice: GuideChoice, grid: Grid, image: TrainingImage) -> Secondary:
    _check_memory(choice, grid, image)
    if choice.saved is not None:
        return choice.saved.fitted(grid, image)
    return Secondary(
        active=_active_of(choice, grid),
        probabilities=_probabilities_of(choice, grid, image),
        auxiliary=_auxiliary_of(choice, grid, image),
        soft_weight=choice.soft_weight,
        angle=_angle_of(choice, grid),
        scale=None if choice.scale == 1 else choice.scale,
        mirrored=choice.mirrored,
        images=[_matched_image(other, image, n) for n, other in enumerate(choice.images, 1)],
        facies={code: code for code in image.codes.tolist()},
        **_use_of_images(choice.zones, len(choice.images), grid),
    ).fitted(grid, image)


def _check_memory(choice: GuideChoice, grid: Grid, image: TrainingImage) -> None:
    """Raise `CCWSIMError` if the maps of the guides do not fit into the free memory."""
    guides = choice.active, choice.auxiliary, choice.angle, choice.zones
    n_maps = sum(guide is not None for guide in guides)
    n_maps += 0 if choice.probabilities is None else image.n_facies
    needed, free = GUIDE_BYTES * n_maps * grid.n_cells, free_bytes(limits_of_environment())
    if free is not None and needed > free:
        raise refused(
            "memory_of_guides", needed=format_bytes(needed), free=format_bytes(free), n=n_maps
        )


def _active_of(choice: GuideChoice, grid: Grid) -> Any:
    if not isinstance(choice.active, Upload):
        return choice.active if choice.active is None else np.array(choice.active)
    with opened(choice.active) as file:
        return io.read_active(file, grid, choice.active_codes or None)


def _probabilities_of(choice: GuideChoice, grid: Grid, image: TrainingImage) -> Any:
    if choice.probabilities is None:
        return None
    if choice.probability_files:
        maps, match = maps_of_probabilities(choice, grid, image)
        name = ", ".join(file.name for file in choice.probability_files)
        check_match(match, name)
        if match.likeliest:  # names that the image does not have
            labels = " and ".join(match.likeliest)
            raise CCWSIMError(f"{name}: {CHOOSE} facies of the image {labels} is")
        return maps_by_code(match, maps)
    if image.n_facies == 1:
        raise CCWSIMError("the training image has only one facies; probabilities need two")
    facies = min(choice.facies, image.n_facies - 1)
    if isinstance(choice.probabilities, Gradient):
        p = _ramp(choice.probabilities, grid)
    else:
        strokes: Any = choice.probabilities
        p = drawn_map(strokes, image.proportions[facies], grid)
    return {int(image.codes[facies]): p}  # the other facies share the rest


def maps_of_probabilities(
    choice: GuideChoice, grid: Grid, image: TrainingImage
) -> tuple[dict[Any, Floats], FaciesMatch]:
    """Return the maps in files of probabilities, and the match of their facies with the image's."""
    with ExitStack() as stack:
        files = [stack.enter_context(opened(file)) for file in choice.probability_files]
        maps = io.read_probabilities(files, grid)
    return maps, match_of_probabilities(maps, grid, image, choice.facies_names)


def _matched_image(choice: ImageChoice, image: TrainingImage, number: int) -> TrainingImage:
    """Return a further image with the codes of the training image."""
    further, stated = image_of(choice), choice.facies_names
    check_match(match_of_image(further, image, stated), further.name)
    return recoded_image(further, image, number, stated)


def check_match(match: FaciesMatch | None, name: str) -> None:
    """Raise `CCWSIMError` if the user must match facies of a file with those of the image."""
    if match is not None and match.open_labels:
        raise refused("facies_by_number", name=name, facies=" or ".join(match.open_labels))


def _auxiliary_of(choice: GuideChoice, grid: Grid, image: TrainingImage) -> list[Auxiliary]:
    auxiliary, image_grid = choice.auxiliary, Grid.of(image.shape)
    if auxiliary is None:
        return []
    if isinstance(auxiliary, Directions):
        image_map = position_along(auxiliary.image, image_grid)
        grid_map = position_along(auxiliary.grid, grid)
    else:
        image_map = _auxiliary_map(auxiliary[0], image_grid, "training image")
        grid_map = _auxiliary_map(auxiliary[1], grid, "grid")
    return [Auxiliary(image=image_map, grid=grid_map, weight=choice.auxiliary_weight)]


def _auxiliary_map(upload: Upload | None, grid: Grid, name: str) -> Floats:
    if upload is None:
        raise CCWSIMError(f"there is no auxiliary map of the {name} {NO_FILE_YET}")
    with opened(upload) as file:
        return io.read_values(file, grid)


def _angle_of(choice: GuideChoice, grid: Grid) -> Any:
    angle = choice.angle
    if isinstance(angle, Gradient):
        return _ramp(angle, grid)
    if isinstance(angle, tuple):
        return io.angles_along(angle, grid, choice.flow_azimuth) if angle else None
    if not isinstance(angle, Upload):
        return angle
    with opened(angle) as file:
        return io.read_values(file, grid)


def _use_of_images(zones: Any, n: int, grid: Grid) -> dict[str, Any]:
    """Return zones (later outlines cover earlier outlines) or the weights of n further images."""
    if isinstance(zones, Upload):
        with opened(zones) as file:
            return {"zones": io.read_active(file, grid) * 1}
    if isinstance(zones, float):
        return {"weights": (1 - zones, *(zones / n for _ in range(n)))}
    if isinstance(zones, ZoneLayers):
        if grid.nz is None:
            raise refused("zones_by_layer_of_map")
        layers = np.digitize(np.arange(grid.nz), np.maximum.accumulate(zones.first))
        return {"zones": np.broadcast_to(layers[:, None, None], grid.shape)}
    zone_map = np.zeros(grid.shape, np.uint8)
    for k, corners in enumerate(zones or (), 1):
        zone_map[cells_in_polygon(np.array(corners), grid)] = k
    return {"zones": None if zones is None else zone_map}


def _ramp(gradient: Gradient, grid: Grid) -> Floats:
    return gradient.start + (gradient.end - gradient.start) * position_along(gradient.azimuth, grid)


def position_along(azimuth: float, grid: Grid) -> Floats:
    """Return the position of each cell along an azimuth, from 0 to 1 within the grid."""
    x, y = grid.axes[0], grid.axes[1]
    along = x[None] * np.sin(np.deg2rad(azimuth)) + y[:, None] * np.cos(np.deg2rad(azimuth))
    along = (along - along.min()) / max(along.max() - along.min(), np.finfo(float).tiny)
    return np.broadcast_to(along, grid.shape).copy()


def drawn_map(strokes: Sequence[Stroke], start: float, grid: Grid) -> Floats:
    """Return a map of the number `start`, changed by one stroke after another."""
    x, y = grid.axes[0], grid.axes[1]
    drawn = np.full((len(y), len(x)), float(start))
    for stroke in strokes:
        strength, points = np.zeros_like(drawn), np.array(stroke.points)
        for first, last in zip(points, [*points[1:], points[-1]], strict=True):
            reach = np.sort([first, last], axis=0) + np.array([[-1], [1]]) * stroke.radius
            ends = (np.searchsorted(axis, reach[:, k]) for k, axis in ((1, y), (0, x)))
            rows, columns = (slice(low, high) for low, high in ends)
            dx, dy = x[columns] - first[0], y[rows][:, None] - first[1]
            wx, wy = last - first
            t = np.clip((dx * wx + dy * wy) / max(wx**2 + wy**2, 1e-300), 0, 1)
            inside = 1 - np.hypot(dx - t * wx, dy - t * wy) / stroke.radius
            near = strength[rows, columns]
            np.maximum(near, inside / max(stroke.softness, 1e-9), out=near)
        drawn += np.minimum(strength, 1) * (stroke.value - drawn)
    return np.broadcast_to(drawn, grid.shape).copy()


@kept_with
@cached(max_entries=32)
def image_of(choice: ImageChoice) -> TrainingImage:
    """Return the training image of a choice; raise `CCWSIMError` if a question is open."""
    if choice.upload is None:
        original = datasets.load(choice.bundled)
    else:
        with opened(choice.upload) as file:
            original = io.read_training_image(file, **dict(choice.answers))

    def turned(array: Array) -> Array:
        if choice.transpose:
            array = np.swapaxes(array, -1, -2)
        array = array[..., ::-1] if choice.flip_ew else array
        return array[..., ::-1, :] if choice.flip_ns else array

    names = choice.names if len(choice.names) == original.n_facies else original.facies_names
    return TrainingImage(
        turned(original.array),
        name=original.name,
        facies_names=names,
        numbering=original.numbering,
        values={variable: turned(values) for variable, values in original.values.items()},
        units=original.units,
    )


@contextmanager
def opened(upload: Upload | None) -> Iterator[IsolatedFile]:
    """Yield an upload as a file that another process reads; in the context, upload limits apply."""
    if upload is None:
        raise CCWSIMError(f"there is no file {NO_FILE_YET}")
    limits = upload_limits()
    with limited(limits):
        yield IsolatedFile(upload.content, upload.name, upload.digest, limits)


@cached(max_entries=96)
def read_upload(
    read: Callable[..., Value], upload: Upload | None, *arguments: Any, **options: Any
) -> Value:
    """Return read(file, …) for an uploaded file; equal files and arguments are read once."""
    with opened(upload) as file:
        return read(file, *arguments, **options)


def data_of(choices: Choices) -> HardData:
    """Return the hard data of a study on its grid; raise `CCWSIMError` if data do not fit."""
    return imported_data(choices).hard_data


@kept_with
def imported_data(choices: Choices) -> io.HardDataImport:
    """Return the hard data of a study and a report about their import."""
    choice, grid = choices.data, choices.grid
    if choice.source == "file" and choice.files:
        return _imported(choice, grid, image_of(choices.image))
    parameters = choices.parameters if choice.source == "sampled" else Parameters()
    return _imported_cells(choice, choices.image, grid, parameters)


@cached(max_entries=32, hash_funcs={**CONTENT, DataChoice: vars})
def _imported_cells(
    choice: DataChoice, image_choice: ImageChoice, grid: Grid, parameters: Parameters
) -> io.HardDataImport:
    return _settled(placed_data(Choices(image_choice, choice, grid, parameters)), choice.answers)


def placed_data(choices: Choices) -> io.PlacedPoints:
    """Return the hard data of a study, placed on the grid, with the problems of the data."""
    choice, image, grid = choices.data, image_of(choices.image), choices.grid
    if choice.source == "file" and choice.files:
        return _placed(_without(choice, SETTLING), grid, image)
    return _placed_cells(_cells_of(choices), grid, image, _names(choices), _numbering(choices))


def _numbering(choices: Choices) -> str:
    """Return the numbering of data in cells: that of the image, or of an earlier image."""
    usual = image_of(choices.image).numbering_of_data
    is_placed = choices.data.source == "placed"
    return dict(choices.data.answers).get("numbering", usual) if is_placed else usual


def _names(choices: Choices) -> Names:
    """Return facies names of bundled data by code, and codes for the names that the image lacks.

    Data for the image itself need no names, so the user may rename the facies of the image.
    """
    choice, image_choice = choices.data, choices.image
    bundled, answered = choice.source == "bundled", dict(choice.answers).get("facies_names", ())
    data_image = datasets.hard_data_training_image(choice.bundled) if bundled else ""
    if not data_image or (image_choice.upload is None and image_choice.bundled == data_image):
        return (), answered if _numbering(choices) == "other" else ()
    words = datasets.load(data_image).facies_names
    return words, (*taken_by_code(words, image_of(image_choice)).items(), *answered)


def taken_by_code(words: Sequence[str], image: TrainingImage) -> dict[str, int]:
    """Return codes for names that an image lacks, unless another name denotes the same facies."""
    if image.numbering != "codes":  # numbers of colours are no codes
        return {}
    names = image.codes_by_name
    free = {*image.codes.tolist()} - {names.get(word.casefold()) for word in words}
    missing = {word: code for code, word in enumerate(words) if word.casefold() not in names}
    return {word: code for word, code in missing.items() if code in free}


def facies_by_code(choices: Choices) -> str:
    """Describe which facies of bundled data have another name in the image; "" if none has."""
    image = image_of(choices.image)
    codes = taken_by_code(_names(choices)[0], image).items()
    return ", ".join(f"{word} counts as {image.names_by_code[code]}" for word, code in codes)


def _cells_of(choices: Choices) -> HardData:
    """Return the hard data of a study, in cells, if the data are not from a file."""
    choice = choices.data
    if choice.source == "bundled":
        return datasets.load_hard_data(choice.bundled)
    if choice.source == "sampled":
        n, seed = choice.n_sampled, choice.seed_sampled
        image, shape = image_of(choices.image), choices.grid.shape
        return _sampled(image, shape, choices.parameters, n, seed)
    return choice.placed if choice.source == "placed" and choice.placed else HardData()


@cached(max_entries=32)
def _placed_cells(
    data: HardData, grid: Grid, image: TrainingImage, facies: Names, numbering: str
) -> io.PlacedPoints:
    words, codes = facies
    if not data.n:  # without data, the array of cells has the number of axes of the grid
        data = HardData(np.empty((0, grid.n_dimensions)), ())
    if image.values:
        data.of_image(image)  # raises an error if the data are facies
    points = io.ImportedPoints(
        places=data.cells.astype(float),
        values=data.measured.astype(float),
        lines=np.arange(1, data.n + 1),
        world=False,
        counted="datum",
        name="hard data",
        variable=image.variable or "facies",
        words=words,
        numbering=numbering,
    )
    conversion = io.Conversion(classes=None if image.values else "codes", facies_names=codes)
    return io.place_points(points, grid, image, conversion)


def wells_of(choices: Choices) -> CellsOfWells:
    """Return the named wells of a study, with the cells of each well."""
    if choices.data.source != "file":
        return choices.data.wells
    wells = imported_data(choices).wells
    return tuple((name, tuple(map(tuple, cells.tolist()))) for name, cells in wells.items())


def imported_points(
    choice: DataChoice, grid: Grid | None = None, variable: str = ""
) -> io.ImportedPoints:
    """Return the points in files of hard data; a grid in a file may differ from `grid`."""
    if choice.tables is not None:
        decisions = tuple(answer for answer in choice.answers if answer[0] in ROW_CHOICES)
        return _well_points(choice.tables, choice.upload, _well_columns(choice), decisions, grid)
    shape = None if grid is None else grid.shape
    columns = _columns(choice, shape, variable)
    return read_upload(io.read_points, choice.upload, columns, grid_shape=shape)


def points_in_files(choices: Choices) -> io.ImportedPoints:
    """Return the points in files of hard data; a grid in a file may differ from a study's map."""
    grid = choices.grid
    return imported_points(
        choices.data,
        grid if grid.is_volume else None,  # heights need its layers
        _variable_of(choices),
    )


def _variable_of(choices: Choices) -> str:
    """Return the name of the continuous variable of a study; "" for facies or an unread image."""
    image = if_possible(lambda: image_of(choices.image))
    return "" if image is None else image.variable


def preview_of(choice: DataChoice, choices: Choices) -> io.PointsPreview:
    """Return the columns of a file of hard data for a study, with guessed roles."""
    shape = choices.grid.shape
    columns = _columns(choice, shape, _variable_of(choices))
    return read_upload(io.preview_points, choice.upload, columns, grid_shape=shape)


def previews_of_wells(choice: DataChoice) -> dict[str, io.PointsPreview | CCWSIMError]:
    """Return, for each table of wells, the columns with their guessed roles, or an error."""
    tables = choice.tables or WellTables()
    files = {"collars": tables.collars, "intervals": choice.upload, "surveys": tables.surveys}
    previews: dict[str, io.PointsPreview | CCWSIMError] = {}
    for table, upload in files.items():
        if upload is not None:
            try:
                previews[table] = read_upload(
                    io.preview_wells, upload, table, _well_columns(choice)
                )
            except CCWSIMError as error:
                previews[table] = error
    return previews


def _without(choice: DataChoice, names: tuple[str, ...]) -> DataChoice:
    """Return a choice without the named answers, which have no effect on this choice."""
    answers = tuple(answer for answer in choice.answers if answer[0] not in names)
    return replace(choice, answers=answers)


def _with_answers(kind: type[Made], choice: DataChoice) -> Made:
    """Return an object of type `kind`; answers set the attributes with the same names."""
    return kind(**{name: answer for name, answer in choice.answers if name in vars(kind())})


def _columns(choice: DataChoice, shape: Shape | None, variable: str) -> io.PointColumns:
    is_volume = shape is not None and len(shape) == 3
    asked = choice if is_volume else _without(choice, VOLUME_ROLES)
    return replace(_with_answers(io.PointColumns, asked), variable=variable)


def _well_columns(choice: DataChoice) -> io.WellColumns:
    has_surveys = choice.tables is not None and choice.tables.surveys is not None
    return _with_answers(
        io.WellColumns, choice if has_surveys else _without(choice, SURVEY_COLUMNS)
    )


def _settled(placed: io.PlacedPoints, answers: Answers) -> io.HardDataImport:
    """Return points placed on the grid; the user's answers resolve conflicts."""
    check_match(placed.match, placed.points.name)
    decisions = {name: answer for name, answer in answers if name in CONVERSION_CHOICES}
    return io.resolve_points(placed, io.Conversion(**decisions))


@cached(max_entries=32)
def _well_points(
    tables: WellTables,
    intervals: Upload | None,
    columns: io.WellColumns,
    decisions: Answers,
    grid: Grid | None,
) -> io.ImportedPoints:
    if grid is None or not grid.is_volume:
        raise CCWSIMError(
            "wells in tables need a volume, but the study is a map; choose a training image that "
            "is a volume"
        )
    for table, upload in (("collars", tables.collars), ("intervals", intervals)):
        if upload is None:
            raise CCWSIMError(f"there is no table of {table} {NO_FILE_YET}")
    surveys: Any = nullcontext() if tables.surveys is None else opened(tables.surveys)
    with opened(tables.collars) as collars, opened(intervals) as log, surveys as stations:
        return io.read_well_points(
            collars,
            log,
            grid,
            columns,
            surveys=stations,
            conversion=io.Conversion(**dict(decisions)),
        )


@cached(max_entries=32)
def _placed(choice: DataChoice, grid: Grid, image: TrainingImage) -> io.PlacedPoints:
    conversion = _with_answers(io.Conversion, choice)
    points = imported_points(choice, grid, image.variable)
    return io.place_points(points, grid, image, conversion)


@cached(max_entries=32)
def _imported(choice: DataChoice, grid: Grid, image: TrainingImage) -> io.HardDataImport:
    return _settled(_placed(_without(choice, SETTLING), grid, image), choice.answers)


@cached(max_entries=32, show_spinner="Simulating a reference to sample …", hash_funcs=BUT_NAMES)
def _sampled(
    image: TrainingImage, shape: Shape, parameters: Parameters, n: int, seed: int
) -> HardData:
    """Return data sampled from an unconditional realization, as in section 5.2 of the paper."""
    seconds = typical_seconds(parameters, image.shape, shape, image.n_facies)
    if seconds > UNASKED_SECONDS:
        raise CCWSIMError(
            "sampling data needs a realization without data, which takes about "
            f"{duration(seconds, rough=True)}; choose a smaller grid or a higher level, or "
            "other data"
        )
    demand = demand_of(Study(image, Grid.of(shape), parameters), 1)
    reference = result_in_turn(partial(simulate, image, shape, parameters, seed=seed), demand)
    values = {variable: stack[0] for variable, stack in reference.values.items()}
    return values_in_cells(sample_random(reference.realizations[0], n, seed), values)


def same_realizations(choices: Choices, other: Choices) -> bool:
    """Return whether two choices give the same realizations; names and colours are ignored."""
    try:
        return choices == other or (
            choices.n_realizations == other.n_realizations
            and not study_of(choices).differs_from(study_of(other))
        )
    except CCWSIMError:  # one of the studies cannot be simulated
        return False


def refitted(p: Parameters, image: TrainingImage, moved: Moved) -> tuple[Parameters, Moved]:
    """Return parameters fitted to another image, and the values that were changed to fit.

    Values that were changed for an earlier image (`moved`) are restored, unless the user has
    changed these values since. Default sizes become those of `default_parameters`.
    """
    restored = {n: requested for n, (requested, used) in moved.items() if getattr(p, n) == used}
    wanted = vars(p) | restored
    if all(wanted[name] == getattr(Parameters(), name) for name in PER_AXIS):
        restored |= {name: getattr(default_parameters(image), name) for name in PER_AXIS}
    fitting = fitted(p, image.shape, **restored)
    return fitting, {n: (wanted[n], used) for n, used in vars(fitting).items() if wanted[n] != used}


def fitted_to_image(choices: Choices, image: TrainingImage) -> Choices:
    """Return choices with grid and parameters adapted to another training image."""
    grid = fitted_grid(choices.grid, image.shape)
    return replace(choices, grid=grid, parameters=fitted(choices.parameters, image.shape))


def geometry_of(choice: ImageChoice) -> Grid | None:
    """Return the grid of a training image in world coordinates, or None if it has none."""
    if choice.upload is None or choice.transpose:
        return None
    return read_upload(io.read_geometry, choice.upload, **dict(choice.answers))


def fitted_grid(grid: Grid, shape: Shape) -> Grid:
    """Return `grid` if it has as many axes as the training image; otherwise the default grid."""
    if grid.n_dimensions == len(shape):
        return grid
    ny, nx = USUAL_VOLUME
    return Grid(ny, nx, nz=shape[0]) if len(shape) == 3 else Choices().grid


def grids_for_data(choices: Choices) -> dict[str, Grid]:
    """Return grids that hold all data but distant ones: an enlarged grid and a fitted grid.

    If no datum is outside, the first grid is that of the study. Grids that are too large are left
    out.
    """
    grid, is_file = choices.grid, choices.data.source == "file"
    points = if_possible(
        lambda: points_in_files(choices) if is_file else placed_data(choices).points
    )
    if points is None:
        return {}
    if not points.world:
        fit = partial(io.fit_grid, points, shape=grid.shape)
        own = points.grid if points.grid and points.grid.shape != grid.shape else None
        return _possible({"fit" if own else "enlarge": lambda: own or with_sides(grid, fit())})
    cells = grid.cells_of(*points.places[~far_away(points.places)].T)
    return _possible(
        {
            "enlarge": lambda: grid.enlarged(cells),
            "fit": lambda: _fitted(partial(io.fit_grid, points), grid),
        }
    )


def fitting_grids(choices: Choices, guides: GuideChoice) -> dict[str, Grid]:
    """Return grids that fit wells, an outline, a raster or the image, by these names."""
    grid, outline = choices.grid, guides.active
    further = guides.auxiliary[1:] if isinstance(guides.auxiliary, tuple) else ()
    files = (*guides.probability_files, outline, guides.angle, guides.zones, *further)
    makers = {
        "wells": lambda: grids_for_data(choices).get("fit"),
        "outline": lambda: _grid_around(outline, grid),
        **{f.name: partial(_raster_grid, f, grid) for f in files if isinstance(f, Upload)},
        "image": lambda: grid_of_image(choices.image, grid),
    }
    return {
        name: other
        for name, other in _possible(makers).items()
        if other.n_dimensions == grid.n_dimensions
    }


def grid_of_image(choice: ImageChoice, grid: Grid) -> Grid:
    """Return the grid that an image states; a map without coordinates has `grid` with its shape."""
    sides = grid if grid.nz else Grid.of(image_of(choice).shape)
    return geometry_of(choice) or with_sides(grid, sides)


def with_sides(grid: Grid, other: Grid) -> Grid:
    """Return a grid with the numbers of cells of another grid."""
    return replace(grid, ny=other.ny, nx=other.nx, nz=other.nz)


def described(grid: Grid) -> str:
    """Describe a grid in words, with the unit of its coordinates."""
    name, unit = name_and_unit(grid.crs)
    return grid.describe(unit, name)


@cached(max_entries=32)
def name_and_unit(crs: str) -> tuple[str, str]:
    """Return the code or name of a coordinate system, and its unit; empty if unknown."""
    code, wkt = code_and_wkt(crs) if crs else ("", "")
    names, units = re.findall(r'^\w+\["([^"]+)|^(.+)', code), re.findall(r'UNIT\["([^"]+)', wkt)
    name = "".join(names[0]) if names else ""
    return name, UNITS.get(units[-1], str(units[-1])) if units else ""


def _possible(makers: Mapping[str, Callable[[], Grid | None]]) -> dict[str, Grid]:
    """Return the grids that can be made and are not too large, by name."""
    grids = {name: if_possible(make) for name, make in makers.items()}
    return {name: k for name, k in grids.items() if k and max(k.shape) <= MAX_GRID_SIDE_OFFERED}


def _fitted(fit: Callable[..., Grid], grid: Grid) -> Grid:
    """Return the result of `fit`, with the cell size of `grid` if its sides are usual."""
    same = if_possible(partial(fit, cell_size=grid.cell_size))
    is_usual = same is not None and max(same.shape) in USUAL_SIDES
    return replace(same if same and is_usual else fit(), crs=grid.crs)


def _grid_around(outline: object, grid: Grid) -> Grid:
    """Return a grid around the outline of active cells; raise `CCWSIMError` without an outline."""
    rings: Any = [outline or ()]
    if isinstance(outline, Upload):
        rings = read_upload(io.read_lines, outline, None, "Polygon") or ()
    return _fitted(partial(Grid.fit, [point for ring in rings for point in ring]), grid)


def _raster_grid(file: Upload, grid: Grid) -> Grid | None:
    """Return the grid of a raster, or None for a file without coordinates of cells."""
    name = read_upload(io.inspect, file).variables[0].name
    volume = grid.is_volume
    return read_upload(io.read_geometry, file, variable=name, volume=volume)
