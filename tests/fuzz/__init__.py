"""Thousands of hostile files and arguments, each in bounded time and memory: see `docs/safety.md`.

python -m tests.fuzz --files 5000 --arguments 2000 --seed 0
"""
