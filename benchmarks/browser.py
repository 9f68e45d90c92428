"""Processor time in the browser: ``python -m benchmarks.browser``.

A browser on one core opens a Streamlit page with one picture, a page with as many controls as
Simulate and nothing else, and the page Simulate, each in a new tab, and changes the seed on the
page Simulate with Live on. The servers run on the other cores. The table has the processor time of
all processes of the browser from the action until the page is at rest (median, minimum), and its
ratio to the page with one picture. The page of controls is what Streamlit alone costs. With
--against DIR ..., several checkouts are measured alternately. The benchmark needs Linux and
chromium.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.opening import cpu_seconds
from tests.browser.hands import SLOW, switch_on
from tests.browser.served import ROOT, browser, started

PICTURE_PAGE = """
import numpy as np
import streamlit as st
st.title("A picture")
st.image(np.random.default_rng(0).integers(0, 255, (512, 512), dtype=np.uint8))
"""
CONTROLS_PAGE = """
import numpy as np
import streamlit as st
st.set_page_config(layout="wide")
with st.sidebar:
    for k in range(5):
        st.selectbox(f"List {k}", ["a", "b"], help="A list.")
        st.number_input(f"Number {k}", 0, 100, 5, help="A number.")
    for k in range(4):
        st.slider(f"Slider {k}", 0, 100, 5, help="A slider.")
    for k in range(13):
        st.popover(f"Menu {k}").markdown("Text")
    for k in range(7):
        st.button(f"Button {k}")
for k in range(25):
    st.markdown(f"Text {k}")
for column in [column for _ in range(5) for column in st.columns(3)]:
    column.container().markdown("Text")
for column in st.columns(2):
    column.image(np.random.default_rng(0).integers(0, 255, (256, 256), dtype=np.uint8))
"""
PLAIN_PAGES = {"picture": PICTURE_PAGE, "controls": CONTROLS_PAGE}
"""Streamlit pages for comparison."""
REST = 1.5
"""Seconds in which a page at rest uses little processor time."""
IDLE = 0.1
"""Maximum of the processor time in `REST` seconds of a page at rest."""
DRAWN = """() => document.querySelectorAll('.st-key-charts .xtick').length
  && document.querySelector('[data-test-script-state=notRunning]')
  && !document.querySelector('.st-key-progress')"""
"""Whether the charts are drawn and no script runs."""
HEADER = "| action | checkout | CPU s | minimum | ratio |\n|---|---|--:|--:|--:|"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.browser", description=__doc__)
    others = {"nargs": "+", "type": Path, "default": [], "metavar": "DIR"}
    parser.add_argument("--against", **others, help="other checkouts")
    parser.add_argument("--rounds", type=int, default=7, metavar="N", help="default: %(default)s")
    options = parser.parse_args(arguments)
    roots = {"this": ROOT, **{root.name: root.resolve() for root in options.against}}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        for name, text in PLAIN_PAGES.items():
            (folder / name).mkdir()
            (folder / name / "app.py").write_text(text, "utf-8")
        addresses = {
            name: stack.enter_context(started(root)).address
            for name, root in {**{name: folder / name for name in PLAIN_PAGES}, **roots}.items()
        }
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        chromium = stack.enter_context(browser())
        context = chromium.new_context(viewport={"width": 1440, "height": 900})
        seconds = openings(context, addresses, options.rounds)
        picture = float(np.median(seconds["picture"]))
        print(HEADER, flush=True)
        for name, values in seconds.items():
            print(row("open", name, values, picture), flush=True)
        for name in PLAIN_PAGES:
            del addresses[name]
        for name, values in new_seeds(context, addresses, options.rounds).items():
            print(row("seed", name, values, picture), flush=True)


def openings(context: Any, addresses: dict[str, str], rounds: int) -> dict[str, list[float]]:
    """Return the processor seconds of the openings of each page, after an opening to warm up."""
    seconds: dict[str, list[float]] = {name: [] for name in addresses}
    for k in range(rounds + 1):
        for name, address in addresses.items():
            page = context.new_page()
            rest(page)
            before = browser_seconds()
            if name in PLAIN_PAGES:
                page.goto(address)
                page.wait_for_selector("[data-testid=stImage] img", timeout=SLOW)
            else:
                page.goto(f"{address}/simulate")
                page.wait_for_function(DRAWN, timeout=SLOW)
            spent = rest(page) - before
            page.close()
            if k:
                seconds[name].append(spent)
    return seconds


def new_seeds(context: Any, addresses: dict[str, str], rounds: int) -> dict[str, list[float]]:
    """Return the processor seconds of new seeds with Live on, after two seeds to warm up."""
    seconds: dict[str, list[float]] = {name: [] for name in addresses}
    pages = {name: context.new_page() for name in addresses}
    for name, page in pages.items():
        page.goto(f"{addresses[name]}/simulate")
        page.wait_for_function(DRAWN, timeout=SLOW)
        switch_on(page, "live")
        rest(page)
    for k in range(rounds + 2):
        for name, page in pages.items():
            page.bring_to_front()
            before = rest(page)
            box = page.locator(".st-key-seed input")
            box.fill(str(101 + k))
            box.press("Enter")
            page.wait_for_timeout(400)
            page.wait_for_function(DRAWN, timeout=SLOW)
            if k > 1:
                seconds[name].append(rest(page) - before)
    return seconds


def rest(page: Any) -> float:
    """Wait until the browser is at rest; return the processor seconds until then."""
    last = browser_seconds()
    while True:
        page.wait_for_timeout(1000 * REST)
        now = browser_seconds()
        if now - last < IDLE:
            return now
        last = now


def browser_seconds() -> float:
    """Return the processor seconds of all browser processes that this process has started."""
    parents = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, fields = file.read_text().split("(", 1)[1].rsplit(")", 1)
        except OSError:  # the process has ended
            continue
        parents[int(file.parent.name)] = int(fields.split()[1]), name
    total = 0.0
    for number, (parent, name) in parents.items():
        while parent in parents and parent != os.getpid():
            parent = parents[parent][0]
        if parent == os.getpid() and name.startswith("chrom"):
            total += cpu_seconds(number)
    return total


def row(action: str, name: str, seconds: Sequence[float], picture: float) -> str:
    """Return a line of the table."""
    cells = np.median(seconds), min(seconds), np.median(seconds) / picture
    return f"| {action} | {name} | {' | '.join(f'{cell:.2f}' for cell in cells)} |"


if __name__ == "__main__":
    sys.exit(main())
