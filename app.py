"""CCWSIM's dashboard: `streamlit run app.py` opens the first page of the menu."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.page import PAGES


def main() -> None:
    """Open the first page; every page configures itself."""
    st.switch_page(PAGES[0][1], query_params=st.query_params)


if __name__ == "__main__":
    main()
