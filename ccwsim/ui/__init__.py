"""The parts of which the dashboard's pages consist: state, jobs, controls, maps, charts."""
