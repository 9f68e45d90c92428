"""Test that files keep the values of continuous variables to the last digit."""

from io import BytesIO

import numpy as np
import pytest

from ccwsim import (
    CCWSIMError,
    Ensemble,
    Grid,
    HardData,
    Parameters,
    Project,
    Secondary,
    TrainingImage,
    read_hard_data,
    read_project,
    read_realizations,
    read_training_image,
    save_project,
    simulate,
    write_realizations,
)
from ccwsim.io import write_hard_data, write_training_image

GRID = Grid(40, 50, (10.0, 10.0), (500.0, 700.0), crs="EPSG:32632")


def field(scale: float = 1e-7) -> np.ndarray:
    rng = np.random.default_rng(0)
    return (
        scale
        * np.exp(np.add.outer(np.sin(np.arange(60) / 5), np.cos(np.arange(70) / 7)))
        * (1 + 0.01 * rng.random((60, 70)))
    )


@pytest.fixture(scope="module")
def image() -> TrainingImage:
    values = field()
    values[3:5, 60:] = np.nan
    return TrainingImage.from_array(values, continuous=True, variable="K", units="m/s", name="k")


@pytest.fixture(scope="module")
def ensemble(image) -> Ensemble:
    active = np.add.outer(np.arange(40), np.arange(50)) > 12
    data = HardData([[20, 20], [30, 7]], values={"K": [1.23456789012345e-7, 3e-7]})
    p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    return simulate(image, GRID, p, data, 3, seed=5, secondary=Secondary(active))


def equal(a, b) -> bool:
    return np.array_equal(a, b, equal_nan=True)


@pytest.mark.parametrize("format", ["npy", "sgems", "gslib", "dat"])
def test_images_come_back(image, format):
    file = BytesIO()
    write_training_image(file, image, format=format)
    file.seek(0)
    read = read_training_image(file, continuous=True, up=True)
    assert equal(read.values[read.variable], image.values["K"])
    assert equal(read.indices, image.indices)


@pytest.mark.parametrize("format", ["npz", "gslib", "sgems", "dat", "vti", "tif", "nc"])
def test_realizations_come_back(ensemble, image, format):
    file = BytesIO()
    write_realizations(file, ensemble, format=format)
    file.seek(0)
    read = read_realizations(file, image)
    assert equal(read.values["K"], ensemble.values["K"])
    assert equal(read.indices, ensemble.indices)
    assert read.grid.origin == GRID.origin


def test_realizations_as_npz_bring_their_image_and_data(ensemble):
    file = BytesIO()
    write_realizations(file, ensemble, format="npz")
    file.seek(0)
    read = read_realizations(file)
    assert read.training_image == ensemble.training_image
    assert read.training_image.units == "m/s"
    assert read.hard_data == ensemble.hard_data
    assert read.n_mismatched.tolist() == [0, 0, 0]
    assert read.study.fitting().contents == ensemble.study.contents


@pytest.mark.parametrize("format", ["png", "grdecl"])
def test_formats_of_facies_are_refused(ensemble, image, format):
    with pytest.raises(CCWSIMError, match=f"{format} contains facies only"):
        write_realizations(BytesIO(), ensemble, format=format)
    with pytest.raises(CCWSIMError, match=f"{format} contains facies only"):
        write_training_image(BytesIO(), image, format=format)


def test_a_data_array_has_units_and_coordinate_system(ensemble):
    array = ensemble.to_xarray()
    assert (array.name, array.attrs["units"], array.attrs["crs"]) == ("K", "m/s", "EPSG:32632")
    assert equal(array.values, ensemble.values["K"])


@pytest.mark.parametrize("format", ["csv", "geojson", "gslib", "dat"])
def test_hard_data_come_back(ensemble, image, format):
    file = BytesIO()
    write_hard_data(file, ensemble.hard_data, GRID, format=format)
    file.seek(0)
    assert read_hard_data(file, GRID, image, facies="K") == ensemble.hard_data


def test_data_with_several_values_in_a_cell_need_a_decision(image):
    text = b"row,col,K\n3,4,1e-7\n3,4,2e-7\n5,5,3e-7\n5,5,3e-7\n"
    with pytest.raises(CCWSIMError, match="1e-07"):
        read_hard_data(BytesIO(text), GRID, image, facies="K")
    data = read_hard_data(BytesIO(text), GRID, image, facies="K", on_collision="nearest")
    assert data.values["K"].tolist() == [1e-7, 3e-7]


def test_data_of_names_or_classes_are_refused(image):
    with pytest.raises(CCWSIMError, match="has values of K; give data with numbers"):
        read_hard_data(BytesIO(b"row,col,facies\n3,4,sand\n5,5,mud\n"), GRID, image)
    with pytest.raises(CCWSIMError, match="without a threshold"):
        read_hard_data(BytesIO(b"row,col,facies\n3,4,1.5\n"), GRID, image, threshold=1e-7)


def test_a_table_of_points_conditions_values(image):
    table = {"x": [745.0], "y": [905.0], "K": [2e-7]}
    assert HardData.of(table, GRID, image).values["K"].tolist() == [2e-7]


def test_pictures_and_merged_facies_have_no_values():
    file = BytesIO()
    write_training_image(file, TrainingImage(np.eye(20)), format="png")
    file.seek(0)
    with pytest.raises(CCWSIMError, match="only grids of numbers"):
        read_training_image(file, continuous=True)


def test_a_project_simulates_the_same_values(ensemble):
    file = BytesIO()
    save_project(file, Project(ensemble.study, 3))
    file.seek(0)
    again = read_project(file)
    assert again.study.contents == ensemble.study.contents
    assert equal(again.simulate().values["K"], ensemble.values["K"])
