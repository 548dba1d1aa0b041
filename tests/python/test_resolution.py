"""Every key of a scenario, set in every way in which Python can, makes the scenario that `settings` make by a
scenario's name. How plans, gates and studies set them: tests/settings."""

import copy
import functools
import pathlib
import pickle
import re
import tempfile

import numpy as np
import pytest

import turbidock
from turbidock.docking_env import DockingEnv
from turbidock.scenario import as_yaml, scenario_of

MODELS = next(pathlib.Path(turbidock.__file__).parent.rglob("models/vehicle.xml")).parent
BASES = ("pool_active", "approach_5m")

# Elements of lists of groups, where two of defaults are not allowed.
ELEMENTS = {
    "lights.marker.balls": [{"name": "red"}, {"name": "green"}],  # before those of `marker`
    "marker.balls": [{"name": "one", "hue_rad": 0}, {"name": "other", "hue_rad": 3}],
    "_coupling": [{"row": "surge", "column": "sway"}, {"row": "sway", "column": "surge"}],
    "estimator.fiducial.tags": [{"id": 0}, {"id": 1}],
}
# Values that the types and ranges do not say, by the end of the key.
VALUES = {
    "start.position_m": [-1, 0, -0.5], "start.quaternion_wxyz": [0, 0, 0, 1],
    "start.velocity_mps": [0.1, 0, 0], "start.turn_rate_rad_s": [0.1, 0, 0],
    "station.mooring.natural_period_s": 5, "thrusters.effectiveness": [0.6, 1, 1, 1],
    "table_volts": [0, 2.5, 4.9], "table_thrust_newton": [-4, 0, 6],
    "lights[].light": "red", "fish[].shines_as": "red", "tags[].q_MT_wxyz": [0, 1, 0, 0],
    "schema_version": 1, "added_mass_coupling[].value": 0.1,
}
# What has to be given before, "@" for the group that the key is in.
BEFORE = {
    "start.quaternion_wxyz": {"start.position_m": [-1, 0, -0.5]},
    "sea.current.file": {"sea.current.surface_velocity_mps": [0, 0, 0]},
    "table_volts": {"@": {"table_volts": [0, 2.5, 5], "table_thrust_newton": [-4, 0, 5]}},
    "table_thrust_newton": {"@": {"table_volts": [0, 2.5, 5], "table_thrust_newton": [-4, 0, 5]}},
    "added_mass_coupling[].value": {"@": [{"row": "surge", "column": "sway", "value": 0.1},
                                          {"row": "sway", "column": "surge", "value": 0.1}]},
}
FILES = {
    "trial.scene": ("own.xml", "pool_active.xml"), "station.model": ("own_station.xml", "station.xml"),
    "vehicle.model": ("bluerov2_heavy.xml", None),
    "sea.current.file": ("current.csv", "time_s,water_x_mps,water_y_mps\n0,0,0\n100,0,0.1\n"),
    "control.playback.file": ("commands.csv", "time_s,surge_newton,sway_newton,heave_newton,yaw_newton_m\n0,0,0,0,0\n9,1,0,0,0\n"),
}


def of_end(table, key, otherwise=None):
    """What a table has for a key, or for keys that end so."""
    return next((value for end, value in table.items() if key == end or key.endswith(
        end if end[0] == "_" else "." + end)), otherwise)


def moved(value, low, high, sign):
    """Another number, near this one and in the range; of lists each."""
    if isinstance(value, (list, tuple)):
        return [moved(each, low, high, sign) for each in value]
    step = 1 if isinstance(value, int) else 0.1 * abs(value) or 0.05 * min(1.0, high - low)
    return value + sign * step if low <= value + sign * step <= high else value - sign * step


def others(doc, now, folder):
    """Values of the key other than this one."""
    if doc.type == "true or false":
        return [not now]
    if doc.type.startswith("one of "):
        return [name for name in doc.type[7:].split(", ") if name != now]
    if doc.type == "text":
        return ["some words"]
    if doc.type == "file":
        name, text = FILES[doc.key]
        if text is None:
            return [name]
        if text.endswith(".xml"):
            text = (MODELS / text).read_text()
        (folder / name).write_text(text)
        return [str(folder / name)]
    bounds = [float(end) for end in re.findall(r"-?[\d.]+(?:e[+-]?\d+)?", doc.range)]
    low, high = bounds if len(bounds) == 2 else (bounds[0] if bounds else -1e9, 1e9)
    return [moved(now, low, high, 1), moved(now, low, high, -1)]


def of_group(group, docs, scenario):
    """The first key of a group that can be moved, as the group's value; no seed, which a plan does not take."""
    for doc in docs:
        inner = doc.key.removeprefix(group + ".")
        if inner == doc.key or "." in inner or doc.key == "trial.seed":
            continue
        if doc.type == "group of keys" and (value := of_group(doc.key, docs, scenario)):
            return {inner: value}
        if doc.type in ("number", "whole number", "true or false") and of_end(VALUES, doc.key) is None:
            return {inner: others(doc, scenario[doc.key], None)[0]}
        if doc.type == "list of groups":
            return {inner: of_end(ELEMENTS, doc.key, [{}])}
    return None


class Case:
    """A key, what has to be given before it, a value, and the scenario that they make by its name."""

    def __init__(self, base, doc, docs, folder):
        self.base, self.listed, self.key, self.before = base, doc.key, doc.key, {}
        scenario = loaded(base)
        while "[]" in self.key:
            group, _, rest = self.key.partition("[]")
            if not len(scenario[group]):
                self.before[group] = of_end(ELEMENTS, group, [{}, {}])
            self.key = f"{group}[1]{rest}"
        inside = re.sub(r"(\[1\])?\.\w+$", "", self.key) if "[1].value" in self.key else self.key.rpartition(".")[0]
        for key, value in of_end(BEFORE, doc.key, {}).items():
            self.before[key.replace("@", inside)] = value
        value = of_end(VALUES, doc.key)
        if value is None and doc.type == "group of keys":
            value = of_group(doc.key, docs, scenario)
        elif value is None and doc.type == "list of groups":
            value = of_end(ELEMENTS, doc.key, [{}, {}])
        self.take([value] if value is not None else others(doc, self.begun()[self.key], folder))

    def take(self, values):
        """The first of the values that is allowed."""
        for self.value in values:
            try:
                self.expected = turbidock.Scenario(self.base, settings=self.settings).to_yaml()
                return
            except turbidock.ConfigError:
                if self.value == values[-1]:
                    raise

    @property
    def settings(self):
        return {**self.before, self.key: self.value}

    def begun(self):
        """A scenario in which the key can be set."""
        return scenario_of(loaded(self.base), settings=self.before)


@functools.cache
def loaded(base):
    return turbidock.Scenario(base)


@functools.cache
def cases(base):
    """Those of every other key, of the other base those of the others."""
    docs, folder = list(turbidock.keys().itertuples()), pathlib.Path(tempfile.mkdtemp())
    return [Case(base, doc, docs, folder) for doc in docs[BASES.index(base)::len(BASES)]]


@pytest.mark.parametrize("base", BASES)
class TestEveryKey:
    def test_is_tried(self, base):
        of = cases(base)
        assert {case.listed for case in of} == set(turbidock.keys()["key"][BASES.index(base)::len(BASES)])
        # added mass is symmetric: of two elements alone none can change
        same = {case.listed for case in of if case.expected == case.begun().to_yaml()}
        assert same <= {"schema_version", "vehicle.hydrodynamics.added_mass_coupling[].value",
                        "control.known_vehicle.hydrodynamics.added_mass_coupling[].value"}, same

    def test_as_an_item(self, base):
        for case in cases(base):
            scenario = case.begun()
            scenario[case.key] = case.value
            assert scenario.to_yaml() == case.expected, case.key

    def test_as_an_attribute(self, base):
        for case in cases(base):
            scenario = group = case.begun()
            *path, last = [word for word in re.split(r"[.\[\]]+", case.key) if word]
            for word in path:
                group = group[int(word)] if word.isdigit() else getattr(group, word)
            numbers = isinstance(case.value, list) and not isinstance(case.value[0], dict)
            setattr(group, last, np.array(case.value) if numbers else case.value)
            assert scenario.to_yaml() == case.expected, case.key

    def test_of_a_scenario_object(self, base):
        before = loaded(base).to_yaml()
        for case in cases(base):
            made = scenario_of(loaded(base), settings=case.settings)
            assert made.to_yaml() == case.expected, case.key
        assert loaded(base).to_yaml() == before

    def test_as_the_command_line_has_it(self, base):
        for case in cases(base)[::5]:
            texts = [f"{key}={as_yaml(value)}" for key, value in case.settings.items()]
            assert turbidock.Scenario(base, settings=texts).to_yaml() == case.expected, case.key

    def test_of_a_copy(self, base):
        for case in cases(base)[::3]:
            begun = case.begun()
            before, made = begun.to_yaml(), copy.copy(begun)
            made[case.key] = case.value
            assert made.to_yaml() == case.expected, case.key
            assert begun.to_yaml() == before, case.key

    def test_of_a_pickle(self, base):
        kept = pickle.dumps(loaded(base))
        for case in cases(base)[::3]:
            made = scenario_of(pickle.loads(kept), settings=case.settings)
            assert made.to_yaml() == case.expected, case.key

    def test_of_an_environment(self, base):
        def with_seed(case):
            return re.sub(r"^  seed: \d+", "  seed: 5", case.expected, flags=re.M)

        env = DockingEnv(base)
        for case in cases(base):
            if case.key != "trial.seed":  # which an environment gives each trial
                assert env._draw(5, case.settings)[0].to_yaml() == with_seed(case), case.key
        for case in cases(base)[::5]:
            made = DockingEnv(base, settings=case.settings)
            assert made._draw(5, {})[0].to_yaml() == with_seed(case), case.key
