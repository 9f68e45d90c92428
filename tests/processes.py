"""Pools of processes for tests."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context


def process_pool(n: int) -> ProcessPoolExecutor:
    """Return a pool of `n` new processes.

    Not forks: threads that earlier tests started may hold locks at that moment, which nobody would
    release in the fork.
    """
    return ProcessPoolExecutor(n, get_context("spawn"))
