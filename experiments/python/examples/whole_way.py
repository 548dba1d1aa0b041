"""Someone else's vehicle, from a first flight to docking: whole_way.py [--seeds N].

A BlueROV2 Heavy that is not as its data say (heavier in the water, other drag, weaker astern, slower thrusters) flies an
experiment proposed for the one that the data describe. Its log, with the noise of motion capture and a late clock, tells what it
is; gains are tuned on that model, and dock on the vehicle that nobody described."""

import argparse

import numpy as np

import turbidock
from turbidock import identify

SCENARIO = "bluerov2_sea_night"
# What nobody knows.
THEIRS = {
    "vehicle.hydrodynamics.added_mass_diagonal": [9.5, 10.5, 14, 0.15, 0.18, 0.4],
    "vehicle.hydrodynamics.linear_damping_diagonal": [6, 4, 20, 0.1, 0.5, 0.5],
    "vehicle.hydrodynamics.quadratic_damping_diagonal": [80, 120, 120, 0.8, 0.6, 0.7],
    "vehicle.hydrodynamics.displaced_volume_m3": 0.0135,
    "vehicle.thrusters.lag_s": 0.15,
}
QUIET = {"pose_source": "true_pose"}
STILL = {"sea.state": "custom", "sea.jonswap.significant_height_m": 0, "sea.current.gust_std_mps": 0,
         "sea.current.surface_velocity_mps": [0, 0, 0], "sea.waves": []}


def fly(plan_file, seed):
    """A table of motion as a camera on the pool's side and the vehicle's own computer would log it."""
    duration_s = 60
    simulated = turbidock.run(SCENARIO, seed=seed, motion=True, settings={
        **QUIET, **STILL, **THEIRS, "controller": "playback", "playback.file": str(plan_file), "duration_s": duration_s,
        "start.position_m": [-4, 0, -1.5]}).motion
    rng = np.random.default_rng(seed)
    every = 48  # ten a second
    rows = simulated.iloc[::every].reset_index(drop=True)
    late = {name: np.asarray(rows[name]) for name in rows if name == "time_s" or name.endswith("_v")}
    for axis in "xyz":
        late[f"vehicle_{axis}_m"] = rows[f"vehicle_{axis}_m"] + 0.005 * rng.standard_normal(len(rows))
    turn = 0.5 * np.radians(0.5) * rng.standard_normal((len(rows), 3))
    w, x, y, z = (np.asarray(rows[f"vehicle_q{axis}"]) for axis in "wxyz")
    a, b, c = turn.T
    noisy = np.stack([w - x * a - y * b - z * c, x + w * a + y * c - z * b, y + w * b + z * a - x * c,
                      z + w * c + x * b - y * a], axis=1)
    noisy /= np.linalg.norm(noisy, axis=1, keepdims=True)
    for i, axis in enumerate("wxyz"):
        late[f"vehicle_q{axis}"] = noisy[:, i]
    return late


def docked(settings, seeds, what):
    """How many dock on their vehicle, and how fast."""
    results = [turbidock.run(SCENARIO, seed=seed, settings={**QUIET, **THEIRS, **settings}) for seed in seeds]
    good = [result.time_s for result in results if result.success]
    print(f"{what}: {len(good)} of {len(results)} dock" + (f", median {np.median(good):.0f} s" if good else ""), flush=True)
    return len(good)


def tuned(settings, seeds):
    """Gains of pid, by a few trials each on the model that was found."""
    best, choice = None, {}
    pid = turbidock.Scenario(SCENARIO)["pid"]
    for kp in (0.5, 1, 1.5):
        for kd in (0.7, 1, 1.4):
            gains = {"controller": "pid"}
            for axis in ("surge", "sway", "heave", "yaw"):
                gains[f"pid.{axis}.kp_per_s2"] = kp * pid[axis]["kp_per_s2"]
                gains[f"pid.{axis}.kd_per_s"] = kd * pid[axis]["kd_per_s"]
            results = [turbidock.run(SCENARIO, seed=seed, settings={**QUIET, **settings, **gains}) for seed in seeds]
            score = (sum(result.success for result in results), -np.median([result.time_s for result in results]))
            if best is None or score > best:
                best, choice = score, gains
    print(f"gains on the model found: {choice}", flush=True)
    return choice


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    given = parser.parse_args()
    seeds = range(1000, 1000 + given.seeds)
    docked({"controller": "pid"}, seeds, "before, the law knows the data")
    turbidock.motion.write_motion(identify.plan(SCENARIO, duration_s=60, pool_m=(6, 5, 3)), "plan.csv")
    log = fly("plan.csv", 1)
    turbidock.motion.write_motion(log, "simulated.csv")
    fit = identify.fit("simulated.csv", SCENARIO)
    print(fit)
    fit.save("theirs.yaml")
    known = {key: value for key, value in fit.settings().items() if key.startswith("known_vehicle.")}
    docked({**known, "controller": "pid"}, seeds, "the law knows the model found")
    gains = tuned(fit.settings(), range(3))
    docked({**known, **gains}, seeds, "and its gains are tuned on it")


if __name__ == "__main__":
    main()
