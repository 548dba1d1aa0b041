"""Scenarios as objects, with the keys, ranges and errors that YAML has."""

from __future__ import annotations

import json
import os
import re
import sys
import warnings
from types import FrameType
from typing import TYPE_CHECKING, Any, Iterable, Iterator, Mapping, Union

from . import _core
from .plug_in import chosen, plugins_of

if TYPE_CHECKING:
    import pandas

    from ._keys import ScenarioKeys
else:
    ScenarioKeys = object

Path = Union[str, "os.PathLike[str]"]
# {"water.milk_ml_m3": 20}, or ["water.milk_ml_m3=20"] as the command line's --set has them
Settings = Union[Mapping[str, Any], Iterable[str], None]


def as_yaml(value: Any) -> str:
    """A Python value as YAML in one line. A text is itself, but one that begins as a list or a group is read as YAML."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    is_plain = isinstance(value, str) and re.fullmatch(r"[\[{].*|[-+.\w]*", value, re.DOTALL)
    return value if is_plain else json.dumps(value, ensure_ascii=False)


def assignments_of(settings: Settings) -> list[str]:
    """Settings as the command line's --set has them."""
    if settings is None:
        return []
    if isinstance(settings, Mapping):
        return [f"{key}={as_yaml(value)}" for key, value in settings.items()]
    return list(settings)


class Group:
    """A group of a scenario's keys: scenario.water.milk_ml_m3. dir() lists them, dict() has the values."""

    _cpp: _core.Scenario
    _path: str

    def __init__(self, core: _core.Scenario, path: str) -> None:
        object.__setattr__(self, "_cpp", core)
        object.__setattr__(self, "_path", path)

    def _found(self, key: str = "") -> Any:
        return self._cpp.get([word for word in re.split(r"[.\[\]]+", self._path + key) if word])

    def __getitem__(self, key: str) -> Any:
        found, path = self._found(key), self._path + key
        if isinstance(found, list):
            return tuple(Group(self._cpp, f"{path}.{i}.") for i in range(len(found)))
        return Group(self._cpp, path + ".") if isinstance(found, dict) else found

    def __setitem__(self, key: str, value: Any) -> None:
        self._cpp.set([f"{self._path}{key}={as_yaml(value)}"])
        self._warn()

    def _warn(self) -> None:
        # At the line outside this package that set it.
        frame: FrameType | None = sys._getframe()
        level = 1
        while frame and (frame.f_globals.get("__package__") or "").partition(".")[0] == __package__:
            frame, level = frame.f_back, level + 1
        for remark in self._cpp.remarks():
            warnings.warn(remark, stacklevel=level)

    if not TYPE_CHECKING:  # which knows the keys, by _keys.pyi

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_"):
                raise AttributeError(name)
            try:
                return self[name]
            except _core.ConfigError as error:
                raise AttributeError(str(error)) from None

        def __setattr__(self, name: str, value: Any) -> None:
            self[name] = value

    def keys(self) -> list[str]:
        """Names of the keys in this group."""
        return list(self._found())

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, key: str) -> bool:
        return key in self.keys()

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.keys()]

    def __repr__(self) -> str:
        return f"<{self._path.rstrip('.')}: {', '.join(f'{key}={self[key]!r}' for key in self.keys())}>"


class Scenario(Group, ScenarioKeys):
    """Everything that decides a trial.

        s = turbidock.Scenario("sea_night_active", seed=77, settings={"water.milk_ml_m3": 20})
        s.water.milk_ml_m3 = 25      # or s["water.milk_ml_m3"] = 25

    `name`: a bundled scenario or a YAML file. Whatever is wrong is a ConfigError (a ValueError)
    that names the key. Scenarios can be copied and pickled, with their plug-ins.
    """

    _classes: list[type]

    def __init__(self, name: Path = "sea_night_active", *, seed: int | None = None,
                 settings: Settings = None, gains: Path = "", controller: type | str | None = None,
                 estimator: type | str | None = None, plugins: Iterable[type] = ()) -> None:
        classes, choices = chosen(controller, estimator, plugins)
        assignments = choices + _with_seed(seed, settings)
        self._take(_core.Scenario(os.fspath(name), assignments, os.fspath(gains),
                                  plugins_of(classes)), classes)
        self._warn()

    def _take(self, core: _core.Scenario, classes: list[type]) -> None:
        super().__init__(core, "")
        object.__setattr__(self, "_classes", classes)

    @staticmethod
    def parse(text: str, name: str = "text", plugins: Iterable[type] = ()) -> Scenario:
        """A resolved scenario, as `to_yaml` gives it."""
        made, classes = Scenario.__new__(Scenario), list(plugins)
        made._take(_core.Scenario.parse(text, name, plugins_of(classes)), classes)
        return made

    def copy(self) -> Scenario:
        """Another one with the same values."""
        made = Scenario.__new__(Scenario)
        made._take(self._cpp.copy(), self._classes)
        return made

    def __copy__(self) -> Scenario:
        return self.copy()

    def __deepcopy__(self, memo: Any) -> Scenario:
        return self.copy()

    def __reduce__(self) -> tuple[Any, ...]:
        return Scenario.parse, (self.to_yaml(), "pickle", self._classes)

    def to_yaml(self) -> str:
        """Every value, with its description as a comment."""
        return self._cpp.yaml()

    def make_controller(self) -> _core.ControllerAlone:
        """Its controller by itself, to steer with elsewhere: observe, demand, given for each frame."""
        return _core.ControllerAlone(self._cpp)

    def __repr__(self) -> str:
        return f"<Scenario {self['description']!r}, seed {self['trial.seed']}>"


def scenario_of(scenario: Scenario | Path, *, seed: int | None = None, settings: Settings = None,
                gains: Path = "", **choices: Any) -> Scenario:
    """A scenario by its name, or a copy of one, with these changes."""
    if not isinstance(scenario, Scenario):
        return Scenario(scenario, seed=seed, settings=settings, gains=gains, **choices)
    if gains or any(choices.values()):
        raise TypeError("give controller, estimator, plugins and gains to the Scenario")
    made = scenario.copy()
    made._cpp.set(_with_seed(seed, settings))
    made._warn()
    return made


def _with_seed(seed: int | None, settings: Settings) -> list[str]:
    assignments = assignments_of(settings)
    if seed is None:
        return assignments
    if any(map(_core.gives_seed, assignments)):
        raise _core.ConfigError("seed: is given by itself and in settings: give one of them")
    return [*assignments, f"trial.seed={seed}"]


def keys(plugins: Iterable[type] = ()) -> pandas.DataFrame:
    """Every key of a scenario: key, type, default, range, doc."""
    import pandas

    return pandas.DataFrame(_core.keys(plugins_of(plugins)),
                            columns=["key", "type", "default", "range", "doc"])


def scenarios() -> list[str]:
    """Names of the bundled scenarios."""
    return _core.names("scenarios")


def plans() -> list[str]:
    """Names of the bundled plans."""
    return _core.names("plans")


def version() -> str:
    """Of turbidock, with its commit."""
    return _core.version()
