"""A vehicle's data as YAML (models/README.md), with where each number is from."""

from __future__ import annotations

import json
from typing import Any, Mapping

from ..scenario import Scenario
from ._parameters import plain

# Which parameters are in which key.
_TOLD = {"hydrodynamics.added_mass_diagonal": "added_mass.", "hydrodynamics.linear_damping_diagonal": "linear_damping.",
    "hydrodynamics.quadratic_damping_diagonal": "quadratic_damping.", "hydrodynamics.displaced_volume_m3": "trim.buoyancy",
    "hydrodynamics.p_BBcb_m": "trim.centre", "thrusters.max_thrust_newton": "thrust.scale",
    "thrusters.reverse_ratio": "thrust.reverse", "thrusters.dead_band_volts": "thrust.dead_band",
    "thrusters.curve_exponent": "thrust.exponent", "thrusters.table_thrust_newton": "thrust.reverse",
    "thrusters.lag_s": "thrust.lag", "thrusters.lag_power": "thrust.lag_power", "thrusters.dead_time_s": "delay.",
    "thrusters.inflow_loss_s_per_m": "thrust.inflow_loss"}


def vehicle_yaml(scenario: Scenario, data: Mapping[str, Any], comments: Mapping[str, str], source: str) -> str:
    """All of the scenario's vehicle, with `data` in the place of its own; `comments` by parameter."""
    lines = [f"# [identified] {source}; in brackets 95 % intervals. The rest is as it was before.", ""]
    vehicle = scenario["vehicle"]
    for group in ("rigid_body", "hydrodynamics", "thrusters", "contact"):
        lines.append(f"{group}:")
        for key in vehicle[group].keys():
            path = f"{group}.{key}"
            lines += [f"  # {name.split('.')[1]}: [identified] {comment}" for name, comment in comments.items()
                      if path in data and path in _TOLD and name.startswith(_TOLD[path])]
            lines.append(f"  {key}: {_text(data.get(path, vehicle[group][key]))}")
        lines.append("")
    lines.append(f"loads: {_text(vehicle['loads'])}")
    return "\n".join(lines) + "\n"


def _text(value: Any) -> str:
    return json.dumps(plain(value))
