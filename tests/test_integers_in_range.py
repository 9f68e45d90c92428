"""Test that every array of integers from outside is checked before it is cast.

NumPy silently casts 2⁶³ of an unsigned type to a negative number, and 1e300 to any number.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from io import BytesIO
from types import ModuleType
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

import ccwsim
from ccwsim import (
    CCWSIMError,
    Grid,
    HardData,
    Parameters,
    Project,
    TrainingImage,
    figures,
    io,
    metrics as m,
)
from ccwsim.datasets.sampling import sample_grid, sample_random, sample_wells
from ccwsim.io.realizations import _MEMBERS
from ccwsim.model.arrays import MAX_INT, MIN_INT, as_integers
from ccwsim.model.ensemble import concatenate
from ccwsim.model.study import Study
from ccwsim.sharing.project import project_as_bytes, read_project
from tests.some import annotations_of

BAD = {
    "2**63": np.uint64(2**63),
    "2**64 - 1": np.uint64(2**64 - 1),
    "-1": np.int64(-1),
    "1e300": np.float64(1e300),
    "inf": np.float64(np.inf),
    "nan": np.float64(np.nan),
}
P = Parameters(template_size=8, overlap_size=4, wavelet_level=1)
IMAGE = TrainingImage(np.kron(np.arange(64).reshape(8, 8) % 3 % 2, np.ones((4, 4))))
STUDY = Study(IMAGE, Grid(16, 16), P, HardData([[1, 2]], [1]))
SHARES = np.full((2, 8, 8), 0.5)
SQUARES = np.kron(np.eye(2, dtype=int), np.ones((8, 8), int))
WITH_VALUES = TrainingImage.from_array(np.arange(64.0).reshape(8, 8), continuous=True)
VOLUME = SQUARES[None, None]
SECOND = np.array([0, 1], np.int8)
COLOURS = ["#000000", "#ffffff"]
Array = Callable[..., np.ndarray]
Act = Callable[[Array], object]


def like(bad: Any) -> Array:
    """Return a function that makes arrays of zeros with a bad first value."""

    def of(*shape: int) -> np.ndarray:
        array = np.zeros(shape, type(bad))
        array.flat[0] = bad
        return array

    return of


def some(of: Array) -> np.ndarray:
    """Return an image of 16 × 16 cells with the given facies and others."""
    array = of(16, 16)
    array[8:, 8:] = 1
    return array


def npz(name: str) -> Act:
    """Read realizations from an npz file with a bad member."""

    def act(of: Array) -> object:
        content = io.realizations_as_bytes(ensemble(), "npz")
        with np.load(BytesIO(content)) as saved:
            members = dict(saved)
        file = BytesIO()
        np.savez(file, **{**members, name: of(*members[name].shape)})
        read = io.read_realizations(BytesIO(file.getvalue()))
        return read.numbers + 1, concatenate([read]), ccwsim.revise(read, HardData([[3, 3]], [0]))

    return act


def project(name: str) -> Act:
    """Read a project with a bad member."""

    def act(of: Array) -> object:
        file, member = BytesIO(), BytesIO()
        with ZipFile(BytesIO(project_as_bytes(Project(STUDY)))) as own, ZipFile(file, "w") as new:
            for each in own.namelist():
                content = own.read(each)
                if each == name:
                    np.save(member, of(*np.load(BytesIO(content)).shape))
                    content = member.getvalue()
                new.writestr(each, content)
        return read_project(BytesIO(file.getvalue()))

    return act


def npy(read: Callable[[BytesIO], object], *shape: int) -> Act:
    """Read an npy file with one array."""

    def act(of: Array) -> object:
        file = BytesIO()
        np.save(file, of(*shape))
        return read(BytesIO(file.getvalue()))

    return act


def table(head: str, line: str) -> Act:
    """Read a text file with a bad number."""

    def act(of: Array) -> object:
        text = f"{head}\n{line.format(of(1)[0])}\n"
        return io.read_hard_data(BytesIO(text.encode()), Grid(16, 16), IMAGE)

    return act


def ensemble() -> ccwsim.Ensemble:
    """Return an ensemble read from a file, without a simulation."""
    made = io.read_realizations(BytesIO(b"16 16 1\n1\na\n" + b"0\n1\n" * 128), IMAGE)
    study = replace(made.study, hard_data=HardData([[0, 0]], [0]))
    return replace(made, study=study, data_status=np.zeros((1, 1), np.int16))


IMAGES: dict[str, Act] = {
    "TrainingImage.__init__.array": lambda of: TrainingImage(some(of)),
    "TrainingImage.from_array.values": lambda of: TrainingImage.from_array(some(of)),
    "TrainingImage.of.image": lambda of: TrainingImage.of(some(of)),
    "simulate.training_image": lambda of: ccwsim.simulate(some(of), (9, 9), P).digest,
    "read_realizations.training_image": lambda of: io.read_realizations(
        BytesIO(b"2 1 1\n1\na\n0\n1\n"), some(of)
    ),
    "anodi.ensembles": lambda of: m.anodi(some(of), SQUARES),
    "anodi.training_image": lambda of: m.anodi(SQUARES, some(of)),
    "calibration.truth": lambda of: m.calibration(SHARES, of(8, 8)),
    "coarsened.image": lambda of: m.coarsened(some(of), 2),
    "connected_geobodies.image": lambda of: m.connected_geobodies(some(of), 1),
    "connectivity.images": lambda of: m.connectivity(some(of), 1),
    "data_match.realizations": lambda of: m.data_match(some(of), HardData([[0, 9]], [0])),
    "diagnose.training_image": lambda of: m.diagnose(some(of)),
    "differing_share.images": lambda of: m.differing_share(np.array([some(of), some(of)])),
    "etype.images": lambda of: m.etype(some(of)),
    "facies_counts.images": lambda of: m.facies_counts(some(of)),
    "feature_spacing.image": lambda of: m.feature_spacing(some(of)),
    "geobody_statistics.images": lambda of: m.geobody_statistics(some(of), 1),
    "local_direction.images": lambda of: m.local_direction(some(of), 1),
    "main_direction.image": lambda of: m.main_direction(some(of)),
    "granulometry.image": lambda of: m.granulometry(some(of), 1),
    "pattern_distance.images": lambda of: m.pattern_distance(some(of), SQUARES),
    "pattern_distance.training_image": lambda of: m.pattern_distance(SQUARES, some(of)),
    "pattern_histogram.image": lambda of: m.pattern_histogram(some(of)),
    "proportions.images": lambda of: m.proportions(some(of)),
    "pyramid_histograms.images": lambda of: m.pyramid_histograms(some(of)),
    "score_reference.truth": lambda of: m.score_reference(SHARES, of(8, 8), 2),
    "stationarity.image": lambda of: m.stationarity(some(of)),
    "transiograms.images": lambda of: m.transiograms(some(of)),
    "unseen_patterns.images": lambda of: m.unseen_patterns(some(of), SQUARES),
    "unseen_patterns.training_image": lambda of: m.unseen_patterns(SQUARES, some(of)),
    "variogram.images": lambda of: m.variogram(some(of), 1),
    "variogram_map.images": lambda of: m.variogram_map(some(of), 1, 2),
    "variogram_of_values.images": lambda of: m.variogram_of_values(some(of)),
    "vertical_proportions.images": lambda of: m.vertical_proportions(some(of)[None, None]),
    "sample_random.field": lambda of: sample_random(of(1, 1), 1),
    "sample_grid.field": lambda of: sample_grid(of(1, 1), 1),
    "sample_wells.field": lambda of: sample_wells(of(1, 1), 1),
}
"""Arguments with facies codes, which may be negative."""
OTHERS: dict[str, Act] = {
    "HardData.__init__.cells": lambda of: HardData(of(1, 2), [0]).check(STUDY.grid),
    "HardData.measured_as.cells": lambda of: HardData.measured_as(IMAGE, of(1, 2), [0]).check(
        STUDY.grid
    ),
    "HardData.measured_as.measured": lambda of: HardData.measured_as(IMAGE, [[0, 0]], of(1)).check(
        STUDY.grid, IMAGE
    ),
    "HardData.part.cells": lambda of: HardData([[1, 2]], [0]).part(..., of(1, 2)).check(STUDY.grid),
    "HardData.__init__.facies": lambda of: HardData([[0, 0]], of(1)).check(STUDY.grid, IMAGE),
    "simulate.hard_data": lambda of: ccwsim.simulate(IMAGE, (16, 16), P, (of(1, 2), [0])),
    "simulate.grid_shape": lambda of: ccwsim.simulate(IMAGE, of(2), P),
    "Grid.of.shape": lambda of: Grid.of(of(2)),
    "Grid.fit.shape": lambda of: Grid.fit([[1, 2], [3, 4]], shape=of(2)),
    "Parameters.along.shape": lambda of: P.along(Grid.of(of(2)).shape),
    "read_training_image.shape": lambda of: io.read_training_image(BytesIO(b"0 1\n"), shape=of(2)),
    "fit_grid.shape": lambda of: io.fit_grid(
        io.read_points(BytesIO(b"x,y,facies\n1,2,0\n")), shape=of(2)
    ),
    **{
        f"{name}.codes": lambda of, call=call: call(of(2))
        for name, call in {
            "anodi": lambda codes: m.anodi(SQUARES, SQUARES, codes),
            "calibration": lambda codes: m.calibration(SHARES, SQUARES[:8, :8], codes=codes),
            "coarsened": lambda codes: m.coarsened(SQUARES, 2, codes),
            "differing_share": lambda codes: m.differing_share(SQUARES[None], codes),
            "etype": lambda codes: m.etype(SQUARES, codes),
            "facies_counts": lambda codes: m.facies_counts(SQUARES, codes),
            "feature_spacing": lambda codes: m.feature_spacing(SQUARES, codes),
            "pattern_distance": lambda codes: m.pattern_distance(SQUARES, SQUARES, codes),
            "pattern_histogram": lambda codes: m.pattern_histogram(SQUARES, codes),
            "proportions": lambda codes: m.proportions(SQUARES, codes),
            "pyramid_histograms": lambda codes: m.pyramid_histograms(SQUARES, codes),
            "score_reference": lambda codes: m.score_reference(
                SHARES, SQUARES[:8, :8], 2, codes=codes
            ),
            "stationarity": lambda codes: m.stationarity(SQUARES, codes),
            "transiograms": lambda codes: m.transiograms(SQUARES, codes),
            "unseen_patterns": lambda codes: m.unseen_patterns(SQUARES, SQUARES, codes),
            "vertical_proportions": lambda codes: m.vertical_proportions(
                SQUARES[None, None], codes
            ),
        }.items()
    },
    "anodi.factors": lambda of: m.anodi(SQUARES, SQUARES, factors=of(1), weights=[1]),
    "pattern_distance.factors": lambda of: m.pattern_distance(SQUARES, SQUARES, factors=of(1)),
    "pyramid_histograms.factors": lambda of: m.pyramid_histograms(SQUARES, factors=of(1)),
    "coarsened.factor": lambda of: m.coarsened(np.kron(SQUARES, np.ones((2, 2, 2), int)), of(3)),
    "axes_of.shape": lambda of: m.axes_of(Grid.of(of(2)).shape),
    "copying.ti_shape": lambda of: m.copying([[0, 1]], of(2)),
    "crop_shape.image_shape": lambda of: m.crop_shape(of(2), (9, 9)),
    "crop_shape.grid_shape": lambda of: m.crop_shape((9, 9), of(2)),
    "etype_of_counts.counts": lambda of: m.etype_of_counts(of(2, 3, 3)),
    "fit_patterns.sizes": lambda of: m.fit_patterns(ensemble(), sizes=of(1)),
    "templates_that_fit.shape": lambda of: m.templates_that_fit(of(2), 3),
    "templates_that_fit.template_size": lambda of: m.templates_that_fit((9, 9), tuple(of(2))),
    "warn_of_level.grid_shape": lambda of: m.warn_of_level(P, of(2), 1),
    "connectivity.lags": lambda of: m.connectivity(SQUARES, 1, lags=of(2)),
    "transiograms.lags": lambda of: m.transiograms(SQUARES, lags=of(2)),
    "variogram.lags": lambda of: m.variogram(SQUARES, 1, lags=of(2)),
    "variogram_of_values.lags": lambda of: m.variogram_of_values(WITH_VALUES, lags=of(2)),
    "read_hard_data.grid": lambda of: io.read_hard_data(BytesIO(b"x,y,facies\n1,2,0\n"), of(2)),
    "import_hard_data.grid": lambda of: io.import_hard_data(BytesIO(b"x,y,facies\n1,2,0\n"), of(2)),
    "contact_sheet.indices": lambda of: figures.contact_sheet(of(1, 9, 9), COLOURS),
    "data_map_png.indices": lambda of: figures.data_map_png(of(9, 9), COLOURS),
    "data_png.indices": lambda of: figures.data_png(
        np.zeros((1, 2), int), of(1), (9, 9), COLOURS, longest=9
    ),
    "map_png.indices": lambda of: figures.map_png(of(9, 9), COLOURS),
    "slices_png.indices": lambda of: figures.slices_png(of(1, 1, 1), COLOURS),
    **{
        f"npz of realizations, {name}": npz(name)
        for name in ("numbers", "hard_cells", "hard_facies", "realizations", "seed")
    },
    "project, hard data": project("hard_cells.npy"),
    "table of rows, column": table("row,col,facies", "{},2,0"),
    "table of points, x": table("x,y,facies", "{},2,0"),
    "table of points, facies": table("x,y,facies", "1,2,{}"),
    "npy of realizations": npy(lambda f: io.read_realizations(f, IMAGE), 2, 5, 5),
}
"""Arguments in which −1 is invalid."""
FREE: dict[str, Act] = {
    "HardData.of.data": lambda of: HardData.of(of(16, 16), STUDY.grid),
    "Grid.holds.cells": lambda of: STUDY.grid.holds(of(1, 2)),
    "Grid.centers_of.cells": lambda of: STUDY.grid.centers_of(of(1, 2)),
    "data_png.cells": lambda of: figures.data_png(
        of(1, 2), np.zeros(1, int), (9, 9), COLOURS, longest=9
    ),
    "placement_svg.cells": lambda of: figures.placement_svg(of(1, 2), [None], (9, 9)),
    "angles_along.lines": lambda of: io.angles_along([of(2, 2)], STUDY.grid),
    "Grid.enlarged.cells": lambda of: Grid(4, 4).enlarged(of(1, 2)),
    "copying.positions": lambda of: m.copying(of(3, 3), (3, 3)),
    "etype_of_counts.codes": lambda of: m.etype_of_counts(np.ones((2, 3, 3), int), of(2) + SECOND),
    "connectivity.direction": lambda of: m.connectivity(SQUARES, 1, tuple(of(2)), 2),
    "feature_spacing.direction": lambda of: m.feature_spacing(SQUARES, direction=tuple(of(2))),
    "fit_curve.direction": lambda of: m.fit_curve(ensemble(), "variogram", 1, tuple(of(2))),
    "transiograms.direction": lambda of: m.transiograms(SQUARES, None, tuple(of(2)), 2),
    "variogram.direction": lambda of: m.variogram(SQUARES, 1, tuple(of(2)), 2),
    "variogram_of_values.direction": lambda of: m.variogram_of_values(WITH_VALUES, tuple(of(2)), 2),
    "npz of realizations, met_by": npz("met_by"),
    "project, training image": project("training_image.npy"),
    "npy of a training image": npy(io.read_training_image, 5, 5),
}
"""Arguments in which −1 is allowed."""
NO_INTEGERS = re.compile(
    r"Grid\.(cells_of|fit\.places)|\.plot\.|HardData\.n_mismatched|entropy|\.probability|band\.curves"
    r"|class_edges|classify|__init__\.values|\.maps$|\.grid_shape$|\.grid$|\.which$|RunningCurves|share_in|compare\."
    r"|_chart\.|sparkline|tile_size|slices_of\.indices|fit_data\.shape|_png\.shape|can_write\.shape|_svg\.(shape|wells)"
)
"""Arguments of real numbers, of NumPy indices, of numbers in a chart, and of `Grid.of`."""
INTEGERS = re.compile(
    r"Images|Codes|Lags|Direction\b|ArrayLike|Shape|Ints\b|Bytes\b|Integers\b|Int\d+s\b|NDArray\[np\.u?int"
    r"|Sequence\[int\]|tuple\[int"
)
CLASSES = (TrainingImage, HardData, Grid, Parameters)
CALLS = {**IMAGES, **OTHERS, **FREE}


def arguments(module: ModuleType) -> set[str]:
    """Return the names of arguments that may be arrays of integers, according to annotations."""
    found = set()
    for name in getattr(module, "__all__", vars(module)):
        own = getattr(module, name)
        functions = {name: own} if inspect.isfunction(own) else {}
        if own in CLASSES:
            made = {"__init__", *(n for n in vars(own) if not n.startswith("_"))}
            functions = {f"{name}.{n}": getattr(own, n) for n in made if callable(getattr(own, n))}
        for label, function in functions.items():
            for parameter, text in annotations_of(function).items():
                if INTEGERS.search(text):
                    found.add(f"{label}.{parameter}")
    return found


@pytest.mark.parametrize("module", [ccwsim, m, io, figures], ids=lambda module: module.__name__)
def test_every_array_of_the_library_is_among_these(module):
    new = {name for name in arguments(module) - set(CALLS) if not NO_INTEGERS.search(name)}
    assert not new, "add a call with this argument to one of the tables"


def test_every_member_of_realizations_is_among_these():
    integers = {name for name, kinds in _MEMBERS.items() if set(kinds) <= {*"ui"}}
    assert {f"npz of realizations, {name}" for name in integers} <= set(CALLS)


WITH_GAPS = {"array", "data", "ensembles", "image", "images", "realization", "realizations"}
WITH_GAPS |= {"training_image", "truth", "values"}
"""Arguments in which NaN stands for a cell without a facies."""


@pytest.mark.parametrize("bad", list(BAD))
@pytest.mark.parametrize("name", list(CALLS))
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_number_out_of_range_is_refused(name, bad):
    legal = bad == "-1" and name not in OTHERS
    legal |= bad == "nan" and re.split(r"[ .]", name)[-1] in WITH_GAPS
    with suppress(CCWSIMError) if legal else pytest.raises(CCWSIMError):
        CALLS[name](like(BAD[bad]))


@pytest.mark.parametrize("value", [MIN_INT, -1, 0, MAX_INT])
def test_what_fits_is_kept(value):
    assert as_integers(np.array([value]), "values").tolist() == [value]
    for low, high in ((value + 1, MAX_INT), (MIN_INT, value - 1)):
        with pytest.raises(CCWSIMError, match=r"is too (small|large); give at (least|most)"):
            as_integers(np.array([value]), "values", low, high)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64, np.longdouble])
def test_real_numbers_are_compared_exactly(kind):
    assert as_integers(np.array([-3, 0.9999, 7], kind), "values").tolist() == [-3, 1, 7]
    if kind is not np.float16:
        with pytest.raises(CCWSIMError, match="9223372036854775808 is too large"):
            as_integers(np.array([2.0**63], kind), "values")
        assert as_integers(np.array([-(2.0**63)], kind), "values").tolist() == [MIN_INT]
