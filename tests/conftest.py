"""Fixtures of all tests, and what two workers need to share the work well.

Kernels are compiled once, while the workers collect, who then find them on disk. Each worker has
one server of the dashboard and one browser. Files that take long go first, so that none is last.
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
FIRST = ("tests/browser/", "tests/ui/", "tests/io/", "tests/engine/", "tests/")
"""Folders whose files take longest, from the longest."""

COMPILING = pytest.StashKey[subprocess.Popen]()
# A test never fails for being slow.
settings.register_profile("patient", deadline=None, max_examples=25)
settings.load_profile("patient")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put files that take long first."""

    def rank(item: pytest.Item) -> int:
        return next((k for k, name in enumerate(FIRST) if item.nodeid.startswith(name)), len(FIRST))

    items.sort(key=rank)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(config: pytest.Config) -> None:
    """Compile all kernels while workers collect, unless only some tests were asked for."""
    if config.args_source is not pytest.Config.ArgsSource.ARGS:
        terminal = config.pluginmanager.get_plugin("terminalreporter")
        if terminal is not None:
            terminal.write_line("compiling kernels, about a minute where there are none yet")
        config.stash[COMPILING] = subprocess.Popen(
            [sys.executable, "-m", "tests.compiled"], cwd=ROOT
        )


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished(node: Any) -> None:
    """Let no test start before the kernels are there."""
    compiling = node.config.stash.get(COMPILING, None)
    if compiling is not None and compiling.wait():
        raise RuntimeError("the kernels cannot be compiled: run `python -m tests.compiled`")


@pytest.fixture(autouse=True)
def _main_module_stays():
    """AppTest puts a page in place of the main module, which new processes import."""
    main = sys.modules["__main__"]
    yield
    sys.modules["__main__"] = main


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of published training images and data, where it is at hand."""
    beside = ROOT.parent / "shared" / "data"
    folder = Path(os.environ["CCWSIM_DATA"]) if os.environ.get("CCWSIM_DATA") else beside
    if not folder.is_dir():
        pytest.skip("no folder of published data; set CCWSIM_DATA")
    return folder


@pytest.fixture(scope="session")
def address():
    """The address of the dashboard, served for all tests of a worker."""
    with served() as there:
        yield there


AS_ON_THE_FIRST_VISIT = """if (location.protocol.startsWith('http'))
  for (const key of Object.keys(localStorage))
    if (key.startsWith('stSidebarCollapsed')) localStorage.removeItem(key);"""
"""The study column is open on wide pages, also where a test closed it on a narrow one before."""


@pytest.fixture(scope="package")
def chromium():
    """A headless browser for all tests of a worker in one folder.

    Not for longer: while it is there, an event loop runs in the main thread.
    """
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with browser() as launched:
        yield launched


@pytest.fixture(scope="package")
def desktop(chromium):
    """A window with an empty profile that tests of one folder share.

    A profile of its own costs each test seconds, as a page's scripts are compiled anew in it.
    """
    context = chromium.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    context.add_init_script(AS_ON_THE_FIRST_VISIT)
    yield context
    context.close()


@pytest.fixture
def tab(desktop):
    """A new tab of that window, closed at the end of the test."""
    page = desktop.new_page()
    yield page
    page.close()


@pytest.fixture
def phone(tab):
    """A new tab as narrow as a phone, in the dark."""
    tab.set_viewport_size({"width": 390, "height": 844})
    tab.emulate_media(color_scheme="dark")
    return tab
