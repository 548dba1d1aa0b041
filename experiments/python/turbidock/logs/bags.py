"""Logs of a vehicle as `estimate` and `identify` take them: `read_bag`, `estimate_bag`, `turbidock-bag`.

Bags of ROS 1 (.bag) and ROS 2 (.mcap, .db3, or the folder with metadata.yaml), and ArduSub's logs (.bin, .tlog), whose topics
are the names of their messages. A YAML file says what is where; all but the topic's name may be left out:

    images: {left: /stereo/left/image_raw, right: /stereo/right/image_raw}     # or CompressedImage, JPEG or PNG
    camera_info: {left: /stereo/left/camera_info, right: /stereo/right/camera_info}
    motion:
      odometry: /odom              # Odometry, PoseStamped, PoseWithCovarianceStamped, TransformStamped
      imu: /imu/data
      depth: {topic: /bar30, field: data, scale: -1}          # a column, positive down
      dvl: /dvl/twist              # TwistStamped, TwistWithCovarianceStamped, Vector3Stamped, any with `velocity`
      commands: {topic: /thrusters, columns: [surge_left_v, surge_right_v, sway_v, heave_v]}
      current: {topic: /adcp, field: [mean.u, mean.v, mean.w], columns: [water_x_mps, water_y_mps, water_z_mps]}
    clock: stamp

and of a dive's .bin:

    motion:
      position: {topic: 'XKF1[0]', field: [PN, PE, PD], columns: [vehicle_x_m, vehicle_y_m, vehicle_z_m], axes: frd}
      attitude: {topic: ATT, field: [Roll, Pitch, Yaw], columns: [roll_rad, pitch_rad, yaw_rad], scale: 0.0174533, axes: frd}
      depth: {topic: CTUN, field: Alt, scale: -1}
      commands: {topic: RCOU, field: [C1, C2, C3], columns: [t1_pwm_us, t2_pwm_us, t3_pwm_us]}

README.md has that of a trial of turbidock's own (`turbidock-mcap --ros2`).

Any message will do, also of a type of one's own: `field` is the way to a number, a list, a vector or a quaternion in it, or a list
of such ways; `columns` are those of `turbidock.logs.motion` that it fills; `scale` multiplies, then `offset` adds: commands of
-1 to 1 are volts with `scale: 2.5, offset: 2.5`. With `axes: frd` (and a world with z down, as ArduSub has them) y and z change
their sign. Where two topics give a column, the first counts. `clock: log` takes the times at which messages were recorded in place
of their headers', which is done in any case where there are none. Where several send under one topic, it is one's own in brackets:
'XKF1[0]', an EKF's lane; '/tf[base_link]', a child frame. `types: {heron_msgs/msg/Thrust: Thrust.msg}` defines what a bag of before
ROS 2 Iron does not.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import sys
from typing import Any, Iterable, Mapping, Optional, Sequence, Union

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from .._core import ConfigError
from .._program import PROGRAM
from ..scenario import Path, Scenario, Settings, assignments_of, scenario_of
from ._images import SIDES, apart_note, pairs_of, rig_text, widen, write_image
from ._log import add_estimates
from ._reading import MAVLINK, Sources, opened, split, whole
from .mcap_out import McapFile
from .motion import (COLUMNS, COMMANDS, DEPTH, EULER, POSITION, QUATERNION, TURN_RATE, VELOCITY, WATER, Motion, check_motion, has,
                     read_motion, without_zeros, write_motion)

# What a name of `motion` stands for: ways to what its messages may hold, and the columns of that.
KNOWN: Mapping[str, Sequence[tuple[Sequence[str], Sequence[str]]]] = {
    "odometry": ((("pose.pose.position", "pose.position", "transform.translation"), POSITION),
                 (("pose.pose.orientation", "pose.orientation", "transform.rotation"), QUATERNION),
                 (("twist.twist.linear",), VELOCITY), (("twist.twist.angular",), TURN_RATE)),
    "imu": ((("orientation",), QUATERNION), (("angular_velocity",), TURN_RATE)), "depth": ((("data", "depth"), DEPTH),),
    "dvl": ((("twist.twist.linear", "twist.linear", "vector", "velocity"), VELOCITY),), "commands": ((("data", "channels"), ()),)}
# Of axes to the right and down.
TURNED = {*POSITION[1:], *QUATERNION[2:], *VELOCITY[1:], *TURN_RATE[1:], *EULER[1:], *WATER[1:]}


@dataclasses.dataclass(frozen=True)
class _Entry:
    """One line of `motion`."""

    name: str
    topic: str
    parts: Sequence[tuple[Sequence[str], Sequence[str]]]  # ways, of which the first that is there counts, and columns
    joined: bool  # instead all of the ways together
    scale: float
    offset: float
    frd: bool
    clock: str


@dataclasses.dataclass
class Bag:
    """What a log holds. Times are nanoseconds of the log's own clock, or seconds since `start_ns`."""

    files: list[str]
    start_ns: int
    motion: Motion  # empty where none was asked for
    pairs: list[tuple[int, int]]  # of the left and the right image
    rig: dict[str, str]  # camera_info by side, as `estimate --rig` takes it
    notes: list[str]  # what is odd in it, in sentences
    _images: Mapping[str, str]
    _clock: str

    def save(self, folder: Path) -> None:
        """Writes motion.csv, left/ and right/ with the images of each pair under one name, times.csv, left.yaml and
        right.yaml, log.json; the folder is there once it is whole. ConfigError if it is there already."""
        target = pathlib.Path(folder)
        if target.exists():
            raise ConfigError(f"{target}: is there already")
        part = target.with_name(target.name + ".part")
        shutil.rmtree(part, ignore_errors=True)
        try:
            part.mkdir(parents=True)
            if self.motion:
                write_motion(self.motion, part / "motion.csv")
            for side, text in self.rig.items():
                (part / f"{side}.yaml").write_text(text)
            if self.pairs:
                self._write_images(part)
            about = {"files": self.files, "start_ns": self.start_ns, "pairs": len(self.pairs), "notes": self.notes}
            (part / "log.json").write_text(json.dumps(about, indent=2) + "\n")
            part.rename(target)
        except BaseException:
            shutil.rmtree(part, ignore_errors=True)
            raise

    def _write_images(self, folder: pathlib.Path) -> None:
        number = {(self._images[side], pair[i]): (side, n) for i, side in enumerate(SIDES) for n, pair in enumerate(self.pairs)}
        for side in SIDES:
            (folder / side).mkdir()
        sources = Sources(self._images.values())
        with opened(self.files) as (_, read), whole(", ".join(self.files)):
            for topic, source, log_ns, message in read(sources.topics()):
                for name in sources.of(topic, source):
                    if at := number.pop((name, _time_of(message, log_ns, self._clock)[0]), None):
                        write_image(message, folder / at[0] / f"{at[1]:06}", topic)
        if number:
            raise ConfigError(f"{', '.join(self.files)}: {len(number)} images of pairs could not be written")
        with open(folder / "times.csv", "w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(["pair", "left_ns", "right_ns", "time_s"])
            rows.writerows([n, *pair, repr((pair[0] - self.start_ns) / 1e9)] for n, pair in enumerate(self.pairs))


def _time_of(message: Any, log_ns: int, clock: str) -> tuple[int, bool]:
    """When it was made, and whether the message says so itself."""
    if clock == "stamp":
        made = getattr(getattr(message, "header", None), "stamp", None)
        if made is not None and (made.sec or made.nanosec):
            return int(made.sec) * 10**9 + int(made.nanosec), True
    return log_ns, False


def _at(message: Any, way: str) -> Optional[list[float]]:
    """The numbers at a way into a message; nothing where there are none."""
    try:
        for word in way.split("."):
            message = message[int(word)] if word.isdigit() else getattr(message, word)
        if hasattr(message, "x") and hasattr(message, "z"):
            message = [getattr(message, axis) for axis in "wxyz" if hasattr(message, axis)]
        return [float(value) for value in np.atleast_1d(message)]
    except (AttributeError, IndexError, TypeError, ValueError):
        return None


def _numbers(entry: _Entry, message: Any, kind: str) -> dict[str, float]:
    """A message's columns."""
    row: dict[str, float] = {}
    seen = False
    for ways, columns in entry.parts:
        found = [_at(message, way) for way in ways]
        there = [values for values in found if values is not None]
        if entry.joined and len(there) < len(ways):
            raise ConfigError(f"motion.{entry.name}: {entry.topic} ({kind}) has no numbers at {ways[found.index(None)]}")
        if not there:
            continue
        seen = True
        values = [value for each in there for value in each] if entry.joined else there[0]
        if len(values) < len(columns):
            raise ConfigError(f"motion.{entry.name}: {entry.topic} has {len(values)} numbers for {len(columns)} columns")
        # a driver that knows no attitude: all zero, or said by the first covariance
        if columns == QUATERNION and (not any(values) or getattr(message, "orientation_covariance", [0])[0] == -1):
            continue
        row.update((column, (-1 if entry.frd and column in TURNED else 1) * entry.scale * value + entry.offset)
                   for column, value in zip(columns, values))
    if not seen:
        ways = ", ".join(way for each, _ in entry.parts for way in each)
        raise ConfigError(f"motion.{entry.name}: {entry.topic} ({kind}) has no {ways}: say its `field`")
    return row


def _settings(topics: Union[Path, Mapping[str, Any]]) -> tuple[dict[str, str], dict[str, str], list[_Entry], str, dict[str, str]]:
    """Images, camera_info, motion, clock and types of such a file, or of a dict like it."""
    given: Any = topics
    name = "topics" if isinstance(topics, Mapping) else os.fspath(topics)
    if not isinstance(topics, Mapping):
        try:
            given = YAML(typ="safe").load(pathlib.Path(name).read_text("utf-8"))
        except OSError as error:
            raise ConfigError(f"{name}: {error.strerror}") from None
        except (YAMLError, UnicodeDecodeError) as error:
            raise ConfigError(f"{name}: is no YAML: {' '.join(str(error).split())}") from None

    def keys(value: Any, path: str, allowed: Sequence[str] = ()) -> dict[str, Any]:
        if not isinstance(value, Mapping):
            raise ConfigError(f"{name}: {path or 'it'} must have {'the keys ' + ', '.join(allowed) if allowed else 'names as keys'}")
        for key in value:
            if allowed and key not in allowed:
                raise ConfigError(f"{name}: {path + '.' if path else ''}{key} is no key; there are {', '.join(allowed)}")
        return dict(value)

    def good(is_good: bool, value: Any, path: str, what: str) -> None:
        if not is_good:
            raise ConfigError(f"{name}: {path} is {value}, must be {what}")

    def names(value: Any, path: str) -> list[str]:
        found = [value] if isinstance(value, str) else value or []
        good(isinstance(found, (list, tuple)) and all(isinstance(each, str) for each in found), value, path, "a name or a list of names")
        return list(found)

    def one_of(value: Any, path: str, allowed: Sequence[str]) -> str:
        good(value in allowed, value, path, " or ".join(allowed))
        return str(value)

    def number(value: Any, path: str) -> float:
        good(type(value) in (int, float) and bool(np.isfinite(value)), value, path, "a number")
        return float(value)

    given = keys(given, "", ("images", "camera_info", "motion", "clock", "types"))
    clock = one_of(given.get("clock", "stamp"), "clock", ("stamp", "log"))
    sided = {of: {side: str(topic) for side, topic in keys(given.get(of, {}), of, SIDES).items()} for of in ("images", "camera_info")}
    for of, each in sided.items():
        if len(each) == 1:
            raise ConfigError(f"{name}: {of} has one side only")
        if len(set(each.values())) < len(each):
            raise ConfigError(f"{name}: {of}: {each['left']} is given for both sides; one that has both images side by side must be cut "
                              "into two topics first")
    entries = []
    for key, value in keys(given.get("motion") or {}, "motion").items():
        path = f"motion.{key}"
        entry = {"topic": value} if isinstance(value, str) else keys(
            value, path, ("topic", "field", "columns", "scale", "offset", "axes", "clock"))
        topic, field, columns = (names(entry.get(word), f"{path}.{word}") for word in ("topic", "field", "columns"))
        parts = KNOWN.get(key, ())
        if field or columns:
            ways = field or [way for each, _ in parts[:1] for way in each]
            parts = ((ways, tuple(columns or (parts[0][1] if parts else ()))),)
        if len(topic) != 1 or not parts or not all(columns for _, columns in parts):
            raise ConfigError(f"{name}: {path} needs " + ("a topic" if len(topic) != 1 else "field and columns"
                                                          if key not in KNOWN else "columns, a thruster each"))
        for column in (column for _, columns in parts for column in columns):
            if column not in COLUMNS and not str(column).endswith(COMMANDS):
                raise ConfigError(f"{name}: {path}: {column} is no column of a table of motion")
        entries.append(_Entry(key, topic[0], parts, bool(field),
                              number(entry.get("scale", 1), f"{path}.scale"), number(entry.get("offset", 0), f"{path}.offset"),
                              one_of(entry.get("axes", "flu"), f"{path}.axes", ("flu", "frd")) == "frd",
                              one_of(entry.get("clock", clock), f"{path}.clock", ("stamp", "log"))))
    if not entries and not sided["images"]:
        raise ConfigError(f"{name}: names neither images nor motion")
    types = {str(kind): str(file) for kind, file in keys(given.get("types") or {}, "types").items()}
    return sided["images"], sided["camera_info"], entries, clock, types


def _check_times(topic: str, times_ns: Sequence[int], notes: list[str], start_ns: int, own: bool) -> None:
    """ConfigError for a clock that runs backwards; a note for a gap."""
    steps = np.diff(np.array(times_ns, np.int64))
    if len(back := np.flatnonzero(steps < 0)):
        at = back[0]
        raise ConfigError(f"{topic}: the clock runs backwards at message {at + 1}, by {-steps[at] / 1e9:.3f} s; " + (
            "`clock: log` takes the times at which it was recorded" if own else "the autopilot began anew: cut the log there"))
    if steps.any() and steps.max() > max(10 * np.median(steps[steps > 0]), 0.5e9):
        at = steps.argmax()
        notes.append(f"{topic}: nothing for {steps[at] / 1e9:.2f} s after {(times_ns[int(at)] - start_ns) / 1e9:.2f} s.")


def read_bag(files: Union[Path, Sequence[Path]], topics: Union[Path, Mapping[str, Any]]) -> Bag:
    """Reads a log, or the parts of one. `topics` is a YAML file as above, or a dict of the same. ConfigError, in one line, for
    a file that cannot be read, a topic that is not there or is empty, a clock that runs backwards, images without a pair."""
    names = [os.fspath(file) for file in ([files] if isinstance(files, (str, os.PathLike)) else files)]
    images, infos, entries, clock, types = _settings(topics)
    wanted = {*images.values(), *infos.values(), *(entry.topic for entry in entries)}
    clocks = {topic: clock for topic in wanted} | {entry.topic: entry.clock for entry in entries}
    times: dict[str, list[int]] = {topic: [] for topic in wanted}
    unstamped: set[str] = set()
    rows: list[tuple[_Entry, int, dict[str, float]]] = []
    rig: dict[str, Any] = {}
    changed: dict[str, str] = {}
    sources = Sources(wanted)
    with opened(names, types) as (kinds, read), whole(", ".join(names)):
        if missing := sorted(sources.topics() - set(kinds)):
            raise ConfigError(f"{', '.join(names)}: has no topic {missing[0]}; it has {', '.join(sorted(kinds)) or 'none'}")
        for name, source, log_ns, message in read(sources.topics()):
            for topic in sources.of(name, source):
                at, stamped = _time_of(message, log_ns, clocks[topic])
                times[topic].append(at)
                if clocks[topic] == "stamp" and not stamped and log_ns and kinds[name] != MAVLINK:
                    unstamped.add(topic)
                rows += [(entry, at, _numbers(entry, message, kinds[name])) for entry in entries if entry.topic == topic]
                for side in (side for side, of in infos.items() if of == topic):
                    if rig_text(rig.setdefault(side, message), topic) != rig_text(message, topic):
                        changed[topic] = f"{topic}: changes in the log; its first is taken."
        sources.check(", ".join(names))
    if empty := sorted(topic for topic in wanted if not times[topic]):
        raise ConfigError(f"{', '.join(names)}: {empty[0]} is empty")
    start_ns = min(min(each) for each in times.values())
    notes = [f"{topic}: its messages say no time, the log's is taken." for topic in sorted(unstamped)] + list(changed.values())
    for topic in sorted({*images.values(), *(entry.topic for entry in entries)}):
        _check_times(topic, times[topic], notes, start_ns, kinds[split(topic)[0]] != MAVLINK)
    spans = {topic: (min(each), max(each)) for topic, each in times.items() if topic not in infos.values()}
    latest, earliest = max(spans, key=lambda topic: spans[topic][0]), min(spans, key=lambda topic: spans[topic][1])
    if spans[latest][0] > spans[earliest][1]:
        raise ConfigError(f"{latest} begins {(spans[latest][0] - spans[earliest][1]) / 1e9:.3f} s after {earliest} ends: "
                          "they have no time in common; `clock: log` takes the times at which they were recorded")
    pairs = pairs_of(times, images, notes) if images else []
    notes += apart_note(pairs, rig) if pairs else []
    return Bag(names, start_ns, _motion(entries, rows, start_ns, notes), pairs,
               {side: rig_text(info, infos[side]) for side, info in rig.items()}, notes, images, clock)


def _motion(entries: Sequence[_Entry], rows: Iterable[tuple[_Entry, int, dict[str, float]]], start_ns: int, notes: list[str]) -> Motion:
    """The table, in which of two entries with a column the first has it. ConfigError for commands that are no volts."""
    there: dict[str, set[str]] = {entry.name: set() for entry in entries}
    table: dict[int, dict[str, float]] = {}
    rows = list(rows)
    for entry, _, row in rows:
        there[entry.name].update(row)
    owner: dict[str, str] = {}
    for entry in entries:
        given = [column for _, columns in entry.parts for column in columns if column in there[entry.name]]
        if twice := [column for column in given if column in owner]:
            notes.append(f"{entry.topic}: {', '.join(twice)} are taken from motion.{owner[twice[0]]}.")
        owner = dict.fromkeys(given, entry.name) | owner
    for entry, at, row in rows:
        if mine := {column: value for column, value in row.items() if owner[column] == entry.name}:
            table.setdefault(at, {}).update(mine)
    times = sorted(table)
    made, zeros = without_zeros(check_motion({"time_s": np.array([(ns - start_ns) / 1e9 for ns in times])} | {
        column: np.array([table[ns].get(column, np.nan) for ns in times]) for column in owner}) if owner else {})
    notes += zeros
    for column, values in list(made.items()):
        if column.endswith("_v") and (np.nanmin(values) < 0 or np.nanmax(values) > 5):
            raise ConfigError(f"motion.{owner[column]}: {column} is {np.nanmin(values):.3g} to {np.nanmax(values):.3g}, must be 0 to "
                              "5 V with 2.5 neutral: commands of -1 to 1 take `scale: 2.5, offset: 2.5`")
        if column.endswith("_pwm_us"):
            if gone := int((values == 0).sum()):  # a disarmed autopilot
                made[column] = values = np.where(values == 0, 1500, values)
                notes.append(f"motion.{owner[column]}: {column} is 0, no pulse, in {gone} messages: taken as 1500, neutral.")
            if np.nanmin(values) < 800 or np.nanmax(values) > 2200:
                raise ConfigError(f"motion.{owner[column]}: {column} is {np.nanmin(values):.4g} to {np.nanmax(values):.4g}, must be 1100 to "
                                  "1900 microseconds with 1500 neutral: `scale` and `offset` make it so")
    return made


def estimate_bag(folder: Path, file: Path = "", *, marker: Path = "", settings: Settings = None, scenario: Scenario | Path = ""
                 ) -> list[dict[str, Any]]:
    """Finds the marker in the images of a folder that Bag.save wrote, and writes where it is as MCAP, FOLDER/poses.mcap unless
    given, in the log's own time: /tf (camera_head > marker_estimated) and /estimate where it was detected, /state for every
    pair. Returns `records` of `turbidock estimate --json`, each with `time_ns`, with wider deviations where the images of a pair are
    apart in time and the log has turn rates. `marker` and `settings` as its --marker and --set.
    With a scenario, whose vehicle has these cameras, FOLDER/motion.csv gets the vehicle's poses for `identify`."""
    at = pathlib.Path(folder)
    if missing := [name for name in ("times.csv", "left.yaml", "right.yaml") if not (at / name).is_file()]:
        raise ConfigError(f"{at}: has no {missing[0]}: it must be a log with images and camera_info")
    with open(at / "times.csv", newline="") as text:
        pairs = list(csv.DictReader(text))
    words = [*(word for side in SIDES for word in (f"--{side}", str(at / side), "--rig", str(at / f"{side}.yaml"))),
             *(["--marker", os.fspath(marker)] if marker else []), *(word for each in assignments_of(settings) for word in ("--set", each))]
    done = subprocess.run([PROGRAM, "estimate", *words, "--json", "--quiet"], capture_output=True, text=True)
    if done.returncode:
        raise ConfigError(done.stderr.strip().splitlines()[-1].removeprefix("turbidock: ") if done.stderr.strip() else
                          f"estimate ended with {done.returncode}")
    sys.stderr.write(done.stderr)
    found = json.loads(done.stdout)
    records: list[dict[str, Any]] = found["records"]
    sys.stderr.writelines(f"{note}\n" for note in found["notes"])  # what may be wrong with the images
    if len(records) != len(pairs):
        raise ConfigError(f"{at}: {len(records)} images were read of {len(pairs)} pairs")
    if (at / "motion.csv").exists() and has(motion := read_motion(at / "motion.csv"), TURN_RATE):
        widen(records, pairs, motion, found["baseline_m"])
    with McapFile(file or at / "poses.mcap") as out:
        for record, pair in zip(records, pairs):
            record["time_ns"] = ns = int(pair["left_ns"])
            pose = [*record["position_m"], *record["quaternion_wxyz"]]
            if record["detected"]:
                out.write_transforms("/tf", ns, ("camera_head", "marker_estimated", pose, ns))
                out.write_pose("/estimate", pose, ns, ns)
            out.write_row("/state", "Estimate", {"detected": float(record["detected"]), "fitness": record["fitness"]}, ns)
    if scenario:
        add_estimates(at, records, scenario_of(scenario))
    return records


def main() -> None:
    """turbidock-bag."""
    parser = argparse.ArgumentParser(prog="turbidock-bag", description="A recorded log as `estimate` and `identify` take it.")
    parser.add_argument("files", nargs="+", help=".bag, .mcap, .db3 or a ROS 2 bag's folder, .bin or .tlog")
    parser.add_argument("--topics", help="YAML file that says what is where (help('turbidock.logs.bags')); none: lists topics")
    parser.add_argument("--out", help="the folder to make")
    parser.add_argument("--estimate", action="store_true", help="also find the marker in the images: poses.mcap")
    parser.add_argument("--scenario", default="", help="whose vehicle has the cameras: motion.csv gets its poses")
    arguments = parser.parse_args()
    if not arguments.topics:
        with opened(arguments.files) as (kinds, _):
            print(*(f"{topic}  {kind}" for topic, kind in sorted(kinds.items())), sep="\n")
        return
    if not arguments.out:
        raise ConfigError("--out is needed: the folder to make")
    bag = read_bag(arguments.files, arguments.topics)
    bag.save(arguments.out)
    print(*bag.notes, sep="\n", end="\n" * bool(bag.notes), file=sys.stderr)
    print(f"{arguments.out}: {len(bag.motion.get('time_s', ()))} rows of motion, {len(bag.pairs)} pairs of images")
    if arguments.estimate:
        found = estimate_bag(arguments.out, scenario=arguments.scenario)
        print(f"{arguments.out}/poses.mcap: the marker in {sum(record['detected'] for record in found)} of {len(found)} pairs")
