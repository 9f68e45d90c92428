"""Test the page Examples in a browser: open an example, and play a round of the quiz."""

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

PICTURES = """(buttons) => buttons.map((b) => {
  const picture = b.querySelector('.picture'), box = picture.getBoundingClientRect();
  return [b.getAttribute('aria-label'), Math.round(box.width), Math.round(box.height),
    picture.style.backgroundImage.length > 100];
})"""


@pytest.fixture
def page(tab):
    return tab


def see(locator, wait: int = SLOW) -> None:
    from playwright.sync_api import expect

    expect(locator.first).to_be_visible(timeout=wait)


def press(page, key: str, seen) -> None:
    """Click a button until its effect is seen."""
    button = page.locator(f".st-key-{key} button").locator("visible=true")
    at_rest(page)
    until(
        lambda: button.first.click(timeout=SOON) if button.count() else None,
        lambda wait: see(seen, wait),
    )


def told(page):
    return page.locator(".verdict")


def test_an_example_opens_as_the_study_and_the_own_one_comes_back(page, address):
    page.goto(f"{address}/simulate?seed=7&realizations=3&data=none&grid=64x48")
    see(page.locator(".st-key-results .facts", has_text="3 realizations"))
    to_page(page, "Examples")
    see(page.locator(".st-key-card_delta"))
    press(page, "open_delta", page.locator(".opened", has_text="Example 11: A delta"))
    see(page.locator(".st-key-results .facts", has_text="12 realizations"))
    page.wait_for_url(re.compile(r"/simulate\?.*ti=delta"), timeout=SLOW)
    press(page, "back_from_example", page.locator(".facts", has_text="3 realizations"))
    page.wait_for_url(re.compile(r"/simulate\?.*seed=7"), timeout=SLOW)


def test_pictures_come_and_stay_in_their_room(page, address):
    page.goto(f"{address}/examples")
    page.wait_for_function(
        "() => document.querySelectorAll('.pictures').length >= 18"
        " && !document.querySelector('.pictures[aria-busy]')",
        timeout=SLOW,
    )
    loaded = "() => [...document.querySelectorAll('.pictures img')].map((i) => i.naturalWidth > 0)"

    def are_shown() -> None:
        shown = page.evaluate(loaded)
        assert all(shown)
        assert len(shown) >= 18 * 3

    soon(are_shown)


def test_a_round_of_the_quiz_is_told_and_counted(page, address):
    from playwright.sync_api import expect

    page.goto(f"{address}/examples")
    see(page.locator(".st-key-examples_view"))
    quiz = page.locator(".st-key-examples_view button", has_text="Quiz")
    at_rest(page)
    until(lambda: quiz.click(timeout=SOON), lambda wait: see(page.locator(".quiz button"), wait))

    def six_are_alike() -> None:
        pictures = page.locator(".quiz button").evaluate_all(PICTURES)
        assert [p[0] for p in pictures] == [f"Picture {k + 1}" for k in range(6)]
        assert len({(width, height) for _, width, height, _ in pictures}) == 1
        assert all(p[3] for p in pictures)

    soon(six_are_alike, SLOW)
    third = page.locator(".quiz button").nth(2)
    until(lambda: third.click(timeout=SOON), lambda wait: see(told(page), wait))
    see(page.locator(".quiz button.answer", has_text="training image"))
    see(page.locator(".score", has_text=re.compile(r"[01] of 1 found")))
    see(page.locator(".st-key-map_quiz_seams canvas"))
    following = page.locator(".st-key-quiz_next button").locator("visible=true").first
    until(
        lambda: following.click(timeout=SOON) if told(page).count() else None,
        lambda wait: told(page).wait_for(state="detached", timeout=wait),
    )
    choose(page, "quiz_level", "3")
    see(page.locator(".quiz button:not([disabled])"))
    expect(page.locator(".quiz button.answer")).to_have_count(0, timeout=SOON)


def test_two_students_open_one_link_and_have_different_seeds(chromium, address):
    seeds = []
    for _ in range(2):
        context = chromium.new_context(viewport={"width": 390, "height": 844})
        student = context.new_page()
        student.goto(f"{address}/simulate?realizations=2&data=none&grid=64x48&class=1")
        see(student.locator(".opened", has_text="Your own seed in this class is"))
        student.wait_for_url(re.compile(r"seed=\d+"), timeout=SLOW)
        seeds += re.findall(r"seed=(\d+)", student.url)
        see(student.locator(".opened", has_text=seeds[-1]))
        no_class = "() => !location.search.includes('class=1')"
        student.wait_for_function(no_class, timeout=SOON)
        student.reload()
        see(student.locator(".st-key-results .facts", has_text="2 realizations"))
        student.wait_for_url(f"**seed={seeds[-1]}*", timeout=SOON)
        context.close()
    assert seeds[0] != seeds[1]
