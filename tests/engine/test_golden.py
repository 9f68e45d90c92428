"""Cells change only on purpose: digests of 414 studies are those that are stored."""

import json

import pytest

from tests.engine.golden_studies import DIGESTS, IMAGES, VOLUMES, digest, studies

STORED = json.loads(DIGESTS.read_text("utf-8"))
STUDIES = [*studies()]


def changed(chosen) -> list[str]:
    """The names of those studies whose cells are not as they were; see golden_studies.py."""
    return [name for name, *study in chosen if digest(*study) != STORED[name]]


def test_every_cell_of_some_studies_is_as_it_was():
    assert changed(STUDIES[::37]) == []


@pytest.mark.slow
@pytest.mark.parametrize("wanted", IMAGES + VOLUMES)
def test_every_cell_is_as_it_was(wanted):
    assert changed(study for study in STUDIES if study[1] == wanted) == []


def test_the_stored_digests_are_those_of_the_studies():
    assert len(STUDIES) == 414
    assert [name for name, *_ in STUDIES] == list(STORED)
