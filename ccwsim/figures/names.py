"""Names of the user's on a chart: shown as they are, whatever markup they look like."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape


def as_written(names: Sequence[str]) -> list[str]:
    """Return names for a chart, which takes tags, entities and %{...} for its own.

    Examples
    --------
    >>> as_written(["sand", "<b>mud", "%{x}"])
    ['sand', '&lt;b&gt;mud', '%&#123;x}']
    """
    return [escape(name, quote=False).replace("%{", "%&#123;") for name in names]
