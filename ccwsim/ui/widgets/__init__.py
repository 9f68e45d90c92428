"""Fields, text, errors and themes of any page; nothing here knows a session."""
