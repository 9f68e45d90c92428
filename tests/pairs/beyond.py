"""A kernel that reads beyond its array, to test that bounds are checked."""

from ccwsim.engine.kernels import kernel


@kernel
def read_beyond(values):
    """Return the sum of an array and the value after its end."""
    total = 0.0
    for k in range(len(values) + 1):
        total += values[k]
    return total
