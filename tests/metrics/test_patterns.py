"""Test pattern histograms and coarsening against plain counting and scikit-image."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.distance import jensenshannon
from skimage.transform import resize

from ccwsim.metrics import (
    coarsened,
    js_divergence,
    pattern_distance,
    pattern_histogram,
    pyramid_histograms,
)
from ccwsim.metrics.pattern_codes import count_patterns
from ccwsim.model.errors import CCWSIMError


def smooth_image(seed, shape, n_facies=2):
    rng = np.random.default_rng(seed)
    noise = resize(rng.random((shape[0] // 4 + 2, shape[1] // 4 + 2)), shape, order=3)
    ranks = noise.ravel().argsort().argsort().reshape(shape)
    return (ranks * n_facies // ranks.size).astype(np.uint8)


def counted(image, size):
    ny, nx = image.shape
    windows = (
        image[i : i + size, j : j + size].tobytes()
        for i in range(ny - size + 1)
        for j in range(nx - size + 1)
    )
    return Counter(windows)


def plain_js(a, b, size):
    one, two = counted(a, size), counted(b, size)
    keys = list({**one, **two})
    return jensenshannon([one[k] for k in keys], [two[k] for k in keys], base=2) ** 2


@settings(deadline=None, max_examples=25)
@given(
    seed=st.integers(0, 10**6),
    n_facies=st.sampled_from([1, 2, 3, 5, 17]),
    size=st.integers(1, 8),
    ny=st.integers(8, 20),
    nx=st.integers(8, 20),
)
def test_counts_and_divergence_are_those_of_plain_counting(seed, n_facies, size, ny, nx):
    rng = np.random.default_rng(seed)
    a, b = rng.integers(0, n_facies, (2, ny, nx)).astype(np.uint8)
    b[:, : nx // 2] = a[:, : nx // 2]
    one, two = (pattern_histogram(image, range(n_facies), size) for image in (a, b))
    expected = counted(a, size)
    assert sorted(expected.values()) == sorted(
        np.rint(one.frequencies * sum(expected.values())).astype(int)
    )
    assert (np.diff(one.codes.astype(object)) > 0).all()
    assert js_divergence(one, two) == pytest.approx(plain_js(a, b, size), abs=1e-12)
    assert js_divergence(one, two) == pytest.approx(js_divergence(two, one))
    assert js_divergence(one, one) == 0


@pytest.mark.parametrize(("shape", "factor"), [((64, 64), 2), ((64, 50), 3), ((41, 67), 4)])
@pytest.mark.parametrize("n_facies", [2, 4])
def test_coarsening_is_the_anti_aliased_resizing_of_scikit_image(shape, factor, n_facies):
    image = smooth_image(5, shape, n_facies)
    smaller = tuple(n // factor for n in shape)
    shares = np.array(
        [resize((image == f).astype(float), smaller, anti_aliasing=True) for f in range(n_facies)]
    )
    result = coarsened(image, factor, range(n_facies))
    chosen = np.take_along_axis(shares, result[None].astype(int), axis=0)[0]
    np.testing.assert_allclose(chosen, shares.max(axis=0), atol=1e-8)
    clear = np.sort(shares, axis=0)[-1] - np.sort(shares, axis=0)[-2] > 1e-8
    np.testing.assert_array_equal(result[clear], shares.argmax(axis=0)[clear])
    assert clear.mean() > 0.8


@given(seed=st.integers(0, 10**6), factor=st.integers(1, 5))
@settings(deadline=None, max_examples=10)
def test_coarsening_keeps_a_constant_image_and_the_facies(seed, factor):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(factor, 30, 2))
    assert (coarsened(np.full(shape, 2), factor) == 2).all()
    image = rng.integers(1, 4, shape)
    assert set(np.unique(coarsened(image, factor))) <= set(np.unique(image))


def test_histograms_of_a_stack_are_those_of_its_images():
    stack = np.stack([smooth_image(k, (30, 40), 3) for k in range(3)])
    shares = []
    rows = pyramid_histograms(stack, range(3), factors=(1, 2), progress=shares.append)
    assert shares[-1] == 1
    for image, row in zip(stack, rows, strict=True):
        for factor, found in zip((1, 2), row, strict=True):
            alone = pattern_histogram(coarsened(image, factor, range(3)), range(3))
            np.testing.assert_array_equal(found.codes, alone.codes)
            np.testing.assert_array_equal(found.frequencies, alone.frequencies)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("CCWSIM_channel512_hd400_L1", (0.0026, 0.0079, 0.039)),
        ("CCWSIM_channel512_hd400_L3", (0.0064, 0.0183, 0.059)),
        ("MS-CCSIM_channel512_hd400_L1", (0.0032, 0.0124, 0.041)),
        ("CCWSIM_channel512_t2_1000_L1", (0.0061, 0.0184, 0.056)),
    ],
)
def test_distances_of_the_published_code_come_out(data_dir, name, expected):
    ti = np.load(data_dir / "paper" / "ti_channel_256x256.npy")
    realizations = np.load(data_dir / "reference" / f"{name}.npz")["r"]
    found = pattern_distance(realizations, ti).mean(axis=0)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=5e-5)


def test_what_cannot_be_counted_is_said():
    image = np.eye(5, dtype=int)
    with pytest.raises(CCWSIMError, match="pattern size = 6"):
        pattern_histogram(image, size=6)
    with pytest.raises(CCWSIMError, match="facies code 3 is not one of 0, 1"):
        pattern_histogram(image * 3, [0, 1])
    with pytest.raises(CCWSIMError, match="coarsening factor = 0"):
        coarsened(image, 0)
    with pytest.raises(CCWSIMError, match="type float64"):
        pattern_histogram(image * 0.5)
    with pytest.raises(CCWSIMError, match="cannot be compared"):
        js_divergence(pattern_histogram(image, size=2), pattern_histogram(image, size=3))
    with pytest.raises(CCWSIMError, match="the same codes"):
        js_divergence(pattern_histogram(image), pattern_histogram(3 * image))


def test_codes_of_patterns_are_counted():
    codes, counts = count_patterns(np.eye(3, dtype=np.uint8)[None], 2, 1, 2)
    assert (codes.tolist(), counts.tolist()) == ([2, 4, 9], [1, 1, 2])
