"""Test the shortest complete use of the program."""

import numpy as np

import ccwsim


def test_a_tiny_study_gives_realizations_that_honour_its_data():
    training_image = ccwsim.TrainingImage(np.tile([[0, 0, 7, 7]], (12, 5)))
    hard_data = ccwsim.HardData([[2, 3], [9, 14]], [7, 0])
    parameters = ccwsim.Parameters(template_size=8, overlap_size=2, wavelet_level=1)
    ensemble = ccwsim.simulate(
        training_image, (15, 20), parameters, hard_data, n_realizations=2, seed=1
    )
    assert ensemble.realizations.shape == (2, 15, 20)
    assert set(np.unique(ensemble.realizations)) == {0, 7}
    assert (ensemble.realizations[:, [2, 9], [3, 14]] == [7, 0]).all()
    assert ensemble.n_mismatched.tolist() == [0, 0]
