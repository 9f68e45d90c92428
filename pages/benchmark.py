"""CPU time against the size of the grid and the number of data, as the paper reports it."""

from __future__ import annotations

from ccwsim.ui.benchmark.page import draw_benchmark
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Benchmark", draw_benchmark)
