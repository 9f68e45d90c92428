"""The page Hard data."""
