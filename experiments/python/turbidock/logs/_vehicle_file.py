"""A vehicle's data as YAML (models/README.md), with where each number is from."""

from __future__ import annotations

import json
from typing import Any, Mapping

from ..scenario import Scenario
from ._parameters import plain

# Which parameters are in which key.
_TOLD = {f"hydrodynamics.{group}_diagonal": group + "." for group in ("added_mass", "linear_damping", "quadratic_damping")} | {
    "hydrodynamics.displaced_volume_m3": "trim.buoyancy", "hydrodynamics.p_BBcb_m": "trim.centre_", "thrusters.dead_time_s": "delay."} | {
    f"thrusters.{key}": "thrust." + name for key, name in (
        ("max_thrust_newton", "scale"), ("reverse_ratio", "reverse"), ("dead_band_volts", "dead_band"), ("curve_exponent", "exponent"),
        ("table_thrust_newton", "reverse"), ("lag_s", "lag"), ("lag_power", "lag_power"), ("inflow_loss_s_per_m", "inflow_loss"))}


def vehicle_yaml(scenario: Scenario, data: Mapping[str, Any], comments: Mapping[str, str], source: str) -> str:
    """All of the scenario's vehicle, with `data` in the place of its own; `comments` by parameter."""
    lines = [f"# [identified] {source}; in brackets 95 % intervals. The rest is as it was before.", ""]
    vehicle = scenario["vehicle"]
    for group in ("rigid_body", "hydrodynamics", "thrusters", "contact"):
        lines.append(f"{group}:")
        for key in vehicle[group].keys():
            path = f"{group}.{key}"
            lines += [f"  # {name.split('.')[1]}: [identified] {comment}" for name, comment in comments.items()
                      if path in data and (told := _TOLD.get(path)) and (name == told or told[-1] in "._" and name.startswith(told))]
            lines.append(f"  {key}: {json.dumps(plain(data.get(path, vehicle[group][key])))}")
        lines.append("")
    lines.append(f"loads: {json.dumps(plain(vehicle['loads']))}")
    return "\n".join(lines) + "\n"
