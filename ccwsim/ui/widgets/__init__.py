"""Fields, text, errors and themes for all pages; nothing here depends on a session."""
