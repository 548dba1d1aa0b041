"""Whole trials, batches of them, gates; and what came out."""

from __future__ import annotations

import io
import json
import os
import sys
from typing import TYPE_CHECKING, Any, Callable, Iterable, Mapping, Union

from . import _core
from .plug_in import chosen, plugins_of
from .scenario import Path, Scenario, Settings, assignments_of, scenario_of

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas

    from ._keys import ResultKeys
else:
    ResultKeys = object

# Called with the share that is done and a few words; True: a line on stderr.
Progress = Union[Callable[[float, str], Any], bool, None]


def _line(share: float, words: str) -> None:
    """A line on stderr, written over the one before."""
    text = f"{100 * share:3.0f} %  {words}"
    print(f"\r{text:<78}", end="", file=sys.stderr, flush=True)


def _reporter(progress: Progress) -> Callable[[float, str], Any] | None:
    return _line if progress is True else progress or None


class Result(ResultKeys):
    """What came of a trial: `result.outcome`, `result.time_s`, every key of result.json."""

    def __init__(self, record: str, series: _core.Series, scenario: str,
                 motion: Mapping[str, Any] | None = None) -> None:
        self.record: dict[str, Any] = json.loads(record)
        self.scenario_yaml = scenario
        self._series = series
        self._motion = motion

    @property
    def success(self) -> bool:
        """The criterion was met and the pole is in the hole."""
        return self.outcome == "success"

    @property
    def trajectory(self) -> pandas.DataFrame:
        """A frame with a row a camera frame; columns name their units."""
        import pandas

        return pandas.DataFrame(self._series.columns())

    @property
    def motion(self) -> pandas.DataFrame:
        """A frame with a row a step of the physics (the table of motion), of a trial that was run with `motion=True`."""
        import pandas

        if self._motion is None:
            raise ValueError("of a trial with motion=True only")
        return pandas.DataFrame(self._motion)

    def save(self, folder: Path) -> None:
        """Writes result.json, resolved.yaml and trajectory.csv, as `turbidock run --out` does."""
        os.makedirs(folder, exist_ok=True)
        for name, text in (("result.json", json.dumps(self.record, indent=2) + "\n"),
                           ("resolved.yaml", self.scenario_yaml),
                           ("trajectory.csv", self._series.csv())):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)

    def plot(self) -> matplotlib.figure.Figure:
        """A matplotlib figure of how it went: F, x, y, z over time, desired, true and estimated, each at its own time. A
        notebook shows it once, as the cell's value."""
        import matplotlib.pyplot as plt

        rows = self.trajectory
        figure, axes = plt.subplots(4, 1, sharex=True, figsize=(8, 8))
        axes[0].plot(rows["time_s"], rows["fitness"])
        axes[0].set_ylabel("F")
        for axis, name in zip(axes[1:], "xyz"):
            axis.plot(rows["time_s"], 1000 * rows[f"true_{name}_m"], "0.6", label="true")
            axis.plot(rows["image_time_s"], 1000 * rows[f"est_{name}_m"], label="estimated")
            axis.plot(rows["time_s"], 1000 * rows[f"desired_{name}_m"], "--", label="desired")
            axis.set_ylabel(f"{name} / mm")
        axes[1].legend()
        axes[3].set_xlabel("time / s")
        figure.suptitle(f"{self.outcome}: {self.reason}", fontsize="medium", wrap=True)
        if "inline" in plt.get_backend():  # a notebook's, which would show it a second time at the cell's end
            plt.close(figure)
        return figure

    def __repr__(self) -> str:
        return f"<Result {self.outcome} after {self.time_s:.1f} s: {self.reason}>"


for _key, _, _doc in _core.result_keys():
    if not TYPE_CHECKING:
        setattr(Result, _key, property(lambda self, key=_key: self.record[key], doc=_doc))


def run(scenario: Scenario | Path = "sea_night_active", *, seed: int | None = None,
        settings: Settings = None, gains: Path = "", controller: type | str | None = None,
        estimator: type | str | None = None, plugins: Iterable[type] = (), motion: bool = False,
        progress: Progress = None) -> Result:
    """Runs one trial. With `motion` it keeps every step of the physics. With a Scenario object, `seed` and `settings` change a copy of it; controllers and
    estimators are then those that it was made with."""
    made = scenario_of(scenario, seed=seed, settings=settings, gains=gains, controller=controller,
                       estimator=estimator, plugins=plugins)
    return Result(*_core.run(made._cpp, _reporter(progress), motion))


def batch(plan: Path | Mapping[str, Any], out: Path, *, workers: int | None = None,
          seed: int | None = None, seeds: int | None = None, settings: Settings = None,
          controller: type | str | None = None, estimator: type | str | None = None,
          plugins: Iterable[type] = (), anew: bool = False, progress: Progress = None) -> pandas.DataFrame:
    """Runs the trials of a plan (a bundled one, a YAML file or a dict of the same keys) in worker
    processes into the file `out`; what is in there already is not run again. A ConfigError names what
    changed since: a file, a key, the code of a controller; with `anew` such trials run anew. Returns
    all its trials as a pandas frame, a row a trial. A controller or an estimator that raises is an
    outcome `crashed`, one that raises NoAnswer `no_answer`, one that never returns `hung`: the others go on."""
    return _frame(_core.batch(_plan(plan, seed, seeds, settings, controller, estimator, plugins), os.fspath(out),
                              _count(workers), anew, _reporter(progress)))


def dataset(plan: Path | Mapping[str, Any], out: Path, *, pairs_per_shard: int = 250, depth: bool = False,
            workers: int | None = None, seed: int | None = None, seeds: int | None = None,
            settings: Settings = None, progress: Progress = None) -> int:
    """Makes images with poses, masks, keypoints and, with `depth`, depth images into a folder: a pair for each trial of a
    plan, from where it begins. In BOP's layout, with COCO's annotations beside it. What is in there already is kept; returns
    how many images there are."""
    return _core.dataset(_plan(plan, seed, seeds, settings), os.fspath(out), pairs_per_shard, depth, _count(workers),
                         _reporter(progress))


def _plan(plan: Path | Mapping[str, Any], seed: int | None, seeds: int | None, settings: Settings,
          controller: type | str | None = None, estimator: type | str | None = None,
          plugins: Iterable[type] = ()) -> _core.Plan:
    classes, choices = chosen(controller, estimator, plugins)
    # A dict is of this version, unless it says otherwise.
    text, name = (json.dumps({"schema_version": 1} | dict(plan)), "plan") if isinstance(plan, Mapping) else (
        "", os.fspath(plan))
    return _core.Plan(text, name, plugins_of(classes, kept=True), choices + assignments_of(settings), seed, seeds)


def read_results(file: Path, *, timing: bool = False) -> pandas.DataFrame:
    """The trials in a batch's file; with `timing` also what differs from run to run."""
    return _frame(_core.read_results(os.fspath(file), timing))


def read_series(file: Path, trial: int) -> pandas.DataFrame:
    """A trial's stored rows; none where its plan stored none."""
    import pandas

    return pandas.DataFrame(_core.read_series(os.fspath(file), trial).columns())


def gate(file: Path, *, workers: int | None = None, settings: Settings = None,
         controller: type | str | None = None, estimator: type | str | None = None,
         plugins: Iterable[type] = (), update: bool = False, time_limit_s: float = 3600,
         progress: Progress = None) -> dict[str, Any]:
    """Judges docking against the gate's committed baseline: summary.json as a dict, whose
    `verdict` is pass, fail or inconclusive. `controller` and `estimator` are judged in place of the
    scenarios' own. With `update` it measures the baseline anew instead. A trial that crashes or
    hangs is no verdict but a SimulatorFault."""
    classes, choices = chosen(controller, estimator, plugins)
    text = _core.gate(os.fspath(file), plugins_of(classes), choices + assignments_of(settings),
                      _count(workers), update, time_limit_s, _reporter(progress))
    return {"baseline": text} if update else json.loads(text)


def _count(workers: int | None) -> int:
    return len(os.sched_getaffinity(0)) if workers is None else workers


def _frame(csv: str) -> pandas.DataFrame:
    """Labels and words stay as they are (a case may be called None, or 01); only what is empty is missing."""
    import pandas

    if not csv.strip():
        return pandas.DataFrame()
    words = {"scenario", "case", "stratum", "outcome", "failure", "reason", "renderer", "digest", "log"} | {
        key for key, kind, *_ in _core.keys(_core.Plugins()) if kind.split()[0] in ("text", "one", "list")}
    kinds: dict[str, type] = dict.fromkeys(words, str) | dict.fromkeys(_core.real_columns(), float)
    header = pandas.read_csv(io.StringIO(csv), nrows=0).columns
    frame = pandas.read_csv(io.StringIO(csv), dtype={name: kinds[name] for name in header if name in kinds}, keep_default_na=False,
                            na_values=[""])
    return frame.astype({"docked": bool, "inserted": bool})
