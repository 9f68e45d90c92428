"""Test that the shared script, command and project give the cells of the study."""

from __future__ import annotations

import shlex
import subprocess
import sys
from html import escape
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from ccwsim import (
    Grid,
    HardData,
    Parameters,
    TrainingImage,
    datasets,
    read_project,
    save_project,
    simulate,
)
from ccwsim.engine.kernel_cache import KERNEL_FOLDER
from ccwsim.io import training_image_as_bytes
from ccwsim.metrics import check_ensemble, fit_curve, fit_flow
from ccwsim.model.study import Study
from ccwsim.report.document import report_html
from ccwsim.report.settings import caption_of
from ccwsim.report.verdicts import describe_checks, describe_curve, describe_flow, relative_text
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Shown, Upload
from ccwsim.sharing.project import Project, project_as_bytes
from ccwsim.sharing.recipe import reproduction_recipe
from ccwsim.sharing.study_report import MAX_FLOW_CELLS, study_report
from ccwsim.ui.session.resolve import study_of
from ccwsim.ui.share.menu import choices_of
from tests.report.test_report import OUTSIDE, own_part
from tests.some import some

ROOT = Path(__file__).parents[2]
SMALL = Parameters(template_size=16, overlap_size=4, wavelet_level=1, search_fraction=1e-6)
GRID = Grid(48, 64, (5.0, 2.5), (-1e-7, 1e6))
FEW = HardData([[3, 4], [20, 30]], [0, 1])
MANY = HardData([[k // 8 * 4, k % 8 * 7] for k in range(60)], np.arange(60) % 2)
TURNED = ImageChoice("lenses", None, (), True, False, True, colours=((0, "#112233"),))
OWN = TrainingImage(np.kron(np.eye(20, dtype=int) * 9, np.ones((2, 3), int)))
UPLOAD = Upload("my image.npy", training_image_as_bytes(OWN, "npy"))
PLACED = DataChoice("placed", placed=HardData([[1, 2]], [9]))
SAMPLED = DataChoice("sampled", n_sampled=20, seed_sampled=3)
STUDIES = {
    "bundled": Choices(ImageChoice("delta"), DataChoice(), GRID, SMALL, 2, 7),
    "usual data": Choices(grid=Grid(512, 512), n_realizations=1),
    "turned": Choices(TURNED, DataChoice("placed", placed=FEW), GRID, SMALL, 2, 7),
    "named": Choices(ImageChoice("channels", names=("it's", "<b>")), DataChoice(), GRID, SMALL, 1),
    "sampled": Choices(ImageChoice("channels", flip_ns=True), SAMPLED, GRID, SMALL, 2),
    "many data": Choices(data=DataChoice("placed", placed=MANY), grid=GRID, parameters=SMALL),
    "uploaded": Choices(ImageChoice(upload=UPLOAD), PLACED, GRID, SMALL, 2, 5),
}


def project_of(choices: Choices, study: Study) -> Project:
    return Project(study, choices.n_realizations, choices=choices)


@pytest.mark.slow
@pytest.mark.parametrize("what", some(STUDIES, ["turned"]))
def test_script_and_command_give_the_same_cells(what, tmp_path):
    choices = STUDIES[what]
    study = study_of(choices)
    inputs = study.training_image, study.grid, study.parameters, study.hard_data
    e = simulate(*inputs, choices.n_realizations, study.seed)
    save_project(tmp_path / "it's mine.ccwsim", project_of(choices, study))
    how = reproduction_recipe(choices, study, "it's mine.ccwsim")
    for words in ([sys.executable, "-c", how.python], shlex.split(how.command)):
        line = [sys.executable, *words[1:]]
        env = {"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(tmp_path)}
        env |= {"NUMBA_CACHE_DIR": "", "LANG": "C.UTF-8"}
        env["XDG_CACHE_HOME"] = str(Path(KERNEL_FOLDER).parents[1])  # kernels of these tests
        subprocess.run(line, cwd=tmp_path, check=True, capture_output=True, env=env)
        out = tmp_path / "realizations.npz"
        with np.load(out) as saved:
            np.testing.assert_array_equal(saved["realizations"], e.realizations)
            assert saved["origin"].tolist() == list(choices.grid.origin)
        out.unlink()
    needed = what in ("many data", "uploaded")
    assert how.python_needs_project == needed
    assert how.command_needs_project == (needed or what in ("turned", "sampled"))


@pytest.mark.parametrize("what", STUDIES)
def test_a_project_becomes_the_study_it_was(what):
    choices = STUDIES[what]
    study = study_of(choices)
    content = BytesIO(project_as_bytes(project_of(choices, study)))
    assert choices_of(read_project(content))[0] == choices
    of_script, _ = choices_of(Project(study, choices.n_realizations))
    again_there = study_of(of_script)
    assert again_there.training_image == study.training_image
    assert not again_there.differs_from(study)
    assert of_script.n_realizations == choices.n_realizations


def test_a_report_has_everything_and_all_of_it_is_escaped():
    odd = "</script><script>alert('\"&1')</script>"
    ti = datasets.load("delta")
    image = TrainingImage(
        ti.array, name=odd, facies_names=[f"{odd}{k}" for k in range(ti.n_facies)]
    )
    e = simulate(image, GRID, SMALL, HardData([[3, 4], [9, 9]], image.codes[:2]), 3, 1)
    choices = Choices(ImageChoice(upload=Upload(odd, b"")), DataChoice(), GRID, SMALL, 3, 1)
    how = reproduction_recipe(choices, Study(image, GRID, SMALL, e.hard_data, 1), f"{odd}.ccwsim")
    link = f"http://here/?{odd}"
    document = study_report(e, choices, Shown(2, 1), ["#112233"] * image.n_facies, [odd], link, how)
    page = report_html(document)
    assert "<script>alert" not in page
    assert not OUTSIDE.search(own_part(page))
    assert ", ".join(section.title for section in document.sections) == (
        "Study, Realizations, E-type, Checks, Variograms and connectivity, Measures, "
        "Flow, CPU time and proportions, Parameters, Reproduction"
    )
    assert page.count('class="plot"') == 6
    assert page.count("<img") == 2 + 3 + 2
    for words in ("read_project", "--project", e.digest, "does not contain", "Realization 3 of 3"):
        assert words in page


def test_a_report_says_the_same_of_curves_as_the_pages():
    image = datasets.load("channels")
    grid = Grid(64, 64)
    choices = Choices(data=DataChoice(), grid=grid, parameters=SMALL, n_realizations=2)
    e = simulate(image, (64, 64), SMALL, n_realizations=2)
    how = reproduction_recipe(choices, Study(image, grid, SMALL), "a.ccwsim")
    page = report_html(study_report(e, choices, Shown(), ["#112233"] * 2, ["fine"], "?", how))
    headline, lines = describe_checks(check_ensemble(e), image.facies_names)
    for words in (str(headline), *(line.verdict.numbers for line in lines)):
        assert escape(words) in page
    for statistic in ("variogram", "connectivity"):
        for way in ("E-W", "N-S"):
            assert str(describe_curve(fit_curve(e, statistic, 1, way), statistic)) in page
    assert page.count(f"{caption_of(e)}.") == 3  # below each row of charts
    found = fit_flow(e, 1, max_cells=MAX_FLOW_CELLS)
    for axis in (0, 1):
        assert f">{found.reference[axis]:.3f}</td>" in page
        assert f">{found.each[:, axis].mean():.3f} (" in page
        assert str(describe_flow(found, axis)) in page
    assert "2 of 2 realizations were solved as a whole" in page
    assert relative_text(float(e.proportions[:, 1].mean()), float(image.proportions[1])) in page


def test_a_report_of_one_facies_and_one_cell_can_be_made():
    image = TrainingImage(np.zeros((20, 20)))
    e = simulate(image, (1, 1), SMALL)
    choices = Choices(data=DataChoice(), grid=Grid(1, 1), parameters=SMALL, n_realizations=1)
    how = reproduction_recipe(choices, Study(image, Grid(1, 1), SMALL), "a.ccwsim")
    assert report_html(study_report(e, choices, Shown(), ["#112233"], ["fine"], "?", how))
