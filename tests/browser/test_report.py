"""Test a report in a browser: charts are drawn, nothing is downloaded, and it fits a phone."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from playwright.sync_api import expect

from ccwsim.report.document import write_report
from ccwsim.ui.examples.catalogue import lecture_sheet
from tests.report.test_report import document

SLOW = 180_000


@pytest.mark.slow
@pytest.mark.parametrize("width", [1200, 390])
def test_a_report_draws_itself_without_a_network(chromium, tmp_path, width):
    path = tmp_path / "report.html"
    write_report(path, document("a word"))
    page = chromium.new_page(viewport={"width": width, "height": 900})
    wrong, asked = [], []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: wrong.append(message.text)
            if message.type == "error" else None)  # fmt: skip
    page.on("request", lambda request: asked.append(request.url)
            if not request.url.startswith(("file:", "data:", "blob:")) else None)  # fmt: skip
    page.goto(path.as_uri())
    expect(page.locator(".plot .main-svg").first).to_be_visible(timeout=SLOW)
    expect(page.locator(".plot .js-line")).to_have_count(4, timeout=SLOW)
    page.locator("nav a").last.click()
    expect(page.locator("#section-2")).to_be_in_viewport(timeout=SLOW)
    narrow = f"() => document.documentElement.scrollWidth <= {width}"
    page.wait_for_function(narrow, timeout=SLOW)
    assert [w for w in wrong if "data:image" not in w] == []
    assert asked == []
    page.close()


@pytest.mark.slow
def test_the_answers_of_the_lecture_begin_on_a_new_page_of_a4(chromium, tmp_path):
    sheet, sizes = lecture_sheet("http://localhost:8501/examples"), []
    for name, printed in (("all", sheet), ("tasks", replace(sheet, sections=sheet.sections[:-1]))):
        path = tmp_path / f"{name}.html"
        write_report(path, printed)
        page = chromium.new_page()
        page.goto(path.as_uri())
        pdf = page.pdf(prefer_css_page_size=True)
        assert set(re.findall(rb"MediaBox \[0 0 (\d+)\.\d+ (\d+)", pdf)) == {(b"594", b"841")}
        sizes.append(len(re.findall(rb"/Type /Page\b", pdf)))
        page.close()
    assert sizes[0] > sizes[1]
