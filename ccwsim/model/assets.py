"""Tables of texts and values that are stored beside the code."""

import tomllib
from pathlib import Path
from typing import Any

PACKAGE_FOLDER = Path(__file__).parents[1]


def read_toml(name: str) -> dict[str, Any]:
    """Return the content of a TOML file; `name` is its path in the package.

    Examples
    --------
    >>> read_toml("assets/parameters.toml")["n_candidates"]["symbol"]
    'K'
    """
    return tomllib.loads((PACKAGE_FOLDER / name).read_text("utf-8"))
