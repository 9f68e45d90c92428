"""Test How it works in a browser for a volume, patch by patch."""

from __future__ import annotations

import re
from urllib.parse import urlencode

import pytest

from ccwsim import Grid, Parameters
from ccwsim.engine.trace import Trace
from ccwsim.model.study import Study
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.how_it_works.words import describe_sides
from ccwsim.ui.session.resolve import data_of, image_of
from tests.browser.hands import SLOW, at_rest, soon
from tests.browser.served import CHROMIUM

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

QUERY = {
    "ti": "sinuous_channels", "data": "none", "grid": "40x30x12", "template": "16x16x8",
    "overlap": "4x4x2", "level": "1x1x1", "realizations": "2", "seed": "7",
}  # fmt: skip
CHOICES = Choices(
    ImageChoice("sinuous_channels"),
    DataChoice(),
    Grid(30, 40, nz=12),
    Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1)),
    seed=7,
)
CELLS = """async () => {
  const kept = [...window[Symbol.for('ccwsim-volume')].cells.values()];
  return Promise.all(kept.map(async (each) => Array.from(await each)));
}"""


def test_a_volume_is_stepped_through(tab, address):
    image = image_of(CHOICES.image)
    own = CHOICES.grid, CHOICES.parameters, data_of(CHOICES), CHOICES.seed
    trace = Trace(Study(image, *own))
    tab.goto(f"{address}/how_it_works?{urlencode(QUERY)}")
    tab.locator(".st-key-volume_how_cut canvas").first.wait_for(timeout=SLOW)
    tab.locator(".st-key-volume_how_repair_after [data-panel=z] canvas").wait_for(timeout=SLOW)
    at_rest(tab)
    where, n = tab.locator(".st-key-how_player .where"), len(trace.patches)
    first = int(re.findall(r"Patch (\d+) of", where.inner_text())[0]) - 1

    def shows(number: int) -> None:
        step = trace.at(number)
        text = where.inner_text()
        assert f"Patch {number + 1} of {n}" in text
        assert describe_sides(trace, step.patch.shape) in text
        shown = tab.evaluate(CELLS)
        assert any(sorted(cells) == sorted(step.cells.ravel().tolist()) for cells in shown)

    soon(lambda: shows(first), SLOW)
    tab.locator(".st-key-how_next button").click(timeout=SLOW)
    soon(lambda: shows(first + 1), SLOW)
    at_rest(tab)
    tab.keyboard.press("ArrowRight")
    soon(lambda: shows(first + 2), SLOW)
    legend = tab.locator(".st-key-volume_how_score .legend")
    soon(lambda: re.search(r"\d+ locations|1 location", legend.inner_text()) or [][0])
    assert not tab.locator("[data-testid=stException], [data-testid=stAlert]").count()
