"""Draw pages without a browser, and find elements on them."""

from __future__ import annotations

import csv
from io import StringIO
from pathlib import Path
from typing import Any

from streamlit.testing.v1 import AppTest

from ccwsim.ui.session.state import KEY, State

PAGES = Path(__file__).parents[2] / "pages"
MENUS = (
    *(f"{step}_menu" for step in ("image", "data", "grid", "method")),
    *(f"{action}_menu" for action in ("import", "tables", "sample", "export")),
)
"""Keys of menus in the study column and on the page Hard data."""


def opened(name: str, state: State | None = None) -> AppTest:
    """Return a page of the dashboard before its first run; without a state its session is new.

    The menus of the study and of hard data are open, as closed menus have no fields.
    """
    app = open_menus(AppTest.from_file(str(PAGES / f"{name}.py"), default_timeout=180))
    if state is not None:
        app.session_state[KEY] = state
    return app


def open_menus(app: AppTest) -> AppTest:
    """Open the menus whose fields are drawn only while they are open; return the page."""
    for menu in MENUS:
        app.session_state[menu] = True
    return app


def named(widgets: Any, key: str) -> Any:
    """Return the widget with a key; a widget that replaced another has spaces after its key."""
    return next(widget for widget in widgets if (widget.key or "").rstrip() == key)


def html(app: AppTest) -> str:
    """Return all texts that a page writes as HTML."""
    return " ".join(element.proto.body for element in app.get("html"))


def texts(app: AppTest) -> str:
    """Return all errors and warnings of a page."""
    return " ".join(element.value for kind in (app.error, app.warning) for element in kind)


def charts(app: AppTest) -> set[str]:
    """Return the keys of all charts of a page."""
    drawn = [*app.get("plotly_chart"), *light_charts(app)]
    return {element.proto.id.rsplit("chart_", 1)[-1] for element in drawn}


def light_charts(app: AppTest) -> list[Any]:
    """Return the charts of a page that are drawn without Plotly."""
    drawn = app.get("bidi_component")
    return [element for element in drawn if element.proto.component_name == "ccwsim_chart"]


def csv_rows(content: bytes) -> list[dict[str, str]]:
    """Return the lines of a CSV file as dictionaries."""
    return list(csv.DictReader(StringIO(content.decode())))
