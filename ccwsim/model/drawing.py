"""Where pictures of the nouns come from: a folder above them, loaded when one is drawn."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def notebook() -> Any:
    """Return the module that draws nouns; a script that draws none does not load plotly."""
    return import_module("ccwsim.figures.notebook")
