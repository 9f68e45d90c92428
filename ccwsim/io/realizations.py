"""Write realizations to files and downloads, and read them from files."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from io import BytesIO
from typing import Any

import numpy as np

from ccwsim import Ensemble, Grid, HardData, Parameters, Secondary, TrainingImage
from ccwsim.io.atomic import check_format, format_of, write_bytes
from ccwsim.io.data_file import DataFile, printable
from ccwsim.io.formats.grdecl import geometry_as_bytes, regions_as_bytes
from ccwsim.io.formats.labelled import realizations_as_netcdf
from ccwsim.io.formats.numpy_files import npz_arrays, one_value, place_arrays, read_npy
from ccwsim.io.formats.pictures import SHEET_GAP, PictureFile, picture_as_bytes, sheet_layout
from ccwsim.io.formats.rasters import geotiff_as_bytes
from ccwsim.io.maps import maps_as_bytes
from ccwsim.io.opening import PathOrFile, kind_of, open_content, read_bytes
from ccwsim.io.secondary import KINDS_OF_ARRAYS, arrays_of_secondary, secondary_of_arrays
from ccwsim.model import (
    UNKNOWN,
    Array,
    ArrayLike,
    Bytes,
    CCWSIMError,
    Study,
    arrays,
    match_facies,
    refused,
    shown,
)

REALIZATION_FORMATS = ("npz", "gslib", "sgems", "dat", "grdecl", "png", "vti", "tif", "nc")
"""Formats of realizations, named by file ending."""


def write_realizations(
    path_or_file: PathOrFile,
    ensemble: Ensemble,
    *,
    format: str | None = None,
    colours: Sequence[str] | None = None,
) -> None:
    """Write realizations to a file in one of `REALIZATION_FORMATS`.

    Examples
    --------
    >>> e = read_realizations(BytesIO(b"2 2 1\\n1\\nrealization_1\\n0\\n1\\n1\\n1\\n"))
    >>> file = BytesIO()
    >>> write_realizations(file, e, format="sgems")
    >>> file.getvalue()
    b'2 2 1\\n1\\nrealization_1\\n0\\n1\\n1\\n1\\n'
    """
    kind = format_of(path_or_file, format, REALIZATION_FORMATS)
    write_bytes(path_or_file, realizations_as_bytes(ensemble, kind, colours=colours))


def realizations_as_bytes(
    ensemble: Ensemble, format: str, *, colours: Sequence[str] | None = None
) -> bytes:
    """Return the file content that `write_realizations` writes, for a download.

    `npz` contains `realizations` (n, ny, nx) or (n, nz, ny, nx) as facies codes, and everything
    that `read_realizations` needs to restore the ensemble: `training_image`, `image_name`,
    `codes`, `facies_names`, `numbering`, `parameters` (JSON), `seed`, `hard_cells`, `hard_facies`,
    `met_by`, `numbers`, `revised`, `cpu_seconds`, `wall_seconds`, `cell_size`, `origin`, `crs`, and
    secondary information. Inactive cells have −9999 in text files and NaN in others.
    `gslib`, `sgems` and `dat` have one column per realization, with cells from the south-west (x
    fastest); line 1 has cell size and origin. `grdecl` has the geometry and region keywords FIP1, …
    that count from 1, with the codes in comments. `vti` has an array per realization, and `tif` a
    band of bytes per realization, north up, with names of facies as tags, and a colour table for
    one realization (needs rasterio). `nc` is `Ensemble.to_xarray` as a file (needs xarray). `png`
    is one map or a contact sheet, north up. `tif` and `png` cannot contain volumes.

    Realizations of a continuous variable are written as values, with all digits; `npz` has them in
    `values`, and `image_values`, `hard_values`, `variable` and `units`. `grdecl` and `png` are
    refused.

    Raises `CCWSIMError` for no realizations, or too many for a PNG.
    """
    kind = format_of(None, format, REALIZATION_FORMATS)
    if not ensemble.n:
        raise CCWSIMError("there are no realizations to write; simulate some first")
    check_format(kind, ensemble.shape, bool(ensemble.values))
    if kind == "npz":
        return _ensemble_npz(ensemble)
    if kind == "png":
        n_facies = ensemble.training_image.n_facies
        return picture_as_bytes(_sheet(ensemble.indices, n_facies), n_facies, colours)
    if kind == "nc":
        return realizations_as_netcdf(ensemble.to_xarray())
    if kind == "grdecl":
        regions = {f"FIP{k + 1}": one for k, one in enumerate(ensemble.indices)}
        geometry = geometry_as_bytes(ensemble.grid, ensemble.active)
        return geometry + regions_as_bytes(regions, ensemble.training_image)
    name, stack = next(iter(ensemble.values.items()), ("realization", ensemble))
    maps = {f"{name}_{k + 1}": one for k, one in enumerate(stack)}
    if kind == "tif" and ensemble.values:
        return geotiff_as_bytes(maps, ensemble.grid, kind="float64")
    if kind == "tif":
        names = ensemble.training_image.names_by_code
        return geotiff_as_bytes(maps, ensemble.grid, names, colours)
    return maps_as_bytes(maps, ensemble.grid, kind, decimals=None)


KINDS_OF_VALUES = {"image_values": "f", "hard_values": "f", "variable": "U", "units": "U"}
"""NumPy kinds of the arrays of `arrays_of_values`, by name."""
_MEMBERS = {
    **dict.fromkeys(("realizations", "codes", "training_image"), "buif"),
    **dict.fromkeys(("image_name", "facies_names", "numbering", "parameters", "crs"), "U"),
    **dict.fromkeys(("seed", "hard_cells", "hard_facies", "numbers"), "ui"),
    **dict.fromkeys(("cpu_seconds", "wall_seconds", "cell_size", "origin"), "f"),
    **{"met_by": "i", "revised": "b", "values": "f"},
    **KINDS_OF_VALUES,
    **KINDS_OF_ARRAYS,
}
"""The members of an npz of realizations, and the NumPy kinds allowed for each."""


def read_realizations(
    path_or_file: PathOrFile, training_image: TrainingImage | ArrayLike | None = None
) -> Ensemble:
    """Return the realizations of a file.

    A warning names facies that are matched by number although the training image has no codes of
    its own. Raises `CCWSIMError` if the file has no realizations, or facies that the image lacks.

    The file is an npz written by `write_realizations`; a GSLIB or SGeMS grid, GRDECL, VTK
    ImageData, GeoTIFF or NetCDF with one realization per variable; or an npy array, as written by
    `simulate(out=...)`, of shape (n, ny, nx) or (n, nz, ny, nx). Unknown times are NaN.

    Ensembles from grids and npy have default parameters, the seed 0 and no hard data; `revised` is
    true, because the seed cannot reproduce the realizations. Without the training image of the
    simulation, theirs has one cell per facies code; its proportions and patterns are meaningless.
    If the image is a volume, an npy array of three dimensions is one realization.

    Examples
    --------
    >>> e = read_realizations(BytesIO(b"2 1 1 10 10 1 500 0 0\\n2\\na\\nb\\n0 7\\n7 7\\n"))
    >>> e.realizations.tolist(), e.grid.origin
    ([[[0, 7]], [[7, 7]]], (500.0, 0.0))
    """
    content, name = read_bytes(path_or_file)
    image = None if training_image is None else TrainingImage.of(training_image)
    try:
        if kind_of(content) == "npz":
            return _of_npz(npz_arrays(content, name, _MEMBERS), image)
        if kind_of(content) == "npy":
            return _of_grids(read_npy(content, name, stacked=True), image)
        return _of_grids(open_content(content, name), image)
    except CCWSIMError as error:
        message = str(error)
        raise CCWSIMError(message if message.startswith(name) else f"{name}: {message}") from error


def _of_npz(members: Mapping[str, Array], image: TrainingImage | None) -> Ensemble:
    stack = members.get("realizations", np.empty(0))
    if stack.ndim not in (3, 4) or not stack.size:
        raise refused("no_realizations")
    n, *shape = stack.shape
    numbering = "codes"
    if "training_image" in members:
        names = members.get("facies_names")
        if names is not None and names.ndim != 1:
            raise CCWSIMError("facies_names must be a list; save it again")
        names = None if names is None else [printable(name) for name in names.tolist()]
        label = printable(str(one_value(members, "image_name", "")))
        saved_image = TrainingImage(
            members["training_image"],
            name=label,
            facies_names=names,
            numbering=printable(str(one_value(members, "numbering", "codes"))),
            **values_of_image(members),
        )
        image, numbering = image or saved_image, saved_image.numbering_of_data
    if image is None and "codes" in members:
        image = _stand_in(members["codes"], len(shape))
    place = {key: members[key].tolist() for key in ("cell_size", "origin") if key in members}
    place["crs"] = str(one_value(members, "crs", ""))
    hard_data = data_of_arrays(members)
    ensemble = _ensemble(stack, replace(Grid.of(shape), **place), image, numbering)
    hard_data.check(ensemble.grid, ensemble.training_image)
    study = replace(
        ensemble.study,
        hard_data=hard_data,
        parameters=parameters_from_json(str(one_value(members, "parameters", "{}"))),
        seed=arrays.check_int("seed", one_value(members, "seed", 0), 0),
        secondary=secondary_of_arrays(members, ensemble.grid, ensemble.training_image),
    )
    return replace(
        ensemble,
        study=study,
        cpu_seconds=_of_shape(members, "cpu_seconds", ensemble.cpu_seconds),
        wall_seconds=float(one_value(members, "wall_seconds", np.nan)),
        data_status=_of_shape(members, "met_by", np.zeros((n, hard_data.n), np.int16)),
        numbers=_of_shape(members, "numbers", ensemble.numbers),
        revised=bool(one_value(members, "revised", "seed" not in members)),
        values=dict.fromkeys(
            values_of_image(members).get("values", ()),
            _of_shape(members, "values", np.zeros(stack.shape)),
        ),
    )


def _of_grids(file: DataFile | PictureFile, image: TrainingImage | None) -> Ensemble:
    if isinstance(file, PictureFile) or file.is_table:
        raise refused("not_a_file_of_realizations")
    layers = list(file.variables.values())
    if file.kind == "NumPy array" and not (image and image.n_dimensions == layers[0].ndim == 3):
        layers = list(layers[0])
    elif not (image and image.n_dimensions == 3) and all(len(grid) == 1 for grid in layers):
        layers = [grid[0] for grid in layers]
    if len({layer.shape for layer in layers}) > 1:
        raise CCWSIMError("variables differ in size; realizations must have equal sizes")
    continuous = image if image and image.values else None
    codes = () if image is None or continuous else image.codes  # −99 may be a facies
    valid_masks = [file.known(layer) | np.isin(layer, codes) for layer in layers]
    maps = [
        layer if valid.all() else np.where(valid, layer, np.nan)
        for valid, layer in zip(valid_masks, layers, strict=True)
    ]
    stack = np.stack(maps)[..., :: 1 if file.south_first else -1, :]
    grid = file.geometry.grid(stack.shape[1:])
    if continuous is None:
        return _ensemble(stack, grid, image)
    values = stack.astype(np.float64)
    classes = np.where(np.isnan(values), np.nan, continuous.class_indices(values))
    ensemble = _ensemble(classes, grid, image, continuous.numbering_of_data)
    return replace(ensemble, values={continuous.variable: values})


def _ensemble(
    stack: Array, grid: Grid, image: TrainingImage | None, numbering: str = "codes"
) -> Ensemble:
    """Return realizations as an ensemble; cells that are NaN in all realizations are inactive."""
    active = None
    if stack.dtype.kind == "f":
        active = ~np.isnan(stack[0])
        if not active.any() or any((np.isnan(one) == active).any() for one in stack):
            raise refused("facies_missing_in_some")
        active = None if active.all() else active
    active_values = [one if active is None else one[active] for one in stack]
    integers = [arrays.as_integers(one, "realizations") for one in active_values]
    present_codes = {int(code) for one in integers for code in arrays.codes_of(one)}
    image = image or _stand_in(np.array(sorted(present_codes)), grid.n_dimensions)
    if image.n_dimensions != grid.n_dimensions:
        contents, image_contents = ("volumes", "a map") if grid.is_volume else ("maps", "a volume")
        raise CCWSIMError(
            f"the file contains {contents}, but the training image is {image_contents}"
        )
    missing = sorted(present_codes - set(image.codes.tolist()))
    if missing:
        codes = ", ".join(map(str, image.codes))
        raise refused("facies_not_in_image", code=missing[0], codes=codes)
    n = len(stack)
    if active is None:
        whole = np.stack([arrays.smallest_integers(one) for one in integers])
        indices = arrays.LazyStack(whole, image.codes).copy()
    else:
        indices = np.full(stack.shape, UNKNOWN, np.uint8)
        indices[:, active] = np.searchsorted(image.codes, np.stack(integers))
    counts = np.bincount(indices.ravel(), minlength=UNKNOWN)[: image.n_facies]
    codes, shares = image.codes.tolist(), (counts / counts.sum()).tolist()
    match_facies(codes, image, numbering=numbering, shares=shares).warn("realizations")
    secondary = None if active is None else Secondary(active=active).fitted(grid, image)
    return Ensemble(
        study=Study(image, grid, secondary=secondary, checked=False),
        indices=arrays.readonly(indices),
        cpu_seconds=arrays.readonly(np.full(n, np.nan)),
        wall_seconds=np.nan,
        data_status=arrays.readonly(np.zeros((n, 0), np.int16)),
        numbers=arrays.readonly(np.arange(n)),
        revised=True,
    )


def _stand_in(codes: Array, n_dimensions: int) -> TrainingImage:
    """Return an image with one cell per code, as a substitute for an unknown training image."""
    return TrainingImage(codes.reshape([1] * (n_dimensions - 1) + [-1]))


def arrays_of_values(study: Study) -> dict[str, Array]:
    """Return the values of a continuous variable in a study as arrays; none for facies."""
    image = study.training_image
    if not image.values:
        return {}
    return {
        "image_values": image.values[image.variable],
        "hard_values": study.hard_data.values.get(image.variable, np.empty(0)),
        "variable": np.array(image.variable),
        "units": np.array(image.units),
    }


def values_of_image(members: Mapping[str, Array]) -> dict[str, Any]:
    """Return the arguments of a training image in arrays of `arrays_of_values`."""
    if "image_values" not in members:
        return {}
    name, units = (printable(str(one_value(members, key, ""))) for key in ("variable", "units"))
    return {"values": {name: members["image_values"]}, "units": units}


def data_of_arrays(members: Mapping[str, Array]) -> HardData:
    """Return the hard data in arrays."""
    measured = members.get("hard_values", np.empty(0))
    names = values_of_image(members).get("values", ()) if measured.size else ()
    cells, facies = members.get("hard_cells", ()), members.get("hard_facies", ())
    return HardData(cells, facies, values=dict.fromkeys(names, measured))


def _of_shape(members: Mapping[str, Array], key: str, default: Array) -> Array:
    values = members.get(key, default)
    if values.shape != default.shape:
        raise CCWSIMError(f"{key} has shape {values.shape}, not {default.shape}; save it again")
    if default.dtype.kind == "i":
        bounds = np.iinfo(default.dtype)
        low = 0 if key == "numbers" else int(bounds.min)
        values = arrays.as_integers(values, key, low, int(bounds.max) - 1)
    return arrays.readonly(values.astype(default.dtype))


def _ensemble_npz(ensemble: Ensemble) -> bytes:
    content, image = BytesIO(), ensemble.training_image
    np.savez_compressed(
        content,
        allow_pickle=False,
        realizations=ensemble.realizations,
        codes=image.codes,
        training_image=image.array,
        image_name=np.array(image.name),
        facies_names=np.array(image.facies_names),
        numbering=np.array(image.numbering),
        parameters=np.array(parameters_to_json(ensemble.parameters)),
        seed=np.array(ensemble.seed),
        cpu_seconds=ensemble.cpu_seconds,
        wall_seconds=np.array(float(ensemble.wall_seconds)),
        hard_cells=ensemble.hard_data.cells,
        hard_facies=ensemble.hard_data.facies,
        met_by=ensemble.data_status,
        numbers=ensemble.numbers,
        revised=np.array(ensemble.revised),
        **({"values": ensemble.values_of()} if ensemble.values else {}),
        **arrays_of_values(ensemble.study),
        **place_arrays(ensemble.grid),
        **arrays_of_secondary(ensemble.secondary),
    )
    return content.getvalue()


def _sheet(indices: Bytes, white: int) -> Bytes:
    """Return one picture of all maps, north up; the first is at the top left, gaps are white."""
    n, ny, nx = indices.shape
    rows, columns = sheet_layout(n, ny, nx)
    high, wide = ny + SHEET_GAP, nx + SHEET_GAP
    sheet = np.full((rows * high - SHEET_GAP, columns * wide - SHEET_GAP), white, np.uint8)
    for k, one in enumerate(indices):
        row, column = rows - 1 - k // columns, k % columns
        south, west = row * high, column * wide
        sheet[south : south + ny, west : west + nx] = np.minimum(one, white)
    return sheet


MAX_LENGTH = 100_000


def parameters_to_json(parameters: Parameters) -> str:
    """Return parameters as a JSON object of all their names and values.

    Examples
    --------
    >>> parameters_to_json(Parameters(template_size=48))[:23]
    '{"template_size": 48, "'
    """
    return json.dumps(asdict(parameters))


def parameters_from_json(text: str | bytes) -> Parameters:
    """Return the parameters in a JSON object; missing names keep their defaults.

    Raises `CCWSIMError` if the text is not a JSON object or has an unknown name or invalid value.

    Examples
    --------
    >>> parameters_from_json('{"template_size": 48}').template_size
    48
    """
    if len(text) > MAX_LENGTH:
        raise CCWSIMError(f"parameters: {len(text)} characters exceed the limit")
    try:
        values = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CCWSIMError(f"parameters are not JSON ({error}); save them again") from error
    if not isinstance(values, dict):
        raise CCWSIMError('parameters: a JSON object is needed, such as {"template_size": 32}')
    names = [f.name for f in fields(Parameters)]
    unknown = [name for name in values if name not in names]
    if unknown:
        raise refused("unknown_parameter", unknown=shown(unknown[0]), known=", ".join(names))
    return Parameters(**values)
