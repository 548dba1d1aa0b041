"""Whether two controllers or estimators run the same code, also in different processes: a digest of all that they name.

Functions, classes and values of the user's own count by what they are: bytecode, defaults, what closures hold,
attributes, and the globals that the code names. Installed packages and Python's library count by name and version,
modules of the user's own by their files. Comments, docstrings, annotations, lines and paths do not count, nor the order
of a dict or a set."""

from __future__ import annotations

import copyreg
import dis
import functools
import hashlib
import importlib
import importlib.metadata
import importlib.util
import operator
import os
import sys
import types
import warnings
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any, Iterable, Mapping

import numpy as np

_PLAIN = (type(None), bool, int, float, complex, str, bytes, type(...))
# Names that Python gives to classes and modules: where they are, or made of the rest.
_ASIDE = frozenset("""__module__ __qualname__ __doc__ __dict__ __weakref__ __firstlineno__ __static_attributes__
    __annotations__ __annotate__ __annotate_func__ __annotations_cache__ __orig_bases__ __parameters__ __type_params__
    __name__ __file__ __spec__ __package__ __loader__ __path__ __cached__ __builtins__ _abc_impl""".split())
_FLAGS = 0x3AC  # of code: *args, **kwargs, generators, coroutines; not docstrings, nesting, __future__
_GLOBAL = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS")  # instructions
_NAMING = (*_GLOBAL, "LOAD_ATTR", "LOAD_METHOD")
_HEAP_TYPE = 1 << 9  # of a class that is not static in C
_WRAPPERS = (property, staticmethod, classmethod, functools.cached_property, functools._lru_cache_wrapper)
# In PyTorch's modules: what training or the last use left.
_UNLEARNT = ("training", "optimizer", "action_dist")
_WRAPPED = ("fget", "fset", "fdel", "__func__", "func", "__wrapped__", "py_func")


def digest_of(cls: type) -> str | None:
    """A digest of the code that a controller or estimator class runs, or None where it cannot be had: it holds an open
    file, a lock, a method in C or the like."""
    try:
        return _Digest({}).of(cls)
    except Exception:  # an object of the user's may raise anything when it is asked for its state
        return None


def _spec(module: str) -> ModuleSpec | None:
    try:
        return importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None


@functools.lru_cache(maxsize=None)
def _version(module: str) -> str | None:
    """Of the installed package that a module is of, or of Python; None for the user's own."""
    root = module.partition(".")[0]
    spec = None if root == "__main__" else _spec(root)
    place = Path(spec.origin or next(iter(spec.submodule_search_locations or ()), "") if spec else "")
    if root == __name__.partition(".")[0] or {"site-packages", "dist-packages"} & set(place.parts):
        try:
            return importlib.metadata.version(root)
        except importlib.metadata.PackageNotFoundError:  # a package of another name
            return str(getattr(importlib.import_module(root), "__version__", ""))
    python = str(place) in ("built-in", "frozen") or Path(os.__file__).parent in place.parents
    return sys.version.split()[0] if python else None


def _installed(value: Any) -> str | None:
    """Where an installed package or Python has a function or a class, with its version; None for others."""
    module, name = getattr(value, "__module__", None), getattr(value, "__qualname__", None)
    version = _version(module) if isinstance(module, str) and isinstance(name, str) else None
    try:
        found = version is not None and operator.attrgetter(str(name))(sys.modules[str(module)]) is value
    except (KeyError, AttributeError):
        found = isinstance(value, type) and not value.__flags__ & _HEAP_TYPE
    return f"{module}.{name} {version}" if found else None


class _Digest:
    """Of values that are added one by one. An object gets a number where it is met and is added later: cycles end."""

    def __init__(self, numbers: dict[int | str, int]) -> None:
        self.hash = hashlib.sha256()
        self.numbers = numbers  # by id, or by a module's name
        self.met: list[Any] = []  # kept, so that no id is used twice

    def of(self, value: Any) -> str:
        self.add(value)
        for each in self.met:  # which grows meanwhile
            self.add_object(each)
        return self.hash.hexdigest()[:16]

    def alone(self, value: Any) -> str:
        return _Digest(dict(self.numbers)).of(value)

    def add(self, value: Any) -> None:
        kind = type(value)
        if kind in _PLAIN:
            text = f"{value:x}" if kind is int else repr(value)
            self.hash.update(f"{kind.__name__} {len(text)} {text}".encode())
        elif kind is tuple:
            self.add_all("tuple", *value)
        elif kind in (set, frozenset):
            self.add_all(kind.__name__, *sorted(map(self.alone, value)))
        else:
            self.add_number(id(value), value)

    def add_all(self, what: str, *values: Any) -> None:
        self.hash.update(f"{what} {len(values)} ".encode())
        for value in values:
            self.add(value)

    def add_number(self, key: int | str, value: Any) -> None:
        if key not in self.numbers:
            self.numbers[key] = len(self.numbers)
            self.met.append(value)
        self.hash.update(f"object {self.numbers[key]} ".encode())

    def add_object(self, value: Any) -> None:
        kind, installed = type(value), _installed(value)
        if installed is not None:
            self.add_all("installed", installed)
        elif kind is types.FunctionType:
            self.add_function(value)
        elif isinstance(value, type):
            if not value.__flags__ & _HEAP_TYPE:
                raise TypeError(f"{value} is in C")
            self.add_all("class", value.__name__, kind, value.__bases__)
            self.add_mapping({key: each for key, each in vars(value).items() if key not in _ASIDE})
        elif kind in (dict, types.MappingProxyType):
            self.add_mapping(value)
        elif kind is list:
            self.add_all("list", *value)
        elif kind is np.ndarray and not value.dtype.hasobject:
            self.add_all("array", str(value.dtype), value.shape, value.tobytes())
        elif isinstance(value, types.ModuleType):
            self.add_import(value.__name__, ())
        elif kind is ModuleSpec:
            self.add_file(value)
        elif kind is types.CodeType:
            self.add_code(value, {}, "")
        elif isinstance(value, _WRAPPERS) or hasattr(value, "py_func"):  # which Numba's functions have
            self.add_all("wrapper", kind, *(getattr(value, name, None) for name in _WRAPPED))
        elif hasattr(kind, "detach") and hasattr(kind, "numpy"):  # a tensor of PyTorch's
            self.add_all("tensor", value.detach().cpu().numpy())
        elif hasattr(kind, "get_parameters") and hasattr(value, "policy"):  # a model of stable-baselines3
            self.add_all("model", kind, value.policy)
        else:
            self.add_instance(value)

    def add_mapping(self, values: Mapping[Any, Any]) -> None:
        keys = sorted(values, key=None if all(type(key) is str for key in values) else self.alone)
        self.add_all("mapping", *((key, values[key]) for key in keys))

    def add_instance(self, value: Any) -> None:
        """By what pickle asks it for; pickle's own text would depend on which equal values are one."""
        reduce = copyreg.dispatch_table.get(type(value))
        stored: Any = reduce(value) if reduce else value.__reduce_ex__(4)
        if isinstance(stored, str):  # the name of a global
            module = getattr(value, "__module__", None) or type(value).__module__
            if _version(module) is None:
                raise TypeError(f"{value!r} has only a name")
            return self.add_all("global", type(value), module, stored, _version(module))
        maker, arguments, state, items, pairs = (*stored, None, None, None)[:5]
        if isinstance(state, dict) and hasattr(type(value), "state_dict"):
            state = {key: each for key, each in state.items() if key not in _UNLEARNT}
        self.add_all("instance", maker, arguments, state, list(items or ()), dict(pairs or ()))

    def add_function(self, function: types.FunctionType) -> None:
        names = function.__globals__
        module = str(names.get("__name__", ""))
        version = _version(module)  # one that an installed package made may still hold the user's
        self.add_all("function", version, function.__defaults__, function.__kwdefaults__, vars(function))
        for cell in function.__closure__ or ():
            try:
                self.add_all("holds", cell.cell_contents)
            except ValueError:
                self.add_all("holds nothing yet")
        self.add_code(function.__code__, names if version is None else {}, str(names.get("__package__") or module))

    def add_code(self, code: types.CodeType, names: Mapping[str, Any], package: str) -> None:
        """Its instructions, with their constants and names, and the globals and modules of these names."""
        self.add_all("code", code.co_name, code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount,
                     code.co_flags & _FLAGS, code.co_varnames, getattr(code, "co_exceptiontable", b""))
        steps: list[tuple[str, Any]] = []
        for step in dis.get_instructions(code):
            if step.opname == "STORE_NAME" and step.argval in _ASIDE:  # and what is stored
                steps.pop()
            elif step.opname != "EXTENDED_ARG":
                steps.append((step.opname, step.argval))
        for at, (action, argument) in enumerate(steps):
            if isinstance(argument, types.CodeType):
                self.add_code(argument, names, package)
            else:
                self.add_all(action, argument)
            if action in _GLOBAL:
                self.add_named(names, steps[at:at + 9])
            elif action == "IMPORT_NAME":
                level, parts = steps[at - 2][1], steps[at - 1][1] or ()
                self.add_import(importlib.util.resolve_name("." * level + argument, package), parts)

    def add_named(self, names: Mapping[str, Any], steps: Iterable[tuple[str, Any]]) -> None:
        """A global. Of a module of the user's also what the next steps take from it, which may differ from its file."""
        for action, name in steps:
            if action not in _NAMING or name not in names or name in _ASIDE:
                return
            if not isinstance(names[name], types.ModuleType):
                return self.add_all("named", names[name])
            self.add_import(names[name].__name__, ())
            if _version(names[name].__name__) is not None:
                return
            names = vars(names[name])

    def add_import(self, module: str, parts: Iterable[str]) -> None:
        """A module by its name, with its packages and those of its `parts` that are modules."""
        version = _version(module)
        self.add_all("module", module, version)
        if version is None:
            names = module.split(".")
            packages = [".".join(names[:end + 1]) for end in range(len(names))]
            for name in packages + [f"{module}.{part}" for part in parts]:
                spec = _spec(name)
                if spec and spec.origin:
                    self.add_number(name, spec)

    def add_file(self, spec: ModuleSpec) -> None:
        data = Path(str(spec.origin)).read_bytes()
        if not str(spec.origin).endswith(".py"):
            return self.add(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self.add_code(compile(data, "", "exec", dont_inherit=True), {}, spec.parent or "")
