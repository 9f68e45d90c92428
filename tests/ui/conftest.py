"""What all pages that are drawn without a browser have in common."""

from __future__ import annotations

from functools import cache

import pytest
from streamlit.components.v2 import manifest_scanner

from ccwsim.jobs.job import server_queue
from ccwsim.ui.study.run import shared_runs


@pytest.fixture(scope="session", autouse=True)
def _components_are_looked_for_once():
    """Streamlit reads about all installed packages for each page, which is half of its time."""
    with pytest.MonkeyPatch.context() as patch:
        looked_for = cache(manifest_scanner.scan_component_manifests)
        patch.setattr(manifest_scanner, "scan_component_manifests", looked_for)
        yield


@pytest.fixture(autouse=True)
def _no_job_outlives_its_test():
    """Jobs that a test leaves behind would lengthen the estimates of the next ones."""
    yield
    queue = server_queue()
    jobs = [*queue._active, *queue._waiting]
    for job in jobs:
        job.cancel()
    assert all(job.wait(60) for job in jobs)


@pytest.fixture
def no_kept_run():
    """No earlier test has simulated the study of this one."""
    shared_runs.clear()
