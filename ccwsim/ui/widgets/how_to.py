"""The how-to pages of the documentation, which the package includes and the dashboard shows."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import ccwsim

LINK = re.compile(r"\[([^\]]+)\]\((?:\.\./)?([\w/-]+\.md)(?:#[\w-]+)?\)")
PICTURE = re.compile(r"^!\[[^\]]*\]\([^)]*\)\n+", re.MULTILINE)


@cache
def how_tos() -> dict[str, str]:
    """Return the texts of all how-tos and of the definitions of measures, by title."""
    package = Path(ccwsim.__file__).parent
    folders = (package / "docs", package.parent / "docs")
    docs = next((folder for folder in folders if (folder / "how-to").is_dir()), None)
    if docs is None:  # package metadata are missing
        return {}
    texts = {}
    for path in (*sorted((docs / "how-to").glob("*.md")), docs / "measures.md"):
        title, _, text = path.read_text("utf-8").partition("\n")
        texts[title.removeprefix("# ")] = on_a_page(text.strip())
    return texts


def on_a_page(text: str) -> str:
    """Return a document without links and pictures.

    Examples
    --------
    >>> print(on_a_page("![It](a.png)\\n\\n## Run\\n[Sweep](sweep.md), [Files](../formats.md)"))
    ### Run
    Sweep, Files (docs/formats.md)
    """

    def named(link: re.Match[str]) -> str:
        words, path = link.groups()
        is_here = path == "measures.md" or not link[0].partition("](")[2].startswith("../")
        return words if is_here else f"{words} (docs/{path})"

    return re.sub(r"(?m)^## ", "### ", LINK.sub(named, PICTURE.sub("", text)))
