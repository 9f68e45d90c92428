"""Old public names work for one more release, with a warning that names the new one."""

import importlib
import sys

import pytest

import ccwsim
from ccwsim import metrics


@pytest.mark.parametrize(
    ("old", "name"),
    [
        ("ccwsim.trace", "Trace"),
        ("ccwsim.comparison", "compare"),
        ("ccwsim.sweep", "sweep"),
        ("ccwsim.timing", "TimingCase"),
    ],
)
def test_moved_modules_are_found_under_their_old_names(old, name):
    sys.modules.pop(old, None)
    with pytest.warns(DeprecationWarning, match=f"{old} is now ccwsim"):
        module = importlib.import_module(old)
    assert module.__dict__[name].__module__.startswith(("ccwsim.engine", "ccwsim.experiments"))


def test_renamed_measures_are_found_under_their_old_names():
    for old, new in (("reuse", "copying"), ("Bodies", "Geobodies"), ("score_truth", None)):
        with pytest.warns(DeprecationWarning, match=f"metrics.{old} is now"):
            found = getattr(metrics, old)
        assert found is (metrics.score_reference if new is None else getattr(metrics, new))


def test_a_name_that_never_was_is_an_error():
    with pytest.raises(AttributeError):
        metrics.__getattr__("no_such_measure")
    with pytest.raises(AttributeError):
        ccwsim.__getattr__("no_such_name")
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("ccwsim.no_such_module")
