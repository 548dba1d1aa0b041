"""The program, as the command `turbidock` of the package, and the package's other commands."""

import importlib
import os
import pathlib
import sys
import types

PROGRAM = pathlib.Path(__file__).with_name("bin") / "turbidock"


def main() -> None:
    os.execv(PROGRAM, sys.argv)


def of_logs(module: str) -> types.ModuleType:
    """A module that needs the extra `logs`. ImportError, which says so, without it."""
    try:
        return importlib.import_module(f".{module}", __package__)
    except ModuleNotFoundError as error:
        raise ImportError(f"{error.name} is not installed: pip install '.[logs]'") from error


def _command(module: str) -> None:
    """Its main(); what is wrong with what was given is a line, with exit code 2."""
    try:
        of_logs(module).main()
    except (ValueError, OSError, ImportError) as error:
        print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
        sys.exit(2)


def mcap() -> None:
    _command("mcap_out")


def bag() -> None:
    _command("bags")
