"""Test that parameters are valid, or refused with a message that states valid values."""

import re
from dataclasses import FrozenInstanceError, asdict, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings, strategies as st
from hypothesis.extra import numpy as hnp

from ccwsim import CCWSIMError, Parameters
from ccwsim.model.parameters import METHODS, SIMILARITIES, fitted, parameter_table
from ccwsim.model.sizes import legal_sizes

NAMES = [f.name for f in fields(Parameters)]

absurd = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.integers(-2, 70),
    st.floats(),
    st.floats(-0.1, 1.1),
    st.complex_numbers(),
    st.text(max_size=6),
    st.sampled_from(["ccwsim", "CCWSIM", "ccsim", "ms-ccsim", "ssd", "correlation", b"ssd"]),
    st.lists(st.integers(), max_size=2),
    st.dictionaries(st.text(max_size=1), st.integers(), max_size=1),
    st.sampled_from([np.int8(4), np.uint64(2**63), np.float32(0.25), np.bool_(True)]),
    hnp.arrays(st.sampled_from([bool, int, float, complex, "U6"]), st.sampled_from([(), 1, 2])),
)


def is_valid(p: Parameters) -> bool:
    """Return whether parameters are valid, by an independent implementation."""
    unit = 1 if p.method == "ccsim" else 2**p.wavelet_level
    types = {
        int: "template_size overlap_size wavelet_level n_candidates co_template",
        float: "search_fraction template_variation",
        bool: "random_path match_proportions published_draw repair_seams refine exact_data",
        str: "method similarity",
    }
    return (
        all(type(getattr(p, n)) is kind for kind, names in types.items() for n in names.split())
        and 4 <= p.template_size <= 1024
        and 1 <= p.overlap_size <= p.template_size / 2
        and p.template_size % unit == p.overlap_size % unit == 0
        and 0 <= p.wavelet_level <= 6
        and p.n_candidates >= 1
        and 1 <= p.co_template <= 4
        and 0 < p.search_fraction <= 1
        and 0 <= p.template_variation <= 0.5
        and p.method in METHODS
        and p.similarity in SIMILARITIES
    )


def valid_or_refused(given: dict[str, Any]) -> bool:
    """Return whether values are valid, after checking that invalid values raise a good message."""
    try:
        return is_valid(Parameters(**given))
    except CCWSIMError as error:
        return len(str(error)) > 20


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=80, deadline=None)
@given(value=absurd)
@example(value=np.array(["ssd", "ccsim"]))
def test_any_value_of_a_parameter_is_valid_or_refused_in_words(name, value):
    assert valid_or_refused({name: value})


@given(
    st.fixed_dictionaries(
        {
            "template_size": st.integers(0, 1100),
            "overlap_size": st.integers(0, 600),
            "wavelet_level": st.integers(-1, 7),
            "method": st.sampled_from(METHODS),
        }
    )
)
def test_sizes_and_level_are_valid_together_or_refused(sizes):
    assert valid_or_refused(sizes)


@given(st.integers(1, 6), st.integers(4, 1024), st.integers(1, 512))
def test_the_sizes_that_a_message_proposes_are_accepted(level, template, overlap):
    wanted = {"template_size": template, "overlap_size": overlap, "wavelet_level": level}
    for _ in range(3):
        try:
            assert is_valid(Parameters(**wanted))
            return
        except CCWSIMError as error:
            proposed = re.search(r"try (\d+)", str(error))
            assume(proposed is not None)
            name = "template_size" if str(error).startswith("Template") else "overlap_size"
            wanted[name] = int(proposed.group(1))
    pytest.fail(f"the messages never lead to valid sizes: {wanted}")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("template_size", 33, "Template 33 must be a multiple of 4 at level 2: try 32 or 36"),
        ("overlap_size", 10, "Overlap 10 must be a multiple of 4 at level 2: try 8 or 12"),
        ("overlap_size", 20, "at most half the template"),
        ("template_size", 2048, "from 4 to 1024"),
        ("search_fraction", 0.0, "more than 0"),
        ("search_fraction", float("nan"), "nan"),
        ("method", "snesim", "ccwsim, ccsim"),
        ("similarity", "", "ssd, correlation"),
        ("refine", 1, "True or False"),
    ],
)
def test_messages_name_the_value_and_the_mend(name, value, said):
    with pytest.raises(CCWSIMError, match=re.escape(said)):
        Parameters(**{name: value})


def test_ccsim_has_no_level_and_so_takes_any_sizes():
    p = Parameters(template_size=33, overlap_size=7, wavelet_level=3, method="ccsim")
    assert p.level == 0
    assert p.step == 26


@given(st.integers(0, 6), st.integers(1, 200), st.integers(1, 200))
def test_legal_sizes_are_all_multiples_in_the_range(level, smallest, largest):
    expected = [n for n in range(smallest, largest + 1) if n % 2**level == 0]
    assert legal_sizes(level, smallest, largest) == expected


def test_the_table_has_a_row_for_each_parameter_with_its_default():
    table = {row["name"]: row for row in parameter_table()}
    assert list(table) == NAMES
    for name, value in asdict(Parameters()).items():
        assert table[name]["default"] == str(value)
        assert table[name]["meaning"].endswith(".")


def test_the_documentation_lists_every_parameter():
    for name in NAMES:
        assert f"\n{name} : " in (Parameters.__doc__ or "")


def test_parameters_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        Parameters().template_size = 16  # type: ignore[misc]


def test_every_parameter_is_part_of_the_digest():
    base = Parameters(template_size=64, overlap_size=16)
    others = {
        "template_size": 32,
        "overlap_size": 8,
        "wavelet_level": 1,
        "n_candidates": 3,
        "method": "ccsim",
        "similarity": "correlation",
        "search_fraction": 0.5,
        "co_template": 3,
        "random_path": False,
        "template_variation": 0.1,
        "match_proportions": True,
        "published_draw": True,
        "repair_seams": False,
        "refine": False,
        "exact_data": False,
        "location_weight": 1.0,
    }
    assert set(others) == set(NAMES) - {"variant"}
    digests = {replace(base, **{name: value}).digest for name, value in others.items()}
    assert len({base.digest, *digests}) == len(others) + 1
    paper, unnamed = base.as_in("paper"), replace(base.as_in("paper"), variant="ours")
    assert paper.digest != unnamed.digest
    assert base.digest == Parameters(template_size=np.int16(64), overlap_size=16).digest


def test_a_fitted_variant_brings_its_parameters_and_a_volume_has_ours():
    usual = Parameters(22, 6, 1, n_candidates=5)
    for variant in ("paper", "code"):
        assert fitted(usual, (100, 100), variant=variant) == usual.as_in(variant)
        assert fitted(usual.as_in(variant), (100, 100), variant="ours") == usual
        volume = fitted(usual.as_in(variant), (30, 100, 100))
        assert volume == fitted(usual, (30, 100, 100))
    assert fitted(usual.as_in("paper"), (100, 100), refine=True).variant == "ours"


def test_a_published_variant_fixes_its_parameters_and_no_others():
    own = Parameters(16, 4, 1, n_candidates=3, co_template=1, location_weight=0.5)
    paper, code = own.as_in("paper"), own.as_in("code")
    assert paper == Parameters.published(
        "paper", template_size=16, overlap_size=4, wavelet_level=1, n_candidates=3, co_template=1
    )
    assert (paper.similarity, code.similarity) == ("correlation", "ssd")
    assert paper.as_in("paper") is paper
    assert paper.as_in("ours") == replace(own, location_weight=0.0)
    assert code.as_in("paper") == paper
    for change in ({"refine": True}, {"similarity": "ssd"}, {"exact_data": True}):
        name, value = next(iter(change.items()))
        with pytest.raises(CCWSIMError, match=f"{name} = {value} is not allowed with .* paper"):
            replace(paper, **change)
    with pytest.raises(CCWSIMError, match="ours, paper, code"):
        own.as_in("MATLAB")  # type: ignore[arg-type]


class TestVolumes:
    """Template, overlap and level along z, y and x."""

    def test_one_number_holds_for_all_axes_of_the_image(self):
        p = Parameters(template_size=32, overlap_size=8, wavelet_level=2)
        assert p.along((100, 200)) == ((1, 32, 32), (0, 8, 8), (0, 2, 2))
        assert p.along((50, 100, 200)) == ((32, 32, 32), (8, 8, 8), (2, 2, 2))

    def test_three_numbers_are_kept_as_they_are_given(self):
        for kind in (tuple, list, np.array):
            p = Parameters(kind((16, 32, 48)), kind((4, 8, 12)), kind((1, 2, 2)))
            assert p.along((50, 100, 200)) == ((16, 32, 48), (4, 8, 12), (1, 2, 2))
            assert p.step == (12, 24, 36)
            assert p.level == (1, 2, 2)
            assert hash(p) == hash(replace(p))

    def test_some_may_be_one_number_and_others_three(self):
        p = Parameters((8, 32, 32), 4, (0, 2, 1))
        assert p.along((9, 40, 40)) == ((8, 32, 32), (4, 4, 4), (0, 2, 1))

    @pytest.mark.parametrize("name", ["template_size", "overlap_size", "wavelet_level"])
    def test_three_numbers_are_none_of_a_map(self, name):
        own = {"template_size": (16, 32, 32), "overlap_size": (4, 8, 8), "wavelet_level": (1, 2, 2)}
        with pytest.raises(CCWSIMError, match=f"{name} = .* the grid is a map: give one number"):
            Parameters(**{name: own[name]}).along((100, 100))

    def test_no_axis_has_a_level_where_single_cells_are_compared(self):
        p = Parameters((7, 9, 9), (3, 4, 4), (1, 2, 2), method="ccsim")
        assert p.along((50, 100, 200)).level == (0, 0, 0)
        assert p.scale == 0

    def test_images_are_coarsened_as_often_as_the_largest_level_says(self):
        levels = {"wavelet_level": (0, 2, 1)}
        assert Parameters((4, 8, 8), (1, 4, 4), **levels, method="ms-ccsim").scale == 2
        assert Parameters((4, 8, 8), (1, 4, 4), **levels).scale == 0

    @pytest.mark.parametrize(
        ("template", "overlaps"), [(1, {0}), (2, {0, 1}), (3, {0, 1}), (4, {1, 2})]
    )
    def test_templates_may_be_thin_along_z(self, template, overlaps):
        for overlap in range(4):
            sizes = (template, 32, 32), (overlap, 8, 8), (0, 2, 2)
            if overlap in overlaps:
                assert Parameters(*sizes).along((9, 40, 40)) == sizes
            else:
                with pytest.raises(CCWSIMError, match=f"Overlap {overlap} along z must be at"):
                    Parameters(*sizes)

    @pytest.mark.parametrize(
        ("given", "said"),
        [
            (
                ((16, 32, 30), 8, 2),
                "Template 30 along x must be a multiple of 4 at level 2: try 28",
            ),
            (
                ((16, 30, 32), 8, 2),
                "Template 30 along y must be a multiple of 4 at level 2: try 28",
            ),
            (((1, 32, 32), (0, 8, 8), 2), "Template 1 along z must be a multiple of 4 at level 2"),
            (((4, 32, 32), (4, 8, 8), 2), "Overlap 4 along z must be at most half the template"),
            (((4, 32, 32), (2, 8, 9), (0, 2, 2)), "Overlap 9 along x must be a multiple of 4"),
            (
                ((16, 32, 32), (0, 8, 8), 2),
                "Overlap 0 along z must be at least 1 at level 2: try 4",
            ),
            (
                ((16, 2, 32), 8, 2),
                "template_size along y = 2 must be a whole number from 4 to 1024",
            ),
            (
                ((0, 32, 32), 8, 2),
                "template_size along z = 0 must be a whole number from 1 to 1024",
            ),
            (((16, 32, 32), 8, (1, 2, 7)), "wavelet_level along x = 7"),
            (((16, 32, 32), (4.0, 8, 8), 2), "overlap_size along z = 4.0"),
            (((16, 32), 8, 2), "template_size = (16, 32) must be a whole number"),
        ],
    )
    def test_messages_name_the_axis(self, given, said):
        with pytest.raises(CCWSIMError, match=re.escape(said)):
            Parameters(*given)

    def test_digests_of_one_number_stay_and_others_differ(self):
        assert Parameters().digest == "8f6a4ad40aa1a4ca0792a751"
        assert Parameters().digest != Parameters((32, 32, 32)).digest
        assert Parameters((16, 32, 32)).digest == Parameters([16, np.int8(32), 32]).digest
