"""Pools of processes for tests."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context


def process_pool(n: int) -> ProcessPoolExecutor:
    """Return a pool of `n` new processes.

    Forked processes would inherit locks that threads of earlier tests hold, and nobody would
    release these locks in the fork.
    """
    return ProcessPoolExecutor(n, get_context("spawn"))
