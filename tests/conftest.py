"""Fixtures of all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

from tests.browser.served import browser, served

settings.register_profile("patient", deadline=None)  # a test never fails for being slow
settings.load_profile("patient")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of published training images and data, where it is at hand."""
    beside = Path(__file__).resolve().parents[1].parent / "shared" / "data"
    folder = Path(os.environ["CCWSIM_DATA"]) if os.environ.get("CCWSIM_DATA") else beside
    if not folder.is_dir():
        pytest.skip("no folder of published data; set CCWSIM_DATA")
    return folder


@pytest.fixture(scope="module")
def address():
    """The address of the dashboard, served for one file of tests."""
    with served() as there:
        yield there


@pytest.fixture(scope="module")
def chromium():
    """A headless browser for one file of tests."""
    with browser() as launched:
        yield launched
