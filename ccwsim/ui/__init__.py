"""The parts of which the dashboard's pages consist: state, jobs, controls, maps, charts."""

from ccwsim.model import check_installed

check_installed("streamlit")
