"""The state of a session, and the study that its choices describe."""
