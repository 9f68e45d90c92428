"""Test a twenty-minute lecture: an example, the steps of a patch, a quiz, a study for the class."""

from __future__ import annotations

import re

import pytest

from tests.browser.hands import SLOW, SOON, at_rest, choose, soon, to_page, until
from tests.browser.served import CHROMIUM

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM.exists(), reason=f"there is no {CHROMIUM}"),
]
OWN = "/simulate?seed=7&realizations=3&data=none&grid=64x48"
OF_CLASS = "/simulate?realizations=2&data=none&grid=64x48&class=1"
PICTURES = """(buttons) => buttons.map((b) => {
  const picture = b.querySelector('.picture'), box = picture.getBoundingClientRect();
  return [b.getAttribute('aria-label'), Math.round(box.width), Math.round(box.height),
    picture.style.backgroundImage.length > 100];
})"""


def button(page, key: str):
    return page.locator(f".st-key-{key} button")


def test_an_example_a_patch_a_quiz_and_a_study_for_each_student(film):
    page = film.page
    film.open(OWN)
    film.see(page.locator(".st-key-results .facts", has_text="3 realizations"))
    an_example(film)
    patches(film)
    back_to_the_own_study(film)
    a_round_of_the_quiz(film)
    a_study_for_each_student(film)


def an_example(film) -> None:
    to_page(film.page, "Examples")
    film.see(film.page.locator(".st-key-card_delta"))
    film.take("examples")
    opened = film.page.locator(".opened", has_text="Example 11: A delta")
    film.press(button(film.page, "open_delta"), opened)
    film.see(film.page.locator(".st-key-results .facts", has_text="12 realizations"))
    film.page.wait_for_url(re.compile(r"/simulate\?.*ti=delta"), timeout=SLOW)
    film.take("an-example")


def patches(film) -> None:
    to_page(film.page, "How it works")
    where = film.page.locator(".st-key-how_player .where")
    film.see(where)
    first = int(re.findall(r"Patch (\d+) of", where.first.inner_text())[0])
    film.take("a-patch")
    film.press(
        button(film.page, "how_next"),
        film.page.locator(".st-key-how_player .where", has_text=f"Patch {first + 1} of"),
    )
    film.take("the-next-patch")


def back_to_the_own_study(film) -> None:
    to_page(film.page, "Simulate")
    facts = film.page.locator(".facts", has_text="3 realizations")
    film.press(button(film.page, "back_from_example"), facts)
    film.page.wait_for_url(re.compile(r"/simulate\?.*seed=7"), timeout=SLOW)
    film.take("the-own-study-again")


def a_round_of_the_quiz(film) -> None:
    from playwright.sync_api import expect

    page = film.page
    to_page(page, "Examples")
    quiz = page.locator(".st-key-examples_view button", has_text="Quiz")
    film.press(quiz, page.locator(".quiz button"))

    def six_are_alike() -> None:
        pictures = page.locator(".quiz button").evaluate_all(PICTURES)
        assert [p[0] for p in pictures] == [f"Picture {k + 1}" for k in range(6)]
        assert len({(width, height) for _, width, height, _ in pictures}) == 1
        assert all(p[3] for p in pictures)

    soon(six_are_alike, SLOW)
    film.take("quiz")
    told = page.locator(".verdict")
    film.press(page.locator(".quiz button").nth(2), told)
    film.see(page.locator(".quiz button.answer", has_text="training image"))
    film.see(page.locator(".score", has_text=re.compile(r"[01] of 1 found")))
    film.see(page.locator(".st-key-map_quiz_seams canvas"))
    film.take("answer")
    following = button(page, "quiz_next").locator("visible=true").first
    until(
        lambda: following.click(timeout=SOON) if told.count() else None,
        lambda wait: told.wait_for(state="detached", timeout=wait),
    )
    choose(page, "quiz_level", "3")
    film.see(page.locator(".quiz button:not([disabled])"))
    expect(page.locator(".quiz button.answer")).to_have_count(0, timeout=SOON)


def a_study_for_each_student(film) -> None:
    seeds = []
    for _ in range(2):
        context = film.page.context.browser.new_context(viewport=film.page.viewport_size)
        student = context.new_page()
        student.goto(film.address + OF_CLASS)
        said = student.locator(".opened", has_text="Your own seed in this class is")
        said.first.wait_for(timeout=SLOW)
        student.wait_for_url(re.compile(r"seed=\d+"), timeout=SLOW)
        seeds += re.findall(r"seed=(\d+)", student.url)
        said.filter(has_text=seeds[-1]).first.wait_for(timeout=SLOW)
        no_class = "() => !location.search.includes('class=1')"
        student.wait_for_function(no_class, timeout=SOON)
        student.reload()
        student.locator(".facts", has_text="2 realizations").first.wait_for(timeout=SLOW)
        student.wait_for_url(f"**seed={seeds[-1]}*", timeout=SOON)
        at_rest(student)
        context.close()
    assert seeds[0] != seeds[1]
