"""Time from a changed control to the new picture in a browser: ``python -m benchmarks.latency``.

A headless browser changes seed and level on the page Simulate of a local server, with Live on. The
table has the median and the 95 % quantile, in ms, of the time from the key or click to the first
frame with the new realization ("picture"), and to the complete page. The time to the picture is
split into "server", including transfers in both directions, and "browser"; "kB" is the size of all
data from the server. With --against DIR, two checkouts are measured alternately. The program first
prints the time from the start of a server to the first page.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from tests.browser.hands import SLOW, at_rest, choose, close_menu, fill, menu
from tests.browser.served import ROOT, browser, served

TRACE = """
window.trace = {start: 0, sent: [], got: [], drawn: []};
for (const kind of ['keydown', 'click'])
  document.addEventListener(kind, () => { trace.start = performance.now(); }, true);
const size = (data) => data.byteLength ?? data.size ?? data.length;
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (data) {
  trace.sent.push([performance.now(), size(data)]);
  return send.call(this, data);
};
window.WebSocket = class extends WebSocket {
  constructor(...all) {
    super(...all);
    this.addEventListener('message', ({ data }) => trace.got.push([performance.now(), size(data)]));
  }
};
const seen = new WeakSet();
const draw = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (picture, ...all) {
  draw.call(this, picture, ...all);
  if (!(picture instanceof OffscreenCanvas) || seen.has(picture)) return;
  seen.add(picture);
  const called = performance.now();
  const own = (this.canvas.getRootNode().host ?? this.canvas).closest('[class*=st-key-map_]');
  requestAnimationFrame(() => setTimeout(() => {
    trace.drawn.push([performance.now(), called, own ? own.className : '']);
  }));
};
"""
"""Script that records the time at which the frame of each new picture is complete."""
COMPLETE = """
(facts) => [...document.querySelectorAll('.facts')].some((e) => e.innerText.includes(facts))
  && ['map_realization', 'map_e_type'].every((key) => trace.drawn.some(
    ([at, , own]) => at > trace.start && own.includes(key)))
  && !document.querySelector('.st-key-progress')
  && document.querySelector('[data-test-script-state=notRunning]') && performance.now()
"""
READ = """
(end) => {
  const { start, sent, got, drawn } = trace;
  const [at, called] = drawn.find(([t, , own]) => t > start && own.includes('map_realization'));
  const asked = sent.find(([t]) => t >= start)[0];
  const came = got.filter(([t]) => t < called).at(-1)[0];
  const bytes = got.filter(([t]) => t >= start).reduce((sum, [, n]) => sum + n, 0);
  Object.assign(trace, { sent: [], got: [], drawn: [] });
  return [at - start, end - start, came - asked, at - came, bytes];
}
"""
LEVELS = ("2", "3", "1")


@dataclass(frozen=True)
class Case:
    """One study of the table, without hard data."""

    side: int
    n: int

    @property
    def title(self) -> str:
        """Name of the case in the table."""
        return f"{self.n} of {self.side} × {self.side}"


CASES = (Case(256, 12), Case(1000, 4))
HEADER = (
    "| study | changed | checkout | picture | p95 | complete | p95 | server | browser | kB |\n"
    "|---|---|---|--:|--:|--:|--:|--:|--:|--:|"
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.latency", description=__doc__)
    parser.add_argument("--against", type=Path, metavar="DIR", help="another checkout")
    parser.add_argument("--changes", type=int, default=7, metavar="N", help="default: %(default)s")
    options = parser.parse_args(arguments)
    roots = {"this": ROOT, **({"other": options.against.resolve()} if options.against else {})}
    with ExitStack() as stack:
        chromium = stack.enter_context(browser())
        print(starts(chromium), flush=True)
        print(HEADER, flush=True)
        addresses = {name: stack.enter_context(served(root)) for name, root in roots.items()}
        for case in CASES:
            pages = {name: opened(chromium, there, case) for name, there in addresses.items()}
            for control in ("seed", "level"):
                report(case, control, measured(pages, case, control, options.changes))
            for page in pages.values():
                page.context.close()


def starts(chromium: Any) -> str:
    """Return the times from the start of a server to the first pages, with compiled kernels."""
    began = time.monotonic()
    with served(ROOT) as address:
        seconds = [time.monotonic() - began]
        for _ in range(2):
            page = chromium.new_context(viewport={"width": 1440, "height": 900}).new_page()
            began = time.monotonic()
            page.goto(address)
            page.wait_for_selector(".facts", timeout=SLOW)
            seconds.append(time.monotonic() - began)
            page.context.close()
    answers, first, second = seconds
    return (
        f"The server answers after {answers:.1f} s; the first page has results after "
        f"{first:.1f} s more, a second one after {second:.1f} s.\n"
    )


def opened(chromium: Any, address: str, case: Case) -> Any:
    """Return a page with the study of a case and Live on."""
    page = chromium.new_context(viewport={"width": 1440, "height": 900}).new_page()
    page.add_init_script(TRACE)
    page.goto(f"{address}/simulate")
    page.wait_for_selector(".facts", timeout=SLOW)
    menu(page, "data_row")
    choose(page, "data_source", "none")
    close_menu(page)
    for key, value in (("grid_nx", case.side), ("grid_ny", case.side), ("n_realizations", case.n)):
        fill(page, key, value)
    page.locator(".st-key-live label").set_checked(True)
    at_rest(page)
    return page


def measured(
    pages: dict[str, Any], case: Case, control: str, n: int
) -> dict[str, list[list[float]]]:
    """Return the measurements of each checkout, without the first three.

    The first three changes include compilation.
    """
    rows: dict[str, list[list[float]]] = {name: [] for name in pages}
    changes = new_values(control)
    for k in range(n + 3):
        value = next(changes)
        for name, page in pages.items():
            row = changed(page, case, control, value)
            if k >= 3:
                rows[name].append(row)
    return rows


def new_values(control: str) -> Iterator[str]:
    """Return values of a control; successive values differ."""
    for k in count(1):
        yield str(k) if control == "seed" else LEVELS[k % 3]


def changed(page: Any, case: Case, control: str, value: str) -> list[float]:
    """Change a control and return the numbers of a row of the table."""
    page.wait_for_timeout(400)
    page.wait_for_selector("[data-test-script-state=notRunning]", timeout=SLOW)
    if control == "seed":
        box = page.locator(".st-key-seed input")
        box.fill(value)
        page.evaluate("Object.assign(trace, { sent: [], got: [], drawn: [] })")
        box.press("Enter")
    else:
        page.locator(".st-key-wavelet_level input").click()
        option = page.get_by_role("option", name=value, exact=True)
        option.wait_for(timeout=SLOW)
        page.evaluate("Object.assign(trace, { sent: [], got: [], drawn: [] })")
        option.click()
    facts = f"{case.n} realizations in"
    end = page.wait_for_function(COMPLETE, arg=facts, timeout=SLOW).json_value()
    return page.evaluate(READ, end)


def report(case: Case, control: str, rows: dict[str, list[list[float]]]) -> None:
    """Print a line for each checkout."""
    for name, own in rows.items():
        first, complete, server, drawing, sent = np.array(own).T
        shown = [
            np.median(first),
            np.quantile(first, 0.95),
            np.median(complete),
            np.quantile(complete, 0.95),
            np.median(server),
            np.median(drawing),
            np.median(sent) / 1000,
        ]
        cells = " | ".join(f"{value:.0f}" for value in shown)
        print(f"| {case.title} | {control} | {name} | {cells} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
