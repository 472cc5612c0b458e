"""The program `trimray`."""

import sys

from ._trimray import run_program


def main() -> int:
    """Runs the program on the process's own command line; its exit code."""
    return run_program(["trimray", *sys.argv[1:]])
