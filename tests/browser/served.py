"""Start the dashboard on a free port, and a browser to view it."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
CHROMIUM = Path("/usr/bin/chromium")
ARGUMENTS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-gpu-watchdog",  # which ends drawing by software on a loaded machine
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
PATIENCE = 180.0


class Server(NamedTuple):
    """A running server: its address and its process."""

    address: str
    process: subprocess.Popen


@contextmanager
def served(root: Path = ROOT) -> Iterator[str]:
    """Start the dashboard of a checkout, yield its address, and stop the dashboard."""
    with started(root) as server:
        yield server.address


@contextmanager
def started(
    root: Path = ROOT, *options: str, port: int = 0, log: Path | None = None
) -> Iterator[Server]:
    """Start the dashboard with options of Streamlit, yield the server, and stop it.

    Parameters
    ----------
    root : Path
        Folder of the checkout.
    options : str
        Options of Streamlit, such as "--server.disconnectedSessionTTL=5".
    port : int
        Port of the server; 0 for a free port.
    log : Path, optional
        File for the output of the server.
    """
    port = port or free_port()
    with open(log or os.devnull, "ab") as said:
        server = subprocess.Popen(
            [sys.executable, "-m", "streamlit", "run", "app.py", "--server.headless=true",
             f"--server.port={port}", "--server.address=127.0.0.1",
             "--server.fileWatcherType=none", *options],
            cwd=root, stdout=said, stderr=said, env={**os.environ, "PYTHONPATH": str(root)},
        )  # fmt: skip
    address = f"http://127.0.0.1:{port}"
    try:
        _wait_until_healthy(server, address)
        yield Server(address, server)
    finally:
        server.terminate()
        try:
            server.wait(10)
        except subprocess.TimeoutExpired:  # a compiling process does not react
            server.kill()
            server.wait(10)


@contextmanager
def browser() -> Iterator[Any]:
    """Start a headless browser, yield it, and close it."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=str(CHROMIUM), args=ARGUMENTS)
        try:
            yield launched
        finally:
            launched.close()


def _wait_until_healthy(server: subprocess.Popen, address: str) -> None:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if server.poll() is not None:
            raise RuntimeError(f"the server ended with code {server.returncode}")
        try:
            with urllib.request.urlopen(f"{address}/_stcore/health", timeout=1) as answer:
                if answer.status == 200:
                    return
        except OSError:
            time.sleep(0.1)
    raise RuntimeError(f"the server was not up after {PATIENCE:.0f} s")


def free_port() -> int:
    """Return the number of a free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
