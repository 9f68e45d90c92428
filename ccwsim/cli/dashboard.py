"""The command `dashboard`, which works in any folder and opens the dashboard in a browser."""

import os
import subprocess
import sys
from pathlib import Path

import click

import ccwsim
from ccwsim import CCWSIMError
from ccwsim.model import check_installed


@click.command(context_settings={"ignore_unknown_options": True})
@click.option("--port", type=click.IntRange(1, 65535), help="Port to listen on (default: 8501).")
@click.argument("streamlit_options", nargs=-1, type=click.UNPROCESSED)
def command(port: int | None, streamlit_options: tuple[str, ...]) -> int:
    """Start the dashboard and open it in the browser; Ctrl-C ends it.

    Options of `streamlit run`, such as --server.headless=true, are passed on. Without
    --server.address, only this machine can reach the dashboard.
    """
    check_installed("streamlit")
    line = command_line(app_file(), port, streamlit_options)
    if os.name == "posix":
        sys.stdout.flush()
        os.execv(line[0], line)  # replace this process; then signals reach the server directly
    return subprocess.call(line)


def app_file() -> Path:
    """Return the path of the app, beside which Streamlit reads its configuration."""
    package = Path(ccwsim.__file__).parent
    for path in (package / "dashboard_app" / "app.py", package.parent / "app.py"):
        if path.is_file():
            return path
    raise CCWSIMError("this installation has no dashboard; install the package ccwsim again")


def command_line(app: Path, port: int | None, options: tuple[str, ...]) -> list[str]:
    """Return the command line that runs an app; if an option is repeated, the last value counts."""
    python = [sys.executable, "-P", "-m", "streamlit", "run", str(app)]
    ports = [] if port is None else [f"--server.port={port}"]
    fixed = "--server.fileWatcherType=none", "--server.showEmailPrompt=false"
    return [*python, *fixed, *ports, *options]
