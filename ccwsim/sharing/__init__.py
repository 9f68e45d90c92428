"""A study to give away: as a link, as a project, as Python, as a command, as a report."""
