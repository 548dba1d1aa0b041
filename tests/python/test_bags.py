"""Bags of ROS 1 and ROS 2 and ArduSub's logs as tables of motion, pairs of images and a rig."""

import csv
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pytest
from mcap_ros2.writer import Writer as McapRos2Writer
from pymavlink.dialects.v20 import ardupilotmega
from PIL import Image
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import turbidock
from conftest import QUICK
from test_mcap import messages, place
from turbidock import _core, logs
from turbidock.logs import identify
from turbidock.frames import rotation
from turbidock.logs.motion import POSITION, QUATERNION, TURN_RATE, VELOCITY, read_motion, write_motion

ROOT = pathlib.Path(__file__).resolve().parents[2]
START_NS = 1_700_000_000_123_456_789  # an hour of a day, which a double does not hold
MOTION = {"odometry": "/odom", "imu": "/imu", "depth": "/depth", "dvl": "/dvl",
          "commands": {"topic": "/thrusters", "columns": ["surge_left_v", "surge_right_v", "sway_v", "heave_v"]}}
IMAGES = {"images": {"left": "/left/image", "right": "/right/image"},
          "camera_info": {"left": "/left/info", "right": "/right/info"}}
CUSTOM = ("std_msgs/Header header\nfloat64[] volts\nmypack/Flow flow\n" + "=" * 80 +
          "\nMSG: mypack/Flow\nfloat64 u\nfloat64 v\nfloat64 w\n" + "=" * 80 +
          "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + "=" * 80 +
          "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n")


class Maker:
    """Messages of ROS 1 or ROS 2 and a bag of them."""

    def __init__(self, kind, folder):
        self.kind = kind
        self.store = get_typestore(Stores.ROS1_NOETIC if kind == "ros1" else Stores.ROS2_HUMBLE)
        self.file = folder / ("log.bag" if kind == "ros1" else "log")
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        self.writer = Writer1(self.file) if kind == "ros1" else Writer2(self.file, version=9, storage_plugin=plugin)
        self.topics, self.writer_open = {}, self.writer.open()

    def make(self, kind, **fields):
        return self.store.types[kind](**fields)

    def header(self, ns):
        stamp = self.make("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
        more = {"seq": 0} if self.kind == "ros1" else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id="", **more)

    def vector(self, values, kind="Vector3"):
        return self.make(f"geometry_msgs/msg/{kind}", **dict(zip("xyz", map(float, values))))

    def quaternion(self, wxyz):
        return self.make("geometry_msgs/msg/Quaternion", **dict(zip("wxyz", map(float, wxyz))))

    def pose(self, p, q):
        return self.make("geometry_msgs/msg/Pose", position=self.vector(p, "Point"), orientation=self.quaternion(q))

    def twist(self, v, w):
        return self.make("geometry_msgs/msg/Twist", linear=self.vector(v), angular=self.vector(w))

    def odometry(self, ns, p, q, v, w):
        many = np.zeros(36)
        return self.make("nav_msgs/msg/Odometry", header=self.header(ns), child_frame_id="",
                         pose=self.make("geometry_msgs/msg/PoseWithCovariance", pose=self.pose(p, q), covariance=many),
                         twist=self.make("geometry_msgs/msg/TwistWithCovariance", twist=self.twist(v, w), covariance=many))

    def imu(self, ns, q, w, known=0.0):
        return self.make("sensor_msgs/msg/Imu", header=self.header(ns), orientation=self.quaternion(q),
                         orientation_covariance=np.array([known, *[0.0] * 8]), angular_velocity=self.vector(w),
                         angular_velocity_covariance=np.zeros(9), linear_acceleration=self.vector([0, 0, 9.8]),
                         linear_acceleration_covariance=np.zeros(9))

    def image(self, ns, pixels, encoding="rgb8", pad=0):
        rows = np.pad(pixels.reshape(len(pixels), -1), ((0, 0), (0, pad)))
        return self.make("sensor_msgs/msg/Image", header=self.header(ns), height=len(pixels), width=pixels.shape[1],
                         encoding=encoding, is_bigendian=0, step=rows.shape[1], data=rows.reshape(-1))

    def compressed(self, ns, data, words="jpeg"):
        return self.make("sensor_msgs/msg/CompressedImage", header=self.header(ns), format=words, data=np.frombuffer(data, np.uint8))

    def camera_info(self, ns, rig, right):
        K = np.array([rig.fx, 0, rig.cx, 0, rig.fy, rig.cy, 0, 0, 1.0])
        P = np.array([rig.fx, 0, rig.cx, -rig.fx * rig.baseline_m * right, 0, rig.fy, rig.cy, 0, 0, 0, 1, 0])
        named = dict(D=np.zeros(5), K=K, R=np.eye(3).reshape(-1), P=P)
        if self.kind != "ros1":
            named = {name.lower(): value for name, value in named.items()}
        roi = self.make("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        return self.make("sensor_msgs/msg/CameraInfo", header=self.header(ns), height=rig.height, width=rig.width,
                         distortion_model="plumb_bob", binning_x=0, binning_y=0, roi=roi, **named)

    def numbers(self, values):
        layout = self.make("std_msgs/msg/MultiArrayLayout", dim=[], data_offset=0)
        return self.make("std_msgs/msg/Float64MultiArray", layout=layout, data=np.array(values, float))

    def write(self, topic, log_ns, message):
        kind = message.__msgtype__
        if topic not in self.topics:
            self.topics[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        data = (self.store.serialize_ros1 if self.kind == "ros1" else self.store.serialize_cdr)(message, kind)
        self.writer.write(self.topics[topic], log_ns, bytes(data))

    def close(self):
        self.writer.close()
        return self.file


def a_motion(maker):
    """Two seconds: poses at 10 Hz, IMU at 50 Hz, DVL at 5 Hz, depth and commands without a stamp; logged 3 ms after stamps."""
    q = np.array([np.cos(0.1), 0, 0, np.sin(0.1)])
    for i in range(100):
        at = START_NS + 20_000_000 * i
        log = at + 3_000_000
        maker.write("/imu", log, maker.imu(at, q, [0.01 * i, 2, 3]))
        if i % 5 == 0:
            maker.write("/odom", log, maker.odometry(at, [0.1 * i, 1, -2], q, [0.5, i, 0.7], [4, 5, 6]))
            maker.write("/thrusters", log, maker.numbers([2.5, 2.5 + 0.01 * i, 1, 4]))
        if i % 10 == 0:
            maker.write("/dvl", log, maker.make("geometry_msgs/msg/TwistStamped", header=maker.header(at + 7),
                                                twist=maker.twist([1, -i, 3], [0, 0, 0])))
            maker.write("/depth", log, maker.make("std_msgs/msg/Float64", data=1.5 + i))


@pytest.fixture(params=["ros1", "sqlite", "mcap"])
def maker(request, tmp_path):
    return Maker(request.param, tmp_path)


@pytest.fixture
def simple(tmp_path):
    return Maker("mcap", tmp_path)


def test_a_bag_is_a_table_of_motion_with_its_own_times(maker, tmp_path):
    a_motion(maker)
    bag = logs.read_bag(maker.close(), {"motion": MOTION})
    table = bag.motion
    assert bag.start_ns == START_NS
    stamps = sorted({100_000_000 * i for i in range(20)} | {100_000_000 * i + 3_000_000 for i in range(20)})
    assert np.array_equal(table["time_s"], np.array(stamps) / 1e9)
    at = {column: {round(1e9 * t): v for t, v in zip(table["time_s"], values) if not np.isnan(v)}
          for column, values in table.items()}
    assert at["vehicle_x_m"] == {100_000_000 * i: pytest.approx(0.5 * i) for i in range(20)}
    assert at["roll_rate_rad_s"] == {100_000_000 * i: 4 for i in range(20)}  # of the odometry, which comes first
    assert at["sway_mps"] == {100_000_000 * i: 5 * i for i in range(20)}
    assert at["vehicle_qz"] == {100_000_000 * i: np.sin(0.1) for i in range(20)}
    assert at["depth_m"] == {200_000_000 * i + 3_000_000: 1.5 + 10 * i for i in range(10)}  # as it was recorded
    assert at["surge_right_v"] == {100_000_000 * i + 3_000_000: 2.5 + 0.01 * (5 * i) for i in range(20)}
    assert sorted(bag.notes) == sorted(
        ["/depth: its messages say no time, the log's is taken.", "/thrusters: its messages say no time, the log's is taken.",
         "/imu: vehicle_qw, vehicle_qx, vehicle_qy, vehicle_qz, roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s are taken from "
         "motion.odometry.", "/dvl: surge_mps, sway_mps, heave_mps are taken from motion.odometry."])
    bag.save(tmp_path / "out")
    again = read_motion(tmp_path / "out/motion.csv")
    assert all(np.array_equal(again[column], values, equal_nan=True) for column, values in table.items())
    assert json.loads((tmp_path / "out/log.json").read_text())["start_ns"] == START_NS


def test_identify_takes_what_a_bag_gives(simple):
    """A trial comes back from a bag as it was, to the nanosecond, and tells of its vehicle."""
    simulated = turbidock.run("pool_active", seed=3, settings={**QUICK, "trial.duration_s": 8}).trajectory
    volts = MOTION["commands"]["columns"]
    for row in simulated.to_dict("records"):
        at = START_NS + round(1e9 * row["time_s"])
        simple.write("/odom", at, simple.odometry(at, *([row[column] for column in group] for group in
                                                        (POSITION, QUATERNION, VELOCITY, TURN_RATE))))
        simple.write("/thrusters", at, simple.numbers([row[column] for column in volts]))
    bag = logs.read_bag(simple.close(), {"motion": {"odometry": "/odom", "commands": MOTION["commands"]}})
    columns = [*POSITION, *QUATERNION, *VELOCITY, *TURN_RATE, *volts]
    assert set(bag.motion) == {"time_s", *columns}
    for column in columns:
        assert np.array_equal(bag.motion[column], simulated[column])
    assert np.allclose(bag.motion["time_s"], simulated["time_s"], rtol=0, atol=1e-9)
    assert any(identify.inform(bag.motion, "pool_active").told())


def test_the_first_entry_counts_and_the_recorders_clock_can_be_had(simple):
    a_motion(simple)
    file = simple.close()
    table = logs.read_bag(file, {"motion": {"imu": "/imu", "dvl": "/dvl", "odometry": "/odom"}}).motion
    assert np.isfinite(table["yaw_rate_rad_s"]).sum() == 100 and np.nanmax(table["roll_rate_rad_s"]) == pytest.approx(0.99)
    assert sorted(table["sway_mps"][np.isfinite(table["sway_mps"])]) == [-10 * i for i in range(9, -1, -1)]
    bag = logs.read_bag(file, {"motion": {"imu": {"topic": "/imu", "clock": "log"}}})
    assert bag.start_ns == START_NS + 3_000_000 and np.allclose(np.diff(bag.motion["time_s"]), 0.02)


def test_axes_to_the_right_and_down_and_a_scale(simple):
    a_motion(simple)
    for i in range(2):
        simple.write("/turned", START_NS + i, simple.imu(START_NS + i, [0.1, 0.3, 0.5, np.sqrt(0.65)], [0, 0, 0]))
    file = simple.close()
    turned = logs.read_bag(file, {"motion": {"imu": {"topic": "/turned", "axes": "frd"}}}).motion
    down = np.diag([1, -1, -1])
    assert np.allclose(rotation([turned[f"vehicle_q{axis}"][0] for axis in "wxyz"]),
                       down @ rotation([0.1, 0.3, 0.5, np.sqrt(0.65)]) @ down)
    table = logs.read_bag(file, {"motion": {
        "odometry": {"topic": "/odom", "axes": "frd"}, "depth": {"topic": "/depth", "scale": -2}}}).motion
    row = {column: values[0] for column, values in table.items()}
    assert [row[f"vehicle_{axis}_m"] for axis in "xyz"] == [0, -1, 2]
    assert [row[f"vehicle_q{axis}"] for axis in "wxyz"] == [np.cos(0.1), 0, 0, -np.sin(0.1)]
    assert [row[f"{axis}_mps"] for axis in ("surge", "sway", "heave")] == [0.5, 0, -0.7]
    assert [row[f"{axis}_rate_rad_s"] for axis in ("roll", "pitch", "yaw")] == [4, -5, -6]
    assert table["depth_m"][1] == -3


def test_an_imu_that_knows_no_attitude(simple):
    for i in range(3):
        simple.write("/imu", START_NS + i, simple.imu(START_NS + i, [1, 0, 0, 0], [1, 2, 3], known=-1.0))
        simple.write("/other", START_NS + i, simple.imu(START_NS + i, [0, 0, 0, 0], [1, 2, 3]))
    file = simple.close()
    for topic in ("/imu", "/other"):
        assert set(logs.read_bag(file, {"motion": {"imu": topic}}).motion) == {
            "time_s", "roll_rate_rad_s", "pitch_rate_rad_s", "yaw_rate_rad_s"}


@pytest.mark.parametrize("field, columns, want", [
    ("volts", ["a_newton", "b_newton"], [[0, 10], [1, 10], [2, 10]]),
    (["flow.u", "flow.w", "volts.1"], ["water_x_mps", "water_y_mps", "water_z_mps"], [[0, 7, 10], [2, 7, 10], [4, 7, 10]])])
def test_a_type_of_ones_own_is_read_by_the_files_definition(tmp_path, field, columns, want):
    """In a file that mcap-ros2-support wrote, without a folder around it."""
    with open(tmp_path / "own.mcap", "wb") as stream:
        writer = McapRos2Writer(stream)
        schema = writer.register_msgdef("mypack/msg/Thrust", CUSTOM)
        for i in range(3):
            ns = START_NS + 10**9 * i
            writer.write_message("/own", schema, {"header": {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": ""},
                                                  "volts": [i, 10], "flow": {"u": 2 * i, "v": 5, "w": 7}}, ns + 999, ns)
        writer.finish()
    bag = logs.read_bag(tmp_path / "own.mcap", {"motion": {"x": {"topic": "/own", "field": field, "columns": columns}}})
    assert bag.start_ns == START_NS and list(bag.motion["time_s"]) == [0, 1, 2]
    assert np.array_equal(np.transpose([bag.motion[column] for column in columns]), want)


def films(count):
    """The first images of the footage, and the truth at them."""
    sides = []
    for side in ("left", "right"):
        raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", str(ROOT / f"assets/footage/{side}.mp4"), "-frames:v", str(count),
                              "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], check=True, capture_output=True).stdout
        sides.append(np.frombuffer(raw, np.uint8).reshape(count, 480, 640, 3))
    with open(ROOT / "assets/footage/truth.csv", newline="") as text:
        return sides, [[float(row[f"{axis}_m"]) for axis in "xyz"] for row in csv.DictReader(text)][:count]


def test_images_go_through_the_estimator_and_come_back_as_mcap(maker, tmp_path):
    """In time with the film, the right camera 2 ms late; what is found is what `estimate` finds in the files themselves."""
    sides, truth = films(12)
    rig = turbidock.Trial("sea_night_active").rig
    step = 10**9 // 30
    for i in range(12):
        at = START_NS + step * i
        for side, images, late in zip(("left", "right"), sides, (0, 2_000_000)):
            maker.write(f"/{side}/info", at, maker.camera_info(at, rig, side == "right"))
            maker.write(f"/{side}/image", at + 40_000_000, maker.image(at + late, images[i], pad=5))
    bag = logs.read_bag(maker.close(), IMAGES)
    assert bag.pairs == [(START_NS + step * i, START_NS + step * i + 2_000_000) for i in range(12)]
    assert bag.motion == {} and bag.notes == ["left and right images are 2.0 ms apart (median; 2.0 ms at most): at 0.1 m/s aside that "
                                              "is 0.2 mm, which makes x wrong by 2 mm at 1 m."]
    folder = tmp_path / "out"
    bag.save(folder)
    for side, images in zip(("left", "right"), sides):
        kept = [np.asarray(Image.open(folder / side / f"{i:06}.png")) for i in range(12)]
        assert np.array_equal(kept, images)
    assert {file.name for file in folder.iterdir()} == {"left", "right", "left.yaml", "right.yaml", "times.csv", "log.json"}
    turning = {"roll_rate_rad_s": 0.1, "pitch_rate_rad_s": -0.2, "yaw_rate_rad_s": 0.3}
    write_motion({"time_s": np.array([0, 1.0])} | {name: np.full(2, rate) for name, rate in turning.items()}, folder / "motion.csv")
    records = logs.estimate_bag(folder, scenario="sea_night_active")
    alone = json.loads(subprocess.run([os.environ.get("PROGRAM", "build/bin/turbidock"), "estimate", "--left", folder / "left",
                                       "--right", folder / "right", "--json", "--quiet"], capture_output=True, check=True).stdout)
    assert [record["time_ns"] for record in records] == [pair[0] for pair in bag.pairs]
    detected = [i for i, record in enumerate(records) if record["detected"]]
    assert len(detected) > 3
    for i, record in enumerate(records):
        assert record["position_m"] == pytest.approx(alone["records"][i]["position_m"], abs=2e-4)
        if i in detected[1:]:
            assert np.linalg.norm(np.subtract(record["position_m"], truth[i])) < 0.03  # sides or images mixed up: far more
        if plain := alone["records"][i]["position_deviation_m"]:  # wider by where it is 2 ms later
            shift = 0.002 * np.cross(record["position_m"], list(turning.values()))
            shift[0] = record["position_m"][0] * shift[1] / rig.baseline_m
            assert abs(shift[0]) > 0.5 * plain[0] and record["position_deviation_m"] == pytest.approx(np.hypot(plain, shift), rel=0.05)
    found = messages(folder / "poses.mcap", "/estimate")
    assert [(log_ns, ns, m.timestamp.ToNanoseconds()) for log_ns, ns, m in found] == [(records[i]["time_ns"],) * 3 for i in detected]
    assert [place(m.pose) for _, _, m in found] == [[*records[i]["position_m"], *records[i]["quaternion_wxyz"]] for i in detected]
    motion = read_motion(folder / "motion.csv")  # the camera head's place in the marker's axes, 5 m deep
    posed = np.isfinite(motion["vehicle_x_m"])
    assert list(motion["time_s"][posed]) == [(records[i]["time_ns"] - bag.start_ns) / 1e9 for i in detected]
    model = json.loads(_core.trial_model(turbidock.Scenario("sea_night_active")._cpp))
    for row, i in enumerate(detected):
        body, head, seen = (rotation(q) for q in ([motion[name][posed][row] for name in QUATERNION], model["scene"]["X_BH"][3:],
                                                  records[i]["quaternion_wxyz"]))
        assert np.allclose(body @ head @ seen, np.eye(3))
        there = [motion[name][posed][row] for name in POSITION] + body @ (model["scene"]["X_BH"][:3] + head @ records[i]["position_m"])
        assert np.allclose(there, [0, 0, -5])
    with pytest.raises(turbidock.ConfigError, match="has poses already"):
        logs.estimate_bag(folder, scenario="sea_night_active")
    state = messages(folder / "poses.mcap", "/state")
    assert [m.fitness for _, _, m in state] == [record["fitness"] for record in records]
    assert len(messages(folder / "poses.mcap", "/tf")) == len(detected)


@pytest.mark.parametrize("encoding", ["bgr8", "mono8", "rgba8", "bgra8", "jpeg", "png"])
def test_images_are_kept_as_they_are(simple, tmp_path, encoding):
    pixels = np.random.default_rng(1).integers(0, 255, (4, 6, 3), np.uint8)
    file = io.BytesIO()
    for i in range(2):
        at = START_NS + 10**8 * i
        for side in ("left", "right"):
            if encoding in ("jpeg", "png"):
                file = io.BytesIO()
                Image.fromarray(pixels).save(file, encoding)
                simple.write(f"/{side}/image", at, simple.compressed(at, file.getvalue(), encoding))
            else:
                given = pixels[:, :, ::-1] if encoding.startswith("bgr") else pixels
                given = given[:, :, :1] if encoding == "mono8" else given
                given = np.dstack([given, np.zeros((4, 6), np.uint8)]) if "a8" in encoding else given
                simple.write(f"/{side}/image", at, simple.image(at, given, encoding))
    logs.read_bag(simple.close(), {"images": IMAGES["images"]}).save(tmp_path / "out")
    kept, = (tmp_path / "out/left").glob("000001.*")
    if encoding in ("jpeg", "png"):
        assert kept.read_bytes() == file.getvalue() and kept.suffix == (".jpg" if encoding == "jpeg" else ".png")
    else:
        assert np.array_equal(np.asarray(Image.open(kept)), pixels[:, :, 0] if encoding == "mono8" else pixels)


def test_images_without_a_pair_are_left_out_and_said(simple, tmp_path):
    image = np.zeros((2, 2, 3), np.uint8)
    for i in range(10):
        at = START_NS + 10**8 * i
        if i != 3:
            simple.write("/left/image", at, simple.image(at, image + i))
        if i not in (5, 6):
            simple.write("/right/image", at, simple.image(at + 30_000_000, image + i))
    bag = logs.read_bag(simple.close(), {"images": IMAGES["images"]})
    assert [(left - START_NS) // 10**8 for left, _ in bag.pairs] == [0, 1, 2, 4, 7, 8, 9]
    assert all(right - left == 30_000_000 for left, right in bag.pairs)
    assert bag.notes == ["/left/image: 2 of 9 images have no partner within 0.050 s and are left out, the first is number 4.",
                         "/right/image: 1 of 8 images have no partner within 0.050 s and are left out, the first is number 3.",
                         "left and right images are 30.0 ms apart (median; 30.0 ms at most): at 0.1 m/s aside that is 3.0 mm."]
    bag.save(tmp_path / "out")
    for side in ("left", "right"):
        seen = [np.asarray(Image.open(file))[0, 0, 0] for file in sorted((tmp_path / "out" / side).iterdir())]
        assert seen == [0, 1, 2, 4, 7, 8, 9]


def test_an_ardusub_telemetry_log(tmp_path):
    file = tmp_path / "dive.tlog"
    link = ardupilotmega.MAVLink(None, srcSystem=1)
    with open(file, "wb") as stream:
        for i in range(5):
            stamp_us = START_NS // 1000 + 100_000 * i
            for message in (ardupilotmega.MAVLink_attitude_message(100 * i, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
                            ardupilotmega.MAVLink_ahrs2_message(0, 0, 0, -1.5, 0, 0),
                            ardupilotmega.MAVLink_servo_output_raw_message(0, 0, 1500, 1510 + i, 0, 0, 0, 0, 0, 0)):
                stream.write(stamp_us.to_bytes(8, "big") + message.pack(link))
    bag = logs.read_bag(file, {"motion": {
        "attitude": {"topic": "ATTITUDE", "field": ["roll", "pitch", "yaw"], "columns": ["roll_rad", "pitch_rad", "yaw_rad"], "axes": "frd"},
        "depth": {"topic": "AHRS2", "field": "altitude", "scale": -1},
        "commands": {"topic": "SERVO_OUTPUT_RAW", "field": ["servo1_raw", "servo2_raw"], "columns": ["a_pwm_us", "b_pwm_us"]}}})
    assert np.allclose(bag.motion["time_s"], np.arange(5) / 10)
    assert np.allclose([bag.motion[column][2] for column in ("roll_rad", "pitch_rad", "yaw_rad", "depth_m")], [0.1, -0.2, -0.3, 1.5])
    assert bag.start_ns // 1000 == START_NS // 1000 and bag.notes == []
    assert list(bag.motion["b_pwm_us"]) == [1510, 1511, 1512, 1513, 1514]


def test_the_gap_of_a_topic_is_said(simple):
    for i in [*range(20), *range(60, 80)]:
        simple.write("/depth", START_NS + 50_000_000 * i, simple.make("std_msgs/msg/Float64", data=1.0))
    bag = logs.read_bag(simple.close(), {"motion": {"depth": {"topic": "/depth", "clock": "log"}}})
    assert bag.notes == ["/depth: nothing for 2.05 s after 0.95 s."]


def test_bad_logs_are_one_line(simple, tmp_path):
    a_motion(simple)
    image = np.zeros((2, 2, 3), np.uint8)
    for i, at in enumerate([0, 10**8, 5 * 10**7]):
        simple.write("/back", START_NS + 10**8 * i, simple.imu(START_NS + at, [1, 0, 0, 0], [0, 0, 0]))
    for i in range(3):
        at = START_NS + 10**8 * i
        simple.write("/left/image", at, simple.image(at, image))
        simple.write("/right/image", at, simple.image(at + 10**9, image))
        simple.write("/raw/image", at, simple.image(at, image, "bayer_rggb8"))
        simple.write("/simulated", at, simple.imu(10**8 * (i + 1), [1, 0, 0, 0], [0, 0, 0]))
        simple.write("/text", at, simple.make("std_msgs/msg/String", data="x"))
        simple.write("/video", at, simple.compressed(at, b"\0\0\0\1", "h264"))
    simple.write("/once/image", START_NS, simple.image(START_NS + 50_000_000, image))
    info = simple.camera_info(START_NS, turbidock.Trial("sea_night_active").rig, False)
    info.k[:] = 0
    simple.write("/zero", START_NS, info)
    simple.write("/info", START_NS, info)
    simple.topics["/never"] = simple.writer.add_connection("/never", "std_msgs/msg/Float64", typestore=simple.store)
    file = simple.close()

    def refused(topics, of=file):
        with pytest.raises(turbidock.ConfigError) as error:
            bag = logs.read_bag(of, topics)
            bag.save(tmp_path / "out")
        words = str(error.value)
        assert "\n" not in words
        assert not (tmp_path / "out").exists() and not (tmp_path / "out.part").exists()
        return words

    def motion(**entries):
        return refused({"motion": entries})

    def images(left, right):
        return refused({"images": {"left": left, "right": right}})

    assert ": has no topic /odo; it has /back, /depth, /dvl, " in motion(odometry="/odo")
    assert motion(depth="/never").endswith(": /never is empty")
    assert "/back: the clock runs backwards at message 2, by 0.050 s; `clock: log`" in motion(imu="/back")
    assert "/simulated ends: they have no time in common" in motion(
        imu="/imu", x={"topic": "/simulated", "field": "angular_velocity", "columns": ["water_x_mps", "water_y_mps", "water_z_mps"]})
    assert "motion.depth: /text (std_msgs/msg/String) has no data, depth: say its `field`" in motion(depth="/text")
    assert "motion.imu: /text (std_msgs/msg/String) has no orientation, angular_velocity" in motion(imu="/text")
    assert "motion.dvl: /imu (sensor_msgs/msg/Imu) has no numbers at speed" in motion(dvl={"topic": "/imu", "field": "speed"})
    assert "/thrusters has 4 numbers for 5 columns" in motion(commands={"topic": "/thrusters", "columns": [f"{c}_v" for c in "abcde"]})
    assert "motion.x: volts is no column of a table" in motion(x={"topic": "/thrusters", "field": "data", "columns": ["volts"]})
    assert "motion.commands needs columns, a thruster each" in motion(commands="/thrusters")
    for word, value in (("topic", 5), ("topic", [{"a": 1}]), ("field", 5), ("field", {"x": "y"}), ("columns", [5])):
        said = motion(depth={"topic": "/depth", "field": "data", "columns": ["depth_m"]} | {word: value})
        assert f"motion.depth.{word} is {value}, must be a name or a list of names" in said
    assert "motion.depth needs a topic" in motion(depth={"topic": ["/depth", "/imu"]})
    assert "topics: types must have names as keys" in refused({"motion": {"depth": "/depth"}, "types": ["a"]})
    assert "motion.imu.axes is ned, must be flu or frd" in motion(imu={"topic": "/imu", "axes": "ned"})
    assert "motion.imu.topics is no key; there are topic, field" in motion(imu={"topics": "/imu"})
    assert "topics: image is no key; there are images, camera_info, motion, clock" in refused({"image": {}})
    assert "names neither images nor motion" in refused({})
    assert "images has one side only" in refused({"images": {"left": "/left/image"}})
    assert "/right/image begins 0.800 s after /left/image ends" in images("/left/image", "/right/image")
    assert "no pair of images: the nearest are 0.050 s apart" in images("/left/image", "/once/image")
    assert "encoding bayer_rggb8, must be rgb8, bgr8" in images("/raw/image", "/left/image")
    assert "format 'h264' is neither JPEG nor PNG" in images("/video", "/left/image")
    assert "/zero: its camera matrix is zero" in refused(
        {"motion": {"imu": "/imu"}, "camera_info": {"left": "/zero", "right": "/info"}})
    (tmp_path / "topics.yaml").write_text("motion: [")
    assert "topics.yaml: is no YAML" in refused(tmp_path / "topics.yaml")
    assert "nowhere: no such file" in refused({"motion": {"imu": "/imu"}}, tmp_path / "nowhere")
    shutil.copy(mcap := next(file.glob("*.mcap")), tmp_path / "copy.mcap")
    for again in (mcap, tmp_path / "copy.mcap"):
        assert f"{again}: is {mcap} once more; give each log once" in refused({"motion": {"imu": "/imu"}}, [mcap, again])


@pytest.mark.parametrize("kind, share", [("ros1", 0.6), ("sqlite", 0.5), ("mcap", 0.7), ("mcap", 0.01)])
def test_a_file_that_is_cut_off_is_one_line(tmp_path, kind, share):
    maker = Maker(kind, tmp_path)
    a_motion(maker)
    file = maker.close()
    cut = file if kind == "ros1" else next(each for each in file.iterdir() if each.suffix in (".mcap", ".db3"))
    whole = cut.read_bytes()
    cut.write_bytes(whole[:int(share * len(whole))])
    for given in (file, cut):
        with pytest.raises(turbidock.ConfigError, match="cannot be read, cut off or no log: .") as error:
            logs.read_bag(given, {"motion": MOTION})
        assert "\n" not in str(error.value)


def test_the_command(simple, tmp_path):
    a_motion(simple)
    file = simple.close()
    (tmp_path / "topics.yaml").write_text("motion: {odometry: /odom, depth: {topic: /depth, scale: -1}}\n")

    def command(*words):
        return subprocess.run([sys.executable, "-c", "from turbidock import _program; _program.bag()", *map(str, words)],
                              capture_output=True, text=True)

    assert "/odom  nav_msgs/msg/Odometry" in command(file).stdout.splitlines()
    done = command(file, "--topics", tmp_path / "topics.yaml", "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (0, f"{tmp_path}/out: 30 rows of motion, 0 pairs of images\n")
    assert done.stderr == "/depth: its messages say no time, the log's is taken.\n"
    assert read_motion(tmp_path / "out/motion.csv")["depth_m"][1] == -1.5
    again = command(file, "--topics", tmp_path / "topics.yaml", "--out", tmp_path / "out")
    assert (again.returncode, again.stderr.splitlines()) == (2, [f"-c: {tmp_path}/out: is there already"])
    assert command(tmp_path / "topics.yaml").returncode == 2
    assert "it must be a log with images and camera_info" in command(
        file, "--topics", tmp_path / "topics.yaml", "--out", tmp_path / "out2", "--estimate").stderr
