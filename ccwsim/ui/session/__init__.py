"""What a session remembers, and what it is resolved to."""
