"""Docking trials of an underwater vehicle that finds its dock with two cameras.

    import turbidock

    result = turbidock.run("sea_night_active", seed=77)
    print(result.outcome, result.time_s, result.digest)

See README.md of experiments/python for the first ten minutes.
"""

import sys as _sys

try:
    from ._core import ConfigError, NoAnswer, PluginError, SimulatorFault
except ModuleNotFoundError as _error:
    raise ImportError(f"{__path__[0]} is not built for Python {_sys.version.split()[0]}: {_error}") from _error
from ._core import Frame, Observation, Reference
from .plug_in import Controller, Estimator, Key
from .frames import Rig
from .results import Result, batch, dataset, gate, read_results, read_series, run
from .scenario import Scenario, keys, plans, scenarios, version
from .trial import Trial

__version__ = version().split()[0]

__all__ = [
    "ConfigError", "Controller", "Estimator", "Frame", "Key", "NoAnswer", "Observation",
    "PluginError", "Reference", "Result", "Rig", "Scenario", "SimulatorFault", "Trial", "batch", "dataset", "gate", "keys", "plans",
    "read_results", "read_series", "run", "scenarios", "version",
]

try:
    import gymnasium as _gymnasium
except ImportError:  # the environment is for those who have it
    pass
else:
    _gymnasium.register(id="turbidock/Docking-v0", entry_point="turbidock.docking_env:DockingEnv")
    del _gymnasium
