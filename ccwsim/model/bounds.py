"""The bounds of what a user may ask for: one table for core, widgets, links, projects and CLI.

Each value stands here once. Where a page offers less than the core takes, both are listed under
names of their own.
"""

from __future__ import annotations

MAX_SEED = 2**31 - 1
"""The largest seed that a widget or a link takes: exact also in the browser and in 32 bits."""

# Training image and grid
MAX_FACIES = 254
"""Facies are bytes in the kernels, and 255 marks a cell that is not simulated yet."""
MAX_GRID_SIDE = 2**31 - 1
"""Cells along a side of any grid: rows and columns are counted in 32 bits."""
MAX_GRID_SIDE_OFFERED = 10_000
"""Cells along a side that a page or a link takes: no screen shows a larger map."""

# Parameters
MIN_TEMPLATE, MAX_TEMPLATE = 4, 1024
"""Cells: a smaller patch holds no pattern, and few training images are larger than the largest."""
MAX_OVERLAP = MAX_TEMPLATE // 2
"""Cells: overlaps on both sides of a patch may not meet."""
MAX_LEVEL = 6
"""One coefficient then stands for 64 × 64 cells, more than most templates have."""
MAX_CANDIDATES = 10**6
"""About as many as a large training image (1000 × 1000) has locations."""
MAX_CANDIDATES_OFFERED = 10_000
"""What a page takes; so many candidates are nearly a draw from all locations."""
MAX_CO_TEMPLATE = 4
"""Template sizes ahead of the path: data farther off say little about a patch."""
MAX_TEMPLATE_VARIATION = 0.5
"""Share of the template: the smallest template still holds an overlap of half of it."""
MAX_LOCATION_WEIGHT = 10.0
"""Ten overlaps of difference: a location far off then hardly ever wins."""

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

# Realizations; the pages differ in what one realization costs there
MAX_REALIZATIONS = 1000
"""Of a study on a page or in a link: all are kept in memory and drawn."""
MAX_REALIZATIONS_OF_PROJECT = 1_000_000
"""In a project file: a script may simulate more than a page; beyond, the number is a mistake."""
MAX_LARGE_ENSEMBLE = 100_000
"""Of a large ensemble, which keeps statistics only."""
MAX_REALIZATIONS_COMPARED = 100
"""For each setting of the page Compare."""
MAX_REALIZATIONS_TIMED = 100
"""Of one timed case of the page Benchmark."""
MAX_REALIZATIONS_OF_SWEEP = 50
"""For each of up to 64 settings of a sweep."""

# World coordinates
MIN_FLOAT, MAX_FLOAT = 5e-324, 1.8e308
"""Cell sizes and origins: whatever a number of 64 bits holds."""

# Hard data
MAX_SAMPLED = 100_000
"""Data sampled from a reference field, as many as an upload may have."""
MAX_SAMPLING_STEP = 10_000
"""Cells between sampled data: the largest side of a grid that is offered."""
MAX_LINK_DATA = 200
"""Data placed by hand in a link; more make an address that mail programs cut."""
MAX_WRITTEN_DATA = 40
"""Data written out in a script; more are read from the project file."""

# Statistics
MAX_LAG = 100
"""Cells: variograms and connectivity are drawn up to here, or to half of the smaller side."""
MAX_CURVES = 100
"""Realizations with a curve of their own; more lie on top of each other."""
