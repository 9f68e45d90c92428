"""Fixtures for tests of pages without a browser."""

from __future__ import annotations

from functools import cache

import pytest
from streamlit.components.v2 import manifest_scanner

from ccwsim.jobs.job import server_queue
from ccwsim.ui.study.run import shared_runs


@pytest.fixture(scope="session", autouse=True)
def _components_are_looked_for_once():
    """Let Streamlit scan the installed packages once; otherwise each page takes twice as long."""
    with pytest.MonkeyPatch.context() as patch:
        looked_for = cache(manifest_scanner.scan_component_manifests)
        patch.setattr(manifest_scanner, "scan_component_manifests", looked_for)
        yield


@pytest.fixture(autouse=True)
def _no_job_outlives_its_test():
    """Cancel the jobs of a test at its end; they would affect the estimates of later tests."""
    yield
    queue = server_queue()
    jobs = [*queue._active, *queue._waiting]
    for job in jobs:
        job.cancel()
    assert all(job.wait(60) for job in jobs)


@pytest.fixture
def no_kept_run():
    """Forget the runs of earlier tests, so that this test simulates its study."""
    shared_runs.clear()
