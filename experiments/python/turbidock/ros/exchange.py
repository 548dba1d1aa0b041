"""One frame is one exchange: what is known of it goes out with its stamp, then the trial waits for an answer with the same."""

from __future__ import annotations

import os
import pathlib
import shlex
import socket
import sys
import time
from dataclasses import dataclass, field
from typing import Any, Callable, Iterable, Sequence

from .. import _core
from . import wire
from .nodes import Nodes
from .topics import CLOCK, START_S, Topic

DOMAINS = range(1, 102)  # those whose ports Linux gives to nobody else
_STEP_S = 0.05  # of a wait
_SETTLE_S = 0.3  # after which no more of the nodes' topics appear
_ROUNDING_NS = 1000  # of a stamp that went through a floating-point number
_WALL_CLOCK_NS = 10**17  # stamps beyond it are of the wall clock


@dataclass
class Stack:
    """The user's nodes, and how they are spoken with. What a process is forked with is its own."""

    launch: str = ""  # a command; empty: they run already
    version: str = ""  # of the nodes: results of a batch are kept by it
    domain: int | None = None  # ROS_DOMAIN_ID; none: with `launch` one that nobody uses, else the environment's
    first_answer_s: float = 60.0  # wall time, with the start of the nodes
    answer_s: float = 10.0
    reset: bool = False  # the nodes stay, and their service `reset` is called when a trial begins
    log: str = ""  # of the nodes' output: a file or, where it ends in /, a folder for that of each trial
    ros_arguments: list[str] = field(default_factory=list)  # of --ros-args: remapping


stack = Stack()


def use(**values: Any) -> None:
    """What to use from the next trial on: the fields of Stack. TypeError for another."""
    global stack
    close()
    stack = Stack(**values)


def close() -> None:
    """Ends what this process has of ROS, with the nodes that it started."""
    global _link
    if _link and _link.process == os.getpid():
        _link.close()
    _link = None


def stamp_of(plug_in: Any, frame: int) -> int:
    """ROS time [ns] of the exposure of a plug-in's image."""
    return arrival_of(plug_in, frame) - round(1e9 * float(plug_in.delay_s))


def arrival_of(plug_in: Any, frame: int) -> int:
    """And of its arrival, which is now."""
    return START_S * 10**9 + round(1e9 * float((frame + plug_in.delay_frames) * plug_in.frame_s))


def _is_bound(port: int) -> bool:
    """Whether a process of this machine listens on a UDP port."""
    lines = pathlib.Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]
    return any(int(line.split()[1].rpartition(":")[2], 16) == port for line in lines)


def _claim(domain: int) -> socket.socket | None:
    """A domain for this process until it ends, in whatever way; None where another trial has it."""
    claim = socket.socket(socket.AF_UNIX)
    try:
        claim.bind(f"\0turbidock-ros-domain-{domain}")  # leaves no file
    except OSError:
        claim.close()
        return None
    return claim


def _is_used(domain: int) -> bool:
    return _is_bound(7400 + 250 * domain)  # where every node of it hears of others


def _free_domain() -> tuple[int, socket.socket]:
    for domain in DOMAINS:
        claim = None if _is_used(domain) else _claim(domain)
        if claim:
            return domain, claim
    raise _core.PluginError(f"each ROS_DOMAIN_ID from {DOMAINS[0]} to {DOMAINS[-1]} is in use")


def _given_domain(domain: int, starts_nodes: bool) -> tuple[int, socket.socket]:
    if starts_nodes and _is_used(domain):
        raise _core.PluginError(f"ROS_DOMAIN_ID {domain} is in use by other nodes; without --domain a worker takes a free one")
    claim = _claim(domain)
    if not claim:
        raise _core.PluginError(f"ROS_DOMAIN_ID {domain} is in use by another trial")
    return domain, claim


def domain_of_environment() -> int:
    """ROS_DOMAIN_ID. ValueError for what is none."""
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not text.isdecimal() or int(text) not in range(233):
        raise ValueError(f"ROS_DOMAIN_ID: '{text}' must be in 0 to 232")
    return int(text)


class Link:
    """Of a process: a node, a domain, and, while a trial is under way, the user's nodes. A trial is that of the plug-ins which
    have entered it."""

    def __init__(self) -> None:
        self.process = os.getpid()
        self._stack = stack
        self._wire: wire.Wire | None = None
        self._claim: socket.socket | None = None
        self.domain = 0  # of the trial under way
        self._environment: dict[str, str] = {}  # of the nodes
        self._nodes: Nodes | None = None
        self._inside: dict[str, int] = {}  # plug-ins by what they are
        self._trials = 0
        self._matched: set[Topic] = set()  # answers that somebody may give
        self._answered: set[Topic] = set()  # and has given
        self._said: set[Topic] = set()  # answers of which something has no effect
        self._now = self._paused = self._steps = 0
        self._last: dict[str, str] = {}  # by topic: the stamp of the last answer that was not waited for
        self.by_hand = self.again = False  # whether the trial can be begun again and changed, and shall be
        self._settings: list[str] = []
        self.truth: Sequence[Topic] = ()  # sent, too

    # --------------------------------------------------------------------------------- the trial

    def enter(self, role: str, plug_in: object, publishes: Iterable[Topic], hears: Iterable[Topic]) -> None:
        """A plug-in begins: a trial, where it is the first one of it."""
        if role in self._inside or not self._inside:
            self._begin()
        self._inside[role] = id(plug_in)
        assert self._wire
        self._wire.open([CLOCK, *publishes], hears)

    def leave(self, role: str, plug_in: object) -> None:
        """The last one that leaves ends the trial."""
        if self.process != os.getpid() or self._inside.get(role) != id(plug_in):
            return
        del self._inside[role]
        if not self._inside:
            self._end()

    def _begin(self) -> None:
        self._inside.clear()
        self._end()
        self._now = 0
        self._matched.clear()
        self._answered.clear()
        self._last.clear()
        self._trials += 1
        self._connect()
        assert self._wire
        if self._stack.launch and self._nodes is None:
            log = self._stack.log
            own = f"{self.process}-{self._trials}.log" if log.endswith("/") else ""
            self._nodes = Nodes(self._stack.launch, log + own, self._environment)
        if self._stack.reset:
            self._reset_nodes()

    def _reset_nodes(self) -> None:
        assert self._wire
        end = time.monotonic() + self._stack.first_answer_s
        done = self._wire.call("std_srvs", "Trigger", "reset", lambda: not self._is_over(end) and not _core.stop_signal())
        if done and not done.success:
            raise _core.PluginError(f"the nodes' service reset: success is false: {done.message}")
        if not done and not _core.stop_signal():
            raise _core.NoAnswer(self._silence("the service reset", self._stack.first_answer_s) + self._output())

    def _end(self) -> None:
        if self._wire:  # with it goes what nodes of this trial may still say
            self._wire.close()
            self._wire = None
        if self._nodes and not self._stack.reset:
            nodes, self._nodes = self._nodes, None
            nodes.close()

    def _connect(self) -> None:
        launch, given = self._stack.launch, self._stack.domain
        if given is None and not launch:
            given = domain_of_environment()
        if not self._claim:
            self.domain, self._claim = _free_domain() if given is None else _given_domain(given, bool(launch))
        own = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        if launch:
            own = {"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp", "RMW_FASTRTPS_USE_QOS_FROM_XML": "1",
                   "OVERRIDE_LAUNCH_PROCESS_OUTPUT": "screen",  # of ros2 launch, which else keeps it in a file of its own
                   "FASTRTPS_DEFAULT_PROFILES_FILE": str(pathlib.Path(__file__).with_name("fastdds.xml"))}
        before = dict(os.environ)
        self._environment = {**own, **before, "ROS_DOMAIN_ID": str(self.domain)}
        if launch:
            self._environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SYSTEM_DEFAULT"  # as the profile says
            self._environment.pop("ROS_LOCALHOST_ONLY", None)  # would take its place, with shared memory
        try:
            os.environ.clear()
            os.environ.update(self._environment)
            self._wire = wire.Wire(self.domain, self._stack.ros_arguments)
        finally:
            os.environ.clear()
            os.environ.update(before)
        self._wire.serve("SetBool", "~/pause", lambda request: self.pause(request.data))
        self._wire.serve("Trigger", "~/step", self._step)
        if self.by_hand:
            self._wire.serve("Trigger", "~/reset", self._reset)
            self._wire.serve_parameters(self._settings.append)
            self._wire.open(self.truth, ())

    def close(self) -> None:
        self._inside.clear()
        self._end()
        if self._nodes:
            self._nodes.close()
        if self._claim:
            self._claim.close()
        self._nodes = self._claim = None

    def pause(self, is_paused: bool) -> str:
        """Before the next frame, until it is told otherwise; says what it does."""
        self._paused, self._steps = int(is_paused), 0
        return "paused" if self._paused else "goes on"

    def _step(self, _: Any) -> str:
        self._paused, self._steps = 1, self._steps + 1
        return "a frame"

    def _reset(self, _: Any) -> str:
        self.again = True
        return "begins again"

    def take_settings(self) -> list[str]:
        """What was set since the last call, as assignments."""
        taken, self._settings[:] = list(self._settings), []
        return taken

    # --------------------------------------------------------------------------------- a frame

    def begin_frame(self, now: int) -> None:
        """Moves /clock on, once a frame; waits while somebody has paused the trial."""
        if now <= self._now:
            return
        assert self._wire
        while self._paused and not (self._steps or self.again or self._settings or _core.stop_signal()):
            self._wire.spin(_STEP_S)
        self._steps = max(0, self._steps - 1)
        self._now = now
        self.send(CLOCK, wire.clock(CLOCK, now))

    def send(self, topic: Topic, message: Any) -> None:
        assert self._wire
        self._wire.send(topic, message)

    def await_nodes(self, asks: Sequence[Topic], answers: Sequence[Topic]) -> None:
        """Before the first frame: until somebody hears one of what is asked, and somebody may answer."""
        if self._matched & set(answers):
            return
        self._matched |= set(answers)
        assert self._wire
        said = time.monotonic()
        end = said + self._stack.first_answer_s
        while not _core.stop_signal():
            is_heard = any(self._wire.readers(topic) for topic in asks)
            writers = [writer for topic in answers for writer in self._wire.writers(topic)]
            if is_heard and writers and not self._wire.mismatches():
                break
            said = self._say(said, "waits for " + (f"somebody who publishes {self._wire.names(answers)}" if is_heard else
                                                   f"somebody who hears {self._wire.names(asks)}"))
            self._check(end, answers, 0, self._stack.first_answer_s)
            self._wire.spin(_STEP_S)
        settled, before = time.monotonic() + _SETTLE_S, [0]
        while time.monotonic() < settled:
            self._wire.spin(_STEP_S)
            now = [self._wire.readers(topic) for topic in asks]
            if now != before:
                settled, before = time.monotonic() + _SETTLE_S, now
        self._require(self._wire.greet, self._stack.first_answer_s)
        if others := self._wire.intruders():
            topic, name = others[0]
            raise _core.PluginError(f"{name} also publishes {self._wire.names([topic])}, which the trial does")

    def settle(self) -> None:
        """After a frame that asks nothing: until the nodes have taken it. A node's queue has ten places, and frames that
        nobody waited for would overwrite each other in it when the machine is busy."""
        assert self._wire
        self._require(self._wire.settle, self._stack.answer_s)

    def _require(self, settle: Callable[[Callable[[], bool]], list[str]], longest: float) -> None:
        end = time.monotonic() + longest
        silent = settle(lambda: not self._is_over(end) and not _core.stop_signal())
        if silent and not _core.stop_signal():
            raise _core.NoAnswer(self._silence(f"get_parameters from {', '.join(silent)}", longest) + self._output())

    def ask(self, answers: Sequence[Topic], stamp: int) -> tuple[Topic, Any] | None:
        """The answer to the frame of this stamp; None where a signal has stopped the trial. NoAnswer when none comes;
        PluginError for what no answer may be."""
        assert self._wire
        begun = said = time.monotonic()
        is_first = not self._answered & set(answers)
        longest = self._stack.first_answer_s if is_first else self._stack.answer_s
        while not _core.stop_signal():
            while self._wire.heard:
                topic, message = self._wire.heard.pop(0)
                if topic in answers and self._is_answer(topic, message, stamp):
                    self._require_one(answers)
                    self._answered |= set(answers)
                    return topic, message
            if is_first:
                said = self._say(said, f"waits for {self._wire.names(answers)} of stamp {_text(stamp)}")
            if time.monotonic() - begun > _STEP_S:
                self._check(begun + longest, answers, stamp, longest)
            self._wire.spin(_STEP_S)
        return None

    def _is_answer(self, topic: Topic, message: Any, stamp: int) -> bool:
        assert self._wire
        given = wire.stamp_ns(message)
        if given is None or abs(given - stamp) <= _ROUNDING_NS:
            return True
        if given == 0:
            raise self.wrong(topic, f"an answer without a stamp: it must be that of the frame, {_text(stamp)}")
        if given > stamp:
            clock = ("of the wall clock: give the node use_sim_time, or the frame's stamp" if given > _WALL_CLOCK_NS
                     else "of the future")
            raise self.wrong(topic, f"stamp {_text(given)} is {clock}; the frame that is waited for has {_text(stamp)}")
        self._last[self._wire.names([topic])] = _text(given)
        return False

    def wrong(self, topic: Topic, why: str) -> _core.PluginError:
        """Of an answer that may not be."""
        assert self._wire
        return _core.PluginError(f"{self._wire.names([topic])} from {', '.join(self._wire.writers(topic))}: {why}")

    def say_once(self, topic: Topic, unused: str) -> None:
        """That these numbers of an answer have no effect; nothing of none."""
        if unused and topic not in self._said:
            assert self._wire
            self._said.add(topic)
            print(f"turbidock-ros: {self._wire.names([topic])}: {unused} {'have' if ',' in unused else 'has'} no effect: roll and "
                  "pitch are not steered", file=sys.stderr, flush=True)

    def require_finite(self, topic: Topic, message: Any) -> None:
        """PluginError for an answer that has a number which is not."""
        if name := wire.not_finite(message):
            raise self.wrong(topic, f"{name} is not finite")

    def _require_one(self, answers: Sequence[Topic]) -> None:
        assert self._wire
        if sum(map(self._wire.writer_count, answers)) < 2:
            return
        known = time.monotonic() + _SETTLE_S
        while time.monotonic() < known:  # of what came just now the name comes later
            self._wire.spin(_STEP_S)
        writers = [writer for topic in answers for writer in self._wire.writers(topic)]
        if len(writers) > 1:
            raise _core.PluginError(f"{self._wire.names(answers)}: {len(writers)} publish it: {', '.join(sorted(writers))}; "
                                    "one must")

    def _is_over(self, end: float) -> bool:
        """Whether no answer comes any more: the nodes have ended, or it is time."""
        return time.monotonic() > end or bool(self._nodes and self._nodes.ended() is not None)

    def _silence(self, asked: str, longest: float, who: str = "") -> str:
        code = self._nodes.ended() if self._nodes else None
        if not self._nodes or code is None:
            return f"no answer on {asked} in {longest:g} s{who}"
        how = f"was ended by signal {-code}" if code < 0 else f"has ended with exit code {code}"
        return f"no answer on {asked}{who}: '{self._nodes.command}' {how}" + (
            "; it must last as long as its nodes" if code == 0 else "")

    def _check(self, end: float, answers: Sequence[Topic], stamp: int, longest: float) -> None:
        """NoAnswer where none comes any more."""
        assert self._wire
        if not self._is_over(end):
            return
        who = sorted({writer for topic in answers for writer in self._wire.writers(topic)})
        why = self._silence(self._wire.names(answers) + (f" of stamp {_text(stamp)}" if stamp else ""), longest,
                            f" from {', '.join(who)}" if who else ", which nobody publishes")
        old = "".join(f"; {name} had stamp {old} last" for name, old in self._last.items())
        raise _core.NoAnswer(f"{why}{old}{self._surroundings()}{self._output()}")

    def _surroundings(self) -> str:
        assert self._wire
        problems = [*self._wire.mismatches(), *self._wire.elsewhere()]
        none = "none" if self._stack.launch else f"none in ROS_DOMAIN_ID {self.domain}; start yours there, or say --launch"
        return f"; nodes: {', '.join(self._wire.others()) or none}" + "".join(f"; {problem}" for problem in problems)

    def _output(self) -> str:
        if not self._nodes or not (tail := self._nodes.tail()):
            return ""
        return f"; the last of their output{f' in {self._nodes.log}' if self._nodes.log else ''}:\n{tail}"

    def _say(self, said: float, what: str) -> float:
        """Once a second."""
        if time.monotonic() < said + 1:
            return said
        assert self._wire
        print(f"turbidock-ros: {what}{self._surroundings()}", file=sys.stderr, flush=True)
        return time.monotonic()


def _text(stamp: int) -> str:
    return f"{stamp // 10**9}.{stamp % 10**9:09d}"


_link: Link | None = None


def link() -> Link:
    """That of this process."""
    global _link
    if _link is None or _link.process != os.getpid():
        _link = Link()
    return _link


def code_of_stack() -> str:
    """What results follow from besides the scenario, as far as it can be told: empty without the nodes' version."""
    s = stack
    return shlex.join([s.launch, s.version, str(s.reset), *s.ros_arguments]) if s.version else ""
