"""Draw pages without a browser, and find what is on them."""

from __future__ import annotations

import csv
from io import StringIO
from pathlib import Path
from typing import Any

from streamlit.testing.v1 import AppTest

from ccwsim.ui.session.state import KEY, State

PAGES = Path(__file__).parents[2] / "pages"


def opened(name: str, state: State | None = None) -> AppTest:
    """Return a page of the dashboard, not drawn yet; without a state its session is new."""
    app = AppTest.from_file(str(PAGES / f"{name}.py"), default_timeout=180)
    if state is not None:
        app.session_state[KEY] = state
    return app


def named(widgets: Any, key: str) -> Any:
    """Return the widget of a key; one that took the place of another has spaces after it."""
    return next(widget for widget in widgets if (widget.key or "").rstrip() == key)


def html(app: AppTest) -> str:
    """All words that a page writes as HTML."""
    return " ".join(element.proto.body for element in app.get("html"))


def texts(app: AppTest) -> str:
    """All errors and warnings of a page."""
    return " ".join(element.value for kind in (app.error, app.warning) for element in kind)


def charts(app: AppTest) -> set[str]:
    """The keys of all charts of a page."""
    return {element.proto.id.rsplit("chart_", 1)[-1] for element in app.get("plotly_chart")}


def csv_rows(content: bytes) -> list[dict[str, str]]:
    """The lines of a CSV file, by the names in its head."""
    return list(csv.DictReader(StringIO(content.decode())))
