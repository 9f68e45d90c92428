"""Our parts of a page hold through the calls that Streamlit makes: it calls a part again for new
data without an end of the call before, and where calls come fast it may end one late."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Grid
from ccwsim.ui.hard_data.page import SHARED
from ccwsim.ui.widgets.maps import CANVAS, CellMap, map_content
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]

BEGIN = """async ([html, js, data]) => {
  const parentElement = document.body.appendChild(document.createElement('div'));
  parentElement.innerHTML = html;
  const url = URL.createObjectURL(new Blob([js], { type: 'text/javascript' }));
  const { default: draw } = await import(url);
  window.told = [];
  const setTriggerValue = (kind, value) => window.told.push(structuredClone([kind, value]));
  window.call = () => draw({ parentElement, setTriggerValue, data: structuredClone(data) });
}"""
CALLS = {
    "late end": "() => { const end = call(); call(); end?.(); }",
    "early end": "() => { call()?.(); call(); }",
    "no end": "() => { call(); call(); }",
}
EMPTY = CellMap(
    np.zeros((8, 16), np.uint8), ["#ffffff"], ["mud"], "a map", point_colours=["#888888"]
)


@pytest.fixture(params=list(CALLS))
def put_up(tab, request):
    """Put up a part on an empty page: it is called twice, and the first call ended so."""

    def put(name: str, data: dict) -> None:
        html, js = ((CANVAS / f"{name}.{kind}").read_text("utf-8") for kind in ("html", "js"))
        if name == "editor":
            js = (CANVAS / "map.js").read_text("utf-8").replace(SHARED, "function ignored()") + js
        tab.goto("about:blank")
        tab.set_content("<div class='stApp' style='width: 100%'></div>")
        tab.evaluate(BEGIN, [html, js, data])
        tab.evaluate(CALLS[request.param])

    return put


def width(tab, expected: str) -> None:
    tab.wait_for_function(
        f"() => parseInt(document.querySelector('canvas').style.width) {expected}"
    )


@pytest.mark.parametrize("name", ["map", "editor"])
def test_a_canvas_follows_the_size_of_the_window_and_of_other_maps(tab, put_up, name):
    extra = {"brushes": [], "reads": False, "empty": True, "ack": 0} if name == "editor" else {}
    extra |= {"can_undo": False, "can_redo": False} if name == "editor" else {}
    content = map_content(EMPTY, grid=Grid(8, 16), scale="maps")
    tab.set_viewport_size({"width": 500, "height": 600})
    put_up(name, content | extra)
    width(tab, "> 400")
    assert tab.evaluate("[...window[Symbol.for('ccwsim-map')].get('maps')].length") == 1
    tab.set_viewport_size({"width": 300, "height": 600})
    width(tab, "< 300")


def test_a_click_and_an_undo_are_told_once(tab, put_up):
    extra = {"brushes": [{"label": "mud", "colour": "#888888"}], "reads": False, "empty": True}
    extra |= {"ack": 0, "can_undo": True, "can_redo": False}
    tab.set_viewport_size({"width": 500, "height": 600})
    put_up("editor", map_content(EMPTY, grid=Grid(8, 16)) | extra)
    width(tab, "> 400")
    tab.locator("canvas").click(position={"x": 100, "y": 100})
    [[kind, queue]] = tab.evaluate("told")
    assert kind == "edits"
    assert [list(edit) for edit in queue] == [["seq", "set"]]
    tab.keyboard.press("Control+z")
    assert [len(queue) for _, queue in tab.evaluate("told")] == [1, 2]


def test_an_arrow_key_makes_one_step(tab, put_up):
    put_up("arrows", {})
    tab.keyboard.press("ArrowRight")
    assert tab.evaluate("told") == [["step", 1]]


def test_a_switch_of_the_theme_is_told_once(tab, put_up):
    put_up("theme", {"theme": "light"})
    tab.evaluate(
        """() => { document.querySelector('.stApp').style.colorScheme = 'dark';
        document.querySelector('i').dispatchEvent(new Event('transitionend')); }"""
    )
    assert tab.evaluate("told") == [["theme", "dark"]]


def test_a_section_in_view_is_told_once(tab, put_up):
    put_up("seen", {"unseen": ["facts"]})
    tab.evaluate(
        """() => { document.querySelector('.stApp').innerHTML =
        "<div class='st-key-section_facts'><div class='unseen'>…</div></div>"; }"""
    )
    tab.wait_for_function("() => told.length")
    tab.wait_for_timeout(600)  # two looks more
    assert tab.evaluate("told") == [["seen", ["facts"]]]


def test_the_menu_of_a_chart_closes_where_somewhere_else_is_clicked(tab, put_up):
    put_up("chart_menu", {"title": "CPU time", "chart": "times", "name": "times"})
    tab.locator(".open").click()
    assert tab.locator(".choices").is_visible()
    tab.mouse.click(400, 400)
    assert tab.locator(".choices").is_hidden()


def test_a_part_of_a_page_keeps_its_height_until_the_page_rests(tab, put_up):
    put_up("steady", {"parts": "[class*=st-key-part]"})
    tab.evaluate(
        """() => { const app = document.querySelector('.stApp');
        app.dataset.testScriptState = 'running';
        app.innerHTML = "<div class='st-key-part'><div style='height: 300px'></div></div>"; }"""
    )
    high = "() => document.querySelector('.st-key-part').getBoundingClientRect().height"
    tab.wait_for_timeout(100)  # a frame, in which it is measured
    tab.evaluate("() => document.querySelector('.st-key-part').replaceChildren()")
    tab.wait_for_timeout(100)
    assert tab.evaluate(high) == 300
    tab.evaluate(
        "() => { document.querySelector('.stApp').dataset.testScriptState = 'notRunning'; }"
    )
    tab.wait_for_function(f"() => ({high})() === 0")
