"""Parameters of which some are taken always, and the rest only where time is no matter."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import Any

import pytest


def some(values: Iterable[Any], always: Container[Any]) -> list[Any]:
    """Return parameters for `parametrize`; those that are not in `always` are marked as slow."""
    return [v if v in always else pytest.param(v, marks=pytest.mark.slow) for v in values]
