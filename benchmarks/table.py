"""Measurements as a Markdown table and as JSON."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numba
import numpy as np

from benchmarks.cases import Row
from ccwsim.io.atomic import write_bytes

HEADER = ("data", "level", "CPU ms", "reference ms", "× faster", "× no data", "peak MB")


def table(rows: Sequence[Row], before: Sequence[Row] = ()) -> str:
    """Return the rows as a Markdown table, with the speed-up over earlier rows if any are given.

    Examples
    --------
    >>> new, old = Row(0, 1, 20.0, 900.0, 210.0), Row(0, 1, 30.0, 930.0, 209.0)
    >>> print(table([new], [old]))
    | data | level | CPU ms | reference ms | × faster | × no data | peak MB | before ms | × before |
    |-----:|------:|-------:|-------------:|---------:|----------:|--------:|----------:|---------:|
    |    0 |     1 |   20.0 |          900 |     45.0 |      1.00 |     210 |      30.0 |     1.50 |
    """
    header = HEADER + (("before ms", "× before") if before else ())
    free = {row.level: row.ms for row in rows if row.data == 0}
    earlier = {(row.data, row.level): row.ms for row in before}
    lines = []
    for row in rows:
        reference = row.reference_ms
        then = earlier.get((row.data, row.level))
        cells = [
            str(row.data),
            str(row.level),
            _shown(row.ms, 1),
            _shown(reference, 0),
            _shown(reference / row.ms if reference else None, 1),
            _shown(row.ms / free[row.level] if row.level in free else None, 2),
            _shown(row.memory_mb, 0),
        ]
        if before:
            cells += [_shown(then, 1), _shown(then / row.ms if then else None, 2)]
        lines.append(_line(cells, header))
    rule = "|" + "|".join("-" * (len(name) + 1) + ":" for name in header) + "|"
    return "\n".join([_line(header, header), rule, *lines])


def machine() -> str:
    """Describe this machine and its software in one line."""
    return (
        f"Python {platform.python_version()}, NumPy {np.__version__}, numba {numba.__version__}, "
        f"{platform.machine()}, {os.cpu_count()} cores, one thread used"
    )


def save(path: Path, image: str, rows: Sequence[Row]) -> None:
    """Write measurements as JSON."""
    content = {"machine": machine(), "training_image": image, "rows": [asdict(r) for r in rows]}
    write_bytes(path, (json.dumps(content, indent=1) + "\n").encode())


def load(path: Path) -> tuple[str, list[Row]]:
    """Return the name of the training image and the rows from a file that `save` wrote."""
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content["training_image"], [Row(**row) for row in content["rows"]]


def warnings(image: str, rows: Sequence[Row], other: str, before: Sequence[Row]) -> list[str]:
    """Describe differences that make a comparison of two runs unreliable.

    Examples
    --------
    >>> warnings("a", [Row(0, 1, 20.0, 900.0, None)], "a", [Row(0, 1, 30.0, 1800.0, None)])
    ['The reference took 2.00 times as long before: another machine, or a busy one.']
    """
    said = []
    if image != other:
        said.append(f"The training images differ: {image}, before {other}.")
    now = {row.level: row.reference_ms for row in rows if row.reference_ms}
    then = {row.level: row.reference_ms for row in before if row.reference_ms}
    ratios = [then[level] / now[level] for level in now if level in then]
    drift = float(np.median(ratios)) if ratios else 1.0
    if not 0.85 < drift < 1.18:
        said.append(
            f"The reference took {drift:.2f} times as long before: another machine, or a busy one."
        )
    return said


def _shown(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _line(cells: Sequence[str], header: Sequence[str]) -> str:
    padded = (cell.rjust(len(name)) for cell, name in zip(cells, header, strict=True))
    return "| " + " | ".join(padded) + " |"
