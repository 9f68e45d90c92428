"""Import modules of higher folders when a noun first needs them."""

from importlib import import_module
from typing import Any


def notebook() -> Any:
    """Import and return the drawing module; scripts that draw nothing do not load plotly."""
    return import_module("ccwsim.figures.notebook")


def reader() -> Any:
    """Import and return the module that reads tables like files."""
    return import_module("ccwsim.io")
