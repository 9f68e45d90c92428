"""Words that came from elsewhere, shown as they are: names in files, of facies, in messages."""

from __future__ import annotations

import re

INSIDE = re.compile(r"[\\`*\[\]<$~|@]|(?<!\w)_|_(?!\w)|:(?=[\w/+-])|&(?=#|\w+;)|(?<=www)\.")
"""What means something to Markdown anywhere in a line."""
AT_START = re.compile(r"(?m)^(\s*)([-+#>=])")
NUMBERED = re.compile(r"(?m)^(\s*\d+)([.)])")


def plain(words: str) -> str:
    """Return words so that a page shows them as they are, whatever Markdown they look like.

    Examples
    --------
    >>> print(plain("**a** :red[b] $c$ <img src=x>, template_size: 3"))
    \\*\\*a\\*\\* \\:red\\[b\\] \\$c\\$ \\<img src=x>, template_size: 3
    """
    escaped = INSIDE.sub(lambda found: "\\" + found[0], words)
    return NUMBERED.sub(r"\1\\\2", AT_START.sub(r"\1\\\2", escaped))
