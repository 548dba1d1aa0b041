"""Scenarios as objects, with the keys, ranges and errors that YAML has."""

from __future__ import annotations

import json
from typing import Any, Iterable, Mapping

from . import _core
from .plug_in import chosen


def as_yaml(value: Any) -> str:
    """A Python value as YAML in one line."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return value if isinstance(value, str) else json.dumps(value)


def as_python(text: str) -> Any:
    """YAML in one line as a Python value; what is no number, bool or list stays text."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def assignments_of(settings: Mapping[str, Any] | Iterable[str] | None) -> list[str]:
    """{"water.milk_ml_m3": 20} or ["water.milk_ml_m3=20"] as the command line's --set has them."""
    if settings is None:
        return []
    if isinstance(settings, Mapping):
        return [f"{key}={as_yaml(value)}" for key, value in settings.items()]
    return list(settings)


class _Group:
    """A group of keys: scenario.water.milk_ml_m3."""

    def __init__(self, scenario: Scenario, path: str) -> None:
        object.__setattr__(self, "_scenario", scenario)
        object.__setattr__(self, "_path", path)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self._scenario._value(f"{self._path}.{name}")

    def __setattr__(self, name: str, value: Any) -> None:
        self._scenario[f"{self._path}.{name}"] = value

    def __repr__(self) -> str:
        return f"<group {self._path}>"


class Scenario:
    """Everything that decides a trial.

        s = turbidock.Scenario("sea_night_active", seed=77, settings={"water.milk_ml_m3": 20})
        s.water.milk_ml_m3 = 25      # or s["water.milk_ml_m3"] = 25

    `name`: a bundled scenario or a YAML file. Whatever is wrong is a ConfigError (a ValueError)
    that names the key.
    """

    _core: _core.Scenario

    def __init__(self, name: str = "sea_night_active", *, seed: int | None = None,
                 settings: Mapping[str, Any] | Iterable[str] | None = None, gains: str = "",
                 controller: type | str | None = None, estimator: type | str | None = None,
                 plugins: Iterable[type] = ()) -> None:
        registry, choices = chosen(controller, estimator, plugins)
        assignments = choices + assignments_of(settings)
        if seed is not None:
            assignments.append(f"seed={seed}")
        object.__setattr__(self, "_core", _core.Scenario(name, assignments, gains, registry))

    @staticmethod
    def parse(text: str, name: str = "text", plugins: Iterable[type] = ()) -> Scenario:
        """A resolved scenario, as `to_yaml` gives it."""
        made = Scenario.__new__(Scenario)
        registry, _ = chosen(None, None, plugins)
        object.__setattr__(made, "_core", _core.Scenario.parse(text, name, registry))
        return made

    def __getitem__(self, key: str) -> Any:
        return as_python(self._core.get(key))

    def __setitem__(self, key: str, value: Any) -> None:
        self._core.set([f"{key}={as_yaml(value)}"])

    def _value(self, key: str) -> Any:
        try:
            return self[key]
        except _core.ConfigError as error:
            if "is a group" in str(error):
                return _Group(self, key)
            raise AttributeError(str(error)) from None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self._value(name)

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value

    def copy(self) -> Scenario:
        """Another one with the same values."""
        made = Scenario.__new__(Scenario)
        object.__setattr__(made, "_core", self._core.copy())
        return made

    def to_yaml(self) -> str:
        """Every value, with its description as a comment."""
        return self._core.yaml()

    def __repr__(self) -> str:
        return f"<Scenario {self['description']!r}, seed {self['seed']}>"


def scenario_of(scenario: Scenario | str, *, seed: int | None = None, gains: str = "",
                settings: Mapping[str, Any] | Iterable[str] | None = None,
                **choices: Any) -> Scenario:
    """A scenario by its name, or a copy of one, with these changes."""
    if isinstance(scenario, str):
        return Scenario(scenario, seed=seed, settings=settings, gains=gains, **choices)
    if gains or any(choices.values()):
        raise TypeError("give controller, estimator, plugins and gains to the Scenario")
    made = scenario.copy()
    made._core.set(assignments_of(settings) + ([] if seed is None else [f"seed={seed}"]))
    return made


def keys(plugins: Iterable[type] = ()) -> Any:
    """Every key of a scenario as a pandas frame: key, type, default, range, doc."""
    import pandas

    registry, _ = chosen(None, None, plugins)
    return pandas.DataFrame(_core.keys(registry), columns=["key", "type", "default", "range", "doc"])


def scenarios() -> list[str]:
    """Names of the bundled scenarios."""
    return _core.names("scenarios")


def plans() -> list[str]:
    """Names of the bundled plans."""
    return _core.names("plans")


def version() -> str:
    """Of turbidock, with its commit."""
    return _core.version()
