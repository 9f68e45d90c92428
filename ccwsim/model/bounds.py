"""Bounds of user input: one table for core, widgets, links, projects and command line.

If a page offers less than the core accepts, both bounds are listed.
"""

from __future__ import annotations

MAX_SEED = 2**31 - 1
"""The largest seed in widgets and links: exact in the browser and in 32 bits."""

# Training image and grid
MAX_FACIES = 254
"""Facies are bytes in kernels, and 255 marks cells that are not simulated yet."""
MAX_GRID_SIDE = 2**31 - 1
"""Cells along a side of any grid: rows and columns have 32 bits."""
MAX_GRID_SIDE_OFFERED = 10_000
"""Cells along a side in pages and links: no screen shows a larger map."""

# Parameters
MIN_TEMPLATE, MAX_TEMPLATE = 4, 1024
"""Cells: smaller patches hold no pattern, and few training images are larger."""
MAX_OVERLAP = MAX_TEMPLATE // 2
"""Cells: overlaps on both sides of a patch may not meet."""
MAX_LEVEL = 6
"""A coefficient of this level covers 64 × 64 cells, more than most templates have."""
MAX_CANDIDATES = 10**6
"""About the locations of a large training image (1000 × 1000)."""
MAX_CANDIDATES_OFFERED = 10_000
"""Candidates offered on a page; more are nearly a draw from all locations."""
MAX_CO_TEMPLATE = 4
"""Template sizes ahead of the path: more distant data have little influence on a patch."""
MAX_TEMPLATE_VARIATION = 0.5
"""Share of the template: the smallest template still holds an overlap of half of it."""
MAX_LOCATION_WEIGHT = 10.0
"""Ten overlaps of difference: distant locations are then hardly ever chosen."""

PARAMETERS: dict[str, tuple[float, float]] = {
    "template_size": (MIN_TEMPLATE, MAX_TEMPLATE),
    "overlap_size": (1, MAX_OVERLAP),
    "wavelet_level": (0, MAX_LEVEL),
    "n_candidates": (1, MAX_CANDIDATES),
    "co_template": (1, MAX_CO_TEMPLATE),
    "search_fraction": (0.0, 1.0),
    "template_variation": (0.0, MAX_TEMPLATE_VARIATION),
    "location_weight": (0.0, MAX_LOCATION_WEIGHT),
}
"""The range of each parameter that is a number; a search fraction is more than 0."""

# Realizations; their cost differs between pages
MAX_REALIZATIONS = 1000
"""Realizations on a page or in a link: all are kept in memory and drawn."""
MAX_REALIZATIONS_OF_PROJECT = 1_000_000
"""Realizations in a project file, for scripts."""
MAX_LARGE_ENSEMBLE = 100_000
"""Realizations of a large ensemble, which keeps statistics only."""
MAX_REALIZATIONS_COMPARED = 100
"""For each setting of the page Compare."""
MAX_REALIZATIONS_TIMED = 100
"""Realizations of a timed case of the page Benchmark."""
MAX_REALIZATIONS_OF_SWEEP = 50
"""For each of up to 64 settings of a sweep."""

# World coordinates
MIN_FLOAT, MAX_FLOAT = 5e-324, 1.8e308
"""Cell sizes and origins: the range of 64-bit floating-point numbers."""

# Hard data
MAX_SAMPLED = 100_000
"""Data sampled from a reference field, as for uploads."""
MAX_SAMPLING_STEP = 10_000
"""Cells between sampled data: the largest side of a grid that is offered."""
MAX_LINK_DATA = 200
"""Data placed by hand in a link; mail programs cut longer addresses."""
MAX_WRITTEN_DATA = 40
"""Data written out in a script; more are read from the project file."""

# Statistics
MAX_LAG = 100
"""Largest lag in cells of variograms and connectivity; at most half of the smaller side."""
MAX_CURVES = 100
"""Realizations with a curve of their own; more would overlap."""
