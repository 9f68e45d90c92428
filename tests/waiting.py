"""Wait for what a test needs, and fail in words where it does not come."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

PATIENCE = 120.0
"""Seconds: much more than anything takes, as a test is not to fail for being slow."""


def wait_until(condition: Callable[[], object], what: str, every: float = 0.02) -> None:
    """Look at a condition until it holds; `what` says what is waited for."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            pytest.fail(f"waited {PATIENCE:g} s in vain for {what}")
        time.sleep(every)
