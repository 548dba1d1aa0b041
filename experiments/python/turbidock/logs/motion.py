"""The table of motion: what a bag gives, what a trial records, what `identify` takes.

A CSV file, or a dict of NumPy arrays of equal length, one row an instant. Every column but `time_s` may be absent; in a
row without that measurement it is empty in a file, NaN in an array. `trajectory.csv` and `motion.csv` of a trial are such
tables; columns of other names are left alone.

| Columns | Meaning |
|---|---|
| `time_s` | seconds, increasing; of one clock for the whole table as far as its writer knows one |
| `vehicle_x_m`, `vehicle_y_m`, `vehicle_z_m` | where the vehicle's origin B is in the world W (z up, 0 at the surface) |
| `vehicle_qw`, `vehicle_qx`, `vehicle_qy`, `vehicle_qz` | its attitude R_WB, a unit quaternion |
| `surge_mps`, `sway_mps`, `heave_mps` | velocity of B in W along B's axes (x ahead, y left, z up), as of a DVL on the bottom |
| `roll_rate_rad_s`, `pitch_rate_rad_s`, `yaw_rate_rad_s` | turn rate along the same axes, as of gyroscopes |
| `roll_rad`, `pitch_rad`, `yaw_rad` | attitude where there is no quaternion: R_WB = Rz(yaw) Ry(pitch) Rx(roll) |
| `depth_m` | of B below the surface, positive down |
| `water_x_mps`, `water_y_mps`, `water_z_mps` | velocity of the water in W, where it was measured |
| `THRUSTER_v`, `THRUSTER_pwm_us` or `THRUSTER_newton` | command to the thruster of that name in the MJCF: 0 to 5 V with 2.5 |
| | neutral, 1100 to 1900 microseconds with 1500 neutral, or newtons asked for; it holds until the next row that has one |
| `surge_newton`, `sway_newton`, `heave_newton`, `yaw_newton_m` | or a demand by axis, which the vehicle shares out |

One kind of command a table; of several, volts count, then pulses, then a demand by axis. Poses that are older than their row
says (a camera's), and commands on another clock than the motion, are for `identify` to find: times stay as they were logged.
"""

from __future__ import annotations

import contextlib
import csv
import filecmp
import itertools
import os
from typing import IO, Any, Iterable, Iterator, Mapping, Sequence, Union

import numpy as np
import numpy.typing as npt

from .._core import ConfigError

Numbers = npt.NDArray[np.float64]
Motion = dict[str, Numbers]

POSITION = ("vehicle_x_m", "vehicle_y_m", "vehicle_z_m")
QUATERNION = ("vehicle_qw", "vehicle_qx", "vehicle_qy", "vehicle_qz")
VELOCITY = ("surge_mps", "sway_mps", "heave_mps")
TURN_RATE = ("roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s")
EULER = ("roll_rad", "pitch_rad", "yaw_rad")
DEPTH = ("depth_m",)
WATER = ("water_x_mps", "water_y_mps", "water_z_mps")
COLUMNS = {*POSITION, *QUATERNION, *VELOCITY, *TURN_RATE, *EULER, *DEPTH, *WATER}
COMMANDS = ("_v", "_pwm_us", "_newton", "_newton_m")
ABSENT = ("null", "none", "na", "n/a", "#n/a", "-")  # besides nan, what programs write where there is no number


def read_motion(file: Union[str, "os.PathLike[str]"]) -> Motion:
    """Reads such a file. Words in other columns (a trial's stage) become NaN. ConfigError with file and line for a row of another
    length, for a word where a number must be, and as of `check_motion`."""
    name = os.fspath(file)
    try:
        with open(name, newline="", encoding="utf-8-sig") as text:  # a spreadsheet's mark at its begin is no letter
            rows = csv.reader(text)
            header = [word.strip() for word in next(rows, ())]
            if not header:
                raise ConfigError(f"{name}: is empty")
            if "time_s" not in header:
                raise ConfigError(f"{name}:1: has no column time_s" + (f"; it has {', '.join(header[:4])}" if len(header) > 1 else
                                                                       ", and no commas between columns"))
            if twice := next((word for word in header if word and header.count(word) > 1), ""):
                raise ConfigError(f"{name}:1: has column {twice} twice")
            table = np.array([_numbers(row, header, f"{name}:{rows.line_num}") for row in rows if row]).reshape(-1, len(header))
    except OSError as error:
        raise ConfigError(f"{name}: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(f"{name}: is no CSV in UTF-8: {error}") from None
    return check_motion({column: table[:, i] for i, column in enumerate(header)}, name)


def _numbers(row: Sequence[str], header: Sequence[str], at: str) -> Numbers:
    if len(row) != len(header):
        raise ConfigError(f"{at}: has {len(row)} values, the header {len(header)}")
    try:
        return np.array([float(word or "nan") for word in row])
    except ValueError:  # each on its own
        return np.array([_number(word.strip(), column, at) for word, column in zip(row, header)])


def _number(word: str, column: str, at: str) -> float:
    try:
        return float(word or "nan")
    except ValueError:
        if (column in COLUMNS or column == "time_s" or column.endswith(COMMANDS)) and word.lower() not in ABSENT:
            raise ConfigError(f"{at}: {column} is '{word}', must be a number" + ", with a point" * ("," in word)) from None
        return float("nan")


def write_motion(motion: Mapping[str, npt.ArrayLike], file: Union[str, "os.PathLike[str]"]) -> None:
    """Writes such a file, whole or not at all; what is NaN is empty."""
    table = check_motion(motion, "motion")
    rows = zip(*table.values())
    lines = [",".join(table), *(",".join("" if np.isnan(value) else repr(float(value)) for value in row) for row in rows)]
    with whole_file(file) as text:
        text.write(("\n".join(lines) + "\n").encode())


def make_folder_of(file: Union[str, "os.PathLike[str]"]) -> None:
    """Makes the folder that a file will be in. ConfigError where it cannot be made."""
    folder = os.path.dirname(os.fspath(file)) or "."
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be made: {error.strerror}") from None


@contextlib.contextmanager
def whole_file(file: Union[str, "os.PathLike[str]"]) -> Iterator[IO[bytes]]:
    """A file that has its name once it is whole; of one that fails nothing is left. Makes its folder."""
    name = os.fspath(file)
    make_folder_of(name)
    try:
        with open(name + ".part", "wb") as stream:
            yield stream
        os.replace(name + ".part", name)
    except BaseException:
        with contextlib.suppress(OSError):
            os.remove(name + ".part")
        raise


def check_once(files: Sequence[str]) -> None:
    """ConfigError for a log that is given twice, also as a copy: it would seem to tell more than it does."""
    for one, other in itertools.combinations(files, 2):
        if os.path.samefile(one, other) or all(map(os.path.isfile, (one, other))) and filecmp.cmp(one, other, False):
            raise ConfigError(f"{other}: is {one} once more; give each log once")


def check_motion(motion: Mapping[str, npt.ArrayLike], name: str = "motion") -> Motion:
    """The table as arrays. ConfigError, in one line, for columns of unequal length, a clock that is not finite or runs
    backwards, and half of a position, a quaternion, a velocity."""
    table = {column: np.asarray(values, float) for column, values in motion.items()}
    if "time_s" not in table:
        raise ConfigError(f"{name}: has no column time_s")
    time_s = table["time_s"]
    if time_s.ndim != 1 or len(time_s) < 2:
        raise ConfigError(f"{name}: needs at least two rows")
    for column, values in table.items():
        if values.shape != time_s.shape:
            raise ConfigError(f"{name}: {column} has {len(values)} rows, time_s {len(time_s)}")
    if len(bad := np.flatnonzero(~np.isfinite(time_s))):
        raise ConfigError(f"{name}:{bad[0] + 2}: time_s is no number")
    if len(back := np.flatnonzero(np.diff(time_s) <= 0)):
        lost = "; most have the time of the one before: it lost its digits, as float32 does" if 2 * len(back) > len(time_s) else ""
        raise ConfigError(f"{name}:{back[0] + 3}: the clock runs backwards, or a row is there twice: from {time_s[back[0]]:.15g} to "
                          f"{time_s[back[0] + 1]:.15g} s{lost}")
    for group in (POSITION, QUATERNION, VELOCITY, TURN_RATE, WATER):
        there = [column for column in group if column in table]
        if there and len(there) < len(group):
            raise ConfigError(f"{name}: has {there[0]} but not {', '.join(column for column in group if column not in table)}")
    return table


def has(motion: Mapping[str, npt.ArrayLike], columns: Iterable[str]) -> bool:
    """Whether each of these columns is there, with a number in it."""
    return all(column in motion and bool(np.isfinite(np.asarray(motion[column])).any()) for column in columns)


def without_zeros(motion: Mapping[str, Numbers]) -> tuple[Motion, list[str]]:
    """The table without velocities and turn rates that are zero in every row, which drivers that measure none write; and a note
    for each. Zeros of one that really rests are no loss."""
    kept, notes = dict(motion), []
    for group in (VELOCITY, TURN_RATE):
        if has(motion, group) and not any(np.nan_to_num(motion[column]).any() for column in group):
            for column in group:
                del kept[column]
            notes.append(f"{', '.join(group)} are zero throughout: no measurement, left out.")
    return kept, notes
