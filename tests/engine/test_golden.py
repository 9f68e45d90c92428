"""Cells change only on purpose: digests of 180 studies are those that are stored."""

import json

import pytest

from tests.engine.golden_studies import DIGESTS, IMAGES, digest, studies

STORED = json.loads(DIGESTS.read_text("utf-8"))


@pytest.mark.parametrize("wanted", IMAGES)
def test_every_cell_is_as_it_was(wanted):
    changed = [
        name
        for name, image, options, n_data in studies()
        if image == wanted and digest(image, options, n_data) != STORED[name]
    ]
    assert not changed, "cells changed; see golden_studies.py"


def test_the_stored_digests_are_those_of_the_studies():
    names = [name for name, *_ in studies()]
    assert len(names) == 180
    assert names == list(STORED)
