"""Run the scripts of docs/gallery.md and write their output and pictures: python -m tools.gallery

Each script runs with no variables of others. The printed output follows the script as text, and the
value of its last line as a picture, as in the tutorials. Tests run the scripts and compare the
output.
"""

from __future__ import annotations

import contextlib
import re
import tempfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from PIL import Image

from tools import tutorials

PAGE = tutorials.ROOT / "docs" / "gallery.md"
PICTURES = tutorials.ROOT / "docs" / "images" / "gallery"
SECTION = re.compile(r"^## (?P<title>.*)\n(?P<body>(?:.*\n)*?)(?=^## |\Z)", re.MULTILINE)
LINK = re.compile(r"\[Open in the dashboard\]\((?P<address>\S+)\)")
WIDTH = 960
"""Maximum width of a picture in pixels; smaller pictures are enlarged by an integer factor."""
COLOURS = 16
"""Number of colours of a picture of facies, which a palette makes small."""


class Entry(NamedTuple):
    """A study of the gallery."""

    title: str
    address: str  # link to the dashboard; empty if there is none
    block: re.Match[str]  # the script with its output and picture

    @property
    def picture(self) -> Path:
        """File of the picture."""
        return PICTURES / f"{re.sub(r'[^a-z]+', '-', self.title.lower())}.png"


def entries(text: str) -> Iterator[Entry]:
    """Yield the studies of the page."""
    for section in SECTION.finditer(text):
        link = LINK.search(section["body"])
        (block,) = tutorials.BLOCK.finditer(section["body"])
        yield Entry(section["title"], link["address"] if link else "", block)


def run(code: str) -> tuple[tutorials.Shown, dict[str, Any]]:
    """Run a script; return its output with a picture of few colours, and its variables."""
    names: dict[str, Any] = {}
    shown = tutorials.run(code, names, charts=False)
    return shown._replace(picture=small(shown.picture)), names


def small(png: bytes) -> bytes:
    """Return a picture with a palette of few colours."""
    out = BytesIO()
    picture = Image.open(BytesIO(png)).convert("RGBA")
    white = Image.new("RGBA", picture.size, "white")  # inactive cells are transparent
    opaque = Image.alpha_composite(white, picture).convert("RGB")
    few = opaque.quantize(COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    times = max(WIDTH // picture.width, 1)
    few = few.resize((times * few.width, times * few.height), Image.Resampling.NEAREST)
    few.save(out, "PNG", optimize=True)
    return out.getvalue()


def main() -> None:
    """Rewrite the page and its pictures."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for old in PICTURES.glob("*.png"):
        old.unlink()
    text = PAGE.read_text("utf-8")
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for entry in entries(text):
            shown, _ = run(entry.block["code"])
            entry.picture.write_bytes(shown.picture)
            parts = [f"```python\n{entry.block['code']}```\n"]
            if shown.text:
                parts.append(f"{tutorials.OUTPUT}{shown.text}```\n")
            words = entry.block["words"] or shown.words
            parts.append(f"![{words}](images/gallery/{entry.picture.name})\n")
            text = text.replace(entry.block[0], "\n".join(parts))
            print(f"{entry.title}: {len(shown.picture) / 1000:.0f} kB")
    PAGE.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
