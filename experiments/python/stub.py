"""Writes _keys.pyi, the types of a scenario's keys and of a result: stub.py MODULE FILE."""

import importlib.util
import sys

HEAD = '''"""The keys of scenarios and results; written by stub.py as the package is built."""

from typing import Any, Literal, Sequence

from .scenario import Group
'''
# By how a description of a key's type begins.
TYPES = {"true": "bool", "text": "str", "whole": "int", "number": "float", "list": "Sequence[Any]"}


def type_of(key, words):
    """A Python type of what the table of keys calls "number in m", "3 numbers", "one of a, b"."""
    if words.startswith("one of ") and key not in ("control.use", "estimator.use"):  # or a plug-in
        return f"Literal[{', '.join(repr(word) for word in words[7:].split(', '))}]"
    if words.startswith("one of "):
        return "str"
    return TYPES.get(words.split()[0])


def class_of(key):
    return "_" + "".join(word.capitalize() for word in key.replace("[]", "").replace(".", "_").split("_"))


def main(module, file):
    spec = importlib.util.spec_from_file_location("_core", module)
    core = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(core)
    groups = {"": []}
    for key, words, _, allowed, doc in core.keys(core.Plugins()):
        group, _, name = key.rpartition(".")
        kind = type_of(key, words)
        if words == "list of groups":
            groups[key + "[]"], kind = [], f"tuple[{class_of(key)}, ...]"
        elif words == "group of keys":
            groups[key], kind = [], class_of(key)
        groups[group].append((name, kind, ", ".join(filter(None, (words, allowed, doc)))))
    classes = {("ScenarioKeys" if key == "" else class_of(key) + "(Group)"): fields
               for key, fields in groups.items()}
    classes["ResultKeys"] = core.result_keys()
    with open(file, "w", encoding="utf-8") as out:
        out.write(HEAD)
        for name, fields in classes.items():
            out.write(f"\nclass {name}:\n")
            for key, kind, doc in fields:
                out.write(f"    {key}: {kind}\n    {doc!r}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
