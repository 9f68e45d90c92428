"""The bounds of what a user may ask for: one table for core, widgets, links, projects and CLI."""

from __future__ import annotations

MAX_SEED = 2**31 - 1
"""The largest seed that a widget, a link or a project takes."""
