"""Trials from Python: the same digests as in C++, frames that stay, errors that name the thing."""

import csv
import multiprocessing
import os
import pathlib
import pickle
import shutil
import subprocess
import sys
import threading
import traceback

import numpy as np
import pytest

import turbidock
from conftest import QUICK, BlindController, CopiedController, CopiedPid, FixedEstimator, OddController


def test_run_is_the_programs_own(program):
    ours = turbidock.run("sea_night_active", seed=77, settings={**QUICK, "trial.duration_s": 8})
    theirs = program("sea_night_active", trial__seed=77, estimator__pose_source="true_pose", trial__duration_s=8)
    assert ours.digest == theirs["digest"]
    assert ours.outcome == theirs["outcome"]
    assert len(ours.trajectory) == 8 * 30


def test_the_log_has_every_digit(tmp_path):
    ours = turbidock.run("pool_active", seed=3, settings={**QUICK, "trial.duration_s": 1})
    rows = ours.trajectory
    assert rows["frame"].dtype == np.int64 and rows["est_x_m"].dtype == np.float64
    assert rows["stage"][0] == "approach"
    ours.save(str(tmp_path))
    with open(tmp_path / "trajectory.csv", encoding="utf-8") as file:
        names, *lines = csv.reader(file)
    assert list(rows.columns) == names
    for name in ("frame", "time_s", "est_x_m", "true_qz", "sway_v"):
        at = names.index(name)
        assert [float(line[at]) for line in lines] == list(rows[name])
    assert pickle.loads(pickle.dumps(ours)).trajectory.equals(rows)


def test_its_files_are_the_programs_own(tmp_path, program):
    settings = {**QUICK, "trial.duration_s": 0.2}
    program("pool_active", trial__seed=3, out=tmp_path / "theirs", **settings)
    theirs = (tmp_path / "theirs/resolved.yaml").read_text("utf-8")
    turbidock.run("pool_active", seed=3, settings=settings).save(tmp_path / "ours")
    assert (tmp_path / "ours/resolved.yaml").read_text("utf-8") == theirs
    assert "file: vehicle.xml" in theirs
    with turbidock.Trial("pool_active", seed=3, settings=settings) as trial:
        for _ in trial:
            pass
        trial.result().save(tmp_path / "stepped")
    assert (tmp_path / "stepped/resolved.yaml").read_text("utf-8") == theirs


def test_stepped_with_images_it_is_the_same_trial(program):
    theirs = program("pool_active", trial__seed=5, trial__duration_s=1.5)
    trial = turbidock.Trial("pool_active", seed=5, settings={"trial.duration_s": 1.5}, images=True)
    kept, copies = [], []
    for _ in trial:
        left, right = trial.images
        kept.append(left)
        copies.append(left.copy())
        assert left.shape == (480, 640, 3) and right.dtype == np.uint8
    assert trial.result().digest == theirs["digest"]
    assert len(kept) == 45
    for frame, copy in zip(kept, copies):  # nothing has been written into what we kept
        np.testing.assert_array_equal(frame, copy)
    assert len({frame.ctypes.data for frame in kept}) == len(kept)
    assert any((a != b).any() for a, b in zip(kept, kept[1:]))


def centre(image, channel, near, radius):
    """Of the patch of this colour about there, in pixels (u, v)."""
    v, u = np.mgrid[:image.shape[0], :image.shape[1]]
    excess = image[:, :, channel].astype(float) - np.delete(image, channel, axis=2).max(2)
    excess[np.hypot(u - near[0], v - near[1]) > radius] = 0
    weights = np.maximum(excess - 0.3 * excess.max(), 0)
    return np.array([(u * weights).sum(), (v * weights).sum()]) / weights.sum()


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_truth_of_an_image_is_where_it_shows_the_balls(delay):
    trial = turbidock.Trial("pool_active", seed=5, images=True, settings={
        "trial.duration_s": 1.5, "cameras.delay_frames": delay, "start.lateral_m": 0.1})
    trial.push([0, 12, 0])
    off, off_now = [], []
    balls = {ball["name"]: ball["position_m"] for ball in trial.balls}
    shown = [balls["red"], balls["green"]]  # nothing hides a part of these
    for frame in trial:
        assert frame.image_time_s == max(0, frame.frame - delay) / 30
        now = trial.rig.project(shown, frame.true_position, frame.true_quaternion_wxyz)
        for image, places, places_now in zip(trial.images, trial.project(shown), now):
            radius = 3 * trial.rig.fx * 0.02 / frame.true_position_at_image[0]
            seen = [centre(image, channel, place, radius) for channel, place in enumerate(places)]
            off.append(places - seen)
            off_now.append(places_now - seen)
    def rms(of):
        return np.sqrt((np.square(of).sum(-1)).mean())
    speed = np.linalg.norm(frame.velocity_mps)
    assert len(off) == 90 and speed > 0.1
    assert rms(off) < 0.5, rms(off)
    assert delay == 0 or rms(off_now) > delay, rms(off_now)


def test_the_rig_projects_as_its_axes_say():
    rig = turbidock.Trial("pool_active", settings=QUICK).rig
    assert (rig.width, rig.height, rig.cx, rig.cy) == (640, 480, 319.5, 239.5)
    assert rig.baseline_m == pytest.approx(0.12)
    (left, right) = rig.project([1, 0.06, 0.1])  # straight ahead of the left camera
    np.testing.assert_allclose(left, [rig.cx, rig.cy - 0.1 * rig.fy])
    np.testing.assert_allclose(right, left - [0.12 * rig.fx, 0])
    turned = rig.project([[0, 0, 0], [0, 0.2, 0]], [1, 0, 0], [np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)])
    assert turned.shape == (2, 2, 2)  # turned to the left, its left is behind it: nearer
    np.testing.assert_allclose(turned[0, 1], rig.project([0.8, 0, 0])[0], atol=1e-9)
    assert np.isnan(rig.project([-1, 0, 0])).all()


def test_overlays_and_films(tmp_path):
    settings = {"trial.duration_s": 0.4, "cameras.rig.width_px": 320, "cameras.rig.height_px": 240, "start.distance_max_m": 0.9}
    with turbidock.Trial("pool_active", settings=settings, images=True) as trial:
        for _ in range(8):
            trial.step()
        picture, plain = trial.overlay(), np.concatenate(trial.images, axis=1)
        assert picture.shape == (240, 640, 3)
        ring = (picture != plain).any(2)
        v, u = np.nonzero(ring[:, :320])
        for (at_u, at_v), ball in zip(trial.project(estimate=True)[0], trial.balls):
            radius = trial.rig.fx * ball["radius_m"] / trial.frame.estimated_position[0]
            near = np.hypot(u - at_u, v - at_v)
            assert np.count_nonzero(abs(near - radius) < 1.01) > 3 * radius
        film = tmp_path / "film.mp4"
        trial.save_video(film)
        assert trial.ended and film.stat().st_size > 5000
    with pytest.raises(ValueError, match="images=True only"):
        turbidock.Trial("pool_active", settings={**QUICK, "trial.duration_s": 1}).save_video(tmp_path / "none.mp4")
    with turbidock.Trial("pool_active", settings=settings, images=True) as trial:
        with pytest.raises(RuntimeError, match="ffmpeg wrote no .*film.txt"):
            trial.save_video(tmp_path / "film.txt")


def test_images_are_without_a_copy_and_read_only():
    trial = turbidock.Trial("pool_active", settings={"trial.duration_s": 1}, images=True)
    trial.step()
    left, _ = trial.images
    again, _ = trial.images
    assert left.ctypes.data == again.ctypes.data
    with pytest.raises(ValueError, match="read-only"):
        left[0, 0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        trial.frame.true_position[0] = 1


def test_a_frame_stays_what_it_was():
    trial = turbidock.Trial("pool_active", settings={**QUICK, "trial.duration_s": 2})
    trial.step()
    frame = trial.frame
    position, first = frame.true_position, frame.true_position.copy()
    for _ in range(30):
        trial.step()
    np.testing.assert_array_equal(position, first)
    assert (trial.frame.true_position != first).any()


def test_a_python_copy_of_the_published_law_steers_the_same_trial(program):
    theirs = program("paper_sea_night_active", trial__seed=3, estimator__pose_source="true_pose", trial__duration_s=12)
    law = turbidock.Scenario("paper_sea_night_active").control.p_voltage
    ours = turbidock.run(
        "paper_sea_night_active", seed=3, controller=CopiedController,
        settings={**QUICK, "trial.duration_s": 12, "control.copied_controller.surge_v_per_m": law.surge.kp_v_per_m,
                  "control.copied_controller.across_v_per_m": law.sway.kp_v_per_m,
                  "control.copied_controller.yaw_v": law.yaw.kp_v})
    assert ours.digest == theirs["digest"]


def test_a_python_copy_of_a_law_that_asks_for_forces_steers_the_same_trial(program):
    gains = {f"control.pid.{axis}.{key}": value for axis in ("surge", "sway", "heave", "yaw")
             for key, value in (("kp_per_s2", 0.5), ("ki_per_s3", 0), ("kd_per_s", 1.0),
                                ("limit_share", 1))}
    theirs = program("sea_night_active", trial__seed=3, estimator__pose_source="true_pose", trial__duration_s=12,
                     control__use="pid", **{key.replace(".", "__"): value for key, value in {
                         **gains, "control.pid.yaw.aim": 0, "control.pid.setpoint.enabled": "false",
                         "control.pid.pose_filter.enabled": "true"}.items()})
    settings = {**QUICK, "trial.duration_s": 12, "control.copied_pid.pose_filter.enabled": True}
    ours = turbidock.run("sea_night_active", seed=3, controller=CopiedPid, settings=settings)
    assert ours.digest == theirs["digest"]


def test_forces_steer_every_vehicle_and_volts_the_published_one():
    ended = turbidock.run("bluerov2_sea_night", seed=1, controller=CopiedPid,
                          settings={**QUICK, "trial.duration_s": 3})
    assert ended.outcome == "timeout"
    assert ended.trajectory.filter(like="_v").iloc[-1].nunique() > 4  # it steers
    with pytest.raises(turbidock.ConfigError, match="thruster"):
        turbidock.run("bluerov2_sea_night", controller=CopiedController, settings=QUICK)

    class Odd(turbidock.Controller):
        asks_for = "watts"

    with pytest.raises(turbidock.ConfigError, match="watts, must be forces, volts, thrusts or thruster_volts"):
        turbidock.run("pool_active", controller=Odd)


def test_another_python_is_told_so(tmp_path):
    (tmp_path / "turbidock").mkdir()
    for file in pathlib.Path(turbidock.__file__).parent.glob("*.py"):
        shutil.copy(file, tmp_path / "turbidock")
    done = subprocess.run([sys.executable, "-S", "-c", "import turbidock"], cwd=tmp_path, capture_output=True, text=True)
    assert f"{tmp_path}/turbidock is not built for Python {sys.version.split()[0]}: " in done.stderr


def test_scenarios_have_the_keys_and_errors_of_yaml():
    s = turbidock.Scenario("sea_night_active", seed=77, settings={"water.milk_ml_m3": 20})
    assert s["trial.seed"] == 77 and s.water.milk_ml_m3 == 20
    s.water.milk_ml_m3 = 25
    assert s["water.milk_ml_m3"] == 25
    assert turbidock.Scenario.parse(s.to_yaml()).to_yaml() == s.to_yaml()
    with pytest.raises(turbidock.ConfigError, match="did you mean milk_ml_m3"):
        s["water.milk_ml_m4"] = 1
    with pytest.raises(turbidock.ConfigError, match=r"must be in"):
        s["water.milk_ml_m3"] = -1
    assert s["water.milk_ml_m3"] == 25  # nothing has changed
    with pytest.raises(AttributeError, match="unknown key"):
        _ = s.watr
    with pytest.raises(ValueError, match="no bundled scenario"):
        turbidock.Scenario("sea_nigt_active")
    with pytest.raises(turbidock.ConfigError, match="did you mean across_v_per_m"):
        turbidock.Scenario("pool_active", controller=CopiedController,
                           settings={"control.copied_controller.acros_v_per_m": 3})
    with pytest.raises(turbidock.ConfigError, match="must be in"):
        turbidock.Scenario("pool_active", controller=CopiedController, settings={"control.copied_controller.yaw_v": -3})


@pytest.mark.parametrize("does, problem", [
    ("raise", "no such gain"), ("nan", r"four numbers up to 1e6.*, not \[0, 0, nan, 0\]"),
    ("shape", r"not \[0, 0, 0\]")])
def test_a_law_that_fails_is_named(does, problem):
    with pytest.raises(turbidock.PluginError, match=rf"controller odd_controller, Demand(.|\n)*{problem}"):
        turbidock.run("pool_active", controller=OddController, settings={**QUICK, "control.odd_controller.does": does})


@pytest.mark.parametrize("does, problem", [
    ("raise", "no such ball"), ("nan", r"not \[nan, 0, 0\]"), ("write", "read-only")])
def test_an_estimator_that_fails_is_named(does, problem):
    with pytest.raises(turbidock.PluginError, match=rf"estimator fixed_estimator(.|\n)*{problem}"):
        turbidock.run("pool_active", estimator=FixedEstimator,
                      settings={"trial.duration_s": 0.5, "estimator.fixed_estimator.does": does})


@pytest.mark.parametrize("plug_in", [{"controller": OddController}, {"estimator": FixedEstimator}])
def test_ctrl_c_in_a_plug_in_is_a_keyboard_interrupt(plug_in):
    (cls,) = plug_in.values()
    group = "control" if "controller" in plug_in else "estimator"
    settings = {"trial.duration_s": 1, f"{group}.{cls.plugin_name()}.does": "interrupt",
                "estimator.pose_source": "true_pose" if "controller" in plug_in else "cameras"}
    with pytest.raises(KeyboardInterrupt):
        turbidock.run("pool_active", settings=settings, **plug_in)
    with pytest.raises(KeyboardInterrupt):
        for _ in turbidock.Trial("pool_active", settings=settings, **plug_in):
            pass


def test_a_prediction_bridges_the_last_leg():
    blind = {**QUICK, "trial.seed": 1, "trial.duration_s": 60, "estimator.true_pose.nearest_m": 0.45, "procedure.servo_x_m": 0.75,
             "procedure.blind_max_s": 8}

    def reasons(does):
        ended = turbidock.run("sea_night_active", controller=BlindController,
                              settings={**blind, "control.blind_controller.does": does})
        return [change["reason"] for change in ended.transitions]

    assert reasons("predict") != reasons("shrug")
    with pytest.raises(turbidock.PluginError, match=r"blind_controller, Predict(.|\n)*four numbers.*, or None, not"):
        reasons("nan")
    with pytest.raises(turbidock.ConfigError, match="needs a controller that predicts: lqg, not copied_pid"):
        turbidock.run("sea_night_active", controller=CopiedPid, settings=blind)


def test_what_a_plug_in_raises_is_the_cause():
    settings = {**QUICK, "control.odd_controller.does": "raise"}
    with pytest.raises(turbidock.PluginError) as error:
        turbidock.run("pool_active", controller=OddController, settings=settings)
    assert isinstance(error.value.__cause__, KeyError)
    assert error.value.__cause__.args == ("no such gain",)
    assert traceback.extract_tb(error.value.__cause__.__traceback__)[-1].name == "demand"
    with pytest.raises(turbidock.PluginError) as error:  # and not that of an earlier trial
        turbidock.run("pool_active", controller=OddController,
                      settings={**QUICK, "control.odd_controller.does": "shape"})
    assert error.value.__cause__ is None


def test_what_is_no_plug_in_is_refused():
    with pytest.raises(TypeError, match="must be a class made from"):
        turbidock.run("pool_active", controller=dict)


def test_steering_by_hand_is_checked():
    trial = turbidock.Trial("pool_active", settings={**QUICK, "trial.duration_s": 1}, steered="volts")
    for wrong in ([0, 0, 0], [0, 0, 0, float("nan")], "left", None):
        with pytest.raises(ValueError, match="4 numbers, surge, sway, heave, yaw, not") as error:
            trial.step(wrong)
        assert repr(wrong) in str(error.value)
    while not trial.ended:
        trial.step([0, 0.1, 0, 0])
    with pytest.raises(ValueError, match="has ended"):
        trial.step([0, 0, 0, 0])
    with pytest.raises(ValueError, match="steered trial only"):
        turbidock.Trial("pool_active", settings=QUICK).step([0, 0, 0, 0])
    with pytest.raises(turbidock.ConfigError, match="watts, must be forces, volts, thrusts or thruster_volts"):
        turbidock.Trial("pool_active", settings=QUICK, steered="watts")


def test_a_demand_is_given_as_far_as_the_vehicle_can():
    trial = turbidock.Trial("pool_active", settings={**QUICK, "trial.duration_s": 3}, steered=True)
    while not trial.in_control:
        trial.step([0, 0, 0, 0])
    half = trial.authority / 2 * [0, 1, 1, 0]
    trial.step(half)
    np.testing.assert_allclose(trial.given, half, atol=1e-9)
    np.testing.assert_allclose(trial.frame.demand, half)
    trial.step([0, 100, 0, 0])
    assert 0.9 * trial.authority[1] < trial.given[1] < 1.2 * trial.authority[1]


def test_thrusters_that_are_commanded_one_by_one():
    def steered(asks_for):
        return turbidock.Trial("bluerov2_sea_night", seed=1, settings={**QUICK, "trial.duration_s": 3}, steered=asks_for)

    by_axis, volts = steered(True), []
    while not by_axis.ended:
        by_axis.step([3, -2, 1, 0.5])
        volts.append(by_axis.frame.command_v)
    again = steered("thruster_volts")
    for each in volts:
        again.step(each)
    assert again.result().digest == by_axis.result().digest
    trial = steered("thrusts")
    names = trial._hand.vehicle["thrusters"]
    while not trial.in_control:
        trial.step([0] * len(names))
    trial.step([1.5 if name.startswith("upright") else 0 for name in names])
    np.testing.assert_allclose(trial.given, [0, 0, 1.5 * sum(name.startswith("upright") for name in names), 0], atol=1e-9)
    np.testing.assert_array_equal(trial.frame.demand, trial.given)
    trial.step([1e4] * len(names))
    assert (trial.frame.command_v == 4.875).all()  # where the T200's table ends
    with pytest.raises(ValueError, match=f"step.. takes {len(names)} numbers, {names[0]}, "):
        trial.step([0, 0, 0, 0])
    with pytest.raises(turbidock.PluginError, match=f"{names[0]}: thruster volts must be in 0 to 5, neutral 2.5, not -0.1"):
        trial = steered("thruster_volts")
        while True:
            trial.step([-0.1] * len(names))


def test_what_is_left_of_a_finished_trial():
    trial = turbidock.Trial("pool_active", settings={"trial.duration_s": 0.3}, images=True)
    with pytest.raises(ValueError, match="no frame yet"):
        _ = trial.frame
    for frame in trial:
        pass
    left = trial.images[0].copy()
    trial.result()
    assert trial.frame.time_s == frame.time_s
    np.testing.assert_array_equal(trial.images[0], left)
    with pytest.raises(ValueError, match="is finished"):
        trial.push([1, 0, 0])


def test_two_trials_at_a_time_do_not_meet():
    def alone(seed):
        return turbidock.run("pool_active", seed=seed, settings={"trial.duration_s": 0.7}).digest

    trials = [turbidock.Trial("pool_active", seed=seed, settings={"trial.duration_s": 0.7}, images=True)
              for seed in (1, 2)]
    while not trials[0].ended:
        for trial in trials:
            trial.step()
            _ = trial.images
    assert [trial.result().digest for trial in trials] == [alone(1), alone(2)]


def _step(trial, answers):
    try:
        trial.step()
        answers.put("it stepped")
    except RuntimeError as error:
        answers.put(str(error))


def test_a_trial_is_its_threads_and_its_process():
    trial = turbidock.Trial("pool_active", settings={"trial.duration_s": 1})
    trial.step()
    answers = multiprocessing.get_context("fork").Queue()
    process = multiprocessing.get_context("fork").Process(target=_step, args=(trial, answers))
    process.start()
    assert f"belongs to process {os.getpid()}" in answers.get(timeout=60)
    process.join()

    thread = threading.Thread(target=_step, args=(trial, answers))
    thread.start()
    thread.join()
    assert "belongs to another thread" in answers.get(timeout=60)


def _draw(answers):
    trial = turbidock.Trial("pool_active", seed=4, settings={"trial.duration_s": 0.2}, images=True)
    for _ in trial:
        _ = trial.images
    answers.put(trial.result().digest)


def test_a_process_that_is_forked_after_drawing_draws_its_own():
    answers = multiprocessing.get_context("fork").Queue()
    _draw(answers)
    process = multiprocessing.get_context("fork").Process(target=_draw, args=(answers,))
    process.start()
    assert answers.get(timeout=60) == answers.get(timeout=60)
    process.join()


def test_python_runs_while_a_trial_does():
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            done.wait(0.005)

    thread = threading.Thread(target=count)
    thread.start()
    turbidock.run("pool_active", settings={"trial.duration_s": 3})
    done.set()
    thread.join()
    assert counted[0] > 20


def test_progress_is_told_and_may_stop():
    shares = []
    turbidock.run("pool_active", settings={**QUICK, "trial.duration_s": 3},
                  progress=lambda share, words: shares.append(share))
    assert shares == sorted(shares) and len(shares) >= 3

    def stop(share, words):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        turbidock.run("pool_active", settings=QUICK, progress=stop)
