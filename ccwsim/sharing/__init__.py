"""Ways to share a study: link, project file, Python code, command and report."""
