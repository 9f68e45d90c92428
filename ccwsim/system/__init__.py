"""The operating system: memory, cores, files, caches and the log."""
