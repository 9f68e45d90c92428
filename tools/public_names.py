"""List the names that a package imports as themselves on the API pages."""

import ast
from typing import Any

from griffe import Alias, Extension


class PublicNames(Extension):
    """Marks the name of `from module import name as name` as public."""

    def on_alias_instance(self, *, node: Any, alias: Alias, **_: Any) -> None:
        """Mark an alias when griffe meets its import."""
        given = node.names if isinstance(node, ast.ImportFrom) else []
        alias.public = any(alias.name == one.name == one.asname for one in given) or None
