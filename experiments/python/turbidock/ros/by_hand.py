"""A trial by hand: nodes and a person look on, pause it, step it, change it and begin it again."""

from __future__ import annotations

import sys
import time

from .. import _core
from ..scenario import Scenario
from ..trial import Trial
from . import exchange, wire
from .topics import START_S, TRUTH


def fly(scenario: Scenario, is_fast: bool, is_paused: bool, truth: bool) -> int:
    """Until a trial ends that nobody begins again; at most in real time, or with `is_fast` as fast as answers come."""
    link = exchange.link()
    link.by_hand = True
    link.truth = TRUTH if truth else ()
    link.pause(is_paused)
    while True:
        with Trial(scenario) as trial:
            print(f"turbidock-ros: a trial begins; its services are of ROS_DOMAIN_ID {link.domain}", file=sys.stderr, flush=True)
            _steps(trial, scenario["trial.clock.frames_per_second"], is_fast, link)
            if not link.again:
                print(trial.result())
                return 0
        link.again = False


def _tell(frame: _core.Frame, link: exchange.Link) -> None:
    stamp = START_S * 10**9 + round(1e9 * frame.time_s)
    poses = ((frame.true_position, frame.true_quaternion_wxyz), (frame.vehicle_position, frame.vehicle_quaternion_wxyz))
    for topic, pose in zip(TRUTH, poses):
        link.send(topic, wire.placed(topic, stamp, *pose))


def _steps(trial: Trial, frames_per_second: int, is_fast: bool, link: exchange.Link) -> None:
    due = time.monotonic()
    while not trial.ended and not link.again:
        trial.step()
        if link.truth:
            _tell(trial.frame, link)
        for assignment in link.take_settings():
            try:
                trial.assign(assignment)
                print(f"turbidock-ros: {assignment}", file=sys.stderr)
            except _core.ConfigError as error:
                print(f"turbidock-ros: {error}", file=sys.stderr)
        due = max(due + 1 / frames_per_second, time.monotonic() - 1)
        if not is_fast:
            time.sleep(max(0.0, due - time.monotonic()))
