"""The program, as the command `turbidock` of the package."""

import os
import pathlib
import sys


def main() -> None:
    program = pathlib.Path(__file__).with_name("bin") / "turbidock"
    os.execv(program, sys.argv)
