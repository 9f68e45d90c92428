"""Parameters are valid or refused with a sentence that says what would be."""

import re
from dataclasses import FrozenInstanceError, asdict, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ccwsim import CCWSIMError, Parameters
from ccwsim.model.parameters import METHODS, SIMILARITIES, legal_sizes, parameter_table

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
    """Say in other words than the code what valid parameters are."""
    unit = 1 if p.method == "ccsim" else 2**p.wavelet_level
    types = {
        int: "template_size overlap_size wavelet_level n_candidates co_template",
        float: "search_fraction template_variation",
        bool: "random_path match_proportions refine exact_data",
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
    """Return whether the values are valid parameters or refused with a sentence."""
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
        "refine": False,
        "exact_data": False,
        "location_weight": 1.0,
    }
    assert set(others) == set(NAMES)
    digests = {replace(base, **{name: value}).digest for name, value in others.items()}
    assert len({base.digest, *digests}) == len(others) + 1
    assert base.digest == Parameters(template_size=np.int16(64), overlap_size=16).digest
