"""The program, as the command `turbidock` of the package."""

import os
import pathlib
import sys

PROGRAM = pathlib.Path(__file__).with_name("bin") / "turbidock"


def main() -> None:
    os.execv(PROGRAM, sys.argv)
