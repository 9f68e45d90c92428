"""One file a format: from bytes to arrays."""
