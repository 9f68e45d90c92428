"""Page that measures CPU time against one quantity of the study, beside the paper's times."""

from __future__ import annotations

from ccwsim.ui.benchmark.page import draw_benchmark
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Benchmark", draw_benchmark)
