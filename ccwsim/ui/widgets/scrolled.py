"""What is wider than the page scrolls sideways, with the keyboard too."""

from __future__ import annotations

from html import escape


def scrolled(content: str, name: str) -> str:
    """Return HTML in a frame of its own that scrolls and can have the focus.

    Parameters
    ----------
    content : str
        HTML.
    name : str
        What the frame holds, for those who cannot see it.

    Examples
    --------
    >>> scrolled("<table></table>", "Times")
    '<div class="wide" tabindex="0" role="group" aria-label="Times"><table></table></div>'
    """
    return (
        f'<div class="wide" tabindex="0" role="group" aria-label="{escape(name)}">{content}</div>'
    )
