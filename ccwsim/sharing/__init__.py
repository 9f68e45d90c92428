"""Ways to share a study, namely link, project file, Python code, command and report."""
