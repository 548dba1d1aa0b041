"""From logs to a vehicle: planted parameters found again, what a log cannot tell, other people's dynamics, bad logs."""

import dataclasses
import importlib.util
import pathlib
import shutil

import numpy as np
import pytest

import turbidock
from turbidock import _core, _rotation
from turbidock.logs import _log, _output_error, _task, excitation, identify
from turbidock.logs._output_error import moved, solve
from turbidock.logs.motion import POSITION, QUATERNION, read_motion, write_motion

ROOT = pathlib.Path(__file__).resolve().parents[2]
_spec = importlib.util.spec_from_file_location("identification", ROOT / "assets/measured/identification.py")
logs = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(logs)

HYDRO = "vehicle.hydrodynamics."


@pytest.fixture(scope="module")
def scenario():
    return turbidock.Scenario("pool_active")


@pytest.fixture(scope="module")
def commands(scenario):
    """A minute of an experiment for the published vehicle."""
    planned = identify.plan(scenario, duration_s=60, pool_m=(4, 3, 2), workers=2)
    return logs.at_rate(planned, 10)


@pytest.fixture(scope="module")
def simulated(scenario, commands):
    """A log of a vehicle with parameters planted, and what the fit makes of it."""
    rng = np.random.default_rng(5)
    values = logs.planted(scenario, rng)
    log = logs.log_of(scenario, values, commands, rng)
    return values, log, identify.fit(log, scenario, workers=2)


def test_the_plan_stays_in_the_pool_and_below_its_thrust(scenario, commands):
    quiet = {**commands}
    log = logs.log_of(scenario, {}, quiet, np.random.default_rng(0), 0, 0, 0)
    for axis, room in zip("xyz", (2, 1.5, 1)):
        there = log[f"vehicle_{axis}_m"][np.isfinite(log[f"vehicle_{axis}_m"])]
        assert np.abs(there - there[0]).max() < room + 0.1, axis
    assert commands["time_s"][-1] > 50
    for name in _core.thrusters(scenario._cpp):
        assert 0 <= commands[f"{name}_v"].min() and commands[f"{name}_v"].max() <= 5
        assert np.ptp(commands[f"{name}_v"]) > 1, name
    with pytest.raises(turbidock.ConfigError, match="no block of 10 s stays in a pool"):
        identify.plan(scenario, duration_s=10, pool_m=(1e-6, 1e-6, 1e-6))


def test_a_plan_says_how_far_its_buoyancy_may_carry_it(scenario, commands, tmp_path, capsys):
    """Where it comes to with what pushes it: 13 v + 76 v^2 newtons at v."""
    far_m, newton = excitation.drift(scenario, commands)
    assert newton == pytest.approx(1.96 * 0.01 * 15 * 9.81)
    speed = (-13 + np.sqrt(13**2 + 4 * 76 * newton)) / (2 * 76)
    assert far_m == pytest.approx(speed * commands["time_s"][-1], rel=0.15)
    assert identify.main(["plan", "--duration", "10", "--pool", "4", "3", "0.5", "--scenario", "pool_active",
                          "--out", str(tmp_path / "plan.csv")]) == 0
    assert "it may rise or sink by" in capsys.readouterr().out


def test_a_flight_is_that_of_endless_steps(scenario, commands):
    """Also with commands that change within a step."""
    odd = commands | {"time_s": 0.977 * commands["time_s"]}
    task = _task.Task(logs.log_of(scenario, {}, odd, np.random.default_rng(4)), scenario, "still", 0, 1)
    parts, z = task.parts(0), np.zeros(len(task.parameters))
    flights = [(0, i, part.state) for i, part in enumerate(parts)]
    flown = task.problem.fly(parts, z, flights, [z])
    far = {}
    for ticks in (256, 16):
        model = task.problem._model(task.logs[0], z, ticks)
        plain = _core.predict([model], task.logs[0].commands, np.array([part.window.begin_s for part in parts]),
                              [task.problem.times(sensor, part.window.rows["position"], z)
                               for part in parts for sensor in task.logs[0].sensors if sensor.kind == "position"],
                              np.zeros(len(parts), np.int64), np.arange(len(parts)), np.array([part.state for part in parts]), 1)
        off = [one["position"][:, :3] - other[:, :3] for one, other in zip(flown, plain)]
        far[ticks] = max(np.abs(each).max() for each in off)
    assert far[256] < 1e-4 < 5e-4 < far[16]
    # So no log that a plant of 16 steps flew is nearer than this.
    task.problem.old, task.problem.coarse = task.problem.slopes(parts, z, len(z), state=False), True
    floor = _output_error.step_error(task.problem, parts, z, task.problem.linear(parts, z, task.problem.old))
    assert 0.9 < floor["position"] / np.sqrt(np.mean(np.concatenate(off) ** 2)) < 1.1 and 0 < floor["attitude"] < 1e-3


@pytest.mark.parametrize("late", ["all", "one"])
def test_a_dead_time_is_no_number_of_steps(scenario, commands, late):
    """Poses that are 37 ms late are those of thrusters that are, and one that is late has its commands late."""
    lateness_s, short = 0.037, {name: column[:200] for name, column in commands.items()}
    flown = {name: column for name, column in short.items()}
    if late == "one":
        flown["time_s"] = np.union1d(short["time_s"], short["time_s"] + lateness_s)
        for name in short.keys() - {"time_s"}:
            since = flown["time_s"] - lateness_s * (name == "surge_left_v")
            flown[name] = np.append(2.5, short[name])[np.searchsorted(short["time_s"], since + 1e-9, side="right")]
    log = logs.log_of(scenario, {}, flown, np.random.default_rng(7), lateness_s if late == "all" else 0, 5e-4, 5e-4)
    told = np.isin(log["time_s"], short["time_s"])
    for name in short.keys() - {"time_s"}:
        log[name] = np.full(len(told), np.nan)
        log[name][told] = short[name]
    kind = {"thrusters.dead_time_s": lateness_s} if late == "all" else {
        "thrusters.individual": [{"thruster": "surge_left", "dead_time_s": lateness_s}]}
    vehicle = turbidock.Scenario("pool_active", settings={f"vehicle.{key}": value for key, value in kind.items()})
    task = _task.Task(log, vehicle, "still", 0, 1)
    parts, z = task.parts(0), np.zeros(len(task.parameters))
    task.problem.held[:] = True
    task.problem.held[at := task.problem.index["delay.pose"]] = False
    z, _, linear = solve(task.problem, parts, z)
    assert abs(task.parameters[at].value(z[at])) < 5e-4
    assert np.sqrt(np.mean([np.mean(one.raw["position"]**2) for one in linear])) < 5.2e-4


def test_planted_parameters_are_found_again(simulated):
    values, _, fit = simulated
    values = {**values, "delay.pose": logs.OFFSET_S}
    told = [name for name in values if fit.told(name)]
    assert {"added_mass.surge", "added_mass.sway", "added_mass.heave", "added_mass.yaw", "trim.buoyancy", "delay.pose",
            "quadratic_damping.surge", "quadratic_damping.sway"} <= set(told)
    # 95 % of thirty, whether told or not: how much heave's quadratic damping is told hangs on the vehicle drawn
    outside = [name for name in values if not fit.interval(name)[0] <= values[name] <= fit.interval(name)[1]]
    assert len(outside) <= 4, outside
    assert fit.value("added_mass.surge") == pytest.approx(values["added_mass.surge"], rel=0.15)
    assert fit.validation["median_m"] < 0.02 < fit.validation["before_m"]
    assert fit.noise["position"] == pytest.approx(logs.NOISE_M, rel=0.1)
    assert fit.noise["attitude"] == pytest.approx(logs.NOISE_RAD, rel=0.1)
    wider = dataclasses.replace(fit, information=dataclasses.replace(fit.information, wider=2 * fit.information.wider))
    assert np.ptp(wider.interval("delay.pose")) == pytest.approx(2 * np.ptp(fit.interval("delay.pose")))


def test_a_plot_compares_what_was_measured(simulated):
    _, log, fit = simulated
    angles = np.random.default_rng(1).uniform(-1.5, 1.5, (20, 3))
    assert np.allclose(_rotation.angles_of(_rotation.quaternion_of(*angles.T)), angles)
    for kind, (measured, predicted, _) in fit.compared.items():
        rate = np.sqrt(np.mean((predicted - measured) ** 2)) / fit.noise[kind]
        assert 0.9 < rate < 1.1 and np.ptp(measured) > 50 * fit.noise[kind], kind
    assert np.isin(fit.compared["position"][0][:, 0], log["vehicle_x_m"]).all()
    assert len(fit.plot().axes) == 2 * len(fit.compared)


def test_outliers_and_gaps_change_little(scenario, simulated):
    values, log, fit = simulated
    rough = {name: np.array(column) for name, column in log.items()}
    rng = np.random.default_rng(1)
    poses = np.flatnonzero(np.isfinite(rough["vehicle_x_m"]))
    rough["vehicle_x_m"][rng.choice(poses, len(poses) // 50, replace=False)] += 0.5
    gone = (rough["time_s"] > 20) & (rough["time_s"] < 22)
    for name in rough:
        if name.startswith("vehicle_"):
            rough[name][gone] = np.nan
    again = identify.fit(rough, scenario, workers=2)
    assert 0.005 < again.outliers < 0.03
    for name in ("added_mass.surge", "quadratic_damping.sway", "trim.buoyancy"):
        low, high = fit.interval(name)
        assert abs(again.value(name) - fit.value(name)) < high - low, name


@pytest.mark.parametrize("off", [[1, -1, 0.5, 0, 0, 0, 0.3, 0, 0, 0, 0, 0],
                                 [0, 0, 0, 0.5, 1.5, 1, 1, 1, 0, 2, 3, 5]])  # so far that a whole step leads astray
def test_a_window_with_a_bad_first_state_is_repaired_not_rejected(scenario, commands, off):
    short = {name: column[:150] for name, column in commands.items()}
    task = _task.Task(logs.log_of(scenario, {}, short, np.random.default_rng(7)), scenario, "still", 0, 1)
    parts, z = task.parts(0), np.zeros(len(task.parameters))
    z[task.problem.index["delay.pose"]] = logs.OFFSET_S / 0.1
    task.problem.reject = True  # as once the noise is known
    parts[1].state = moved(parts[1].state, np.array(off, float))
    _, _, linear = solve(task.problem, parts, z, with_z=False)
    for one in linear:
        assert min(weight.mean() for weight in one.weight.values()) > 0.95
        assert np.sqrt((one.raw["position"] ** 2).mean()) < 1.2 * logs.NOISE_M


def test_water_that_was_measured_stays_where_a_current_is_tried(scenario, commands):
    """Every model reads it, so that of 480 Hz is averaged as measurements are."""
    log = logs.log_of(scenario, {}, {name: column[:150] for name, column in commands.items()}, np.random.default_rng(7))
    time_s = np.union1d(log["time_s"], np.arange(0, log["time_s"][-1], 1 / 480))
    at, table = np.searchsorted(time_s, log["time_s"]), {"time_s": time_s}
    for name in log.keys() - {"time_s"}:
        table[name] = np.full(len(time_s), np.nan)
        table[name][at] = log[name]
    water = {f"water_{axis}_mps": 0.01 * np.sin(time_s + k) for k, axis in enumerate("xyz")}
    task = _task.Task(table | water, scenario, "steady", 0, 1)
    rows = np.loadtxt(task.problem.scenarios[0]["sea.current.file"], delimiter=",", skiprows=1)
    assert len(rows) == pytest.approx(20 * time_s[-1], abs=2)
    assert np.allclose(rows[:, 1:], 0.01 * np.sin(rows[:, :1] + [0, 1, 2]), atol=1e-5)
    assert "water.x" in task.problem.index
    slopes, = task.problem.slopes(task.parts(0)[:1], np.ones(len(task.parameters)))
    assert not slopes["position"][0][:, task.problem.index["water.x"]].any() and slopes["position"][0].any()


def test_a_prediction_that_leaves_all_bounds_is_one_line(scenario, commands):
    short = {name: column[:150] for name, column in commands.items()}
    task = _task.Task(logs.log_of(scenario, {}, short, np.random.default_rng(7)), scenario, "still", 0, 1)
    parts = task.parts(0)
    parts[1].state = np.where(np.arange(13) == 7, 1e200, parts[1].state)
    with pytest.raises(turbidock.ConfigError, match=r"log 1: a prediction from [0-9.]+ s on leaves all bounds"):
        solve(task.problem, parts, np.zeros(len(task.parameters)))


def test_a_clock_that_is_far_off_is_found(scenario, commands):
    short = {name: column[:300] for name, column in commands.items()}
    rng = np.random.default_rng(6)
    values = logs.planted(scenario, rng)
    for offset in (0.05, 1.25, -0.8):
        task = _task.Task(logs.log_of(scenario, values, short, rng, offset_s=offset), scenario, "still", 0, 1)
        found = {sensor.offset_s for sensor in task.logs[0].sensors}
        assert len(found) == 1
        assert abs(found.pop() - offset) < 0.15, offset  # the rest is delay.pose


def test_measurements_beyond_twenty_a_second_are_averaged(scenario, commands):
    """At 480 Hz, with quaternions that change their sign and a gap; at 10 Hz all are kept."""
    rng = np.random.default_rng(3)
    time_s = np.delete(np.arange(9600) / 480, np.arange(2400, 4800))
    place = np.stack([0.3 * np.sin(time_s), 0.2 * np.cos(time_s), -1.5 + 0 * time_s], axis=1)
    body = _rotation.turned(np.stack([0 * time_s, 0 * time_s, 0.5 * np.sin(time_s)], axis=1))
    noisy = np.concatenate([place + 0.005 * rng.standard_normal(place.shape),
                            body * rng.choice([-1, 1], (len(body), 1))], axis=1)
    thrusters = {f"{name}_v": np.full(len(time_s), 2.5) for name in _core.thrusters(scenario._cpp)}
    log = _log.Log({"time_s": time_s} | thrusters | dict(zip(POSITION + QUATERNION, noisy.T)), scenario)
    position, attitude = log.sensor("position"), log.sensor("attitude")
    assert len(position.time_s) == 300 and len(log.stretches()) == 2
    there = np.stack([0.3 * np.sin(position.time_s), 0.2 * np.cos(position.time_s), np.full(300, -1.5)], axis=1)
    assert np.std(position.values - there) == pytest.approx(0.005 / np.sqrt(24), rel=0.1)
    assert position.std == pytest.approx(0.005 / np.sqrt(24), rel=0.3)
    yaw = 0.5 * np.sin(attitude.time_s)
    assert np.allclose(_rotation.angles_of(attitude.values)[:, 2], yaw, atol=3e-4)
    slow = logs.log_of(scenario, {}, commands, rng)
    kept = np.isfinite(slow["vehicle_x_m"]).sum()
    assert len(_log.Log(slow, scenario).sensor("position").time_s) == kept


def test_windows_disagree_where_they_ask_for_other_parameters():
    """Ten of white noise for three parameters: a standard normal by its test's mean, deviation and skew, less than 3.1 where the
    noise hangs together over rows, many where each has parameters of its own."""
    rng = np.random.default_rng(11)

    def windows(apart, rows):
        noise = rng.standard_normal((10, 300 // rows, 1)).repeat(rows, axis=1)
        by_z = rng.standard_normal((10, 300 // rows, 3)).repeat(rows, axis=1)
        state, nowhere = np.zeros(13), np.zeros((300, 12))
        parts = [_output_error.Part(None, None, state + (np.arange(13) == 3)) for _ in range(10)]
        off = noise[..., 0] + np.einsum("wnk,wk->wn", by_z, apart * rng.standard_normal((10, 3)))
        step = -np.linalg.lstsq(by_z.reshape(-1, 3), off.ravel(), rcond=None)[0]
        off = off + by_z @ step
        linear = [_output_error.Linear(r, z, nowhere, {"position": r[:, None]}, {"position": np.ones(300)}, 0)
                  for r, z in zip(off, by_z)]
        return _output_error.disagreement(linear, _output_error.reduce(linear, parts, [part.state for part in parts]))

    white = np.array([windows(0, 1) for _ in range(300)])
    assert abs(white.mean()) < 0.25 and 0.85 < white.std() < 1.15
    assert abs(np.mean(white**3) / np.mean(white**2) ** 1.5) < 0.3
    assert np.mean([windows(0, 10) for _ in range(20)]) < 1
    assert windows(0.3, 1) > 20


def test_intervals_are_those_of_noise_that_hangs_together():
    """Ten windows of white noise and of a swell of 25 rows, with a state of two numbers each; parameters that are told at the swell's
    period and far from it. The deviations of 200 estimates are those that are said, where white noise alone would say much less."""
    rng = np.random.default_rng(5)
    t = np.arange(65)
    by_state = np.zeros((65, 12))
    by_state[:, 3], by_state[:, 6] = 1, t / 65
    by_z = [np.stack([np.cos(2 * np.pi * t / period + rng.uniform(0, 6)) for period in (27, 22, 6, 3)], axis=1) for _ in range(10)]
    parts = [_output_error.Part(None, None, np.zeros(13) + (np.arange(13) == 3)) for _ in range(10)]
    guesses = [part.state for part in parts]

    def windows(residuals):
        return [_output_error.Linear(r, z, by_state, {"position": r[:, None]}, {"position": np.ones(65)}, 0)
                for r, z in zip(residuals, by_z)]

    found, said = [], []
    for _ in range(200):
        noise = rng.standard_normal((10, 65)) + 2 * np.sin(2 * np.pi * t / 25 + rng.uniform(0, 2 * np.pi, (10, 1)))
        begun = _output_error.reduce(windows(noise), parts, guesses)
        found.append(-np.linalg.solve(begun.information + np.eye(4), begun.gradient))
        left = [r + z @ found[-1] - by_state @ np.linalg.solve(inner, force + cross @ found[-1])
                for r, z, (inner, cross, force) in zip(noise, by_z, begun.windows)]
        linear = windows(left)
        said.append(np.diag(_output_error.covariance_of(linear, _output_error.reduce(linear, parts, guesses))[0]))
    share = np.sqrt(np.mean(said, axis=0)) / np.std(found, axis=0)
    white = np.sqrt(np.diag(np.linalg.inv(begun.information + np.eye(4)))) / np.std(found, axis=0)
    assert (abs(share - 1) < 0.25).all() and (white[:2] < 0.25).all() and (abs(white[2:] - 1) < 0.25).all(), (share, white)


def test_intervals_are_wider_where_windows_differ_more_than_noise():
    """Where each window has parameters of its own, as of a model that is wrong, what is left looks white all the same. Where it is
    noise alone, also with most of what tells a parameter in one window, they hardly change."""
    rng = np.random.default_rng(6)
    by_z = rng.standard_normal((10, 300, 3))
    by_z[0, :, 2] *= 5
    parts = [_output_error.Part(None, None, np.zeros(13) + (np.arange(13) == 3)) for _ in by_z]

    def widths(apart):
        found, said, white = [], [], []
        for _ in range(100):
            noise = rng.standard_normal((10, 300)) + np.einsum("wnk,wk->wn", by_z, apart * rng.standard_normal((10, 3)))
            found.append(-np.linalg.lstsq(by_z.reshape(-1, 3), noise.ravel(), rcond=None)[0])
            linear = [_output_error.Linear(r, z, np.zeros((300, 12)), {"position": r[:, None]}, {"position": np.ones(300)}, 0)
                      for r, z in zip(noise + by_z @ found[-1], by_z)]
            covariance, wider = _output_error.covariance_of(linear, _output_error.reduce(linear, parts, [part.state for part in parts]))
            white.append(np.diag(covariance))
            said.append(white[-1] * wider**2)
        return [np.sqrt(np.mean(each, axis=0)) / np.std(found, axis=0) for each in (said, white)]

    apart, quiet = widths(0.3), widths(0)
    assert (abs(apart[0][:2] - 1) < 0.25).all() and (apart[1][:2] < 0.5).all(), apart
    assert ((quiet[0] > 0.85) & (quiet[0] < 1.35)).all(), quiet


def test_a_lack_is_offered_where_it_is_beyond_its_own_interval(scenario, commands, monkeypatch):
    log = logs.log_of(scenario, {}, {name: column[:250] for name, column in commands.items()}, np.random.default_rng(7))
    q = np.stack([log[f"vehicle_q{axis}"] for axis in "wxyz"], axis=1)
    for axis, way in zip("xyz", _rotation.rotated(q, np.tile([0.15, 0, 0], (len(q), 1))).T):
        log[f"vehicle_{axis}_m"] = log[f"vehicle_{axis}_m"] + way
    task = _task.Task(log, scenario, "still", 0, 1)
    parts = task.parts(0)
    z, reduced, linear = solve(task.problem, parts, np.zeros(len(task.parameters)), most=4)
    task.problem.std = _output_error.noise(task.problem, linear, parts)
    apart = _output_error.disagreement(linear, reduced)
    offer = identify._offer(task, parts, z, apart)
    assert "with poses of another point than B" in offer and float(offer.split("lever.ahead ")[1].split()[0]) == pytest.approx(0.15, abs=0.02)
    monkeypatch.setattr(identify, "covariance_of", lambda _, reduced: (np.eye(len(reduced.information)), np.ones(len(reduced.gradient))))
    assert identify._offer(task, parts, z, apart) == identify.NO_OFFER


def test_the_vehicles_file_is_what_was_found(simulated, tmp_path):
    _, _, fit = simulated
    shutil.copy(pathlib.Path(_core.data_dir()) / "models/vehicle.xml", tmp_path / "mine.xml")
    fit.save(tmp_path / "mine.yaml")
    text = (tmp_path / "mine.yaml").read_text()
    assert "[identified] turbidock-identify, log 1, 20" in text
    assert "not told, kept" in text and all(text.count(f"# {name}:") == 1 for name in ("lag", "lag_power", "centre_ahead"))
    kept = fit.table()[~fit.table()["told"]]
    assert len(kept) and (kept["value"] == kept["before"]).all() and not fit.doubt
    mine = turbidock.Scenario("pool_active", settings={"vehicle.model": str(tmp_path / "mine.xml")})
    for group in ("vehicle", "control.known_vehicle"):  # the laws' model follows
        assert mine[f"{group}.hydrodynamics.added_mass_diagonal"][0] == pytest.approx(fit.value("added_mass.surge"))
        assert mine[f"{group}.thrusters.lag_s"] == pytest.approx(fit.value("thrust.lag"))
        assert mine[f"{group}.thrusters.dead_time_s"] == pytest.approx(fit.value("delay.pose")) == pytest.approx(0.05, abs=0.03)
    assert mine["vehicle.rigid_body.mass_kg"] == 15


def test_a_poor_log_is_said_to_be_poor(scenario):
    hover = logs.log_of(scenario, {}, logs.hover(scenario, 30), np.random.default_rng(2))
    told = identify.inform(hover, scenario, workers=2)
    dark = {p.name for p, known in zip(told.parameters, told.told()) if not known}
    assert {f"{group}.{axis}" for group in ("added_mass", "linear_damping", "quadratic_damping")
            for axis in ("surge", "sway", "yaw")} <= dark
    assert any(line.startswith("sway: ") for line in told.advice())
    assert "not told" in str(told)
    # A vehicle whose turning is damped so much that nobody sees how fast it turned before a window: noise is no information.
    rng = np.random.default_rng([3, 49])
    damped = {name: value for name, value in logs.planted(scenario, rng).items() if not name.startswith("trim.")}
    told = identify.inform(logs.log_of(scenario, damped, logs.one_axis(scenario, 60), rng), scenario, workers=2)
    index = [parameter.name for parameter in told.parameters].index("linear_damping.yaw")
    assert told.from_noise[index] > 0.2 and not told.told()[index]
    assert max(share for share, known in zip(told.from_noise, told.told()) if known) < 0.02
    surge = logs.log_of(scenario, {}, logs.one_axis(scenario, 30), np.random.default_rng(2))
    told = identify.inform(surge, scenario, workers=2)
    dark = {p.name for p, known in zip(told.parameters, told.told()) if not known}
    assert "added_mass.surge" not in dark
    assert {"added_mass.sway", "added_mass.yaw", "quadratic_damping.sway", "linear_damping.yaw"} <= dark
    assert any({"linear_damping.surge", "quadratic_damping.surge"} <= {a, b} for a, b, _ in told.pairs()) or told.pairs()


def test_bad_logs_are_refused_in_a_line(scenario, commands, tmp_path):
    log = logs.log_of(scenario, {}, commands, np.random.default_rng(3))

    def refusal(**changes):
        table = {name: column for name, column in {**log, **changes}.items() if column is not None}
        with pytest.raises(turbidock.ConfigError) as error:
            identify.inform(table, scenario)
        assert "\n" not in str(error.value)
        return str(error.value)

    volts = {f"{name}_v": log[f"{name}_v"] for name in _core.thrusters(scenario._cpp)}
    assert "it looks like a pulse width" in refusal(**{name: 1500 + 160 * (v - 2.5) for name, v in volts.items()})
    assert "has no commands" in refusal(**dict.fromkeys(volts), thruster1_v=log["sway_v"])
    assert "the clock runs backwards" in refusal(time_s=log["time_s"][::-1].copy())
    assert "has no attitude" in refusal(**{f"vehicle_q{axis}": None for axis in "wxyz"})
    assert "but not vehicle_z_m" in refusal(vehicle_z_m=None)
    empty = np.full(len(log["time_s"]), np.nan)
    assert "has neither positions" in refusal(**{f"vehicle_{axis}_m": empty for axis in "xyz"})
    posed = np.isfinite(log["vehicle_x_m"])
    assert "position has noise of 4" in (words := refusal(**{f"vehicle_{a}_m": 1000 * log[f"vehicle_{a}_m"] for a in "xyz"}))
    assert "it looks like milli- or centimetres" in words
    assert "no unit quaternion: of length 0" in refusal(**{f"vehicle_q{axis}": np.where(posed, 0, np.nan) for axis in "wxyz"})
    for pitch in (0.5, 2):  # degrees
        angles = {name: np.where(posed, degrees, np.nan) for name, degrees in (("roll_rad", 1), ("pitch_rad", pitch), ("yaw_rad", 90))}
        assert "look like degrees" in refusal(**dict.fromkeys(f"vehicle_q{axis}" for axis in "wxyz"), **angles)
    rare = np.where(np.arange(len(posed)) % 200 < 2, 1, np.nan)
    assert "measurements of position" in refusal(**{f"vehicle_{a}_m": rare * log[f"vehicle_{a}_m"] for a in "xyz"})
    apart = np.where(log["time_s"] % 3 > 1, np.nan, 1)
    assert "no stretch of 5 s without a gap" in refusal(**{name: apart * log[name] for name in log if name.startswith("vehicle_")})
    write_motion(log, tmp_path / "log.csv")
    again = read_motion(tmp_path / "log.csv")
    assert all(np.array_equal(again[name], log[name], equal_nan=True) for name in log)
    (tmp_path / "half.csv").write_text("time_s,sway_v\n0,2.5\n1\n")
    with pytest.raises(turbidock.ConfigError, match="half.csv:3: has 1 values, the header 2"):
        read_motion(tmp_path / "half.csv")


def test_the_command_line(scenario, commands, tmp_path, capsys):
    log = logs.log_of(scenario, {}, commands, np.random.default_rng(4))
    short = {name: column[log["time_s"] < 25] for name, column in log.items()}
    write_motion(short, tmp_path / "log.csv")
    assert identify.main(["inform", str(tmp_path / "log.csv"), "--scenario", "pool_active"]) == 0
    assert "windows of" in capsys.readouterr().out
    assert identify.main(["inform", str(tmp_path / "none.csv"), "--scenario", "pool_active"]) == 2
    assert "none.csv: No such file" in capsys.readouterr().err
    for words, said in ((["fit", str(tmp_path / "log.csv"), "--out", str(tmp_path / "log.csv/mine.yaml")], "log.csv"),
                        (["fit", str(tmp_path / "log.csv"), "--workers", "0"], "workers must be at least 1"),
                        (["plan", "--duration", "5", "--out", str(tmp_path / "plan.csv")], "an experiment of 5 s")):
        assert identify.main([*words, "--scenario", "pool_active"]) == 2
        assert said in (told := capsys.readouterr()).err and told.err.count("\n") == 1 and not told.out
    assert [file.name for file in tmp_path.iterdir()] == ["log.csv"]


def fossen(values, commands, times):
    """Fossen's equations in six degrees of freedom for the published vehicle (Fossen 2011, eqs. 6.1 ff.), its thrusters with
    their lag, by SciPy: nothing of it is turbidock's. B x ahead, y left, z up, about B's origin, which is the centre of mass."""
    from scipy.integrate import solve_ivp

    mass, inertia, weight = 15.0, np.array([0.18, 0.25, 0.23]), 15.0 * 9.81
    added = np.array([values[f"added_mass.{axis}"] for axis in logs.AXES])
    linear = np.array([values[f"linear_damping.{axis}"] for axis in logs.AXES])
    quadratic = np.array([values[f"quadratic_damping.{axis}"] for axis in logs.AXES])
    total = np.concatenate([np.full(3, mass), inertia]) + added
    buoyancy = weight + values["trim.buoyancy"]
    centre = np.array([values.get(f"trim.centre_{name}", 0.0) for name in ("ahead", "left", "above")])
    places = np.array([[-0.13, 0.10, 0], [-0.13, -0.10, 0], [0, 0, 0], [0, 0, 0]])
    axes = np.array([[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    names = ("surge_left", "surge_right", "sway", "heave")
    volts = np.stack([commands[f"{name}_v"] for name in names], axis=1)

    def thrust(v):
        beyond = np.maximum(np.abs(v - 2.5) - 0.19, 0) / (2.5 - 0.19)
        return np.sign(v - 2.5) * beyond * 4.9 * np.where(v < 2.5, 0.9, 1)

    def rate(t, x, wanted):
        q, v, w, lagged = x[3:7] / np.linalg.norm(x[3:7]), x[7:10], x[10:13], x[13:17]
        s, u = q[0], q[1:]
        turn = np.eye(3) + 2 * s * np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        cross = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        turn = turn + 2 * cross @ cross
        inflow = np.einsum("ij,ij->i", axes, v + np.cross(w, places))
        given = lagged * np.maximum(0, 1 - 0.3 * np.maximum(0, np.sign(lagged) * inflow))
        force, moment = given @ axes, np.cross(places, given[:, None] * axes).sum(axis=0)
        down = turn.T @ np.array([0, 0, -1.0])
        force = force + (weight - buoyancy) * down
        moment = moment + np.cross(centre, -buoyancy * down)
        nu = np.concatenate([v, w])
        damping = (linear + quadratic * np.abs(nu)) * nu
        momentum = total * nu  # Kirchhoff's equations: rigid body and added mass together
        force = force - damping[:3] - np.cross(w, momentum[:3])
        moment = moment - damping[3:] - np.cross(w, momentum[3:]) - np.cross(v, momentum[:3])
        spin = 0.5 * np.concatenate([[-u @ w], s * w + np.cross(u, w)])
        return np.concatenate([turn @ v, spin, np.concatenate([force, moment]) / total, (thrust(wanted) - lagged) / 0.08])

    x = np.zeros(17)
    x[2], x[3] = -5, 1
    states = []
    edges = np.append(commands["time_s"], 2 * commands["time_s"][-1] - commands["time_s"][-2])
    for i, (begin, end) in enumerate(zip(edges, edges[1:])):
        inside = times[(times >= begin - 1e-12) & (times < end - 1e-12)]
        solved = solve_ivp(rate, (begin, end), x, args=(volts[i],), t_eval=np.append(inside, end), rtol=1e-8, atol=1e-10)
        states += list(solved.y.T[:-1])
        x = solved.y[:, -1]
    return np.array(states)


def test_fossens_equations_by_scipy_are_found_again(scenario, commands):
    rng = np.random.default_rng(8)
    values = {name: value for name, value in logs.planted(scenario, rng).items() if not name.startswith("thrust.")}
    times = np.arange(0, 60, 0.1) + 0.003
    times = times[times < commands["time_s"][-1]]
    states = fossen(values, commands, times)
    assert len(states) == len(times)
    position = states[:, :3] + logs.NOISE_M * rng.standard_normal((len(times), 3))
    attitude = logs.product(states[:, 3:7], logs.turned(logs.NOISE_RAD * rng.standard_normal((len(times), 3))))
    fit = identify.fit(logs.joined(commands, times, position, attitude), scenario, workers=2)
    told = [name for name in values if fit.told(name)]
    assert len(told) > 10
    outside = [name for name in told if not fit.interval(name)[0] <= values[name] <= fit.interval(name)[1]]
    assert len(outside) <= 2, [(name, values[name], fit.interval(name)) for name in outside]
