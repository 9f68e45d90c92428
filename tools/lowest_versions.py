"""Print constraints for pip with the lowest allowed versions: ``python -m tools.lowest_versions``.

The constraints name each package that the library requires, without extras.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def lowest_versions() -> list[str]:
    """Return a constraint such as "numpy==2.0" for each required package.

    Examples
    --------
    >>> [line for line in lowest_versions() if line.startswith("tqdm")]
    ['tqdm==4.66']
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return [re.sub(r">=([^,]+).*", r"==\1", required) for required in project["dependencies"]]


if __name__ == "__main__":
    print("\n".join(lowest_versions()))
