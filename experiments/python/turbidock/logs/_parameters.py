"""What of a vehicle a log may tell: the parameters of `identify`, what is known of them before, and where they are in a scenario."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Collection, Mapping, Sequence

import numpy as np

from ..scenario import Scenario, assignments_of

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
# What logs often have besides, and how a fit is asked for it.
FINDS = {"current": "a steady current (--water steady)", "lever_arm": "poses of another point than B (--find lever_arm)",
         "couplings": "added mass off the diagonal (--find couplings)", "tether": "a tether (--find tether; sea.tether of a scenario)",
         "sag": "thrust that falls over the log, a battery that sags (--find sag, or fit the log's first part)"}
COUPLINGS = ((0, 4), (1, 3), (1, 5), (2, 4))  # those of a hull that is alike on both sides, or nearly
GRAVITY_MPS2 = 9.81
UP_NEWTON = 10.0  # pull of a tether's float, which is the tether's weight


@dataclass(frozen=True)
class Parameter:
    """One number of a vehicle, or of how its log was made. Fitted is z: value = before exp(std z) where it is a scale, which
    stays positive, else before + std z. So the prior of every z is normal, 0 and 1; `std` is of the logarithm, or in `unit`."""

    name: str
    unit: str
    before: float
    std: float
    scale: bool = True
    at_least: float = -np.inf
    at_most: float = np.inf

    def value(self, z: float) -> float:
        value = self.before * np.exp(self.std * z) if self.scale else self.before + self.std * z
        return float(min(max(value, self.at_least), self.at_most))

    def z_bounds(self) -> tuple[float, float]:
        least, most = (float(np.log(max(bound, 1e-12) / self.before) if self.scale else bound - self.before) / self.std
                       for bound in (self.at_least, self.at_most))
        return least, most


def parameters_of(scenario: Scenario, *, thrust_std: float = 0, find: Collection[str] = (),
                  delays: Collection[str] = ("delay.pose",)) -> list[Parameter]:
    """Those of the scenario's vehicle; their values before are `vehicle`'s. `thrust_std`: relative, of all thrust together, which no log
    of motion alone tells. `find`: of FINDS. `delays`: of poses, of sensors on the commands' clock."""
    vehicle = plain_vehicle(scenario)
    hydro, thrusters, body = vehicle["hydrodynamics"], vehicle["thrusters"], vehicle["rigid_body"]
    mass = float(body["mass_kg"])
    inertia = [mass] * 3 + [float(x) for x in body["inertia_kg_m2"]]
    found = []
    for group, units, std in (("added_mass", ("kg", "kg m^2"), 0.5), ("linear_damping", ("N s/m", "N m s"), 0.7),
                              ("quadratic_damping", ("N s^2/m^2", "N m s^2"), 0.7)):
        for axis, before, inert in zip(AXES, hydro[group + "_diagonal"], inertia):
            # where none is known, a quarter of the inertia a second, or of twice that a metre
            how = (float(before), std) if before > 0 else (0, 0.25 * inert * (2 if group[0] == "q" else 1), False, 0)
            found.append(Parameter(f"{group}.{axis}", units[AXES.index(axis) >= 3], *how))
    found.append(Parameter("trim.buoyancy", "N", buoyancy_newton(vehicle), 0.01 * mass * GRAVITY_MPS2, False))
    offset = np.array(hydro["p_BBcb_m"]) - np.array(body["p_BBcm_m"])
    found += [Parameter(f"trim.centre_{way}", "m", float(offset[i]), 0.005, False) for i, way in enumerate(("ahead", "left"))]
    found.append(Parameter("trim.centre_above", "m", float(offset[2]), 0.5) if offset[2] > 0 else
                 Parameter("trim.centre_above", "m", float(offset[2]), 0.02, False))
    if thrust_std > 0:
        found.append(Parameter("thrust.scale", "", 1, thrust_std))
    found.append(Parameter("thrust.reverse", "", 1, 0.1))
    if not len(thrusters["table_volts"]):
        found += [Parameter("thrust.dead_band", "V", float(thrusters["dead_band_volts"]), 0.3, True, 0, 2.4),
                  Parameter("thrust.exponent", "", float(thrusters["curve_exponent"]), 0.2, True, 0.5, 4)]
    if thrusters["lag_s"] > 0:
        found += [Parameter("thrust.lag", "s", float(thrusters["lag_s"]), 0.5, True, 0, 10),
                  Parameter("thrust.lag_power", "", float(thrusters["lag_power"]), 0.5, True, 0.5, 4)]
    found.append(Parameter("thrust.inflow_loss", "s/m", float(thrusters["inflow_loss_s_per_m"]), 0.5, True, 0, 10))
    found += [Parameter("delay.pose", "s", 0, 0.1, False), Parameter("delay.drift", "s/s", 0, 1e-4, False)] if "delay.pose" in delays else []
    found += [Parameter("delay.onboard", "s", 0, 0.1, False)] if "delay.onboard" in delays else []
    return [parameter for parameter in found if parameter.before != 0 or not parameter.scale] + [
        parameter for name in find for parameter in parameters_to_find(name, hydro["added_mass_diagonal"])]


def parameters_to_find(name: str, added_mass: Sequence[float]) -> list[Parameter]:
    """Of one of FINDS."""
    if name == "current":
        return [Parameter(f"water.{axis}", "m/s", 0, 0.05, False) for axis in "xy"]
    if name == "lever_arm":  # of the point in B
        return [Parameter(f"lever.{axis}", "m", 0, 0.1, False) for axis in ("ahead", "left", "above")]
    if name == "tether":
        return [Parameter("tether.drag", "N s^2/m^2", 0, 10, False, 0, 50),
                *(Parameter(f"tether.pull_{axis}", "N", 0, 2, False, -50, 50) for axis in "xy")]
    if name == "sag":  # share of the thrust that is gone at the log's end
        return [Parameter("thrust.sag", "", 0, 0.1, False, 0, 0.9)]
    most = [float(np.sqrt(added_mass[i] * added_mass[j])) for i, j in COUPLINGS]
    return [Parameter(f"added_mass.{AXES[i]}_{AXES[j]}", "kg m", 0, 0.25 * bound, False, -0.7 * bound, 0.7 * bound)
            for (i, j), bound in zip(COUPLINGS, most) if bound > 0]


def plain_vehicle(scenario: Scenario) -> dict[str, Any]:
    """The data of the scenario's vehicle as dicts and lists."""
    return {key: plain(scenario[f"vehicle.{key}"]) for key in scenario["vehicle"].keys() if key != "model"}


def plain(value: Any) -> Any:
    if hasattr(value, "keys"):
        return {key: plain(value[key]) for key in value.keys()}
    value = value.tolist() if hasattr(value, "tolist") else value
    return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def buoyancy_newton(vehicle: Mapping[str, Any]) -> float:
    """Of the vehicle with its loads, less its weight."""
    mass = vehicle["rigid_body"]["mass_kg"] + sum(load["mass_kg"] for load in vehicle["loads"])
    volume = vehicle["hydrodynamics"]["displaced_volume_m3"] + sum(load["volume_m3"] for load in vehicle["loads"])
    return float(GRAVITY_MPS2 * (vehicle["hydrodynamics"]["water_density_kg_m3"] * volume - mass))


def data_of(vehicle: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """Keys of a vehicle's data with these parameters' values, "hydrodynamics.added_mass_diagonal": [...]; the others are as they were."""
    hydro, thrusters, body = vehicle["hydrodynamics"], vehicle["thrusters"], vehicle["rigid_body"]
    data: dict[str, Any] = {}
    for group in ("added_mass", "linear_damping", "quadratic_damping"):
        data[f"hydrodynamics.{group}_diagonal"] = [
            values.get(f"{group}.{axis}", float(before)) for axis, before in zip(AXES, hydro[group + "_diagonal"])]
    coupled = [{"row": AXES[row], "column": AXES[column], "value": values[f"added_mass.{AXES[i]}_{AXES[j]}"]}
               for i, j in COUPLINGS if f"added_mass.{AXES[i]}_{AXES[j]}" in values for row, column in ((i, j), (j, i))]
    if coupled:
        data["hydrodynamics.added_mass_coupling"] = coupled
    more = values.get("trim.buoyancy", before := buoyancy_newton(vehicle)) - before
    data["hydrodynamics.displaced_volume_m3"] = hydro["displaced_volume_m3"] + more / GRAVITY_MPS2 / hydro["water_density_kg_m3"]
    centre = np.array(body["p_BBcm_m"], float)
    data["hydrodynamics.p_BBcb_m"] = [
        at + values.get("trim.centre_" + name, before - at) for at, before, name in zip(centre.tolist(), hydro["p_BBcb_m"], ("ahead", "left", "above"))]
    scale, reverse = values.get("thrust.scale", 1.0), values.get("thrust.reverse", 1.0)
    if len(thrusters["table_volts"]):
        data["thrusters.table_thrust_newton"] = [
            float(scale * newton * (reverse if newton < 0 else 1)) for newton in thrusters["table_thrust_newton"]]
    else:
        data["thrusters.max_thrust_newton"] = float(scale * thrusters["max_thrust_newton"])
        data["thrusters.reverse_ratio"] = float(min(reverse * thrusters["reverse_ratio"], 1))
        for name, key in (("dead_band", "dead_band_volts"), ("exponent", "curve_exponent")):
            data["thrusters." + key] = values.get("thrust." + name, float(thrusters[key]))
    for name, key in (("lag", "lag_s"), ("lag_power", "lag_power"), ("inflow_loss", "inflow_loss_s_per_m")):
        data["thrusters." + key] = values.get("thrust." + name, float(thrusters[key]))
    return data


def scenario_with(scenario: Scenario, values: Mapping[str, float], vehicle: Mapping[str, Any] | None = None) -> Scenario:
    """The scenario with a vehicle of these values, in open water that is still but for the current. `vehicle`: its own, plain."""
    made = scenario.copy()
    settings = {f"vehicle.{key}": value for key, value in data_of(vehicle or plain_vehicle(scenario), values).items()}
    if "water.x" in values and not scenario["sea.current.file"]:  # which the log measured
        settings["sea.current.surface_velocity_mps"] = [values["water.x"], values["water.y"], 0.0]
    if "tether.drag" in values:  # up to a float that carries it, so far off that its pull stays
        pull, far_m = np.array([values["tether.pull_x"], values["tether.pull_y"], UP_NEWTON]), 1e5
        tether = {"enabled": True, "p_WAnchor_m": (far_m / UP_NEWTON * pull).tolist(), "length_m": 20, "diameter_m": 0.008,
                  "water_density_kg_m3": 1000, "drag_coefficient": values["tether.drag"] / 10, "net_weight_newton_per_m": UP_NEWTON / 10,
                  "stiffness_newton_per_m": UP_NEWTON / far_m, "stretch_damping_newton_s_per_m": 0}
        settings |= {f"sea.tether.{key}": value for key, value in tether.items()}
    made._cpp.set(assignments_of(settings))
    return made


def still(scenario: Scenario, series: str = "") -> Scenario:
    """The scenario's vehicle in water that stands, or flows as a file has it."""
    made = scenario.copy()
    made._cpp.set(assignments_of({"sea.state": "custom", "sea.waves": [], "sea.jonswap.significant_height_m": 0, "sea.tether.enabled":
                                  False, "sea.current.surface_velocity_mps": [0, 0, 0], "sea.current.gust_std_mps": 0,
                                  "sea.current.file": series, "control.use": "pid", "station.mooring.swing_x_m": 0, "station.mooring.swing_y_m": 0}))
    return made


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
