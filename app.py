"""CCWSIM's dashboard: `streamlit run app.py` opens the first page of the menu."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.page import PAGES


def main() -> None:
    """Open the first page with the study of the address; every page configures itself."""
    # a copy, because switching clears the query
    asked = {name: st.query_params.get_all(name) for name in st.query_params}
    st.switch_page(PAGES[0][1], query_params=asked)


if __name__ == "__main__":
    main()
