"""Test that no page has a serious accessibility problem or logs anything in the console."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest

from ccwsim.ui.page import PAGES
from tests.browser.all_pages.test_console import BASE
from tests.browser.hands import SLOW, at_rest, fill, soon, to_page
from tests.browser.screenshots import FILLED, SETTLED, SIZES, fill_with_maps
from tests.browser.served import CHROMIUM

axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

THEMED = """(dark) => {
  const background = getComputedStyle(document.querySelector('.stApp')).backgroundColor;
  const [r, g, b] = background.match(/\\d+/g).map(Number);
  return (r + g + b < 384) === dark;
}"""
SMALL = "grid=96x64&data=sampled&data-n=30&template=16&overlap=4&realizations=3"
VOLUME = (
    "ti=sinuous_channels&data=none&grid=40x36x20&template=16x16x8&overlap=4x4x2&level=1x1x1"
    "&realizations=2"
)
LONG = ("benchmark", "import", "paper", "sweep")
"""Pages that start empty; the test fills these pages by running them."""
OTHERS = [title for title, path in PAGES if Path(path).stem not in LONG]
CONTRAST = "color-contrast"
SIGHTS = (
    (1440, "light", {}),
    (1440, "dark", {"runOnly": [CONTRAST]}),  # the theme changes only colours
    (390, "light", {"rules": {CONTRAST: {"enabled": False}}}),  # the width changes everything else
)
"""Width, theme and axe options of each check."""


def findings(page, **options) -> list[str]:
    """Return the problems that axe-core rates serious or critical, with their elements."""
    found = axe.Axe().run(page, options={"resultTypes": ["violations"], **options})
    return [
        f"{violation['id']} ({violation['impact']}): {node['target']} {node['html'][:160]}"
        for violation in found.response["violations"]
        if violation["impact"] in ("serious", "critical")
        for node in violation["nodes"]
    ]


def lasting_findings(page, width: int, theme: str, options: dict) -> list[str]:
    """Return the lasting problems at a width and in a theme; parts that fade in are no problem."""
    page.set_viewport_size({"width": width, "height": SIZES[width]})
    page.emulate_media(color_scheme=theme)
    page.wait_for_function(THEMED, arg=theme == "dark", timeout=SLOW)
    found: list[str] = []

    def none() -> None:
        at_rest(page)
        found[:] = findings(page, **options)
        assert not found

    with suppress(AssertionError):
        soon(none)
    return [f"{width} {theme}: {each}" for each in found]


@pytest.fixture(scope="module")
def said() -> list[str]:
    """Return a list of all messages in the console of the tab for all pages."""
    return []


@pytest.fixture(scope="module")
def page(desktop, address, said):
    """Yield one tab for all pages, so that the study runs only once."""
    page = desktop.new_page()
    page.on("console", lambda m: None if BASE.search(m.location["url"]) else said.append(m.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(f"{address}/simulate?{SMALL}")
    fill_with_maps(page)
    yield page
    page.close()


def looked_through(page) -> list[str]:
    """Return the problems of a page at all widths and in all themes."""
    found = [each for sight in SIGHTS for each in lasting_findings(page, *sight)]
    page.set_viewport_size({"width": 1440, "height": SIZES[1440]})
    page.emulate_media(color_scheme="light")
    return found


@pytest.mark.parametrize("title", OTHERS)
def test_a_page_has_no_serious_finding_and_an_empty_console(page, said, title):
    name = Path(dict(PAGES)[title]).stem
    to_page(page, title)
    at_rest(page)
    if name == "examples":  # the last pictures come after a minute and are like the first
        page.wait_for_selector(".pictures img", timeout=SLOW)
    else:
        FILLED.get(name, fill_with_maps)(page)
        page.wait_for_function(SETTLED, timeout=SLOW)
    assert not looked_through(page)
    assert said == []


def measure_little(page) -> None:
    """Choose one realization of each grid on the page Benchmark."""
    fill(page, "benchmark_realizations", 1)


def sweep_little(page) -> None:
    """Choose two realizations of each setting on the page Sweep."""
    fill(page, "n_swept", 2)


QUICKER = {"benchmark": measure_little, "sweep": sweep_little}
"""Functions that let a page take less time to be filled."""


@pytest.mark.parametrize("name", LONG)
def test_a_page_that_was_filled_has_no_serious_finding(tab, address, name):
    page = tab
    page.goto(f"{address}/{name}?{SMALL}")
    page.wait_for_selector(".st-key-menu", timeout=SLOW)
    QUICKER.get(name, at_rest)(page)
    FILLED[name](page)
    page.wait_for_function(SETTLED, timeout=SLOW)
    assert not looked_through(page)


@pytest.mark.parametrize("name", ["simulate", "how_it_works"])
def test_a_page_with_a_volume_has_no_serious_finding(tab, address, name):
    """Test the pages that draw volumes; other pages show slices in the same elements as maps."""
    tab.goto(f"{address}/{name}?{VOLUME}")
    tab.wait_for_selector("[class*=volume_] canvas >> visible=true", timeout=SLOW)
    tab.wait_for_function(SETTLED, timeout=SLOW)
    assert not looked_through(tab)
