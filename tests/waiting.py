"""Wait for a condition in a test, and fail with a message if it is never true."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

PATIENCE = 120.0
"""Seconds to wait, far more than any condition needs, so that slow machines do not fail."""


def wait_until(condition: Callable[[], object], what: str, every: float = 0.02) -> None:
    """Check a condition until it is true; `what` describes the condition in the message."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            pytest.fail(f"waited {PATIENCE:g} s in vain for {what}")
        time.sleep(every)
