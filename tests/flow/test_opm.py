"""Test that OPM, which simulates flow in reservoirs, reads every GRDECL file that we write."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from zipfile import ZipFile

import numpy as np
import pytest

from ccwsim import Ensemble, Grid, Secondary, io, write_realizations
from ccwsim.cli.program import main
from ccwsim.model.missing import UNKNOWN
from ccwsim.sharing.choices import FlowChoice
from ccwsim.ui.flow.solving import model_downloads
from tests.flow.test_flow import ensemble

VALUES = {"mud": 3.3e-14, "sand": 1.7e-13}  # m/s: millidarcy of 17 and more digits
PLACES = {
    "map": Grid(8, 9, (12.345678901, 7.1), (501234.567890123, 4201234.56789)),
    "volume": Grid(8, 9, (10.0, 20.0, 0.35), (500.0, 100.0, -1234.56789), nz=3),
    "feet": Grid(8, 9, (82.0, 82.0), (6306015.0, 1982413.0), crs="EPSG:2226"),
}
DECK = """RUNSPEC
DIMENS
{nx} {ny} {nz} /
OIL
WATER
METRIC
TABDIMS
/
REGDIMS
2 /
START
1 JAN 2020 /
GRID
INCLUDE
'{stem}.grdecl' /
INCLUDE
'{stem}_2.inc' /
PORO
{n}*0.25 /
PROPS
REGIONS
INCLUDE
'{stem}_2_facies.inc' /
SOLUTION
SCHEDULE
END
"""


def masked(grid: Grid, kind: str) -> Ensemble:
    """Return random realizations; `kind` is the place of inactive cells."""
    e = ensemble(2, grid.shape, grid)
    active = np.ones(grid.shape, bool)
    if kind == "side":
        active[..., :3, :4] = False
    if kind == "hole":
        active[..., 3:5, 4:6] = False
    if kind == "none":
        return e
    indices = np.where(active, e.indices, UNKNOWN).astype(np.uint8)
    return replace(e, indices=indices, study=replace(e.study, secondary=Secondary(active=active)))


def by_library(folder, e: Ensemble) -> None:
    io.write_grdecl(folder / "g.grdecl", e, VALUES, anisotropy=0.013)


def by_command(folder, e: Ensemble) -> None:
    write_realizations(folder / "e.npz", e)
    values = [f"-k{name}={k!r}" for name, k in VALUES.items()]
    options = ["--anisotropy", "0.013", "--grdecl", str(folder / "g.grdecl")]
    assert main(["flow", str(folder / "e.npz"), *values, *options, "-q"]) == 0


def by_dashboard(folder, e: Ensemble) -> None:
    rocks = tuple((name, (k, 0.2)) for name, k in VALUES.items())
    choice = FlowChoice(rocks=rocks, anisotropy=0.013)
    (files,) = model_downloads(choice, e, 0).values()
    with ZipFile(BytesIO(files[0].content())) as archive:
        archive.extractall(folder)
    for file in list(folder.iterdir()):
        file.rename(folder / ("g" + file.name[file.name.index("_seed0") + 6 :]))


WAYS = {"library": by_library, "command": by_command, "dashboard": by_dashboard}


@pytest.mark.parametrize("kind", ["none", "side", "hole"])
@pytest.mark.parametrize("dimension", PLACES)
@pytest.mark.parametrize("way", WAYS)
def test_lines_are_short_and_keywords_those_of_a_deck(way, dimension, kind, tmp_path):
    grid = PLACES[dimension]
    WAYS[way](tmp_path, masked(grid, kind))
    texts = {name: (tmp_path / name).read_text() for name in ("g.grdecl", "g_2.inc")}
    texts["facies"] = (tmp_path / "g_2_facies.inc").read_text()
    lines = [line for text in texts.values() for line in text.splitlines()]
    assert max(map(len, lines)) <= 128
    keywords = [line for line in lines if line[:1].isalpha()]
    wanted = ["SPECGRID", "COORD", "ZCORN", "ACTNUM", "PERMX", "PERMY", "PERMZ", "FIPNUM"]
    assert keywords == [word for word in wanted if word != "ACTNUM" or kind != "none"]
    table = [line for line in texts["facies"].splitlines() if line.startswith("--")]
    assert table == ["-- region 1 = code 0, mud", "-- region 2 = code 1, sand"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["none", "side", "hole"])
@pytest.mark.parametrize("dimension", PLACES)
@pytest.mark.parametrize("way", WAYS)
def test_opm_reads_the_deck_cell_for_cell(way, dimension, kind, tmp_path):
    pytest.importorskip("opm")
    from opm.io.ecl_state import EclipseState
    from opm.io.parser import Parser

    grid = PLACES[dimension]
    e = masked(grid, kind)
    WAYS[way](tmp_path, e)
    sizes = {"nx": grid.nx, "ny": grid.ny, "nz": grid.nz or 1, "n": grid.n_cells}
    (tmp_path / "A.DATA").write_text(DECK.format(stem="g", **sizes))
    state = EclipseState(Parser().parse(str(tmp_path / "A.DATA")))
    assert state.grid().nactive == e.n_active
    indices = np.atleast_3d(e.indices[1].T).T[::-1, ::-1].ravel()
    regions = indices[indices != UNKNOWN] + 1
    assert state.field_props().get_int_array("FIPNUM").tolist() == regions.tolist()
    k = io.millidarcy(np.array([*VALUES.values()]))[regions - 1] * io.flow_models.MILLIDARCY
    vertical = 0.013 if way != "dashboard" or grid.nz else 1.0  # the page asks in volumes only
    for key, wanted in {"PERMX": k, "PERMY": k, "PERMZ": vertical * k}.items():
        np.testing.assert_allclose(state.field_props().get_double_array(key), wanted, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["none", "hole"])
@pytest.mark.parametrize("dimension", PLACES)
def test_opm_reads_realizations_and_images(dimension, kind, tmp_path):
    pytest.importorskip("opm")
    from opm.io.parser import Parser

    e = masked(PLACES[dimension], kind)
    keys = ["SPECGRID", "COORD", "ZCORN", *(["ACTNUM"] if kind == "hole" else [])]
    texts = {
        ("FIP1", "FIP2"): io.realizations_as_bytes(e, "grdecl"),
        ("FIPNUM",): io.training_image_as_bytes(e.training_image, "grdecl"),
    }
    for regions, text in texts.items():
        deck = Parser().parse_string(text.decode())
        wanted = keys if len(regions) == 2 else keys[:3]
        assert [keyword.name for keyword in deck] == [*wanted, *regions]
        assert max(map(len, text.decode().splitlines())) <= 128


@pytest.mark.parametrize("kind", ["none", "hole"])
@pytest.mark.parametrize("dimension", PLACES)
def test_region_keywords_are_read_back_as_codes(dimension, kind):
    e = masked(PLACES[dimension], kind)
    back = io.read_realizations(BytesIO(io.realizations_as_bytes(e, "grdecl")), e.training_image)
    assert np.array_equal(back.realizations, e.realizations, equal_nan=True)
