"""Run the command line: ``python -m ccwsim``."""

import sys

from ccwsim.cli.program import main

if __name__ == "__main__":
    sys.exit(main())
