"""Fixtures of all tests, and hooks that divide the work well between two processes.

Kernels are compiled once, while the workers collect tests; the workers then read the kernels from
disk. Each worker has one server of the dashboard and one browser. The longest files are first, so
that no worker ends long after the other.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from tests.browser.served import browser, served

ROOT = Path(__file__).parents[1]
# Otherwise each worker, server and process of the tests would compile all modules anew.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
FIRST = (
    "tests/pairs/",
    "tests/test_package.py",
    "tests/browser/all_pages/",
    "tests/browser/",
    "tests/jobs/",
    "tests/ui/pages/",
    "tests/ui/",
    "tests/engine/",
    "tests/metrics/",
    "tests/io/",
    "tests/",
)
"""Starts of the paths of test files, in the order of the times that the slowest files take."""

COMPILING = pytest.StashKey[subprocess.Popen]()
# By default, Hypothesis draws 25 examples for a test, and does not limit their time.
settings.register_profile("patient", deadline=None, max_examples=25)
settings.load_profile("patient")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the tests so that slow files are first."""

    def rank(item: pytest.Item) -> int:
        return next((k for k, name in enumerate(FIRST) if item.nodeid.startswith(name)), len(FIRST))

    items.sort(key=rank)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(config: pytest.Config) -> None:
    """Compile all kernels while workers collect tests, unless only some tests are requested."""
    if config.args_source is not pytest.Config.ArgsSource.ARGS:
        terminal = config.pluginmanager.get_plugin("terminalreporter")
        if terminal is not None:
            terminal.write_line("compiling kernels, about a minute where there are none yet")
        config.stash[COMPILING] = subprocess.Popen(
            [sys.executable, "-m", "tests.compiled"], cwd=ROOT
        )


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished(node: Any) -> None:
    """Delay all tests until the kernels are compiled."""
    compiling = node.config.stash.get(COMPILING, None)
    if compiling is not None and compiling.wait():
        raise RuntimeError("the kernels cannot be compiled: run `python -m tests.compiled`")


@pytest.fixture(autouse=True)
def _main_module_stays():
    """Restore the main module, which new processes import and AppTest replaces by a page."""
    main = sys.modules["__main__"]
    yield
    sys.modules["__main__"] = main


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Return the folder of published images and data; skip the test if there is no such folder."""
    beside = ROOT.parent / "shared" / "data"
    folder = Path(os.environ["CCWSIM_DATA"]) if os.environ.get("CCWSIM_DATA") else beside
    if not folder.is_dir():
        pytest.skip("no folder of published data; set CCWSIM_DATA")
    return folder


@pytest.fixture(scope="session")
def address():
    """Yield the address of the dashboard, which runs for all tests of a worker."""
    with served() as there:
        yield there


AS_ON_THE_FIRST_VISIT = """if (location.protocol.startsWith('http'))
  for (const key of Object.keys(localStorage))
    if (key.startsWith('stSidebarCollapsed')) localStorage.removeItem(key);"""
"""Script that forgets the closed study column, so that later tests find it open on wide pages."""


@pytest.fixture(scope="package")
def chromium():
    """Yield a headless browser for all tests of a worker in one folder.

    The browser is closed after the folder, because its event loop runs in the main thread.
    """
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with browser() as launched:
        yield launched


@pytest.fixture(scope="package")
def desktop(chromium):
    """Yield a browser window with an empty profile, shared by the tests of a folder.

    A new profile for each test would take seconds, because the scripts of pages are compiled again.
    """
    context = chromium.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    context.add_init_script(AS_ON_THE_FIRST_VISIT)
    yield context
    context.close()


@pytest.fixture
def tab(desktop):
    """Yield a new tab of the window, closed at the end of the test."""
    page = desktop.new_page()
    yield page
    page.close()


@pytest.fixture
def phone(tab):
    """Return a new tab with the width of a phone, in the dark theme."""
    tab.set_viewport_size({"width": 390, "height": 844})
    tab.emulate_media(color_scheme="dark")
    return tab
