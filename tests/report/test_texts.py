"""Test small functions of reports, links, limits and commands with one or two values each."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.cli.options import suggestion
from ccwsim.cli.simulate import streamed_output
from ccwsim.jobs import limits
from ccwsim.jobs.limits import Demand, needs_consent
from ccwsim.report.pictures import bundle_of_curves, layer_data, layers_of_image
from ccwsim.report.settings import caption_of, describe_parameters, describe_setting
from ccwsim.report.verdicts import curve_title, describe_variety, way_name
from ccwsim.sharing import codec
from ccwsim.sharing.choices import ImageChoice
from ccwsim.sharing.link import first_values, usual_data
from ccwsim.sharing.words import packed, unpacked

VOLUME = Parameters((16, 32, 32), (4, 8, 8), (1, 2, 2))
LONG = {"seed": ["7"], "name": ["sand"] * 1000, "grid": ["80x60"]}


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (describe_parameters(Parameters()), "CCWSIM, level 2, template 32, overlap 8, K 20"),
        (
            describe_parameters(VOLUME),
            "CCWSIM, level 2 × 2 × 1, template 32 × 32 × 16, overlap 8 × 8 × 4, K 20",
        ),
        ((way_name("E-W"), way_name(45.0)), ("E–W", "45°")),
        (curve_title("variogram", "E-W"), "Variogram E–W"),
        (curve_title("connectivity", "vertical"), "Vertical connectivity"),
        (
            describe_variety(0.1, [0.5, 0.5]),
            "two realizations differ in 10 % of the cells (50 % if cells were independent)",
        ),
        ([codec.format_exactly(n) for n in (5.0, 1e-7, -0.1)], ["5", "0.0000001", "-0.1"]),
        (
            [codec.link_name(n) for n in ("template_size", "n_candidates")],
            ["template", "candidates"],
        ),
        (codec.link_name("wavelet_level"), "level"),
        (usual_data(ImageChoice("channels")).bundled, "channels_400_data"),
        (usual_data(ImageChoice("dunes")).source, "none"),
        (first_values(LONG.items()), {"seed": ["7"]}),
        (packed(HardData([[3, 4], [3, 9], [60, 2]], [1, 1, 0])), "0_0_1P_A~1_Y_5~0_GQ~3"),
        (unpacked("0_0_1P_A~1_Y_5~0_GQ~3").cells.tolist(), [[3, 4], [3, 9], [60, 2]]),
        (suggestion("chanels", ["channels", "dunes"]), " Did you mean channels?"),
        (suggestion("oil", ["channels"]), ""),
        (streamed_output(["out.png", "out.npy"]), "out.npy"),
        (
            [limits.format_millions(n) for n in (786_432, 1_200_000_000, 2_500_000)],
            ["786,432", "1,200 million", "2.5 million"],
        ),
        (needs_consent(Demand(65_536), 0.1), False),
        (needs_consent(Demand(2_000_000_000), 25.0), True),
        (layers_of_image(Grid(5, 5, nz=2), 4).tolist(), [0.25, 0.75, 1.25, 1.75]),
    ],
)
def test_the_value_is_as_expected(found, expected):
    assert found == expected


def test_quantiles_of_lags_without_values_are_unknown():
    each = np.array([[0.0, np.nan], [2.0, np.nan]])
    median = bundle_of_curves(np.arange(2.0), np.zeros(2), each).median
    assert np.array_equal(median, [1.0, np.nan], equal_nan=True)


def test_data_are_counted_by_layer():
    data = HardData([[0, 1, 1], [0, 2, 2], [3, 1, 1]], [1, 0, 1])
    found = layer_data(data, Grid(5, 5, nz=4), 1)
    assert found.at.tolist() == [0.5, 3.5]
    assert found.share.tolist() == [0.5, 1.0]
    assert found.count.tolist() == [2, 1]


def test_a_caption_says_image_setting_and_seed():
    image = TrainingImage([[0, 1] * 20] * 40, name="stripes")
    ensemble = simulate(image, (30, 30), Parameters(16, 4, refine=False), seed=5)
    assert caption_of(ensemble).split("; ") == [
        "stripes, no hard data, grid 30 × 30",
        "CCWSIM, level 2, template 16, overlap 4, K 20, no refine",
        "1 realization, seed 5",
    ]


def test_a_variant_describes_the_parameters_that_it_sets():
    study = Parameters(wavelet_level=1)
    assert describe_setting(study.as_in("paper"), study) == "as in the paper"
    assert describe_setting(study, study.as_in("code")) == "ours"
    coarser = Parameters.published("paper", wavelet_level=3)
    assert describe_setting(coarser, study) == "level 3, as in the paper"
    assert describe_setting(study.as_in("paper"), study.as_in("paper")) == "the same"
