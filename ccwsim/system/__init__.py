"""Threads, memory and the machine."""
