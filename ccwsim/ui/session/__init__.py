"""The state of a session, and the study that the user's choices describe."""
