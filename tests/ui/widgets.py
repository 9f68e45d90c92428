"""Find a widget of a page that was drawn without a browser."""

from __future__ import annotations

from typing import Any


def named(widgets: Any, key: str) -> Any:
    """Return the widget of a key; one that took the place of another has spaces after it."""
    return next(widget for widget in widgets if (widget.key or "").rstrip() == key)
