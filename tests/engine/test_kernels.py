"""Test that kernels allocate no arrays, so that reference counting can be switched off."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from numba.core.errors import TypingError

from ccwsim.engine import kernels


def first_of(arrays):
    return arrays[0][0] + arrays[1].reshape(-1)[-1]


def test_kernels_do_not_count_who_holds_an_array(monkeypatch):
    monkeypatch.setattr(
        kernels, "KERNEL_FOLDER", ""
    )  # kernels read from disk have no code to inspect
    part = kernels.part_of_kernel(first_of)

    given = np.arange(3), np.arange(6).reshape(2, 3)
    found = kernels.kernel(lambda arrays: part(arrays) * 2)
    assert found(given) == 10
    counted = kernels.allocating_kernel(lambda arrays: part(arrays) * 2)
    assert counted(given) == 10
    code, other = (next(iter(each.dispatcher.inspect_llvm().values())) for each in (found, counted))
    assert "NRT_incref" not in code
    assert "NRT_incref" in other


def test_only_kernels_that_say_so_make_arrays(monkeypatch):
    monkeypatch.setattr(kernels, "KERNEL_FOLDER", "")
    with pytest.raises(TypingError):
        kernels.kernel(lambda n: np.zeros(n).sum())(3)
    assert kernels.allocating_kernel(lambda n: np.zeros(n))(3).tolist() == [0, 0, 0]


@pytest.mark.parametrize("decorate", [kernels.kernel, kernels.allocating_kernel])
def test_a_kernel_keeps_no_random_generator(monkeypatch, decorate):
    monkeypatch.setattr(kernels, "KERNEL_FOLDER", "")
    draw = decorate(lambda rng: rng.random())
    rng, other = (np.random.default_rng(1) for _ in range(2))
    held = rng, rng.bit_generator
    n_references = [*map(sys.getrefcount, held)]
    assert [draw(rng) for _ in range(5)] == other.random(5).tolist()
    assert [*map(sys.getrefcount, held)] == n_references
