"""Peak memory of this process."""

from __future__ import annotations

import sys
from pathlib import Path


def peak_megabytes() -> float | None:
    """Return the peak of the resident memory in MB, or None if the system does not report a peak.

    Examples
    --------
    >>> peak_megabytes() is None or peak_megabytes() > 10
    True
    """
    status = Path("/proc/self/status")
    if status.exists():  # ru_maxrss would include the memory of the parent process
        lines = [line for line in status.read_text().splitlines() if line.startswith("VmHWM")]
        if lines:
            return int(lines[0].split()[1]) / 1024
    try:
        import resource
    except ImportError:
        return None
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit
