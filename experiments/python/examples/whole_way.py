"""Someone else's vehicle, from a first flight to docking: whole_way.py [--seeds N] [--cameras].

A BlueROV2 Heavy that is not as its data say (heavier in the water, other drag, slower thrusters) flies an experiment proposed
for the one that the data describe. The ROS 2 bag of that flight, with the noise of motion capture and a clock that drifts,
tells what it is; gains are tuned on that model, and dock on the vehicle that nobody described."""

import argparse

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import turbidock
from turbidock import logs
from turbidock.logs import identify
from turbidock.logs.motion import POSITION, QUATERNION

SCENARIO = "bluerov2_sea_night"
# What nobody knows.
THEIRS = {
    "vehicle.hydrodynamics.added_mass_diagonal": [9.5, 10.5, 14, 0.15, 0.18, 0.4],
    "vehicle.hydrodynamics.linear_damping_diagonal": [6, 4, 20, 0.1, 0.5, 0.5],
    "vehicle.hydrodynamics.quadratic_damping_diagonal": [80, 120, 120, 0.8, 0.6, 0.7],
    "vehicle.hydrodynamics.displaced_volume_m3": 0.0135,
    "vehicle.thrusters.lag_s": 0.15,
}
TYPES = {"/mocap": "geometry_msgs/msg/PoseStamped", "/thrusters": "std_msgs/msg/Float64MultiArray"}
START_S = 1_700_000_000
QUIET = {"estimator.pose_source": "true_pose"}
STILL = {"sea.state": "custom", "sea.jonswap.significant_height_m": 0, "sea.current.gust_std_mps": 0,
         "sea.current.surface_velocity_mps": [0, 0, 0], "sea.waves": []}


def fly(plan_file, bag, seed):
    """Writes a ROS 2 bag of the flight: commands as the vehicle records them, poses as motion capture stamps them, with its
    noise, 50 ms late and by a clock that gains 0.1 ms a second. Returns the thrusters' columns."""
    rows = turbidock.run(SCENARIO, seed=seed, motion=True, settings={
        **QUIET, **STILL, **THEIRS, "control.use": "playback", "control.playback.file": str(plan_file), "trial.duration_s": 60,
        "start.position_m": [-4, 0, -1.5]}).motion.iloc[::48]  # ten a second
    columns = [name for name in rows if name.endswith("_v")]
    rng = np.random.default_rng(seed)
    places = rows[list(POSITION)].to_numpy() + 0.005 * rng.standard_normal((len(rows), 3))
    a, b, c = 0.5 * np.radians(0.5) * rng.standard_normal((3, len(rows)))
    w, x, y, z = rows[list(QUATERNION)].to_numpy().T
    turns = np.stack([w - x * a - y * b - z * c, x + w * a + y * c - z * b, y + w * b + z * a - x * c,
                      z + w * c + x * b - y * a], axis=1)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    volts = np.ascontiguousarray(rows[columns])
    store = get_typestore(Stores.ROS2_HUMBLE)

    def make(kind, *values):  # its fields in order
        return store.types[kind](*values)

    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in TYPES.items()}
        for i, time_s in enumerate(rows["time_s"]):
            log_ns, stamp_ns = (round(1e9 * (START_S + at)) for at in (time_s, 1.0001 * time_s + 0.05))
            stamp = make("builtin_interfaces/msg/Time", *divmod(stamp_ns, 10**9))
            pose = make("geometry_msgs/msg/Pose", make("geometry_msgs/msg/Point", *map(float, places[i])),
                        make("geometry_msgs/msg/Quaternion", *map(float, np.roll(turns[i], -1))))
            layout = make("std_msgs/msg/MultiArrayLayout", [], 0)
            for topic, message in (("/mocap", make(TYPES["/mocap"], make("std_msgs/msg/Header", stamp, "pool"), pose)),
                                   ("/thrusters", make(TYPES["/thrusters"], layout, volts[i]))):
                writer.write(topics[topic], log_ns, bytes(store.serialize_cdr(message, TYPES[topic])))
    return columns


def docked(settings, seeds, what):
    """How many dock on their vehicle, and how fast."""
    results = [turbidock.run(SCENARIO, seed=seed, settings={**THEIRS, **settings}) for seed in seeds]
    good = [result.time_s for result in results if result.success]
    print(f"{what}: {len(good)} of {len(results)} dock" + (f", median {np.median(good):.0f} s" if good else ""), flush=True)
    return len(good)


def tuned(settings, seeds):
    """Gains of pid, by a few trials each on the model that was found."""
    best, choice = None, {}
    pid = turbidock.Scenario(SCENARIO)["control.pid"]
    for kp in (0.5, 1, 1.5):
        for kd in (0.7, 1, 1.4):
            gains = {"control.use": "pid"}
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
    parser.add_argument("--cameras", action="store_true", help="docks by what the cameras see, in place of true poses")
    given = parser.parse_args()
    seeds = range(1000, 1000 + given.seeds)
    poses = {} if given.cameras else QUIET
    docked({**poses, "control.use": "pid"}, seeds, "before, the law knows the data")
    logs.motion.write_motion(identify.plan(SCENARIO, duration_s=60, pool_m=(6, 5, 3)), "plan.csv")
    thrusters = fly("plan.csv", "flight", 1)
    bag = logs.read_bag("flight", {"motion": {
        "odometry": "/mocap", "commands": {"topic": "/thrusters", "columns": thrusters}}})
    fit = identify.fit(bag.motion, SCENARIO)
    print(fit)
    fit.save("theirs.yaml")
    # It is motion capture that is late here, not the thrusters.
    found = {key: value for key, value in fit.settings().items() if not key.endswith("dead_time_s")}
    known = {key: value for key, value in found.items() if key.startswith("control.known_vehicle.")}
    docked({**poses, **known, "control.use": "pid"}, seeds, "the law knows the model found")
    gains = tuned(found, range(3))
    docked({**poses, **known, **gains}, seeds, "and its gains are tuned on it")


if __name__ == "__main__":
    main()
