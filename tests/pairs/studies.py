"""Simulate random studies and check the results: `python -m tests.pairs.studies`.

`FEATURES` lists the features that studies can have. `pairs()` returns few rows of features that
contain each pair of features; `random_rows()` returns random rows. With `NUMBA_BOUNDSCHECK=1` in
the environment, kernels check the bounds of their arrays. Every line printed is a fault, followed
by a summary; the exit code is 1 if there are faults.
"""

from __future__ import annotations

import argparse
import io
import itertools
import sys
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numba import config
from numpy.typing import NDArray
from scipy import ndimage

from ccwsim import (
    Auxiliary,
    CCWSIMError,
    Ensemble,
    Grid,
    HardData,
    Parameters,
    Project,
    Secondary,
    TrainingImage,
    concatenate,
    read_project,
    read_realizations,
    revise,
    save_project,
    simulate,
    write_realizations,
)
from ccwsim.model.missing import UNKNOWN
from ccwsim.model.study import Study

Row = Mapping[str, str]
"""The level of each feature of a study, by the name of the feature."""

FEATURES: dict[str, tuple[str, ...]] = {
    "dimension": ("map", "volume"),
    "sides": ("usual", "thin", "one cell"),
    "facies": ("2", "1", "4", "values"),
    "codes": ("indices", "others", "named"),
    "gaps": ("none", "a corner", "scattered"),
    "method": ("ccwsim", "ccsim", "ms-ccsim"),
    "level": ("1", "0", "2"),
    "data": ("none", "few", "dense"),
    "exact_data": ("on", "off"),
    "published_draw": ("off", "on"),
    "template": ("fixed", "varied"),
    "similarity": ("ssd", "correlation"),
    "match_proportions": ("off", "on"),
    "location_weight": ("0", "1"),
    "refine": ("on", "off"),
    "repair_seams": ("on", "off"),
    "random_path": ("on", "off"),
    "cells": ("unit", "world"),
    "active": ("all", "most", "few"),
    "probabilities": ("none", "map", "constant"),
    "images": ("one", "auxiliary", "several", "zones", "weights"),
    "turn": ("none", "angle", "angles", "fan", "scale", "scales", "dip"),
    "mirrored": ("none", "x", "all"),
}
"""Levels of each feature; the first level is the default."""


def is_possible(row: Row) -> bool:
    """Return whether the features of a row, which may be incomplete, can be combined."""
    volume = row.get("dimension") == "volume"
    if row.get("turn") == "dip" and "dimension" in row and not volume:
        return False
    if row.get("facies") == "values":
        refused = {"dimension": ["volume"], "method": ["ms-ccsim"], "exact_data": ["off"]}
        refused |= {"images": ["several", "zones", "weights"], "codes": ["others", "named"]}
        refused |= {"turn": ["dip"]}
        refused |= {"probabilities": ["map", "constant"]}
        return not any(row.get(name) in levels for name, levels in refused.items())
    return not (row.get("facies") == "1" and row.get("probabilities", "none") != "none")


def pairs(seed: int = 0) -> list[dict[str, str]]:
    """Return few rows that contain each possible pair of levels of two features."""
    rng = np.random.default_rng(seed)
    left = {
        ((a, x), (b, y))
        for a, b in itertools.combinations(FEATURES, 2)
        for x, y in itertools.product(FEATURES[a], FEATURES[b])
        if is_possible({a: x, b: y})
    }
    rows = []
    while left:
        row = dict(min(left))
        for name in rng.permutation([name for name in FEATURES if name not in row]).tolist():
            levels = [x for x in FEATURES[name] if is_possible({**row, name: x})]
            gains = [len(_pairs_of({**row, name: x}) & left) for x in levels]
            row[name] = levels[int(np.argmax(gains))]
        left -= _pairs_of(row)
        rows.append({name: row[name] for name in FEATURES})
    return rows


def published_rows() -> list[dict[str, str]]:
    """Return rows with the published variants, which are only for maps without guides."""
    usual = {name: levels[0] for name, levels in FEATURES.items()}
    studies = (
        {"variant": "paper", "data": "few", "level": "2"},
        {"variant": "paper", "data": "dense", "method": "ms-ccsim", "gaps": "a corner"},
        {"variant": "paper", "facies": "4", "active": "most", "method": "ccsim", "sides": "thin"},
        {"variant": "code", "data": "few", "level": "2", "active": "few"},
        {"variant": "code", "data": "dense", "method": "ms-ccsim", "sides": "one cell"},
        {"variant": "code", "facies": "1", "cells": "world", "gaps": "scattered"},
    )
    return [usual | row for row in studies]


def _pairs_of(row: Row) -> set[tuple[tuple[str, str], tuple[str, str]]]:
    levels = [(name, row[name]) for name in FEATURES if name in row]
    return set(itertools.combinations(levels, 2))


def random_rows(first: int, n: int) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield the number and the features of random studies; half of the levels are the default."""
    for number in range(first, first + n):
        rng = np.random.default_rng([7, number])
        row: dict[str, str] = {}
        for name, levels in FEATURES.items():
            possible = [x for x in levels if is_possible({**row, name: x})]
            row[name] = possible[int(rng.integers(len(possible)) * (rng.random() < 0.5))]
        yield number, row


def make_study(row: Row, seed: int) -> Study:
    """Return a small study with the features of a row; `seed` draws sizes and values."""
    rng = np.random.default_rng([5, seed])
    volume = row["dimension"] == "volume"
    grid = Grid.of(_grid_shape(row["sides"], volume, rng))
    if row["cells"] == "world":
        size = tuple(rng.uniform(0.5, 50) * np.array([1, 1.5, 0.1][: len(grid.shape)]))
        origin = tuple(rng.uniform(-1e4, 1e6, len(grid.shape)).tolist())
        grid = Grid(grid.ny, grid.nx, size, origin, grid.nz, crs="EPSG:32632")
    image = _image(row, volume, rng)
    data = _data(row["data"], image, grid, rng)
    given = _guides(row, image, grid, rng)
    secondary = Secondary(**given) if given else None
    return Study(image, grid, _parameters(row, volume, rng), data, seed, secondary)


def _grid_shape(sides: str, volume: bool, rng: np.random.Generator) -> tuple[int, ...]:
    longest = int(rng.integers(20, 40))
    ny, nx = (int(n) for n in rng.integers(12, 40, 2))
    if sides == "one cell":
        return (1, 1, longest) if volume else (1, longest)
    if sides == "thin":
        thin = int(rng.integers(2, 8))
        return (min(thin, 4), ny, nx) if volume else (thin, longest)[:: int(rng.choice([1, -1]))]
    return (int(rng.integers(5, 10)), ny // 2 + 6, nx // 2 + 6) if volume else (ny, nx)


def _blobs(shape: Sequence[int], n: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return a field of integers 0 … n − 1, with bodies of a few cells."""
    sigma = [rng.uniform(0.5, 1), *rng.uniform(1, 4, 2)][-len(shape) :]
    field = ndimage.gaussian_filter(rng.standard_normal(shape), sigma, mode="wrap")
    shares = np.cumsum(rng.dirichlet(np.full(n, 4.0)))[:-1]
    return np.searchsorted(np.quantile(field, shares), field)


def _image(row: Row, volume: bool, rng: np.random.Generator) -> TrainingImage:
    if row["facies"] == "values":
        values = _cells({**row, "gaps": "none"}, np.arange(20), volume, rng)
        values += rng.normal(0, 0.1, values.shape)
        return TrainingImage.from_array(
            np.where(np.isnan(_gaps(row, values, rng)), np.nan, values),
            continuous=True,
            variable="porosity",
            name="image",
        )
    n = int(row["facies"])
    codes = np.arange(n) if row["codes"] == "indices" else np.sort(rng.choice(90, n, False)) - 9
    names = [f"facies {'ABCD'[k]}" for k in range(n)] if row["codes"] == "named" else None
    return TrainingImage(_cells(row, codes, volume, rng), name="image", facies_names=names)


def _cells(
    row: Row, codes: NDArray[np.integer], volume: bool, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the cells of a training image with gaps; each facies occurs."""
    shape = (12, *rng.integers(30, 44, 2)) if volume else tuple(rng.integers(48, 80, 2))
    return _gaps(row, codes[_blobs(shape, len(codes), rng)].astype(float), rng)


def _gaps(row: Row, cells: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the cells of a training image with its gaps."""
    shape = cells.shape
    if row["gaps"] == "a corner":
        cells[..., : shape[-2] // 5, : shape[-1] // 4] = np.nan
    elif row["gaps"] == "scattered":
        cells[(*(rng.integers(n, size=2) for n in shape),)] = np.nan
    return cells


def _data(level: str, image: TrainingImage, grid: Grid, rng: np.random.Generator) -> HardData:
    share = {"none": 0.0, "few": 0.02, "dense": 0.3}[level]
    cells = np.argwhere(rng.random(grid.shape) < share)
    if level != "none" and not len(cells):
        cells = np.zeros((1, len(grid.shape)), int)
    if image.values:
        measured = 10 + 8 * rng.standard_normal(len(cells))  # also beyond those of the image
        return HardData(cells, values={"porosity": measured})
    facies = _blobs(grid.shape, image.n_facies, rng)[tuple(cells.T)]
    if rng.random() < 0.5:  # contradictory data
        facies = rng.integers(image.n_facies, size=len(cells))
    return HardData(cells, image.codes[facies])


def _parameters(row: Row, volume: bool, rng: np.random.Generator) -> Parameters:
    level = int(row["level"])
    template = 2**level * int(rng.integers(2, 4) if level == 2 else rng.integers(4, 6))
    sizes: dict[str, Any] = {"template_size": template, "wavelet_level": level}
    sizes["overlap_size"] = 2**level * max(template // 4 >> level, 1)
    if volume:
        along_z = {"template_size": 4, "overlap_size": 2, "wavelet_level": min(level, 1)}
        sizes = {name: (along_z[name], n, n) for name, n in sizes.items()}
    variant: Any = row.get("variant", "ours")
    switches = ("exact_data", "published_draw", "match_proportions", "refine", "repair_seams")
    return Parameters(
        **sizes,
        method=row["method"],
        similarity=row["similarity"],
        n_candidates=int(rng.choice([1, 5, 20, 200])),
        search_fraction=float(rng.choice([0.1, 1.0])),
        co_template=int(rng.integers(1, 4)),
        template_variation=0.5 if row["template"] == "varied" else 0.0,
        location_weight=float(row["location_weight"]),
        **{name: row[name] == "on" for name in (*switches, "random_path")},
    ).as_in(variant)


def _guides(row: Row, image: TrainingImage, grid: Grid, rng: np.random.Generator) -> dict[str, Any]:
    """Return the arguments of `Secondary`."""
    shape, n, volume = grid.shape, image.n_facies, grid.nz is not None
    given: dict[str, Any] = {}
    if row["active"] != "all":
        field = ndimage.gaussian_filter(rng.standard_normal(shape), 2)
        limit = np.quantile(field, 0.3 if row["active"] == "most" else 0.95)
        given["active"] = field >= limit
    if row["probabilities"] == "map":
        soft = rng.dirichlet(np.ones(n), shape)
        soft[rng.random(shape) < 0.2] = np.nan
        soft[(0,) * len(shape)] = 1 / n  # at least one cell is known
        given["probabilities"] = {code: soft[..., k] for k, code in enumerate(image.codes.tolist())}
        given["soft_weight"] = 2.0
    elif row["probabilities"] == "constant":
        shares = rng.dirichlet(np.ones(n)).tolist()
        given["probabilities"] = dict(zip(image.codes.tolist()[1:], shares[1:], strict=True))
        given["facies"] = {code: code for code in image.codes.tolist()}
    if row["images"] == "auxiliary":
        maps = (ndimage.gaussian_filter(rng.random(size), 3) for size in (image.shape, shape))
        given["auxiliary"] = [Auxiliary(*maps, weight=float(rng.choice([0.5, 2.0])))]
    elif row["images"] != "one":
        others = [_cells(row, image.codes, volume, rng) for _ in range(2)]
        given["images"] = others
        if row["images"] == "zones":
            given["zones"] = _blobs(shape, 3, rng)
        elif row["images"] == "weights":
            given["weights"] = rng.random(3) + 0.01
    along = np.broadcast_to(np.linspace(0, 1, shape[-1]), shape)
    turns = {
        "none": {},
        "angle": {"angle": float(rng.uniform(-360, 360))},
        "angles": {"angle": np.where(along < 0.3, np.nan, 90 * along)},
        "fan": {"angle": 360 * along, "angle_tolerance": 45.0},
        "scale": {"scale": float(rng.uniform(0.7, 1.6))},
        "scales": {"scale": (0.8 + along / 2, *(1.0,) * (len(shape) - 1))},
        "dip": {"dip": _dip(grid, rng)},
    }
    axes = "xyz" if volume else "xy"
    mirrored = {"none": "", "x": "x", "all": axes}[row["mirrored"]]
    return given | turns[row["turn"]] | ({"mirrored": mirrored} if mirrored else {})


def _dip(grid: Grid, rng: np.random.Generator) -> float:
    """Return a dip in degrees at which layers rise by at most .3 cells per cell."""
    _, dy, dz = (*grid.cell_size, 1.0)[:3]
    return float(np.degrees(np.arctan(rng.uniform(-0.3, 0.3) * dz / dy)))


def run_study(study: Study, n: int = 2, **options: Any) -> Ensemble:
    """Return realizations of a study with the sources of their cells."""
    inputs = study.training_image, study.grid, study.parameters, study.hard_data
    options = {"seed": study.seed, "secondary": study.secondary, "keep_sources": True} | options
    return simulate(*inputs, n_realizations=n, **options)


def check_rows(rows: Sequence[Row], file: Path) -> None:
    """Check the study of each row in turn, and write the row into a file before its study starts.

    The last line of the file thus names the study at which the process ends. A fault ends it too.
    Only realizations and revisions are checked, which run all kernels; `faults_of` checks more.
    """
    with file.open("w") as lines:
        for seed, row in enumerate(rows):
            print({name: x for name, x in row.items() if x != FEATURES[name][0]}, file=lines)
            lines.flush()
            study = make_study(row, seed)
            ensemble = run_study(study)
            if faults := faults_in(ensemble) + _faults_of_revision(study, ensemble):
                print(*faults, sep="\n", file=lines)
                sys.exit(1)


def faults_of(study: Study) -> list[str]:
    """Return the faults in the realizations of a study and in everything derived from them."""
    ensemble = run_study(study, n_workers=1)
    faults = faults_in(ensemble)
    if not _are_equal(ensemble, run_study(study, n_workers=2)):
        faults.append("one and two workers differ")
    parts = [run_study(study, 1, first_realization=k) for k in range(2)]
    if not _are_equal(ensemble, concatenate(parts)):
        faults.append("realizations depend on the first realization")
    file = io.BytesIO()
    write_realizations(file, ensemble, format="npz")
    file.seek(0)
    if not _are_equal(ensemble, read := read_realizations(file)):
        faults.append("npz changes realizations")
    if (read.secondary and read.secondary.digest) != (
        ensemble.secondary and ensemble.secondary.digest
    ):
        faults.append("npz changes guides")
    file = io.BytesIO()
    save_project(file, Project(study, 2))
    file.seek(0)
    if not _are_equal(ensemble, read_project(file).simulate(keep_sources=True)):
        faults.append("a project simulates other realizations")
    return faults + [f"revised: {fault}" for fault in _faults_of_revision(study, ensemble)]


def _faults_of_revision(study: Study, ensemble: Ensemble) -> list[str]:
    """Return the faults after some data were removed, changed and added."""
    rng = np.random.default_rng(study.seed)
    image, data = study.training_image, study.hard_data
    values = np.full(study.grid.shape, np.nan)
    of_data, of_image = data.facies, image.codes
    if image.values:
        of_data, of_image = data.values.get("porosity", of_data), image.sorted_values
    kept = rng.random(data.n) < 0.7
    values[tuple(data.cells[kept].T)] = of_data[kept]
    values[rng.random(values.shape) < 0.03] = rng.choice(of_image)
    if np.isnan(values).all():
        values[(0,) * values.ndim] = of_image[0]
    revised = [revise(ensemble, values, n_workers=n) for n in (1, 2)]
    faults = faults_in(revised[0])
    if not _are_equal(*revised):
        faults.append("one and two workers differ")
    if not _are_equal(ensemble, revise(ensemble, ensemble.hard_data)):
        faults.append("equal data change realizations")
    return faults


def _are_equal(a: Ensemble, b: Ensemble) -> bool:
    names = "indices", "data_status", "numbers"
    sources = a.sources is None or b.sources is None or np.array_equal(a.sources, b.sources)
    values = [*a.values] == [*b.values] and all(
        np.array_equal(a.values[name], b.values[name], equal_nan=True) for name in a.values
    )
    return sources and values and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in names)


def faults_in(ensemble: Ensemble) -> list[str]:
    """Return the faults in realizations, by plain comparisons with their inputs."""
    faults, indices = [], np.asarray(ensemble.indices)
    image, data, shape = ensemble.training_image, ensemble.hard_data, ensemble.grid.shape
    active = np.ones(shape, bool) if ensemble.active is None else ensemble.active
    n_wrong = np.zeros(ensemble.n, int)
    if data.n:
        facies = np.searchsorted(image.codes, data.facies)
        at = (slice(None), *data.cells.T)
        n_wrong = (indices[at] != facies).sum(axis=1)
        for name, values in ensemble.values.items():
            n_wrong = (values[at] != data.values[name]).sum(axis=1)
    if ensemble.n_mismatched.tolist() != n_wrong.tolist():
        faults.append(f"n_mismatched is {ensemble.n_mismatched}, but {n_wrong} data are wrong")
    if ensemble.parameters.exact_data and n_wrong.any():
        faults.append(f"{n_wrong} data are wrong")
    if (indices[:, ~active] != UNKNOWN).any():
        faults.append("inactive cells have facies")
    if (indices[:, active] >= image.n_facies).any():
        faults.append("active cells have no facies")
    if not np.allclose(ensemble.proportions.sum(axis=1), 1):
        faults.append(f"proportions sum to {ensemble.proportions.sum(axis=1)}")
    secondary = ensemble.secondary
    images = image, *(secondary.images if secondary else ())
    cells = np.concatenate([np.ravel(each.indices) for each in images])
    sources = ensemble.sources
    for name, values in ensemble.values.items():
        if not np.array_equal(image.class_indices(values), indices):
            faults.append("values have other classes than the facies")
        if sources is not None and not (data.n or ensemble.revised):
            copied = sources >= 0
            if (image.values[name].ravel()[sources[copied]] != values[copied]).any():
                faults.append("values differ from those of the image at the sources")
    if sources is not None and not (image.values and (data.n or ensemble.revised)):
        copied = sources >= 0
        if sources.max() >= len(cells) or (cells[sources[copied]] != indices[copied]).any():
            faults.append("sources have other facies than the cells copied from them")
        if (sources[:, ~active] != -1).any():
            faults.append("inactive cells have sources")
    return faults


def main(arguments: Sequence[str] | None = None) -> int:
    """Check random studies; return 1 if there are faults."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.pairs.studies",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--first", type=int, default=0, help="number of the first study")
    parser.add_argument("--number", type=int, default=2000, help="number of studies")
    options = parser.parse_args(arguments)
    start, n_faulty, n_refused = time.perf_counter(), 0, 0
    for number, row in random_rows(options.first, options.number):
        changed = {name: x for name, x in row.items() if x != FEATURES[name][0]}
        try:
            faults = faults_of(make_study(row, number))
        except CCWSIMError as error:
            n_refused += 1
            print(f"study {number} is refused: {error}", file=sys.stderr)
            continue
        except Exception:
            faults = [traceback.format_exc()]
        n_faulty += bool(faults)
        for fault in faults:
            print(f"study {number} {changed}: {fault}", flush=True)
    checked = "with" if getattr(config, "BOUNDSCHECK", None) else "without"
    print(
        f"{options.number} studies {checked} bounds checks: {n_faulty} with faults, {n_refused} "
        f"refused in a sentence; {time.perf_counter() - start:.0f} s"
    )
    return int(n_faulty > 0)


if __name__ == "__main__":
    sys.exit(main())
