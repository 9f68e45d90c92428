"""Generate the bundled files: ``python -m tools.datasets write``."""

import argparse

from ccwsim.datasets.catalogue import ASSETS
from tools.datasets import write_assets


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tools.datasets", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("write", help=f"write every bundled file to {ASSETS}")
    parser.parse_args()
    write_assets()
    print(f"wrote training images, reference fields and hard data to {ASSETS}")


if __name__ == "__main__":
    main()
