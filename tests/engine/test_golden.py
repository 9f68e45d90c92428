"""Test that cells change only on purpose: compare 474 studies with stored digests."""

import json

import pytest

from tests.engine.golden_studies import DIGESTS, IMAGES, VOLUMES, digest, few, studies

STORED = json.loads(DIGESTS.read_text("utf-8"))
STUDIES = [*studies()]
FEW = few()


def changed(chosen) -> list[str]:
    """Return the names of studies with changed cells; see golden_studies.py."""
    return [name for name, *study in chosen if digest(*study) != STORED[name]]


def test_every_cell_of_some_studies_is_as_it_was():
    assert changed(FEW) == []


def test_these_have_every_image_every_number_of_data_and_every_value_of_an_option():
    def settings(chosen) -> set[str]:
        return {
            f"{key}={value}"
            for _, image, options, n_data in chosen
            for key, value in {"image": image, "n_data": n_data, **options}.items()
        }

    assert settings(FEW) == settings(STUDIES)


@pytest.mark.slow
@pytest.mark.parametrize("wanted", IMAGES + VOLUMES)
def test_every_cell_of_the_other_studies_is_as_it_was(wanted):
    others = [study for study in STUDIES if study[1] == wanted and study not in FEW]
    assert changed(others) == []


def test_the_stored_digests_are_those_of_the_studies():
    assert len(STUDIES) == 474
    assert [name for name, *_ in STUDIES] == list(STORED)
