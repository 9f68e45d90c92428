"""What draws: maps, fields, errors, theme. Nothing here knows a session."""
