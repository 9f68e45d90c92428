"""Names and colours of the facies of the study."""

from __future__ import annotations

from ccwsim import datasets
from ccwsim.figures import facies_colours
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State


def colours_of(state: State) -> list[str]:
    """Return the colours of the facies, the user's own where there are some."""
    choice = state.choices.image
    return facies_colours(image_of(choice), dict(choice.colours))


def pretty(name: str) -> str:
    """Return a bundled data set's name as words, and the name of a file as it is."""
    bundled = {*datasets.names(), *datasets.hard_data_names()}
    return name.replace("_", " ") if name in bundled else name or "unnamed"


def colours_of_ran(state: State) -> list[str]:
    """Return the facies colours for the results, which may be of another image than the study."""
    assert state.ensemble is not None
    image = state.ensemble.training_image
    chosen = dict(state.choices.image.colours) if state.ran else {}
    return facies_colours(image, chosen)
