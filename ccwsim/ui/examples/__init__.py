"""The page Examples, with its quiz."""
