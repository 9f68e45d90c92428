"""Page with example studies in the order of a lecture, and with a quiz."""

from __future__ import annotations

from ccwsim.ui.examples.page import draw_examples
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Examples", draw_examples)
