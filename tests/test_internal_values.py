"""Test small internal functions by single values."""

from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, Parameters, TrainingImage, datasets
from ccwsim.engine.lengths import lengths_of, templates
from ccwsim.engine.stages.candidates import n_up_to
from ccwsim.engine.stages.similarity import sum_type
from ccwsim.experiments.plan import plan_sweep
from ccwsim.experiments.sweep import pareto_front
from ccwsim.flow.answers import at_percentiles, starts_on_grid
from ccwsim.io import Conversion, preview_wells
from ccwsim.model.arrays import check_choice, check_number
from ccwsim.model.facies_property import values_by_facies
from ccwsim.model.parameters import fitted
from ccwsim.ui.guides.page import frame
from ccwsim.ui.session.resolve import position_along, taken_by_code
from ccwsim.ui.widgets.fields import bound_to
from ccwsim.ui.widgets.text import plain


def test_lengths():
    assert lengths_of(Parameters(32, 8, 2), (60, 100))[0][:3] == ((1, 32, 32), (0, 8, 8), (0, 2, 2))
    scales = lengths_of(Parameters(32, 8, 2, method="ms-ccsim"), (9, 9))
    assert [own.template for own in scales] == [(1, 32, 32), (1, 16, 16), (1, 8, 8)]
    assert templates(Parameters(32, 8, 2, template_variation=0.1), (60, 100)) == [(1, 32, 32)]
    p = Parameters((8, 32, 16), (2, 8, 4), 1, template_variation=0.2)
    assert templates(p, (20, 99, 99)) == [(6, 28, 14), (8, 32, 16), (8, 36, 18)]


def test_types_and_counts_of_the_engine():
    names = [sum_type((0, n, n), (1, 32, 32)).__name__ for n in range(6)]
    assert names == ["uint16"] * 4 + ["uint32"] * 2
    assert n_up_to(np.array([3, 1, 2]), 2) == 2
    assert check_number("share", 1, 0.0, 1.0) == 1.0
    assert check_number("within", float("inf"), 0.0, float("inf")) == float("inf")
    with pytest.raises(CCWSIMError, match="within = "):
        check_number("within", 10**400, 0.0, float("inf"))


@pytest.mark.parametrize("value", [None, 3, [], {}, "up", np.array(["upper", "lower"])])
def test_a_choice_of_any_type_is_refused_in_words(value):
    for refuse in (
        lambda: check_choice("on_overlap", value, ("upper", "lower")),
        lambda: Conversion(on_overlap=value),
        lambda: preview_wells(BytesIO(b"BHID,From,To,Rock\nA,1,3,1\n"), value),
    ):
        with pytest.raises(CCWSIMError, match="must be one of"):
            refuse()


def test_flow():
    assert starts_on_grid(Grid(4, 8), 4)[0].tolist() == [[2.5, 2.5], [6.5, 2.5]]
    assert at_percentiles(np.array([3.0, 1.0, 2.0]), (0, 50, 100)).tolist() == [1, 2, 0]
    image = TrainingImage([[0, 7]], facies_names=["mud", "sand"])
    assert values_by_facies(image, {"mud": 1, 7: 10}).tolist() == [1.0, 10.0]


def test_widgets():
    page_state = SimpleNamespace(n=3)
    bound_to(page_state, "n")["write"](4)
    assert page_state.n == 4
    text = plain("**a** :red[b] $c$ <img src=x>, template_size: 3")
    assert text == r"\*\*a\*\* \:red\[b\] \$c\$ \<img src=x>, template_size: 3"


def test_sweeps():
    found = plan_sweep(Parameters(), {"wavelet_level": [1, 3], "overlap_size": [8, 12]})
    assert [(p.wavelet_level, p.overlap_size) for p in found] == [(1, 8), (3, 8), (1, 12)]
    assert found.left_out[0][1].startswith("Overlap 12 must be a multiple of 8 at level 3")
    assert pareto_front([1.0, 2.0, 3.0], [5.0, 6.0, 4.0]).tolist() == [0, 2]


def test_choices_of_a_page():
    assert position_along(90.0, Grid(1, 3)).tolist() == [[0.0, 0.5, 1.0]]
    assert frame(Grid(11, 21))[2] == (18.5, 9.5)
    assert taken_by_code(["mud", "sand"], datasets.load("stone_wall")) == {"mud": 0, "sand": 1}
    names = ["interdune", "slip face", "sand body"]
    assert taken_by_code(names, datasets.load("dunes")) == {}
    p = fitted(Parameters(overlap_size=12), (256, 256), wavelet_level=3)
    assert (p.template_size, p.overlap_size) == (32, 8)
    p = fitted(Parameters(), (9, 160, 160))
    assert (p.template_size, p.overlap_size) == ((8, 32, 32), (4, 8, 8))
    assert p.wavelet_level == (1, 2, 2)
