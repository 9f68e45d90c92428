"""Test that facies with different numberings are matched right, or not in silence."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from io import BytesIO

import numpy as np
import pytest

from ccwsim import (
    CCWSIMError,
    Ensemble,
    Grid,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
    read_hard_data,
    read_realizations,
    read_training_image,
    simulate,
)
from ccwsim.cli.program import main
from ccwsim.io import (
    import_hard_data,
    read_probabilities,
    realizations_as_bytes,
    write_training_image,
)
from ccwsim.model.facies_match import match_facies
from ccwsim.model.facies_property import values_by_facies
from ccwsim.model.study import Study
from ccwsim.sharing.choices import FlowChoice
from ccwsim.sharing.project import Project, project_as_bytes, read_project
from ccwsim.ui.flow.solving import rock_name, rock_of
from tests.numberings import (
    CELLS,
    CHANNEL,
    IMAGES,
    codes,
    grid_with_gaps,
    named,
    probabilities,
    table,
)

SHAPE = CHANNEL.shape
STATED = {0: 1, 1: 0}
"""In the images, the channel is 0; in data, probabilities and other images it is 1."""

HALVES = [0.5, 0.5]


def image_of(kind: str, **options) -> TrainingImage:
    name, content, answers = IMAGES[kind]
    image = read_training_image(named(content(), name), **answers, **options)
    assert np.array_equal(image.array, 1 - CHANNEL)
    return image


def data_are_right(image: TrainingImage, content: bytes, stated: dict | None) -> bool:
    data = import_hard_data(named(content, "data"), SHAPE, image, facies_names=stated).hard_data
    return bool((data.facies == image.array[tuple(data.cells.T)]).all())


def soft_data_are_right(image: TrainingImage, stated: dict | None) -> bool:
    maps = read_probabilities(named(probabilities(), "soft"), Grid(*SHAPE))
    fitted = Secondary(probabilities=maps, facies=stated).fitted(Grid(*SHAPE), image)
    return bool(np.allclose(fitted.probabilities[0], 0.1 + 0.8 * CHANNEL))


def second_image_is_right(image: TrainingImage, stated: dict | None) -> bool:
    other = read_training_image(named(codes(), "other.npy"))
    zones = np.arange(SHAPE[0])[:, None].repeat(SHAPE[1], 1) % 2
    fitted = Secondary(images=[other], zones=zones, facies=stated).fitted(Grid(*SHAPE), image)
    return bool(np.array_equal(fitted.images[0].array, image.array))


OTHERS: dict[str, Callable[[TrainingImage, dict | None], bool]] = {
    "table": lambda image, stated: data_are_right(image, table(), stated),
    "grid": lambda image, stated: data_are_right(image, grid_with_gaps(), stated),
    "probabilities": soft_data_are_right,
    "zones of a second image": second_image_is_right,
}


@pytest.mark.parametrize("kind", IMAGES)
@pytest.mark.parametrize("other", OTHERS)
def test_numbers_of_an_image_are_no_codes(kind, other):
    image = image_of(kind)
    with pytest.warns(UserWarning, match="0 → facies 1, 1 → facies 0 is likeliest"):
        OTHERS[other](image, None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert OTHERS[other](image, STATED)


@pytest.mark.parametrize("other", OTHERS)
def test_codes_of_both_sides_are_matched_in_silence(other, recwarn):
    image = TrainingImage(CHANNEL)
    right = OTHERS[other](image, None) if other != "probabilities" else True
    assert right
    assert not recwarn


def test_an_image_with_codes_says_so(recwarn):
    image = image_of("picture")
    assert image.numbering == "colours"
    file = BytesIO()
    write_training_image(file, image, format="png")
    assert read_training_image(named(file.getvalue(), "ti.png")).numbering == "codes"
    name, content, _ = IMAGES["palette"]
    indices = read_training_image(named(content(), name), classes="codes")
    assert (indices.numbering, data_are_right(indices, table(), None)) == ("codes", True)
    assert image_of("classes").numbering == "values"
    assert image_of("picture", numbering="codes").numbering == "codes"
    assert not recwarn


def test_names_are_matched_but_not_the_usual_names_of_a_numbering():
    named_image = TrainingImage(1 - CHANNEL, facies_names=("Sand", "Mud"), numbering="colours")
    assert match_facies(["mud", "sand"], named_image, shares=HALVES).codes == {"mud": 1, "sand": 0}
    usual = match_facies(["facies 0", "facies 1"], image_of("picture"), shares=HALVES)
    assert usual.codes == {"facies 0": "facies 0", "facies 1": "facies 1"}
    assert match_facies(["facies 0"], TrainingImage(CHANNEL), shares=[1.0]).codes == {"facies 0": 0}


def test_continuous_values_with_a_threshold_are_numbered_alike(recwarn):
    image, values = image_of("classes"), np.where(CHANNEL == 1, 0.05, 0.3)
    rows = [f"{column + 0.5},{row + 0.5},{values[row, column]}" for row, column in CELLS.tolist()]
    file = named("\n".join(["x,y,porosity", *rows]).encode(), "logs.csv")
    data = read_hard_data(file, SHAPE, image, threshold=0.1, facies="porosity")
    assert (data.facies == image.array[tuple(data.cells.T)]).all()
    assert not recwarn


def test_data_that_were_read_for_an_image_are_not_matched_again(recwarn):
    image = image_of("picture")
    data = read_hard_data(named(table(), "t.csv"), SHAPE, image, facies_names=STATED)
    p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    e = simulate(image, SHAPE, p, data)
    assert (e.realizations[0][tuple(CELLS.T)] == image.array[tuple(CELLS.T)]).all()
    study = Study.of(image, SHAPE, p, pickle.loads(pickle.dumps(data)))
    assert np.array_equal(study.hard_data.facies, data.facies)
    again = read_project(BytesIO(project_as_bytes(Project(study))))
    assert again.study.training_image.numbering == "colours"
    assert again.simulate(1).realizations.shape == (1, *SHAPE)
    saved: Ensemble = read_realizations(BytesIO(realizations_as_bytes(e, "npz")))
    assert saved.training_image.numbering == "colours"
    assert not recwarn


@pytest.mark.parametrize("form", ["npz", "sgems"])
def test_realizations_of_another_image_are_matched_with_a_warning(form, recwarn):
    image, p = image_of("picture"), Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    file = realizations_as_bytes(simulate(TrainingImage(CHANNEL), SHAPE, p, seed=1), form)
    own = realizations_as_bytes(simulate(image, SHAPE, p, seed=1), "npz")
    assert read_realizations(named(own, "own.npz"), image).training_image.numbering == "colours"
    assert not recwarn
    with pytest.warns(
        UserWarning, match="realizations: .* 0 → facies 1, 1 → facies 0 is likeliest"
    ):
        read_realizations(named(file, f"other.{form}"), image)


def test_values_by_number_are_given_with_a_warning_or_by_name(recwarn):
    image = image_of("picture")
    assert values_by_facies(image, {"facies 0": 1.0, "facies 1": 2.0}).tolist() == [1.0, 2.0]
    assert values_by_facies(TrainingImage(CHANNEL), {0: 1.0, 1: 2.0}).tolist() == [1.0, 2.0]
    assert not recwarn
    with pytest.warns(
        UserWarning, match="conductivity: numbers of colours or classes are no codes"
    ):
        values_by_facies(image, {0: 1.0, 1: 2.0})


def test_values_of_the_page_flow_belong_to_one_picture():
    image = image_of("picture")
    choice = FlowChoice(rocks=((rock_name(image, 0), (5.0, 0.2)),))
    other = TrainingImage(CHANNEL[:30], numbering="colours")
    assert rock_of(choice, image, 0) == (5.0, 0.2)
    assert rock_of(choice, other, 0)[0] != 5.0


@pytest.mark.parametrize("form", ["hard data", "pair", "array", "table"])
def test_every_form_of_data_warns_until_the_facies_are_stated(form):
    image, values = image_of("picture"), CHANNEL[tuple(CELLS.T)]
    array = np.full(SHAPE, np.nan)
    array[tuple(CELLS.T)] = values
    y, x = CELLS.T
    forms = {
        "hard data": HardData(CELLS, values),
        "pair": (CELLS, values),
        "array": array,
        "table": {"x": x + 0.5, "y": y + 0.5, "facies": values},
    }
    with pytest.warns(UserWarning, match="matched by number"):
        Study.of(image, SHAPE, None, forms[form])
    with warnings.catch_warnings():
        warnings.filterwarnings("error", ".*matched by number.*")
        study = Study.of(image, SHAPE, None, forms[form], facies={0: "facies 1", 1: "facies 0"})
    assert (study.hard_data.facies == image.array[tuple(study.hard_data.cells.T)]).all()


def test_names_in_a_pair_may_be_stated():
    image = image_of("picture")
    data = HardData.of((CELLS[:2], ["mud", "sand"]), SHAPE, image, {"Mud": 1, "sand": "facies 0"})
    assert data.facies.tolist() == [1, 0]
    with pytest.raises(CCWSIMError, match="mud"):
        HardData.of((CELLS[:2], ["mud", "sand"]), SHAPE, image)


def test_the_command_line_warns_or_takes_the_stated_facies(tmp_path, recwarn):
    files = {"ti.png": IMAGES["picture"][1](), "w.csv": table(), "soft.gslib": probabilities()}
    files["other.npy"] = codes()
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    line = f"simulate {tmp_path}/ti.png --grid 60x60 --template 16 --overlap 4 --level 1 -q"
    line += f" --hard-data {tmp_path}/w.csv --probability {tmp_path}/soft.gslib"
    line += f" --other-image {tmp_path}/other.npy -o {tmp_path}/out.npz"
    assert main(line.split()) == 0
    messages = [str(w.message) for w in recwarn if "by number" in str(w.message)]
    assert [message.partition(":")[0] for message in messages] == [
        "w.csv",
        "probabilities",
        "further image 1",
    ]
    recwarn.clear()
    stated = ["--facies-name", "0=1", "--facies-name", "1=facies 0"]
    assert main([*line.split(), *stated]) == 0
    assert not [w for w in recwarn if "by number" in str(w.message)]
    with np.load(tmp_path / "out.npz") as saved:
        cells, facies = saved["hard_cells"], saved["hard_facies"]
    assert (facies == 1 - CHANNEL[tuple(cells.T)]).all()


def test_names_in_a_matrix_are_no_codes_of_data():
    rows = [",".join("mud" if value else "sand" for value in row) for row in CHANNEL[::-1]]
    matrix = "\n".join(rows).encode()
    image = read_training_image(named(matrix, "rivers.csv"))
    assert (image.numbering, {*image.facies_names}) == ("names", {"sand", "mud"})
    assert data_are_right(TrainingImage(1 - CHANNEL, facies_names=("mud", "sand")), matrix, None)
    with pytest.warns(UserWarning, match="matched by number"):
        import_hard_data(named(table(), "wells.csv"), SHAPE, image)
