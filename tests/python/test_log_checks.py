"""Logs that make no sense are refused with the column, both figures, and what would fit; a driver's zeros are no measurement."""

import tracemalloc

import numpy as np
import pandas
import pytest

import turbidock
from turbidock import _core, _rotation
from turbidock.logs import _log, identify
from turbidock.logs.motion import POSITION, QUATERNION, TURN_RATE, VELOCITY, read_motion, write_motion

TIME_S = np.arange(0, 30, 0.05)
PLACE = np.stack([-2 + 0.4 * np.sin(TIME_S), 0.3 * np.cos(0.7 * TIME_S), -1.5 + 0.2 * np.sin(0.5 * TIME_S)], axis=1)
ANGLES = np.stack([0.1 * np.sin(TIME_S), 0.1 * np.cos(1.1 * TIME_S), 1.5 + 0.6 * np.sin(0.6 * TIME_S)], axis=1)
BODY = _rotation.quaternion_of(*ANGLES.T)
WORLD_MPS = np.gradient(PLACE, TIME_S, axis=0)
TURN = _rotation.vector_of(_rotation.product(_rotation.conjugate(BODY[:-1]), BODY[1:])) / 0.05
RATES = np.concatenate([TURN[:1], 0.5 * (TURN[1:] + TURN[:-1]), TURN[-1:]])
SPEEDS = _rotation.rotated(_rotation.conjugate(BODY), WORLD_MPS)
LEVER_M = np.array([0.4, 0.1, -0.2])


@pytest.fixture(scope="module")
def scenario():
    return turbidock.Scenario("pool_active")


def log_of(scenario, speeds=SPEEDS, rates=RATES, **columns):
    commands = {f"{name}_v": np.full(len(TIME_S), 2.5) for name in _core.thrusters(scenario._cpp)}
    table = {"time_s": TIME_S} | commands | dict(zip(POSITION + QUATERNION + VELOCITY + TURN_RATE,
                                                     np.hstack([PLACE, BODY, speeds, rates]).T))
    return _log.Log(table | columns, scenario, "log.csv")


def test_columns_that_agree_pass_however_late_their_clock(scenario):
    for later in (0, 0.4, -1.1):
        speeds = np.stack([np.interp(TIME_S - later, TIME_S, column, np.nan, np.nan) for column in SPEEDS.T], axis=1)
        assert log_of(scenario, speeds, depth_m=-PLACE[:, 2]).notes == []


@pytest.mark.parametrize("speeds, fits", [
    (WORLD_MPS, "they were along the world's axes"), (SPEEDS * [1, -1, -1], "they were along axes ahead, right, down"),
    (SPEEDS + np.cross(RATES, LEVER_M), "they were of a point 0.40, 0.10, -0.20 m from B"),
    (_rotation.rotated(_rotation.conjugate(BODY), WORLD_MPS - [0.2, -0.1, 0]), "through water that moves at 0.20, -0.10, 0.00 m/s")])
def test_velocities_that_contradict_positions_are_refused_with_what_fits(scenario, speeds, fits):
    with pytest.raises(turbidock.ConfigError, match=r"log.csv: surge_mps, .* contradict vehicle_x_m, .* \(rms\)") as error:
        log_of(scenario, speeds)
    words = str(error.value)
    assert fits in words and "\n" not in words
    taken, other = (float(words.split(between)[0].split()[-1]) for between in (" m/s (rms)", " if they"))
    assert other < 0.3 * taken


@pytest.mark.parametrize("rates, fits", [
    (_rotation.rotated(BODY, RATES), "the world's axes"), (RATES * [1, -1, -1], "axes ahead, right, down"),
    (np.degrees(RATES), "B's axes in degrees/s")])
def test_turn_rates_that_contradict_the_attitude_are_refused(scenario, rates, fits):
    with pytest.raises(turbidock.ConfigError, match=f"yaw_rate_rad_s contradict its attitude: .* if they were along {fits}$"):
        log_of(scenario, rates=rates)


def test_a_gyroscopes_bias_is_taken_off_and_said(scenario):
    log = log_of(scenario, rates=RATES + [0.02, 0, -0.03])
    assert log.notes == ["log.csv: the turn rates are biased by 0.0200, 0.0000, -0.0300 rad/s against the attitude; taken off."]
    assert np.allclose(log.sensor("turn_rate").values.mean(axis=0), RATES.mean(axis=0), atol=1e-3)


def test_zeros_are_no_measurement(scenario):
    log = log_of(scenario, speeds=0 * SPEEDS, rates=0 * RATES)
    assert [sensor.kind for sensor in log.sensors] == ["position", "attitude"] and len(log.notes) == 2


@pytest.mark.parametrize("columns, words", [
    ({"time_s": 1e3 * TIME_S}, "time_s has steps of 50: it looks like milliseconds"),
    ({"time_s": 1.764e18 + 1e9 * TIME_S}, r"time_s has steps of 5.*e\+07: it looks like nanoseconds"),
    ({"time_s": TIME_S / 86400}, "time_s has steps of 5.79e-07: it looks like days, must be seconds: multiply by 86400"),
    ({"time_s": TIME_S / 60}, "time_s has steps of 0.000833: it looks like minutes"),
    ({"vehicle_z_m": PLACE[:, 2] + 3}, "vehicle_z_m is 1.55 m .*above the water"),
    ({"depth_m": PLACE[:, 2]}, r"depth_m is -1.45 m \(median\), must be positive"),
    ({"depth_m": -PLACE[:, 2] + 10.3}, "vehicle_z_m and depth_m differ by 10.30 m .*`offset`"),
    ({"depth_m": -PLACE[:, 2] / 10.2}, r"vehicle_z_m and depth_m differ by .*; depth_m agrees multiplied by 10.2 \(bar\): `scale`"),
    ({"depth_m": -PLACE[:, 2], "vehicle_z_m": -PLACE[:, 2]}, "vehicle_z_m grows with depth_m: it points down")])
def test_clocks_and_origins_are_named(scenario, columns, words):
    with pytest.raises(turbidock.ConfigError, match=f"^log.csv: {words}"):
        log_of(scenario, **columns)


def test_a_pose_that_repeats_is_no_measurement(scenario):
    """A tracker that lost its body, a recorder faster than the tracker, and one that stands for ever."""
    at = np.arange(len(TIME_S))
    for held, words in ((np.where((at >= 200) & (at < 240), 199, at), "in 40 of 600 rows, first at 10.00 s"),
                        (at - at % 3, "in 400 of 600 rows, first at 0.05 s")):
        log = log_of(scenario, **dict(zip(POSITION + QUATERNION, np.hstack([PLACE, BODY])[held].T)))
        assert log.notes == [f"log.csv: vehicle_x_m to vehicle_qz repeat the pose before {words}: no measurement, left out."]
        assert np.array_equal(log.sensor("position").values, PLACE[np.unique(held)])
    with pytest.raises(turbidock.ConfigError, match="log.csv: vehicle_x_m to vehicle_qz repeat .* 599 of 600 rows: they stand still"):
        log_of(scenario, **dict(zip(POSITION + QUATERNION, np.hstack([PLACE, BODY])[0 * at].T)))
    turned = log_of(scenario, **dict(zip(QUATERNION, BODY[0 * at].T)), **dict.fromkeys(VELOCITY + TURN_RATE, np.nan * at))
    assert turned.notes == []  # it only does not turn


def test_a_dvl_that_lost_the_bottom_repeats_what_is_no_measurement(scenario):
    at = np.arange(len(TIME_S))
    for lost in (SPEEDS[200], [0, 0, 0], [-32.768] * 3):
        log = log_of(scenario, np.where(((at >= 200) & (at < 240))[:, None], lost, SPEEDS))
        assert log.notes == [f"log.csv: surge_mps to heave_mps repeat the row before in 39 of 600 rows, first at 10.05 s: no measurement, "
                             "left out."]
        assert len(log.sensor("velocity").values) == 561


def test_a_factor_is_named_by_its_unit(scenario):
    for columns, words in (({"speeds": SPEEDS / 0.5144}, r"multiplied by 0.51\d \(knots\)$"),
                           (dict.fromkeys(POSITION, np.nan * TIME_S) | {"depth_m": -PLACE[:, 2] / 0.3048},
                            r"multiplied by 3.2\d \(depth_m in feet\)$")):
        with pytest.raises(turbidock.ConfigError, match=f"log.csv: surge_mps, sway_mps, heave_mps .* if they were {words}"):
            log_of(scenario, **columns)
    with pytest.raises(turbidock.ConfigError, match="velocity has noise of .* m/s and moves at .*: it looks like milli"):
        log_of(scenario, 1000 * SPEEDS)


def test_a_jump_is_a_gap_and_said_and_one_that_comes_back_is_none(scenario):
    """Another solution of a tracker; a second log behind the first."""
    moved = PLACE + [0.5, 0, 0] * (TIME_S > 14.98)[:, None]
    log = log_of(scenario, **dict(zip(POSITION, moved.T)))
    assert log.notes == ["log.csv: the position jumps by 0.50 m at 15.00 s (1 such places; another solution of the tracker, or "
                         "another log? Taken as gaps)"]
    assert [end for _, end in log.stretches()][:1] == pytest.approx([14.95]) and log.stretches()[1][0] == pytest.approx(15.0)
    turned = _rotation.product(BODY, _rotation.quaternion_of(0, 0, 0.4)[None].reshape(1, 4))
    with pytest.raises(turbidock.ConfigError, match=r"log.csv: the attitude jumps by 0.40 rad at 10.00 s \(1 such places; .*: surge_mps"):
        log_of(scenario, **dict(zip(QUATERNION, np.where((TIME_S > 9.98)[:, None], turned, BODY).T)))
    blunder = PLACE + [0.5, 0, 0] * (abs(TIME_S - 15.02) < 0.04)[:, None]
    assert log_of(scenario, **dict(zip(POSITION, blunder.T))).notes == []


def test_wiring_and_poses_that_are_written_otherwise_are_named(scenario):
    """Ten seconds of the vehicle as it is known; its commands and poses as a wrong file of topics has them."""
    from turbidock.logs import _task
    from turbidock.logs._parameters import still

    names = _core.thrusters(scenario._cpp)
    rng = np.random.default_rng(1)
    time_s = np.arange(100) / 10
    commands = {"time_s": time_s} | {f"{name}_v": np.repeat(2.5 + rng.uniform(-2, 2, 5), 20) for name in names}
    begin = np.zeros((1, 13))
    begin[0, 2], begin[0, 3] = -5, 1
    none = np.zeros(1, np.int64)

    def flown(commands):
        states = _core.predict([still(scenario)._cpp], commands, np.zeros(1), [time_s], none, none, begin, 1)[0]
        poses = states[:, :7] + 0.003 * rng.standard_normal((100, 7)) * [1, 1, 1, 0, 1, 1, 1]
        poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
        return poses

    poses = flown(commands)

    def read(order=range(7), signs=1, poses=poses, kind=dict, **changed):
        table = commands | changed | dict(zip(POSITION + QUATERNION, (signs * poses[:, order]).T))
        return _task.Task(kind(table), scenario, "still", 0, 1)

    read()
    assert read(kind=pandas.DataFrame).names == ["log 1"]
    with pytest.raises(turbidock.ConfigError, match=f"log 1: thruster {names[0]} looks dead: "):
        read(poses=flown(commands | {f"{names[0]}_v": np.full(100, 2.5)}))
    first, second = (f"{name}_v" for name in names[:2])
    with pytest.raises(turbidock.ConfigError, match=f"log 1: thruster {names[1]} and {names[0]} look exchanged: "):
        read(**{first: commands[second], second: commands[first]})
    with pytest.raises(turbidock.ConfigError, match=f"log 1: thruster {names[2]} looks reversed: "):
        read(**{f"{names[2]}_v": 5 - commands[f"{names[2]}_v"]})
    for order, signs, words in (([1, 0, 2, 3, 4, 5, 6], 1, "vehicle_x_m and vehicle_y_m look exchanged: "),
                                (range(7), [1, -1, *[1] * 5], "vehicle_y_m looks as if it pointed right: "),
                                (range(7), [1 / 0.3048] * 3 + [1] * 4, "vehicle_x_m to vehicle_z_m look like feet: "),
                                ([0, 1, 2, 4, 5, 6, 3], 1, "vehicle_qw to vehicle_qz look like x, y, z, w"),
                                (range(7), [1, 1, 1, 1, -1, -1, -1], "vehicle_qw to vehicle_qz look like the attitude of W in B: ")):
        with pytest.raises(turbidock.ConfigError, match=f"log 1: {words}"):
            read(order, signs)
    with pytest.raises(turbidock.ConfigError, match="thrust_std a number of at least 0, not 1 and nan"):
        _task.Task(commands, scenario, "still", np.nan, 1)


def test_tables_of_spreadsheets(tmp_path):
    def read(text):
        (tmp_path / "log.csv").write_bytes(text)
        return read_motion(tmp_path / "log.csv")

    assert list(read(b"\xef\xbb\xbftime_s,depth_m\r\n0,1\r\n1,2\r\n\r\n")["depth_m"]) == [1, 2]
    for text, words in ((b"time_s;depth_m\n0;1\n", "has no column time_s, and no commas between columns"),
                        (b"time_s,depth_m,depth_m\n0,1,7\n", "has column depth_m twice"),
                        (b"TIME_S,depth_m\n0,1\n", "has no column time_s; it has TIME_S, depth_m")):
        with pytest.raises(turbidock.ConfigError, match=f"log.csv:1: {words}$"):
            read(text)
    for text, words in ((b'time_s,depth_m\n0,1\n1,"2,5"\n', "3: depth_m is '2,5', must be a number, with a point"),
                        (b"time_s,h_v\n0,2.5\n1,2..5\n", "3: h_v is '2..5', must be a number"),
                        (b"time_s,depth_m\n2026-05-01,1\n", "2: time_s is '2026-05-01', must be a number"),
                        (b"time_s,depth_m\n1.7e9,1\n1.7e9,1\n1.7e9,1\n", "3: .* 1700000000 s; most have .* lost its digits, as float32 does")):
        with pytest.raises(turbidock.ConfigError, match=f"log.csv:{words}$"):
            read(text)
    with pytest.raises(turbidock.ConfigError, match="log.csv: is no CSV in UTF-8: "):
        read("time_s,depth_m\n0,1\n".encode("utf-16"))
    assert np.isnan(read(b"time_s,depth_m,stage\n0,null,search\n1,2,dock\n")["stage"]).all()


def test_a_large_table_takes_little_more_memory_than_its_numbers(tmp_path):
    np.savetxt(tmp_path / "log.csv", np.arange(10_000)[:, None] + np.zeros(20), "%.3f", ",", comments="",
               header=",".join(["time_s", *(f"c{i}" for i in range(19))]))
    tracemalloc.start()
    read_motion(tmp_path / "log.csv")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 4 * 8 * 10_000 * 20


@pytest.mark.parametrize("kind, find, name", [("tether", "tether", "tether.drag"), ("battery", "sag", "thrust.sag")])
def test_a_tether_and_a_battery_that_sags_are_offered_by_name(tmp_path, kind, find, name):
    """Of logs by a simulator that is not ours. Its cable drags along itself as well, which ours does not."""
    import logs_coverage

    truth, table = logs_coverage.logs_of([kind], [600], 40)[0]
    scenario = turbidock.Scenario("pool_active", settings={"vehicle.model": str(logs_coverage.vehicle_files(tmp_path))})
    doubt = identify.fit(table, scenario, workers=2).doubt
    assert f"--find {find}" in doubt and float(doubt.split(f"{name} ")[1].split()[0]) == pytest.approx(
        logs_coverage.true_values(truth)[name], rel=0.3)
    if kind == "battery":
        fit = identify.fit(table, scenario, find=["sag"], workers=2)
        low, high = fit.interval(name)
        assert not fit.doubt and fit.told(name) and low <= truth["sag"] <= high


def test_a_doubt_says_when(tmp_path):
    """Somebody holds the vehicle for three seconds and lets it go."""
    import logs_coverage

    (_, table), = logs_coverage.logs_of(["clean"], [600], 30)
    time_s = table["time_s"]
    table["vehicle_x_m"] = table["vehicle_x_m"] + 0.3 * np.sin(np.pi * np.clip((time_s - 11) / 3, 0, 1))**2
    scenario = turbidock.Scenario("pool_active", settings={"vehicle.model": str(logs_coverage.vehicle_files(tmp_path))})
    begin, end = identify.fit(table, scenario, workers=2).doubt.split(", most from ")[1].split(" s of log 1: ")[0].split(" to ")
    assert float(begin) < 14 and float(end) > 11


def test_thrust_that_sags_is_that_of_weaker_thrusters(scenario):
    """A second of it, about when half is left, and the loss by the log's end in a problem of a log."""
    names = _core.thrusters(scenario._cpp)
    commands = {"time_s": np.arange(70) / 10} | {f"{name}_v": np.full(70, 4.0 if name == names[0] else 2.5) for name in names}
    begin, none = np.eye(1, 13, 3), np.zeros(1, np.int64)
    begin[0, 2] = -5

    def way(sag_per_s, share):
        model = turbidock.Scenario("pool_active", settings={
            "vehicle.thrusters.max_thrust_newton": share * scenario["vehicle"]["thrusters"]["max_thrust_newton"]})
        return _core.predict([model._cpp], commands, np.array([5.0]), [np.array([6.0])], none, none, begin, 1, [sag_per_s])[0][0, 7]

    assert way(0.1, 1) == pytest.approx(way(0, 0.45), rel=0.02) and way(0, 1) > 1.5 * way(0.1, 1)


def test_a_log_is_not_written_over(tmp_path, capsys):
    (tmp_path / "log.csv").write_text("time_s\n0\n1\n")
    for option in ("--out", "--plot"):
        assert identify.main(["fit", str(tmp_path / "log.csv"), "--scenario", "pool_active", option, f"{tmp_path}/./log.csv"]) == 2
        assert capsys.readouterr().err.endswith("log.csv: is the log, which is not written over\n")
    assert identify.main(["plan", "--scenario", "pool_active", "--out", str(tmp_path / "no/such/plan.csv")]) == 0
    write_motion(read_motion(tmp_path / "no/such/plan.csv"), tmp_path / "another/copy.csv")
    assert (tmp_path / "another/copy.csv").read_bytes() == (tmp_path / "no/such/plan.csv").read_bytes()
    assert identify.main(["plan", "--scenario", "pool_active", "--most-thrust", "5", "--out", str(tmp_path / "plan.csv")]) == 2
    assert "an experiment of 60 s at 5 of the thrust" in capsys.readouterr().err


def test_a_vehicle_that_rests_lacks_no_model(tmp_path):
    """It rises; that tells what several are together, which contradicts what is known of each before."""
    import logs_coverage

    truth = logs_coverage.draw("clean", 5)
    times, volts = logs_coverage.commands_of(truth["rng"], 25)
    volts[:] = 2.5
    table = logs_coverage.table_of(truth, times, volts, logs_coverage.fly([truth], times, volts[None], 25)[:, 0])
    scenario = turbidock.Scenario("pool_active", settings={"vehicle.model": str(logs_coverage.vehicle_files(tmp_path))})
    fit = identify.fit(table, scenario, workers=2)
    assert fit.doubt == ""
    assert "told only together with others" in str(fit)
