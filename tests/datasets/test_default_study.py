"""Test that the stored realizations of the first study equal those of `simulate`."""

import numpy as np

from ccwsim.datasets.default_study import stored_ensemble
from tools.default_study import simulated


def test_stored_realizations_are_those_of_simulate():
    stored, own = stored_ensemble(), simulated()
    assert stored.digest == own.digest
    np.testing.assert_array_equal(stored.data_status, own.data_status)
    np.testing.assert_array_equal(stored.numbers, own.numbers)
    assert not stored.n_mismatched.any()


def test_no_time_of_another_machine_is_stored():
    assert np.isnan(stored_ensemble().cpu_seconds).all()
