"""Trials in lock step with ROS 2 nodes: what is said and refused, with nodes that the tests play, and a few through DDS.
ros_trials.py has those that take long."""

import json
import os
import re
import subprocess
import sys
import time

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped, WrenchStamped

import turbidock
from ros_command import (EXAMPLES, HERE, P_VOLTAGE, PAPER, built_in, nothing_is_left, plan, processes, ros,  # noqa: F401: fixtures
                         said, wait_until)
from turbidock._program import PROGRAM
from turbidock.ros import by_hand, command, exchange, nodes, plug_ins, topics, wire

QUICK = {"estimator.pose_source": "true_pose", "estimator.true_pose.found_after_s": 0, "trial.duration_s": 1}


def right_answer(topic, message):
    """To what a controller or an estimator is asked."""
    answer = WrenchStamped() if topic == topics.DESIRED else PoseWithCovarianceStamped()
    answer.header.stamp.sec, answer.header.stamp.nanosec = message.header.stamp.sec, message.header.stamp.nanosec
    answer.header.frame_id = "base_link" if topic == topics.DESIRED else "camera_head"
    if topic != topics.DESIRED:
        answer.pose.pose.position.x = answer.pose.pose.orientation.w = 1.0
    return answer


def spoil(what, answer):
    """Makes it one that none may be."""
    stamp = answer.header.stamp
    if what == "old":
        stamp.sec -= 1
    elif what == "future":
        stamp.sec += 1
    elif what == "zero":
        stamp.sec = stamp.nanosec = 0
    elif what == "wall":
        stamp.sec = int(time.time())
    elif what == "frame":
        answer.header.frame_id = "map"
    elif what == "nan":
        (answer.pose.pose.position if hasattr(answer, "pose") else answer.wrench.force).x = float("nan")
    elif what == "nan_unused":
        (answer.pose.covariance.__setitem__(0, float("nan")) if hasattr(answer, "pose")
         else setattr(answer.wrench.torque, "x", float("inf")))
    elif what == "levels":
        answer.wrench.torque.x = answer.wrench.torque.y = 0.1
    elif what == "rounded":
        stamp.nanosec -= 1
    elif what == "huge":
        answer.wrench.force.x = 1e7
    elif what == "length":
        answer.pose.pose.orientation.w = 0.0
    elif what == "unseen":
        answer.pose.covariance[0] = -1.0


class Played:
    """A Wire to a node that answers as `what` says; `sent` has what it was told."""

    what, sent = "right", []

    def __init__(self, domain, arguments):
        self.heard, self.frames = [], 0
        Played.sent = []

    def send(self, topic, message):
        self.sent.append((topic, message))
        if topic not in (topics.DESIRED, topics.IMAGES[1]):
            return
        self.frames += 1
        answer = right_answer(topic, message)
        spoil(self.what, answer)
        if self.what == "unstamped":
            self.heard.append((topics.UNSTAMPED, Twist()))
            self.heard[-1][1].angular.y = 0.1
        elif self.what != "silent" or self.frames < 6:
            self.heard.append((topics.WRENCH if topic == topics.DESIRED else topics.ESTIMATE, answer))

    def spin(self, longest_s):
        time.sleep(0.01)

    def readers(self, topic):
        return 1

    def writers(self, topic):
        if topic == topics.VELOCITY:
            return []
        return ["/odd", "/other"] if self.what == "two" or self.what == "late" and self.frames > 3 else ["/odd"]

    def writer_count(self, topic):
        return len(self.writers(topic))

    def others(self):
        return ["/odd"]

    def mismatches(self):
        return []

    elsewhere = mismatches

    def intruders(self):
        return [(topics.DESIRED, "/odd")] if self.what == "intruder" else []

    def names(self, which):
        return ", ".join(f"/{topic.name}" for topic in which)

    def nothing(self, *_):
        pass

    def settle(self, *_):
        return []

    open = serve = serve_parameters = close = nothing
    greet = settle


@pytest.fixture
def play(monkeypatch):
    """Flies a trial of a second with a node that does this."""
    monkeypatch.setattr(wire, "Wire", Played)
    monkeypatch.setattr(exchange, "_SETTLE_S", 0)

    def fly(what, controller=turbidock.ros.WrenchController, estimator=None, **stack):
        monkeypatch.setattr(Played, "what", what)
        turbidock.ros.use(**{"answer_s": 0.2, "first_answer_s": 0.4, **stack})
        settings = {**QUICK, "trial.duration_s": 0.1, "estimator.pose_source": "cameras"} if estimator else QUICK
        return turbidock.run("pool_active", controller=None if estimator else controller, estimator=estimator,
                             settings=settings)

    yield fly
    turbidock.ros.use()


# ------------------------------------------------------------------------------------------ answers


@pytest.mark.parametrize("role, what, problem", [
    ("controller", "zero", r"Demand at frame \d+: /wrench from /odd: an answer without a stamp: it must be that of the frame, 1\d\.\d{9}"),
    ("controller", "future", r"is of the future; the frame that is waited for has 1\d"),
    ("controller", "wall", "is of the wall clock: give the node use_sim_time"),
    ("controller", "frame", "/wrench from /odd: frame_id 'map', must be base_link$"),
    ("controller", "nan", "/wrench from /odd: wrench.force.x is not finite$"),
    ("controller", "nan_unused", "/wrench from /odd: wrench.torque.x is not finite$"),
    ("controller", "huge", r"/wrench from /odd: surge is 1e\+07, must be in -1e\+06 to 1e\+06$"),
    ("controller", "two", "2 publish it: /odd, /other; one must"),
    ("controller", "late", "2 publish it: /odd, /other; one must"),
    ("controller", "intruder", "/odd also publishes /marker/desired, which the trial does"),
    ("estimator", "nan", "/estimate from /odd: pose.pose.position.x is not finite$"),
    ("estimator", "nan_unused", r"/estimate from /odd: pose.covariance\[0\] is not finite$"),
    ("estimator", "length", "/estimate from /odd: has a quaternion of length 0$"),
    ("estimator", "frame", "/estimate from /odd: frame_id 'map', must be camera_head or left_camera_optical"),
])
def test_an_answer_that_no_answer_may_be_is_named(play, role, what, problem):
    with pytest.raises(turbidock.PluginError, match=problem) as raised:
        play(what, estimator=turbidock.ros.ImageEstimator if role == "estimator" else None)
    assert raised.type is turbidock.PluginError  # no silence


@pytest.mark.parametrize("what, problem", [
    ("silent", r"^no answer on /wrench of stamp 1\d\.\d{9} in 0.2 s from /odd; nodes: /odd$"),
    ("old", r"^no answer on /wrench of stamp 1\d\.\d{9} in 0.4 s from /odd; /wrench had stamp \d+\.\d{9} last; nodes: /odd$"),
])
def test_silence_is_named(play, what, problem):
    with pytest.raises(turbidock.NoAnswer, match=problem):
        play(what)


@pytest.mark.parametrize("launch, problem", [
    ("echo no such package; exit 3", r"/odd: '[^']*' has ended with exit code 3; .*nodes: /odd; the last of their output in LOG"
     r"/\d+-\d+.log:\s*no such package"),
    ("sleep 0.1 &", r"/odd: 'sleep 0.1 &' has ended with exit code 0; it must last as long as its nodes"),
    ("source /dev/null && kill -9 $$", r"/odd: '[^']*' was ended by signal 9; /wrench had"),
])
def test_a_launch_command_that_ended_is_named_with_its_output(play, tmp_path, launch, problem):
    with pytest.raises(turbidock.NoAnswer, match=r"^no answer on /wrench of stamp 1\d\.\d{9} from " +
                       problem.replace("LOG", str(tmp_path))):
        play("old", launch=launch, domain=91, first_answer_s=30, log=f"{tmp_path}/")


def test_without_nodes_it_says_where_to_start_them(play, monkeypatch):
    monkeypatch.setattr(Played, "others", lambda _: [])
    with pytest.raises(turbidock.NoAnswer, match="; nodes: none in ROS_DOMAIN_ID 93; start yours there, or say --launch$"):
        play("silent", domain=93)


@pytest.mark.parametrize("controller, what, problem", [
    (turbidock.ros.WrenchController, "levels", "/wrench: torque.x, torque.y have no effect"),
    (turbidock.ros.TwistController, "unstamped", "/cmd_vel_unstamped: angular.y has no effect"),
])
def test_what_has_no_effect_is_said_once(play, capfd, controller, what, problem):
    play(what, controller)
    assert capfd.readouterr().err.count(problem) == 1
    play("right")
    assert "no effect" not in capfd.readouterr().err


def test_a_stamp_that_went_through_a_floating_point_number_is_that_of_its_frame(play):
    assert play("rounded").outcome == "timeout"


def test_a_velocity_without_a_stamp_counts_for_the_frame_that_is_waited_for(play):
    assert play("unstamped", turbidock.ros.TwistController).outcome == "timeout"


@pytest.mark.parametrize("answer, names, value, problem", [
    ("thrusts", ["sway", "heave", "surge_left", "surge_right"], 0.5, None),
    ("volts", ["sway", "heave", "surge_left", "surge_right"], 3.5, None),
    ("volts", ["sway", "heave", "surge_left", "surge_right"], 0.0, "/volts from /odd: heave is -0.5, must be in 0 to 5$"),
    ("volts", ["sway", "heave", "surge_left", "surge_right"], 5.5, "/volts from /odd: surge_left is 5.5, must be in 0 to 5$"),
    ("thrusts", ["surge", "sway", "heave", "yaw"], 0.5, "/thrusts from /odd: has 4 efforts of surge, sway, heave, yaw; must be of each "
     "of surge_left, surge_right, sway, heave"),
    ("volts", ["sway"], 0.5, "/volts from /odd: has 1 efforts of sway; must be of each of surge_left"),
    ("volts", ["sway", "heave", "sway", "sway"], 0.5, "has 4 efforts of sway, heave, sway, sway; must be"),
    ("thrusts", ["sway", "heave", "surge_left", "surge_right"], float("nan"), r"/thrusts from /odd: effort\[0\] is not finite"),
])
def test_thrusters_are_answered_by_name(play, monkeypatch, answer, names, value, problem):
    efforts = [value - 0.5 * (name == "heave") for name in names]
    monkeypatch.setattr(sys.modules[__name__], "right_answer",
                        lambda _, message: wire.named(topics.THRUSTS, wire.stamp_ns(message), names, effort=efforts))
    monkeypatch.setattr(topics, "WRENCH", topics.ANSWERS[answer][0])
    if problem:
        with pytest.raises(turbidock.PluginError, match=problem):
            play("right", command.CONTROLLERS[answer])
        return
    row = play("right", command.CONTROLLERS[answer]).trajectory.iloc[-1]
    if answer == "thrusts":  # over the dead band of the published curve
        efforts = [2.5 + (effort > 0) * (0.19 + 2.31 * effort / 4.9) for effort in efforts]
    np.testing.assert_allclose([row[f"{name}_v"] for name in names], efforts, atol=1e-12)


def test_an_estimator_may_say_that_it_sees_nothing(play):
    assert play("unseen", estimator=turbidock.ros.ImageEstimator).outcome == "timeout"
    frames = [Played.sent[at:at + 5] for at in range(0, len(Played.sent), 5)]
    assert len(frames) == 3  # at 30 a second
    for frame in frames:
        assert [topic for topic, _ in frame] == [topics.CLOCK, *topics.IMAGES[2:], *topics.IMAGES[:2]]
        assert len({wire.stamp_ns(message) for _, message in frame[1:]}) == 1


def test_an_estimate_in_the_left_camera_is_that_in_the_head():
    estimator = plug_ins.ImageEstimator()
    estimator.rig = turbidock.Rig(640, 480, 500.0, 500.0, 320.0, 240.0, 0.1)
    point = np.array([0.2, -0.1, 1.5])  # right, down, ahead of the left camera
    position, quaternion = estimator._in_head(topics.LEFT, list(point), [1.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(position, [1.5, 0.05 - 0.2, 0.1], atol=1e-15)
    left, _ = estimator.rig.project(position)
    np.testing.assert_allclose(left, [320 + 500 * 0.2 / 1.5, 240 - 500 * 0.1 / 1.5])
    np.testing.assert_allclose(turbidock.frames.rotation(quaternion) @ [0, 0, 1], [1, 0, 0], atol=1e-15)  # its z is ahead


@pytest.mark.parametrize("truth", [False, True])
def test_truth_is_for_who_looks_on(play, truth):
    play("right")  # makes the surroundings
    scenario = turbidock.Scenario("pool_active", settings=QUICK, controller=turbidock.ros.WrenchController)
    by_hand.fly(scenario, is_fast=True, is_paused=False, truth=truth)
    told = {topic: [wire.stamp_ns(message) for sent, message in Played.sent if sent == topic] for topic in topics.TRUTH}
    for stamps in told.values():
        assert len(stamps) == (30 if truth else 0)
        assert not stamps or stamps[-1] == round((topics.START_S + 29 / 30) * 1e9)


# ------------------------------------------------------------------------------------------ surroundings


def test_the_table_has_every_topic():
    for topic in topics.ALL:
        assert f"| `{topic.name}` | {topic.type} | {topic.frame} |" in topics.as_markdown()


@pytest.mark.parametrize("arguments, problem", [
    ("fly", "'fly' must be one of run, batch, gate, view"),
    ("run pool_active", "say what your nodes do"),
    ("batch a.yaml --workers 2 --answer wrench", "--workers 2: nodes that run already are one worker's"),
    ("batch a.yaml --workers=2 --answer wrench --launch x --domain 3", "--domain is for one worker"),
    ("run pool_active --answer wrench --domain 300", "--domain: 300 must be in 0 to 232"),
    ("run pool_active --answer wrench --ros-args -r wrench", "--ros-args: .*Couldn't parse remap rule: '-r wrench'"),
    ("run pool_active --answer wrench --ros-args --launch x", "--ros-args: .*--launch.*; other options stand before it, or after --"),
    ("run pool_active --ros-args -r a:=b -- --answer wrench --domain 300", "--domain: 300 must be in 0 to 232"),
    ("run pool_active --answer wrench --launch=", "--launch: is empty; leave it out where there is none"),
    ("batch a.yaml --answer wrench --nodes-version=", "--nodes-version: is empty"),
    ("run pool_active --answer wrench --set control.use=pid", "--set control.use=pid and --answer wrench: must be one of them"),
    ("run pool_active --estimator --set=estimator.pose_source=true_pose", "--set estimator.pose_source=true_pose and --estimator: must be one"),
    ("run pool_active --answer wrench --answer-within 0", "--answer-within: 0 must be above 0"),
])
def test_a_command_line_that_cannot_be(monkeypatch, arguments, problem):
    monkeypatch.setattr(sys, "argv", ["turbidock-ros", *arguments.split()])
    with pytest.raises(ValueError, match=problem):
        command.main()


def test_a_batch_that_cannot_go_on_says_so_before(capsys):
    for words, says in (([], True), (["--quiet"], False), (["--nodes-version", "1"], False)):
        own, rest = command._parser().parse_known_args(["batch", "a.yaml", "--answer", "wrench", "--launch", "x", *words])
        command._arguments_of("batch", rest, own)
        assert ("without --nodes-version this batch cannot be resumed" in capsys.readouterr().err) == says


@pytest.mark.parametrize("domain", ["abc", "-1", "233", "1.5"])
def test_an_environments_domain_that_is_none_is_refused(monkeypatch, domain):
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    monkeypatch.setattr(sys, "argv", "turbidock-ros run pool_active --answer wrench".split())
    with pytest.raises(ValueError, match=f"ROS_DOMAIN_ID: '{domain}' must be in 0 to 232"):
        command.main()


def test_a_middleware_that_is_not_there_is_refused():
    words = said(ros("run", "pool_active", "--answer", "wrench", environment={"RMW_IMPLEMENTATION": "rmw_none_cpp"}), 2)
    assert re.fullmatch(r".*: RMW_IMPLEMENTATION=rmw_none_cpp: the rclpy of .*python.* cannot be loaded with it\n", words)


def test_a_baseline_that_is_not_there_is_made_by_the_same_program(tmp_path):
    (tmp_path / "gate.yaml").write_text("schema_version: 1\nscenario: pool_active\nseeds: 3\ngate: {baseline: none.yaml}\n")
    words = said(ros("gate", tmp_path / "gate.yaml", "--answer", "wrench", launch="sleep 9"), 2)
    assert "there is no baseline; the gate makes it with --update" in words


def test_a_domain_in_use_is_refused(play):
    with exchange._claim(97), pytest.raises(turbidock.PluginError, match="ROS_DOMAIN_ID 97 is in use by another trial"):
        play("right", launch="sleep 9", domain=97)


def test_a_command_is_ended_with_all_that_it_started():
    mark = f"turbidock-test-{os.getpid()}"
    started = nodes.Nodes("trap '' INT TERM; (sleep 1000 &); sleep 1000; true", "", {**os.environ, "TURBIDOCK_TEST": mark})
    wait_until(lambda: len(processes(mark)) == 4)  # its keeper, the shell and what that started
    assert started.ended() is None
    started.close()
    assert not processes(mark)


def test_types_and_qos_that_do_not_match_are_named(monkeypatch):
    turbidock.ros.use(launch="sleep 60", domain=92)
    link, plug_in = exchange.link(), object()
    link.enter("controller", plug_in, topics.CONTROLLER, topics.ANSWERS["wrench"])
    for name, value in link._environment.items():
        monkeypatch.setenv(name, value)
    context = rclpy.context.Context()
    rclpy.init(context=context, domain_id=92)
    try:
        node = rclpy.node.Node("odd", context=context)
        volatile, best_effort, local = (rclpy.qos.QoSProfile(depth=10) for _ in range(3))
        best_effort.reliability = rclpy.qos.ReliabilityPolicy.BEST_EFFORT
        local.durability = rclpy.qos.DurabilityPolicy.TRANSIENT_LOCAL
        node.create_publisher(WrenchStamped, "wrench", best_effort)
        node.create_subscription(PoseStamped, "marker/pose", print, volatile)
        node.create_publisher(PoseStamped, "marker/desired", volatile)
        node.create_subscription(PoseStamped, "marker/desired", print, local)
        node.create_subscription(PoseStamped, "marker/desired", print, best_effort)  # asks for less: that fits
        node.create_publisher(WrenchStamped, "/mine/wrench", best_effort)
        wait_until(lambda: link._wire.others() == ["/odd"] and len(link._wire.mismatches()) == 3)
        assert sorted(link._wire.mismatches()) == [
            "/odd has /marker/pose as geometry_msgs/PoseStamped, it is geometry_msgs/PoseWithCovarianceStamped",
            "/odd publishes /wrench as best effort, it must be reliable",
            "/odd subscribes /marker/desired as transient local, it must be volatile"]
        node.create_publisher(TwistStamped, "cmd_vel", volatile)
        wait_until(lambda: link._wire.elsewhere() == ["/mine/wrench is another topic than /wrench",
                                                      "/cmd_vel is there, for --answer twist"])
        assert link._wire.intruders() == [(topics.DESIRED, "/odd")]
        assert exchange._is_used(92) and not exchange._is_used(93)
        with pytest.raises(turbidock.PluginError, match="ROS_DOMAIN_ID 92 is in use by other nodes"):
            exchange._given_domain(92, starts_nodes=True)
    finally:
        context.try_shutdown()
        link.leave("controller", plug_in)
        turbidock.ros.use()


@pytest.mark.parametrize("domain, remap", [(94, []), (96, ["--ros-args", "-r", "__ns:=/rov", "-r", "__node:=sim"])])
def test_a_trial_knows_itself_by_whatever_name(domain, remap, monkeypatch):
    turbidock.ros.use(launch="sleep 60", domain=domain, ros_arguments=remap)
    link, plug_in = exchange.link(), object()
    link.enter("controller", plug_in, topics.CONTROLLER, topics.ANSWERS["twist"])
    for name, value in link._environment.items():
        monkeypatch.setenv(name, value)
    context = rclpy.context.Context()
    rclpy.init(context=context, domain_id=domain)
    name, space = ("sim", "/rov") if remap else ("turbidock", "")
    try:
        node = rclpy.node.Node("odd", context=context)
        node.create_publisher(Twist, f"{space}/cmd_vel", 10)
        problem = (f"/odd has {space}/cmd_vel as geometry_msgs/Twist, it is geometry_msgs/TwistStamped; "
                   f"geometry_msgs/Twist is {space}/cmd_vel_unstamped")
        wait_until(lambda: link._wire.others() == ["/odd"] and link._wire.mismatches() == [problem])
        assert link._wire.intruders() == []
        same = rclpy.node.Node(name, namespace=space, context=context)
        same.create_publisher(PoseStamped, f"{space}/marker/desired", 10)
        wait_until(lambda: link._wire.intruders() == [(topics.DESIRED, f"{space}/{name}")])
    finally:
        context.try_shutdown()
        link.leave("controller", plug_in)
        turbidock.ros.use()


# ---------------------------------------------------------------------------------------- through DDS


def test_a_controller_as_a_node_flies_the_trial_of_the_built_in_one(built_in, tmp_path, nothing_is_left):
    done = ros("run", *PAPER, "--json", "--answer", "volts", "--out", tmp_path / "out", launch=P_VOLTAGE,
               environment=nothing_is_left)
    said(done, 0)
    assert json.loads(done.stdout)["digest"] == built_in
    assert (tmp_path / "out/nodes.log").exists()
    said(ros("mcap", tmp_path / "out"), 0)
    assert (tmp_path / "out/trial.mcap").exists()


def test_lqg_as_a_node_that_is_slow_flies_the_trial_of_the_built_in_one(nothing_is_left):
    trial = ["sea_night_active", "--seed", "7", "--set", "estimator.pose_source=true_pose", "--set", "trial.duration_s=8"]
    led = ["--set", "control.ros_wrench.setpoint.enabled=true"]
    done = ros("run", *trial, *led, "--json", "--answer", "wrench", environment=nothing_is_left,
               launch=f"exec {sys.executable} {HERE / 'ros_nodes/lqg.py'} sea_night_active slow")
    said(done, 0)
    ours = turbidock.run("sea_night_active", seed=7,
                         settings={"estimator.pose_source": "true_pose", "trial.duration_s": 8, "control.lqg.setpoint.enabled": True})
    assert json.loads(done.stdout)["digest"] == ours.digest
    assert ours.trajectory["controlled"].sum() > 100


def test_workers_do_not_hear_each_other_and_a_node_that_is_killed_ends_its_trial_alone(tmp_path, nothing_is_left):
    said(ros("batch", plan(tmp_path, 4), "--workers", 2, "--quiet", "--out", tmp_path / "ros.db", "--answer", "volts",
             launch=f"{P_VOLTAGE} die {tmp_path / 'died'}", environment=nothing_is_left), 0)
    theirs = turbidock.read_results(tmp_path / "ros.db")
    ours = turbidock.batch(tmp_path / "plan.yaml", tmp_path / "own.db", workers=1)
    assert sorted(theirs["digest"] == ours["digest"]) == [False, True, True, True]
    assert sorted(theirs["outcome"])[0] == "no_answer" and "crashed" not in list(theirs["outcome"])
    assert len(list((tmp_path / "ros.nodes").iterdir())) == 4
    plain = subprocess.run([PROGRAM, "replay", tmp_path / "ros.db", "0"], capture_output=True, text=True, check=False)
    assert re.fullmatch(r"turbidock: .*: control.use = 'ros_volts', must be one of p_voltage, .* \(turbidock-ros .*\n", said(plain, 2))


def test_the_examples_dock(nothing_is_left):
    nearby = HERE.parents[1] / "assets/gates/nearby_pool.yaml"
    launch = f"{sys.executable} {EXAMPLES / 'controller_node.py'} & {sys.executable} {EXAMPLES / 'estimator_node.py'} & wait"
    done = ros("run", nearby, "--seed", 3, "--answer", "wrench", "--estimator", "--expect", "success", "--json", launch=launch,
               environment=nothing_is_left)
    said(done, 0)
    assert json.loads(done.stdout)["estimator"] == "ros_estimator"
