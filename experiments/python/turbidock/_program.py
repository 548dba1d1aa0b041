"""The program, as the command `turbidock` of the package, and the commands that need an extra."""

import importlib
import os
import pathlib
import signal
import sys
import types

PROGRAM = pathlib.Path(__file__).with_name("bin") / "turbidock"


def main() -> None:
    os.execv(PROGRAM, sys.argv)


def of_extra(module: str, extra: str) -> types.ModuleType:
    """A module that needs an extra. ImportError, which says so, without it."""
    try:
        return importlib.import_module(f".{module}", __package__)
    except ModuleNotFoundError as error:
        raise ImportError(f"{error.name} is not installed: pip install '.[{extra}]'") from error


def _command(module: str, extra: str) -> None:
    """Its main(); what is wrong with what was given is a line, with exit code 2. A SIGTERM leaves nothing half written."""
    if extra == "logs":
        signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        sys.exit(of_extra(module, extra).main())
    except (ValueError, OSError, ImportError) as error:
        print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)


def mcap() -> None:
    _command("logs.mcap_out", "logs")


def bag() -> None:
    _command("logs.bags", "logs")


def identify() -> None:
    _command("logs.identify", "logs")


def ros() -> None:
    _command("ros.command", "ros")
