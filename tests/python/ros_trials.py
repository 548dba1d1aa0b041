"""Trials in lock step with ROS 2 nodes that take long: by hand, `bash .ci/run ros`."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pandas
import pytest

import turbidock
from ros_command import (EXAMPLES, HERE, NODES, P_VOLTAGE, PAPER, ROS, SHORT, built_in,  # noqa: F401: fixtures
                         nothing_is_left, plan, processes, ros, said, wait_until)
from turbidock.ros import topics

# ------------------------------------------------------------------------------------------ what holds


def test_the_digest_is_the_same_on_a_busy_machine(built_in, nothing_is_left):
    load = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(3 * (os.cpu_count() or 1))]
    try:
        done = ros("run", *PAPER, "--json", "--answer", "volts", launch=P_VOLTAGE, environment=nothing_is_left)
    finally:
        for process in load:
            process.kill()
            process.wait()
    said(done, 0)
    assert json.loads(done.stdout)["digest"] == built_in


def test_the_trial_of_python_is_that_of_the_command(built_in):
    turbidock.ros.use(launch=P_VOLTAGE)
    try:
        result = turbidock.run("paper_sea_night_active", seed=3, controller=turbidock.ros.VoltsController,
                               settings={"estimator.pose_source": "true_pose", "trial.duration_s": 4})
    finally:
        turbidock.ros.use()
    assert result.digest == built_in


def test_names_can_be_remapped(built_in):
    names = ["--ros-args", "-r", "marker/pose:=mine/pose", "-r", "volts:=mine/volts"]
    done = ros("run", *PAPER, "--json", "--answer", "volts", *names, launch=" ".join([P_VOLTAGE, *names]))
    said(done, 0)
    assert json.loads(done.stdout)["digest"] == built_in


def test_a_stamp_is_that_of_the_exposure_and_the_clock_that_of_its_arrival(tmp_path):
    said(ros("run", "pool_active", *SHORT, "--set", "cameras.period_frames=2", "--set", "cameras.delay_frames=3", "--set",
             "cameras.drop_probability=0.3", "--out", tmp_path / "out", "--answer", "wrench",
             launch=f"exec {sys.executable} {NODES / 'record.py'} {tmp_path / 'stamps'}"), 0)
    rows = pandas.read_csv(tmp_path / "out/trajectory.csv")
    arrived = rows[rows["image_time_s"].diff() > 0]
    arrived = arrived[arrived["controlled"] == 1]
    stamps = np.loadtxt(tmp_path / "stamps")
    assert 10 < len(stamps) < 50
    np.testing.assert_allclose(stamps - topics.START_S, arrived[["image_time_s", "time_s"]], atol=1e-6)


def test_nodes_may_run_already(built_in):
    theirs = {**os.environ, "ROS_DOMAIN_ID": "95", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    node = subprocess.Popen([sys.executable, NODES / "p_voltage.py"], env=theirs)
    try:
        done = ros("run", *PAPER, "--json", "--answer", "volts", "--domain", 95)
    finally:
        node.send_signal(signal.SIGINT)
        try:
            node.wait(10)
        except subprocess.TimeoutExpired:  # rclpy may hang at its end
            node.kill()
            node.wait()
    said(done, 0)
    assert json.loads(done.stdout)["digest"] == built_in


# ------------------------------------------------------------------------------------------ silence


def test_silence_is_named(nothing_is_left):
    words = said(ros("run", *PAPER, "--answer", "volts", "--answer-within", 1, launch=f"{P_VOLTAGE} silent",
                     environment=nothing_is_left), 4)
    assert re.search(r"no answer on /volts of stamp 1\d\.\d{9} in 1 s from /p_voltage; nodes: /p_voltage", words)


@pytest.mark.parametrize("launch, problem", [
    ("echo no such package; exit 3", "has ended with exit code 3.*\n?.*no such package"),
    ("sleep 1000", "waits for somebody who hears /marker/desired, /marker/desired_axes; nodes: none.*which nobody publishes; nodes: none"),
    ("trap '' INT TERM; sleep 1000", "which nobody publishes"),
])
def test_a_launch_command_that_gives_no_node(launch, problem, nothing_is_left):
    words = said(ros("run", "pool_active", *SHORT, "--answer", "wrench", "--first-answer-within", 2, launch=launch,
                     environment=nothing_is_left), 4)
    assert re.search(problem, words, re.DOTALL), words


# ---------------------------------------------------------------------------------- batches and gates


def test_nodes_that_have_reset_stay_from_trial_to_trial(tmp_path, nothing_is_left):
    said(ros("batch", plan(tmp_path, 3), "--workers", 1, "--quiet", "--out", tmp_path / "ros.db", "--answer", "volts",
             "--reset-service", launch=P_VOLTAGE, environment=nothing_is_left), 0)
    ours = turbidock.batch(tmp_path / "plan.yaml", tmp_path / "own.db", workers=1)
    assert list(turbidock.read_results(tmp_path / "ros.db")["digest"]) == list(ours["digest"])
    assert len(list((tmp_path / "ros.nodes").iterdir())) == 1


def test_a_service_that_nobody_has_is_named(nothing_is_left):
    words = said(ros("run", "pool_active", *SHORT, "--answer", "wrench", "--first-answer-within", 2, "--reset-service",
                     launch="sleep 1000", environment=nothing_is_left), 4)
    assert "no answer on the service reset in 2 s" in words


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
@pytest.mark.parametrize("command", ["run", "batch"])
def test_nothing_is_left_of_what_is_stopped(command, number, tmp_path, nothing_is_left):
    steers_nowhere = f"exec {sys.executable} {NODES / 'record.py'} {tmp_path / 'stamps'}"  # so the trial lasts
    what = {"run": ["pool_active", "--set", "estimator.pose_source=true_pose", "--set", "cameras.delay_frames=3", "--set", "trial.duration_s=3600",
                    "--answer", "wrench", "--launch", steers_nowhere],
            "batch": [plan(tmp_path, 200), "--workers", "2", "--answer", "volts", "--launch", P_VOLTAGE]}[command]
    running = subprocess.Popen([*ROS, command, *what, "--quiet", "--out", tmp_path / "b.db"],
                               env={**os.environ, **nothing_is_left})
    logs = {"run": "b.db/nodes.log", "batch": "b.nodes/*"}[command]  # one for each trial that began
    try:
        wait_until(lambda: len(list(tmp_path.glob(logs))) > (command == "batch") * 3, 60)
        time.sleep(2)
        assert len(processes(nothing_is_left["TURBIDOCK_TEST"])) >= 3  # else they are no longer found
        running.send_signal(number)
        assert running.wait(60) == (-9 if number == signal.SIGKILL else 130)
    finally:
        running.kill()


@pytest.fixture(scope="module")
def gate(tmp_path_factory):
    """An easy one, with the baseline of the built-in controller."""
    file = tmp_path_factory.mktemp("gate") / "gate.yaml"
    nearby = HERE.parents[1] / "assets/gates/nearby_pool.yaml"
    file.write_text(f"""schema_version: 1
description: the pool, from nearby
scenario: {nearby}
set: {{estimator.pose_source: true_pose, trial.duration_s: 20}}
seeds: 12
gate: {{baseline: gate.baseline.yaml, margins: {{success_rate: 0.5}}}}
""")
    turbidock.gate(str(file), workers=2, update=True)
    return file


def controller(*more):
    return " ".join(["exec", sys.executable, str(EXAMPLES / "controller_node.py"), *more])


def test_a_gate_passes_the_example(gate, tmp_path, nothing_is_left):
    said(ros("gate", gate, "--workers", 2, "--quiet", "--out", tmp_path / "judged", "--answer", "wrench", launch=controller(),
             environment=nothing_is_left), 0)
    assert {file.read_text() for file in (tmp_path / "judged/nodes").iterdir()} == {""}


def test_a_gate_fails_the_example_with_a_wrong_sign_and_replays_a_trial(gate, tmp_path, nothing_is_left):
    said(ros("gate", gate, "--workers", 2, "--quiet", "--out", tmp_path / "judged", "--bundles", 1, "--answer", "wrench",
             launch=controller("--ros-args", "-p", "sign:=-1.0"), environment=nothing_is_left), 1)
    assert [folder for folder in (tmp_path / "judged/failures").iterdir() if (folder / "result.json").exists()]
    assert "turbidock-ros replay " in (tmp_path / "judged/summary.json").read_text()


def test_a_baseline_may_be_that_of_the_nodes(gate, tmp_path, nothing_is_left):
    own = tmp_path / "gate.yaml"
    own.write_text(gate.read_text().replace("seeds: 12", "seeds: 3"))
    for code, more in ((0, ["--update"]), (3, ["--out", tmp_path / "judged"])):  # three are too few for a verdict
        said(ros("gate", own, "--workers", 2, "--quiet", "--answer", "wrench", *more, launch=controller(),
                 environment=nothing_is_left), code)
    baseline = (tmp_path / "gate.baseline.yaml").read_text()
    digests = re.findall('outcome: success.*digest: "(.*)"', baseline)
    assert len(digests) == 3
    assert not set(digests) & set(re.findall('digest: "(.*)"', gate.with_name("gate.baseline.yaml").read_text()))


def test_silence_is_no_verdict(gate, nothing_is_left):
    words = said(ros("gate", gate, "--workers", 2, "--quiet", "--answer", "volts", "--answer-within", 1,
                     launch=f"{P_VOLTAGE} silent", environment=nothing_is_left), 4)
    assert "no_answer" in words and "no answer on /volts of stamp" in words


# --------------------------------------------------------------------------------------------- by hand


def test_a_trial_by_hand_is_stepped_changed_and_begun_again(tmp_path, nothing_is_left):
    stamps = tmp_path / "stamps"
    launch = (f"{sys.executable} {NODES / 'record.py'} {stamps} & "
              f"{sys.executable} {NODES / 'hand.py'} {stamps} >> {tmp_path / 'said'} 2>&1; wait")
    done = ros("by-hand", "pool_active", *SHORT, "--set", "estimator.true_pose.found_after_s=0", "--set", "cameras.delay_frames=3", "--fast",
               "--paused", "--answer", "wrench", launch=launch, environment=nothing_is_left)
    words = said(done, 0)
    assert len(re.findall(r"a trial begins; its services are of ROS_DOMAIN_ID [1-9]\d*\n", words)) == 2
    assert "water.milk_ml_m3=20" in words and "cameras.rig.width_px: cannot change while the trial runs" in words
    assert (tmp_path / "said").read_text().split() == ["paused", "stepped", "reset"], words
    assert "timeout" in done.stdout
