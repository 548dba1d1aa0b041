"""Messages of logs by their topics: ROS 1, ROS 2, ArduSub.

What is sent under one name by several (lanes of an EKF, IMUs, systems of a .tlog, children of /tf) is told apart by its source,
in brackets: `XKF1[0]`, `ATTITUDE[1:1]` (system, component), `/tf[base_link]` (child frame), `/imu[imu_link]`."""

from __future__ import annotations

import os
import pathlib
import sys
import tempfile
from contextlib import contextmanager
from typing import Any, Callable, Iterable, Iterator, Mapping, Sequence

from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from .._core import ConfigError
from .motion import check_once

MAVLINK = "MAVLink"  # the type of ArduSub's messages, whose times are those of their log
# Of DataFlash messages, where the log itself does not say it (before ArduPilot 4.0).
INSTANCES = ("I", "C", "Instance")
# Topic, source, when it was recorded [ns], message.
Messages = Iterator[tuple[str, str, int, Any]]


def split(topic: str) -> tuple[str, str]:
    """A topic and the source that is asked for, "" for any: XKF1[0]."""
    name, bracket, source = topic.partition("[")
    return (name, source[:-1]) if bracket and source.endswith("]") else (topic, "")


@contextmanager
def opened(files: Sequence[str], types: Mapping[str, str] = {}) -> Iterator[tuple[dict[str, str], Callable[[set[str]], Messages]]]:
    """Types by topic, and what reads the messages of such topics. `types`: .msg files of types that a bag does not define.
    ConfigError for what cannot be read."""
    name = ", ".join(files)
    if missing := [file for file in files if not os.path.exists(file)]:
        raise ConfigError(f"{missing[0]}: no such file")
    check_once(files)
    of_ardusub = [file.lower().endswith((".bin", ".tlog")) for file in files]
    if all(of_ardusub):
        said: list[str] = []
        with whole(name):
            kinds = {topic: MAVLINK for topic, _, _, _ in _mavlink(files, said)}
        if said:
            print(f"{name}: is damaged, some is left out: {said[0]} ({len(said)} such places)", file=sys.stderr)
        yield kinds, lambda topics: (each for each in _mavlink(files, []) if each[0] in topics)
        return
    if any(of_ardusub):
        raise ConfigError(f"{name}: logs of ArduSub and bags of ROS have no clock in common")
    for file in files:
        if os.path.isdir(file) and not os.path.exists(os.path.join(file, "metadata.yaml")):
            raise ConfigError(f"{file}: has no metadata.yaml: give its .mcap or .db3 files themselves, or `ros2 bag reindex` it")
        if file.lower().endswith((".zst", ".gz", ".lz4", ".csv", ".ulg")):
            raise ConfigError(f"{file}: is no bag: one that was packed is unpacked first (zstd -d), a table goes to turbidock-identify itself")
    store = get_typestore(Stores.LATEST)
    with whole(name):
        for file in [file for file in files if file.lower().endswith(".mcap")]:
            with open(file, "rb") as stream:
                if (profile := make_reader(stream).get_header().profile) != "ros2":
                    raise ConfigError(f"{file}: an MCAP of profile '{profile}', must be ros2 (a trial's own has Foxglove's messages)")
        reader = AnyReader([pathlib.Path(file) for file in files], default_typestore=store)
        reader.open()
        reader.typestore.register({kind: fields for kind, fields in _defined(types).items() if kind not in reader.typestore.types})

    def read(topics: set[str]) -> Messages:
        wanted = [connection for connection in reader.connections if connection.topic in topics]
        for connection in wanted:
            if connection.msgtype not in reader.typestore.types:
                raise ConfigError(f"{name}: {connection.topic} is of type {connection.msgtype}, which the bag does not define (one "
                                  f"of before ROS 2 Iron): name its file under types: {{{connection.msgtype}: FILE.msg}}")
        for connection, log_ns, data in reader.messages(wanted) if wanted else ():
            try:
                message: Any = reader.deserialize(data, connection.msgtype)
            except Exception as error:
                raise ConfigError(f"{name}: a message of {connection.topic} is not as {connection.msgtype} is defined: "
                                  f"{_words(error)}") from error
            for each in message.transforms if hasattr(message, "transforms") else [message]:  # whose it is: its child frame, else its frame
                source = getattr(each, "child_frame_id", "") or getattr(getattr(each, "header", None), "frame_id", "")
                yield connection.topic, source, log_ns, each

    try:
        yield {connection.topic: connection.msgtype for connection in reader.connections}, read
    finally:
        reader.close()


def _defined(types: Mapping[str, str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for kind, file in types.items():
        try:
            found.update(get_types_from_msg(pathlib.Path(file).read_text("utf-8"), kind))
        except OSError as error:
            raise ConfigError(f"{file}: {error.strerror}") from None
        except Exception as error:
            raise ConfigError(f"{file}: defines no {kind}: {_words(error)}") from error
    return found


def _words(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def whole(name: str) -> Iterator[None]:
    """Whatever a reader's library says of a broken file, in one line."""
    try:
        yield
    except (ConfigError, ImportError, KeyboardInterrupt):
        raise
    except Exception as error:
        raise ConfigError(f"{name}: cannot be read, cut off or no log: {_words(error)}"
                          + "; `mcap recover` saves what is whole" * ("end magic" in str(error))) from error


def _mavlink(files: Sequence[str], said: list[str]) -> Messages:  # said: of damage, by C code, a line a byte
    from pymavlink import mavutil  # type: ignore[import-untyped]

    for file in files:
        stderr = os.dup(2)
        with tempfile.TemporaryFile() as lines:
            os.dup2(lines.fileno(), 2)
            try:
                log = mavutil.mavlink_connection(file)
            finally:
                os.dup2(stderr, 2)
                os.close(stderr)
            lines.seek(0)
            said += lines.read().decode("utf-8", "replace").splitlines()
        while (message := log.recv_msg()) is not None:
            if message.get_type() != "BAD_DATA":
                yield message.get_type(), _sender(message), round(1e9 * message._timestamp), message
        log.close()


def _sender(message: Any) -> str:
    """An instance of a DataFlash message; a system and its component of a MAVLink one, with an instance where it has one."""
    if (layout := getattr(message, "fmt", None)) is not None:
        instance = layout.instance_field or next((name for name in layout.columns[1:2] if name in INSTANCES), "")
        return str(getattr(message, instance)) if instance else ""
    instance = getattr(message, "_instance_field", None)
    return f"{message.get_srcSystem()}:{message.get_srcComponent()}" + (f":{getattr(message, instance)}" if instance else "")


class Sources:
    """Who sends under the topics that are wanted, of which one each is taken."""

    def __init__(self, wanted: Iterable[str]) -> None:
        self.wanted = set(wanted)
        self._found: dict[str, dict[str, None]] = {split(topic)[0]: {} for topic in wanted}

    def topics(self) -> set[str]:
        return set(self._found)

    def of(self, topic: str, source: str) -> list[str]:
        """What is wanted that this message is: its topic with its source, or without."""
        self._found[topic][source] = None
        return [name for name in (f"{topic}[{source}]", topic) if name in self.wanted]

    def check(self, files: str) -> None:
        """ConfigError for a topic with several, of which none is named, and for one that is not there."""
        for name in sorted(self.wanted):
            topic, source = split(name)
            found = sorted(self._found[topic])
            names = ", ".join(f"'{topic}[{each}]'" for each in found)  # as YAML wants them within braces
            if source and found and source not in found:
                raise ConfigError(f"{files}: has no {name}; it has {names}")
            if not source and len(found) > 1:
                raise ConfigError(f"{files}: {topic} comes from {len(found)} sources: say which of {names}")
