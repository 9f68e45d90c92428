"""The dashboard's parts: state, jobs, controls, maps, charts. Pages put them together."""
