"""Page of the guides: what a simulation follows besides hard data, on a large map."""

from __future__ import annotations

from ccwsim.ui.guides.page import guides_page
from ccwsim.ui.page import show_page

if __name__ == "__main__":
    show_page("Guides", guides_page)
