"""Run the command line: ``python -m ccwsim``."""

import sys
from io import TextIOWrapper

from ccwsim.cli.program import main

if __name__ == "__main__":
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a help text must not fail for an old code page
    sys.exit(main())
