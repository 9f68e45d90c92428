"""Test that a study names the inputs in which it differs from another study."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, HardData, Parameters, Secondary, TrainingImage
from ccwsim.model.study import Study
from tests.small_images import noise

CELLS = noise((40, 40), 3)
STUDY = Study(TrainingImage(CELLS), Grid(30, 20), Parameters(16, 4, 1))
OTHERS: dict[str, Any] = {
    "training image": TrainingImage(CELLS[::-1]),
    "grid": Grid(30, 20, (2.0, 2.0)),
    "parameters": Parameters(16, 4, 0),
    "hard data": HardData([[1, 2]], [int(CELLS.max())]),
    "seed": 5,
    "secondary information": Secondary(active=np.arange(600).reshape(30, 20) > 7),
}


@pytest.mark.parametrize("name", OTHERS)
def test_the_input_that_differs_is_named_and_changes_the_key(name):
    field = "secondary" if name == "secondary information" else name.replace(" ", "_")
    other = replace(STUDY, **{field: OTHERS[name]})
    assert other.differs_from(STUDY) == STUDY.differs_from(other) == [name]
    assert other.key() != STUDY.key()
    assert other.key(name) == STUDY.key(name)


def test_names_of_images_and_facies_do_not_count():
    n = STUDY.training_image.n_facies
    named = TrainingImage(CELLS, name="other", facies_names=[f"f{k}" for k in range(n)])
    assert replace(STUDY, training_image=named).differs_from(STUDY) == []


def test_only_an_unchecked_study_may_have_a_template_that_does_not_fit():
    large = Parameters(64, 16, 1)
    with pytest.raises(CCWSIMError, match="64"):
        replace(STUDY, parameters=large)
    unchecked = replace(STUDY, parameters=large, checked=False)
    with pytest.raises(CCWSIMError, match="64"):
        replace(unchecked, checked=True)
