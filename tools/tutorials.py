"""Run the tutorials and write their output into their pages: python -m tools.tutorials [NAME …]

A tutorial is a page of Markdown. Its blocks of Python run one after another, like the cells of a
notebook. The printed output of each block follows the block as text, and the value of the last line
as a picture. Tests run the tutorials and compare the output. The site also has notebooks of the
tutorials.
"""

from __future__ import annotations

import ast
import contextlib
import json
import os
import re
import sys
import tempfile
from base64 import b64decode
from collections.abc import Iterator
from html import unescape
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "tutorials"
PICTURES = ROOT / "docs" / "images" / "tutorials"
OUTPUT = '```text title="Output"\n'
BLOCK = re.compile(
    r"^```python\n(?P<code>.*?)^```\n"
    rf"(?:\n{re.escape(OUTPUT)}(?P<text>.*?)^```\n)?"
    r"(?:\n!\[(?P<words>[^\n]*)\]\((?P<picture>[^\n]*)\)\n)?",
    re.DOTALL | re.MULTILINE,
)
CHART_SIZE = 720, 300
MAX_SIDE = 640
"""Maximum longer side of a map in pixels; smaller maps are enlarged by an integer factor."""
MAX_BYTES, COLOURS = 95_000, 16
"""Size of the file of a picture above which it has only so many colours."""


class Shown(NamedTuple):
    """Output of a block: printed text, and a PNG with a caption for the value of the last line."""

    text: str
    picture: bytes = b""
    words: str = ""


def run(code: str, names: dict[str, Any], charts: bool = True) -> Shown:
    """Run a block with the variables of earlier blocks; without `charts`, draw no chart.

    Examples
    --------
    >>> names = {}
    >>> run("a = 2\\nprint(a)", names).text, names["a"]
    ('2\\n', 2)
    >>> run("a + 1", names).text
    '3\\n'
    """
    tree = ast.parse(code)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(StringIO()) as printed:
        exec(compile(tree, "<block>", "exec"), names)
        value = None
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "<block>", "eval"), names)  # type: ignore[attr-defined]
    text = printed.getvalue()
    if value is None:
        return Shown(text)
    if hasattr(value, "to_plotly_json"):
        return Shown(text, *(chart_picture(value) if charts else (b"", "")))
    if hasattr(value, "_repr_html_"):
        return Shown(text, *html_picture(value._repr_html_()))
    if isinstance(value, Image.Image):
        return Shown(text, enlarged(value))
    return Shown(f"{text}{value!r}\n")


def html_picture(html: str) -> tuple[bytes, str]:
    """Return the enlarged picture in a notebook's HTML output, and the picture's caption."""
    found = re.search(r'base64,([^"]*)" alt="([^"]*)"', html)
    assert found, html
    return enlarged(Image.open(BytesIO(b64decode(found[1])))), unescape(found[2])


def enlarged(picture: Image.Image) -> bytes:
    """Return a PNG of a picture, enlarged by an integer factor if it is small.

    A file that would be large, for example a map of values, gets a palette of few colours.
    """
    times = max(MAX_SIDE // max(picture.size), 1)
    size = picture.width * times, picture.height * times
    picture, file = picture.resize(size, Image.Resampling.NEAREST), BytesIO()
    picture.save(file, "PNG", optimize=True)
    if file.tell() > MAX_BYTES:
        few = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
        file = BytesIO()
        few.save(file, "PNG", optimize=True)
    return file.getvalue()


def chart_picture(chart: Any) -> tuple[bytes, str]:
    """Return a PNG of a Plotly chart, drawn by a browser, and the titles of the chart's axes."""
    from tests.browser.served import browser

    width, height = CHART_SIZE
    chart.update_layout(width=width, height=height)
    with browser() as chromium:
        page = chromium.new_page(viewport={"width": width, "height": height})
        page.set_content(chart.to_html(include_plotlyjs=True))
        page.wait_for_selector(".main-svg")
        drawn = Image.open(BytesIO(page.locator(".js-plotly-plot").screenshot()))
    file = BytesIO()
    drawn.convert("RGB").quantize(64).save(file, "PNG", optimize=True)
    x, y = chart.layout.xaxis.title.text, chart.layout.yaxis.title.text
    return file.getvalue(), f"{y} against {x}"


def pixels(png: bytes) -> np.ndarray:
    """Return the colours of the pixels of a picture."""
    return np.asarray(Image.open(BytesIO(png)).convert("RGB"))


def written_anew(name: str, text: str) -> str:
    """Run all blocks of a tutorial, write the pictures, and return the page with the new output."""
    names: dict[str, Any] = {}
    count = 0

    def with_output(block: re.Match[str]) -> str:
        nonlocal count
        shown = run(block["code"], names)
        parts = [f"```python\n{block['code']}```\n"]
        if shown.text:
            parts.append(f"{OUTPUT}{shown.text}```\n")
        if shown.picture:
            count += 1
            file = PICTURES / f"{name}-{count}.png"
            PICTURES.mkdir(parents=True, exist_ok=True)
            file.write_bytes(shown.picture)
            parts.append(f"![{shown.words}](../images/tutorials/{file.name})\n")
        return "\n".join(parts)

    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for old in PICTURES.glob(f"{name}-[0-9]*.png"):
            old.unlink()
        return BLOCK.sub(with_output, text)


def cells_of(text: str) -> Iterator[dict[str, Any]]:
    """Yield the notebook cells of a tutorial's Markdown."""

    def words(source: str) -> Iterator[dict[str, Any]]:
        if source.strip():
            yield {"cell_type": "markdown", "metadata": {}, "source": source.strip()}

    at = 0
    for block in BLOCK.finditer(text):
        yield from words(text[at : block.start()])
        stream = {"output_type": "stream", "name": "stdout", "text": block["text"]}
        yield {
            "cell_type": "code", "metadata": {}, "execution_count": None,
            "source": block["code"].rstrip("\n"), "outputs": [stream] if block["text"] else [],
        }  # fmt: skip
        at = block.end()
    yield from words(text[at:])


def notebook(text: str) -> str:
    """Return a tutorial as a notebook without output; running it shows the pictures.

    Examples
    --------
    >>> cells = json.loads(notebook("Add.\\n\\n```python\\n1 + 1\\n```\\n"))["cells"]
    >>> [(cell["cell_type"], cell["source"]) for cell in cells]
    [('markdown', 'Add.'), ('code', '1 + 1')]
    """
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    cells = [{"id": f"cell-{k}", **cell} for k, cell in enumerate(cells_of(text))]
    return json.dumps(
        {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5},
        indent=1,
    )


def on_page_markdown(text: str, page: Any, **_: Any) -> str:
    """Add a link to the notebook at the end of a tutorial; called when the site is built."""
    source = Path(page.file.src_uri)
    if source.parent.name != PAGES.name:
        return text
    return f'{text}\n\n<a href="../{source.stem}.ipynb" download>This tutorial as a notebook</a>\n'


def on_post_build(config: Any, **_: Any) -> None:
    """Write the notebook of each tutorial beside its page; called when the site is built."""
    folder = Path(config["site_dir"]) / "tutorials"
    for page in sorted(PAGES.glob("*.md")):
        (folder / f"{page.stem}.ipynb").write_text(notebook(page.read_text("utf-8")), "utf-8")


def main(names: list[str]) -> None:
    """Rewrite the named tutorials, or all of them."""
    for page in sorted(PAGES.glob("*.md")):
        if not names or page.stem in names:
            page.write_text(written_anew(page.stem, page.read_text("utf-8")), "utf-8")
            print(os.path.relpath(page))


if __name__ == "__main__":
    main(sys.argv[1:])
