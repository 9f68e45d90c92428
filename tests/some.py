"""Parameters of tests, of which some always run and the others run only with the slow tests."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import Any

import pytest


def some(values: Iterable[Any], always: Container[Any]) -> list[Any]:
    """Return parameters for `parametrize`; those that are not in `always` are marked as slow."""
    return [v if v in always else pytest.param(v, marks=pytest.mark.slow) for v in values]
