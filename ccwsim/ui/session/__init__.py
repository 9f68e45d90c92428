"""The state of a session, and the study described by its choices."""
