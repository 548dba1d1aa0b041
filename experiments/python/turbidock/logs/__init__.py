"""Logs of vehicles: bags of ROS and ArduSub read (`bags`), trials written as MCAP (`mcap_out`), a vehicle's parameters found from
its motion (`identify`), the table that they share (`motion`). The core of the package imports none of it.

    from turbidock.logs import identify, read_bag

    read_bag("dive.mcap", "dive.yaml").save("dive")
    print(identify.fit("dive/motion.csv", "pool_active"))
"""

import importlib
import os
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .bags import Bag as Bag, estimate_bag as estimate_bag, read_bag as read_bag
    from .mcap_out import to_mcap as to_mcap
else:

    def __getattr__(name: str) -> Any:  # what needs the extra `logs`
        modules = {"Bag": "bags", "estimate_bag": "bags", "read_bag": "bags", "to_mcap": "mcap_out"}
        if name not in modules:
            raise AttributeError(f"turbidock.logs has no {name}")
        return getattr(_extra(modules[name]), name)


def _extra(module: str) -> Any:
    """A module that needs the extra `logs`. ImportError, which says so, without it."""
    try:
        return importlib.import_module(f".{module}", __package__)
    except ModuleNotFoundError as error:
        raise ImportError(f"{error.name} is not installed: pip install '.[logs]'") from error


def _command(module: str) -> None:
    """Its main(); what is wrong with what was given is a line, with exit code 2."""
    try:
        _extra(module).main()
    except (ValueError, OSError, ImportError) as error:
        print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
        sys.exit(2)


def mcap() -> None:
    """turbidock-mcap."""
    _command("mcap_out")


def bag() -> None:
    """turbidock-bag."""
    _command("bags")
