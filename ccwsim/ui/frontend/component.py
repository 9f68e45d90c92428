"""Components that Streamlit does not have: each is a folder of HTML, CSS and JavaScript."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import streamlit as st
from streamlit.components import v2

from ccwsim.ui.widgets.errors import catch_callback_errors

FOLDER = Path(__file__).parent
BELOW = {
    "map": ("shared/drawing",),
    "editor": ("shared/drawing", "map/map", "shared/edits"),
    "volume": ("shared/drawing", "shared/edits", "volume/slice", "volume/body"),
}
"""The modules before that of a component, after `shared/calls`: the browser gets one text."""
ENTRY = "export default "
"""Before what Streamlit calls: of the modules of a component that is the last one."""


def reported(key: str, name: str) -> Any:
    """Return what a component reported, for a callback; None after a run that was interrupted."""
    return getattr(st.session_state.get(key), name, None)


@cache
def canvas_component(name: str) -> Any:
    """Return the component whose parts are `<name>/<name>.html`, `.css` and `.js`."""
    html, css, js = component_parts(name)
    component = v2.component(f"ccwsim_{name}", html=html, css=css, js=js)

    def draw(**options: Any) -> Any:
        for option, value in options.items():
            if option.startswith("on_"):
                options[option] = catch_callback_errors(value)
        return component(**options)

    return draw


def component_parts(name: str) -> tuple[str, str, str]:
    """Return HTML, CSS and JavaScript of a component, after the modules that it builds on."""
    modules = "shared/calls", *BELOW.get(name, ()), f"{name}/{name}"
    css, js = ("\n".join(_text(f"{module}.{kind}") for module in modules) for kind in ("css", "js"))
    inherited = js.count(ENTRY) - 1
    return _text(f"{name}/{name}.html"), css, js.replace(ENTRY, "", inherited)


def _text(name: str) -> str:
    """A file of the folder; a module without a style sheet has none."""
    path = FOLDER / name
    return path.read_text("utf-8") if path.exists() or path.suffix != ".css" else ""
