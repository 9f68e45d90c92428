"""Read thousands of hostile files and arguments in bounded time and memory: `docs/safety.md`.

python -m tests.fuzz --files 5000 --arguments 2000 --seed 0
"""
