"""Test that absurd arguments of flow give a result, or an error in words."""

from __future__ import annotations

import inspect
import os
import random
from itertools import chain

import pytest

from ccwsim import flow, io
from ccwsim.io import flow_models
from tests.fuzz.arguments import ABSURD, flows
from tests.fuzz.flows import FUNCTIONS, flow_arguments, spoilt_calls
from tests.fuzz.workers import measured

pytestmark = pytest.mark.filterwarnings("ignore")
N_CASES = 100
N_SLOW = int(os.environ.get("CCWSIM_FLOW_CASES", "800"))
"""Random cases of the fast and of all tests; 8000 in the environment test more combinations."""


def faults(numbers: range) -> list[tuple]:
    acts = ((k, flows(random.Random(f"flow {k}"))) for k in numbers)
    outcomes = [measured(k, iter([("flow", act)])) for k, act in acts]
    return [(o.case, *o.faults) for o in outcomes if o.faults]


def test_random_arguments_of_flow_give_a_result_or_are_refused():
    assert faults(range(N_CASES)) == []


@pytest.mark.slow
def test_each_argument_of_flow_may_be_absurd():
    acts = spoilt_calls(ABSURD)
    assert [*chain(*(measured(name, iter([(name, act)])).faults for name, act in acts))] == []


@pytest.mark.slow
def test_many_random_arguments_of_flow_give_a_result_or_are_refused():
    assert faults(range(N_CASES, N_SLOW)) == []


def test_every_argument_of_flow_is_among_the_random_arguments():
    def names(function) -> set[str]:
        """Return the arguments, with those of the function that takes the rest."""
        rest = {io.grdecl_as_zip: io.write_grdecl, io.flopy_as_zip: io.to_flopy}
        own = inspect.signature(function).parameters
        if not any(p.kind is p.VAR_KEYWORD for p in own.values()):
            return set(own)
        inner = names(rest.get(function, flow.over)) - {"function", "path", "workspace"}
        return {p.name for p in own.values() if p.kind is not p.VAR_KEYWORD} | inner

    written = [f for name, f in vars(io).items() if name in vars(flow_models)]
    public = {f for f in (*vars(flow).values(), *written) if inspect.isfunction(f)}
    own = {f for f in public if f.__module__.startswith(("ccwsim.flow", flow_models.__name__))}
    assert set(FUNCTIONS) == own | {flow.Capture.brier}
    given = flow_arguments(random.Random(0), lambda value: value)
    for function, arguments in zip(FUNCTIONS, given, strict=True):
        assert set(arguments) == names(function), function.__name__
