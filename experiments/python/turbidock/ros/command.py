"""turbidock-ros: the program with the user's nodes as controller, as estimator, or both."""

from __future__ import annotations

import argparse
import os
import sys
from typing import Sequence

from .. import _core
from .._program import of_extra
from ..plug_in import plugins_of
from ..scenario import Scenario
from . import by_hand, exchange, wire
from .plug_ins import CONTROLLERS, ImageEstimator
from .topics import as_markdown

BY_HAND = "by-hand"
FLIES = ("run", "batch", "gate", "view", BY_HAND)  # what --set goes to
OTHERS = ("replay", "report", "status", "mcap")

_USAGE = """turbidock-ros COMMAND ... [--launch "COMMAND"] [--answer wrench|twist|thrusts|volts] [--estimator] [...] [--ros-args ...]

COMMAND and what follows are those of turbidock: run, batch, gate, view; also replay, report and status of what they wrote,
mcap, which is turbidock-mcap, and topics, which prints their table. All there is to know: python -m pydoc turbidock.ros
by-hand SCENARIO [--seed N] [--set KEY=VALUE] [--fast] [--paused] [--truth] has the services /turbidock/pause, step, reset and
set_parameters (`ros2 param set /turbidock KEY VALUE`)."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="turbidock-ros", usage=_USAGE, allow_abbrev=False,
                                     description="Docking trials in lockstep with ROS 2 nodes.")
    add = parser.add_argument
    add("--launch", metavar="COMMAND",
        help="of bash, starts your nodes for each trial, and lasts as long as they do; without it they run already")
    add("--answer", choices=tuple(CONTROLLERS), help="your nodes are the controller, and answer with this")
    add("--estimator", action="store_true", help="your nodes are the estimator")
    add("--nodes-version", metavar="TEXT",
        help="of your nodes' code: with it a batch goes on where it was stopped, and its trials can be replayed")
    add("--domain", type=int, help="ROS_DOMAIN_ID; with --launch else one that nobody uses")
    add("--answer-within", type=float, default=10, metavar="S", help="wall time for an answer [10]")
    add("--first-answer-within", type=float, default=60, metavar="S", help="the same with the nodes' start [60]")
    add("--reset-service", action="store_true",
        help="the nodes go on from trial to trial, and their service reset (std_srvs/Trigger) is called in between")
    return parser


def _value_of(arguments: Sequence[str], option: str) -> str:
    """Of an option among those of turbidock; empty where it is not there."""
    for at, word in enumerate(arguments):
        if word == option:
            return next(iter(arguments[at + 1:at + 2]), "")
        if word.startswith(option + "="):
            return word.partition("=")[2]
    return ""


def _log_of(command: str, out: str) -> str:
    if not out:
        return ""
    folder = os.path.splitext(out)[0] + ".nodes" if command == "batch" else os.path.join(out, "nodes")
    return folder + (".log" if command == "run" else "/")


def _arguments_of(command: str, rest: list[str], own: argparse.Namespace) -> list[str]:
    """What turbidock is given. ValueError for what does not go together."""
    if command not in (*FLIES, *OTHERS):
        raise ValueError(f"'{command}' must be one of {', '.join((*FLIES, *OTHERS))}, topics")
    if command in OTHERS:
        return rest
    if not own.answer and not own.estimator:
        raise ValueError("say what your nodes do: --answer wrench|twist|thrusts|volts, --estimator, or both")
    for name in ("launch", "nodes_version"):
        if getattr(own, name) is not None and not getattr(own, name).strip():
            raise ValueError(f"--{name.replace('_', '-')}: is empty; leave it out where there is none")
    for name in ("answer_within", "first_answer_within"):
        if not 0 < getattr(own, name) < 1e6:
            raise ValueError(f"--{name.replace('_', '-')}: {getattr(own, name):g} must be above 0 and below 1e6")
    if own.domain is not None and own.domain not in range(233):
        raise ValueError(f"--domain: {own.domain} must be in 0 to 232")
    if not own.launch and own.domain is None:
        exchange.domain_of_environment()
    if command in ("batch", "gate") and (not own.launch or own.domain is not None):
        why = "--domain is for one worker" if own.launch else "nodes that run already are one worker's"
        if _value_of(rest, "--workers") not in ("", "1"):
            raise ValueError(f"--workers {_value_of(rest, '--workers')}: {why}")
        if not _value_of(rest, "--workers"):
            rest = [*rest, "--workers", "1"]
    if command == "batch" and not own.nodes_version and "--quiet" not in rest:
        print("turbidock-ros: without --nodes-version this batch cannot be resumed", file=sys.stderr, flush=True)
    chosen = {}
    if own.answer:
        chosen["control.use"] = CONTROLLERS[own.answer].plugin_name(), f"--answer {own.answer}"
    if own.estimator:
        chosen["estimator.use"] = ImageEstimator.plugin_name(), "--estimator"
        chosen["estimator.pose_source"] = "cameras", "--estimator"
    for key, (value, option) in chosen.items():
        for word in rest:
            if (given := word.removeprefix("--set=")).startswith(key + "=") and given != f"{key}={value}":
                raise ValueError(f"--set {given} and {option}: must be one of them")
        rest = [*rest, "--set", f"{key}={value}"]
    return rest


def _by_hand(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(prog="turbidock-ros by-hand", allow_abbrev=False)
    parser.add_argument("scenario")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--fast", action="store_true", help="as fast as answers come, else in real time")
    parser.add_argument("--paused", action="store_true", help="waits for /turbidock/step, or for /turbidock/pause with false")
    parser.add_argument("--truth", action="store_true", help="sends truth/marker and truth/vehicle, too")
    given = parser.parse_args(arguments)
    scenario = Scenario(given.scenario, seed=given.seed, settings=given.set, plugins=[*CONTROLLERS.values(), ImageEstimator])
    try:
        by_hand.fly(scenario, given.fast, given.paused, given.truth)
    except _core.PluginError as error:
        print(f"turbidock-ros: {error}", file=sys.stderr)
        sys.exit(4)
    except KeyboardInterrupt:
        sys.exit(130)
    finally:
        exchange.close()


def main() -> None:
    if sys.argv[1:] == ["topics"]:
        return print(as_markdown(), end="")
    words, ros = sys.argv[1:], []
    if "--ros-args" in words:
        at = words.index("--ros-args")
        end = words.index("--", at) if "--" in words[at:] else len(words)
        words, ros = words[:at] + words[end + 1:], words[at:end]
    own, rest = _parser().parse_known_args(words)
    if not rest:
        _parser().error("which COMMAND?")
    wire.check(ros)
    command = rest[0]
    arguments = _arguments_of(command, rest, own)
    exchange.use(launch=own.launch or "", version=own.nodes_version or "", domain=own.domain, reset=own.reset_service,
                 answer_s=own.answer_within, first_answer_s=own.first_answer_within, ros_arguments=ros,
                 log=_log_of(command, _value_of(arguments, "--out")))
    if command == BY_HAND:
        return _by_hand(arguments[1:])
    ours = [*CONTROLLERS.values(), ImageEstimator]
    if command == "mcap":
        of_extra("logs.mcap_out", "logs").main(arguments[1:], ours)
        return exchange.close()
    code = _core.main(["turbidock-ros", *arguments], plugins_of(ours, kept=bool(own.nodes_version)))
    exchange.close()
    sys.stdout.flush()
    sys.exit(code)
