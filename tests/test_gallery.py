"""Test the gallery: scripts, outputs, pictures, and the links that open the same studies."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from PIL import Image

from ccwsim import simulate
from ccwsim.sharing.link import link_of, read_link
from ccwsim.ui.page import PAGES
from ccwsim.ui.session.resolve import study_of
from tests.ui.widgets import opened, texts
from tools import film, gallery, tutorials

ENTRIES = [*gallery.entries(gallery.PAGE.read_text("utf-8"))]
LINKED = [entry for entry in ENTRIES if entry.address]
WITHOUT_LINK = {"Elevation"}  # whose image is not bundled
MAX_LINES, MAX_BYTES = 15, 60_000
SECONDS = 10, 20


def title(entry: gallery.Entry) -> str:
    return entry.title


def query_of(entry: gallery.Entry) -> dict[str, list[str]]:
    return parse_qs(urlsplit(entry.address).query, keep_blank_values=True)


def test_each_of_twelve_studies_has_a_short_script_and_a_small_picture_of_its_own():
    assert len({*map(title, ENTRIES)}) == 12
    pictures = {entry.picture for entry in ENTRIES}
    assert pictures == {*gallery.PICTURES.iterdir()}
    assert max(picture.stat().st_size for picture in pictures) <= MAX_BYTES
    for entry in ENTRIES:
        assert len([line for line in entry.block["code"].splitlines() if line]) <= MAX_LINES
        assert Path(entry.block["picture"]).name == entry.picture.name
        assert entry.block["words"], entry.title


def test_only_studies_of_bundled_images_have_a_link():
    assert {entry.title for entry in ENTRIES if not entry.address} == WITHOUT_LINK


@pytest.mark.parametrize("entry", LINKED, ids=title)
def test_a_link_is_read_without_a_note_and_written_alike(entry):
    parts = urlsplit(entry.address)
    assert parts.netloc == "localhost:8501"
    assert parts.path.removeprefix("/") in {Path(page).stem for _, page in PAGES}
    choices, shown, notes = read_link(query_of(entry))
    assert not notes
    assert by_value(link_of(choices, shown)) == by_value(query_of(entry))


def by_value(query: dict[str, list[str]]) -> dict[str, list[Any]]:
    """Return a query with the values of its JSON texts, where 92 equals 92.0."""
    return {k: [json.loads(t) if t[:1] == "{" else t for t in v] for k, v in query.items()}


@pytest.mark.slow
@pytest.mark.parametrize("entry", LINKED, ids=title)
def test_a_link_opens_its_page(entry):
    page = opened(urlsplit(entry.address).path.removeprefix("/"))
    for name, values in query_of(entry).items():
        page.query_params[name] = values
    page.run()
    assert not page.exception
    assert not texts(page)


@pytest.mark.slow
@pytest.mark.parametrize("entry", ENTRIES, ids=title)
def test_a_script_prints_and_shows_what_the_page_has_and_simulates_the_study_of_its_link(
    entry, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    shown, names = gallery.run(entry.block["code"])
    assert shown.text == (entry.block["text"] or "")
    stored = tutorials.pixels(entry.picture.read_bytes())
    np.testing.assert_array_equal(stored, tutorials.pixels(shown.picture))
    if entry.address:
        study = study_of(read_link(query_of(entry))[0])
        inputs = study.training_image, study.grid, study.parameters, study.hard_data
        linked = simulate(*inputs, seed=study.seed, secondary=study.secondary)
        np.testing.assert_array_equal(names["e"].realizations[0], linked.realizations[0])


def test_the_film_of_the_readme_is_short_and_small():
    assert film.OUT.stat().st_size <= film.MAX_BYTES
    with Image.open(film.OUT) as picture:
        n_frames, durations = getattr(picture, "n_frames", 1), []
        for number in range(n_frames):
            picture.seek(number)
            picture.load()
            durations.append(picture.info["duration"])
        assert picture.width == film.WIDTH
    assert SECONDS[0] <= sum(durations) / 1000 <= SECONDS[1]
