"""No page keeps out a reader with a screen reader or weak eyes: checked by axe-core."""

from __future__ import annotations

from pathlib import Path

import pytest

from ccwsim.ui.page import PAGES
from tests.browser.hands import SLOW, at_rest
from tests.browser.screenshots import FILLED, SETTLED, SIZES, fill_with_maps
from tests.browser.served import CHROMIUM

axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
pytestmark = pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}")

LOOKS = 3
"""A finding is one that lasts."""


def findings(page) -> list[str]:
    """What axe-core calls serious or critical, with the elements."""
    found = axe.Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]
    return [
        f"{v['id']} ({v['impact']}): {node['target']} {node['html'][:160]}"
        for v in found if v["impact"] in ("serious", "critical")
        for node in v["nodes"]
    ]  # fmt: skip


# on a phone the colours are those of a wide screen: once is enough there
@pytest.mark.parametrize(("width", "theme"), [(1440, "light"), (1440, "dark"), (390, "light")])
@pytest.mark.parametrize("path", [Path(path).stem for _, path in PAGES])
def test_a_page_has_no_serious_finding(chromium, address, path, width, theme):
    size = {"width": width, "height": SIZES[width]}
    context = chromium.new_context(viewport=size, color_scheme=theme)
    page = context.new_page()
    page.goto(f"{address}/{path}")
    page.wait_for_selector(".st-key-menu", timeout=SLOW)
    FILLED.get(path, fill_with_maps)(page)
    page.wait_for_function(SETTLED, timeout=SLOW)
    found: list[str] = []
    for _ in range(LOOKS):  # on a slow machine a part may be fading in while axe looks
        at_rest(page)
        found = findings(page)
        if not found:
            break
        page.wait_for_timeout(1000)
    assert not found
    context.close()
