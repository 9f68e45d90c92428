"""Page that measures CPU time by grid size and number of data, as in the paper."""

from __future__ import annotations

from ccwsim.ui.benchmark.page import draw_benchmark
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Benchmark", draw_benchmark)
