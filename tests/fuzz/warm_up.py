"""Compile kernels before measurements, as a server does at its start."""

from __future__ import annotations

import random

from tests.fuzz.arguments import TARGETS
from tests.fuzz.workers import hold_memory


def warm_up() -> None:
    """Call every target several times with random arguments."""
    hold_memory()
    source = random.Random(0)
    for target in TARGETS:
        for _ in range(12):
            try:
                target(source)()
            except Exception:
                continue
