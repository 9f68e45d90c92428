"""Streamlit components of the dashboard: each is a folder of JavaScript, HTML and CSS."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import streamlit as st
from streamlit.components import v2

from ccwsim.ui.widgets import catch_callback_errors

FRONTEND_FOLDER = Path(__file__).parent
MAP_SCRIPTS = ("shared/ticks", "shared/drawing", "shared/view", "map/map")
SCRIPTS_BELOW = {
    "map": MAP_SCRIPTS[:-1],
    "chart": MAP_SCRIPTS[:1],
    "histogram": MAP_SCRIPTS[:2],
    **dict.fromkeys(("editor", "guides", "flow"), (*MAP_SCRIPTS, "shared/edits", "shared/tools")),
    "volume": (*MAP_SCRIPTS[:-1], "shared/edits", "volume/slice", "volume/body"),
}
"""Shared modules that each component uses besides `shared/calls`."""
ENTRY = "export default "
"""Start of the line that defines the function called by Streamlit, in a component's last module."""


def draw_component(
    name: str,
    key: str,
    content: dict[str, Any],
    event: str = "",
    take: Callable[[Any], None] | None = None,
    **options: Any,
) -> None:
    """Draw a component with the content that its JavaScript reads.

    `take` is called with the value that the component reports as `event`, before the page is drawn
    again. `options`, such as the width, are passed to Streamlit.
    """

    def changed() -> None:
        value = reported(key, event)
        if value is not None and take is not None:
            take(value)

    if event:
        options[f"on_{event}_change"] = catch_callback_errors(changed)
    _component(name)(key=key, data=content, **options)


def draw_tiles(
    key: str,
    heading: str,
    tiles: Sequence[dict[str, Any]],
    take: Callable[[Any], None],
    **options: Any,
) -> None:
    """Draw pictures that act as buttons; `take` is called with the value of a clicked tile.

    A tile may have a `value` (by default its number), a `name` for screen readers, texts (`label`,
    `note`, `badge`, `title`), a picture `png` with `width` and `height`, and may be `disabled`.
    `options` has the style `kind` of all tiles, the number of the tile `shown`, the effect of
    `arrows` ("choose" or "move"), and a picture `png` of all tiles with its number of `columns`.
    """
    content = {"heading": heading, "tiles": tiles, **options}
    draw_component("tiles", key, content, "chosen", take)


def run_script(
    name: str, key: str, take: Callable[[Any], None] | None = None, **content: Any
) -> None:
    """Run a script of the component `script`; `take` is called with the values that it reports."""
    draw_component("script", key, {"script": name, **content}, "told", take)


def reported(key: str, event: str) -> Any:
    """Return the value that a component reported, or None after an interrupted run."""
    return getattr(st.session_state.get(key), event, None)


@cache
def _component(name: str) -> Any:
    html, css, js = component_parts(name)
    # charts have the style of the page, which is parsed only once
    return v2.component(f"ccwsim_{name}", html=html, css=css, js=js, isolate_styles=name != "chart")


def component_parts(name: str) -> tuple[str, str, str]:
    """Return HTML (by default an empty element), CSS and JavaScript with the modules used."""
    modules = "shared/calls", *SCRIPTS_BELOW.get(name, ()), f"{name}/{name}"
    html, css, js = (
        "\n".join(path.read_text("utf-8") for path in paths if path.exists())
        for paths in (
            [FRONTEND_FOLDER / f"{m}.{kind}" for m in modules] for kind in ("html", "css", "js")
        )
    )
    n_entries = js.count(ENTRY)
    return html or f'<div class="{name}"></div>', css, js.replace(ENTRY, "", n_entries - 1)
