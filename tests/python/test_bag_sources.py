"""What of other people's logs may be taken for something else: several senders under one name, zeros, twins, types, binning."""

import json
import sqlite3
import struct

import numpy as np
import pytest
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import turbidock
from test_bags import START_NS, Maker, films
from turbidock import logs

SIZES = {"Q": "Q", "B": "B", "f": "f", "H": "H", "c": "h", "n": "4s", "N": "16s", "Z": "64s"}


def dataflash(file, messages, formats):
    """A log of ArduSub, by hand: messages as (name, values)."""
    numbers = {"FMT": 128} | {name: 140 + i for i, name in enumerate(formats)}
    formats = {"FMT": ("BBnNZ", "Type,Length,Name,Format,Columns")} | formats

    def pack(name, *values):
        kinds = "<" + "".join(SIZES[letter] for letter in formats[name][0])
        return bytes([0xA3, 0x95, numbers[name]]) + struct.pack(kinds, *(v.encode() if isinstance(v, str) else v for v in values))

    with open(file, "wb") as stream:
        for name, (kinds, columns) in formats.items():
            size = 3 + struct.calcsize("<" + "".join(SIZES[letter] for letter in kinds))
            stream.write(pack("FMT", numbers[name], size, name, kinds, columns))
        for name, *values in messages:
            stream.write(pack(name, *values))


def test_an_ardusub_flight_log(tmp_path):
    """Its angles are hundredths of a degree."""
    messages = [message for i in range(5) for message in (("RCOU", 7_000_000 + 100_000 * i, 1500, 1600 + i),
                                                          ("ATT", 7_000_000 + 100_000 * i, 1000, -2000, 3000))]
    dataflash(tmp_path / "dive.bin", messages, {"RCOU": ("QHH", "TimeUS,C1,C2"), "ATT": ("Qccc", "TimeUS,Roll,Pitch,Yaw")})
    bag = logs.read_bag(tmp_path / "dive.bin", {"motion": {
        "attitude": {"topic": "ATT", "field": ["Roll", "Pitch", "Yaw"], "columns": ["roll_rad", "pitch_rad", "yaw_rad"],
                     "scale": np.pi / 180, "axes": "frd"},
        "commands": {"topic": "RCOU", "field": ["C1", "C2"], "columns": ["a_pwm_us", "b_pwm_us"]}}})
    assert bag.start_ns == 7_000_000_000 and bag.notes == [] and np.allclose(bag.motion["time_s"], np.arange(5) / 10)
    assert np.allclose(np.degrees([bag.motion[f"{axis}_rad"][1] for axis in ("roll", "pitch", "yaw")]), [10, 20, -30])
    assert list(bag.motion["b_pwm_us"]) == [1600, 1601, 1602, 1603, 1604]


@pytest.mark.parametrize("said", [True, False])  # by the log itself, as ArduPilot does since 4.0
def test_a_lane_is_taken_by_its_number_else_refused(tmp_path, said):
    formats = {"FMTU": ("QBNN", "TimeUS,FmtType,UnitIds,MultIds"), "XKF1": ("QBfff", "TimeUS,C,PN,PE,PD"),
               "ATT": ("Qff", "TimeUS,DesRoll,Roll")}
    both = [("XKF1", 10**5 * i, lane, i + 100.0 * lane, 0.0, 1.0) for i in range(5) for lane in (0, 1)]
    attitude = [("ATT", 10**5 * i, 0.0, 1.0) for i in range(5)]
    dataflash(tmp_path / "two.bin", [("FMTU", 0, 141, "s#mmm", "F-000")] * said + both + attitude, formats)
    dataflash(tmp_path / "one.bin", [("FMTU", 0, 141, "s#mmm", "F-000")] * said + both[::2], formats)

    def x(file, topic):
        entry = {"topic": topic, "field": ["PN", "PE", "PD"], "columns": ["vehicle_x_m", "vehicle_y_m", "vehicle_z_m"], "axes": "frd"}
        return list(logs.read_bag(tmp_path / file, {"motion": {"position": entry}}).motion["vehicle_x_m"])

    assert x("one.bin", "XKF1") == x("two.bin", "XKF1[0]") == [0, 1, 2, 3, 4]
    assert x("two.bin", "XKF1[1]") == [100, 101, 102, 103, 104]
    with pytest.raises(turbidock.ConfigError, match=r"two.bin: XKF1 comes from 2 sources: say which of 'XKF1\[0\]', 'XKF1\[1\]'$"):
        x("two.bin", "XKF1")
    with pytest.raises(turbidock.ConfigError, match=r"two.bin: has no XKF1\[2\]; it has 'XKF1\[0\]', 'XKF1\[1\]'$"):
        x("two.bin", "XKF1[2]")


def test_a_child_of_tf_is_taken_by_its_name_else_refused(tmp_path):
    maker = Maker("mcap", tmp_path)
    for i in range(5):
        at = START_NS + 10**8 * i
        maker.write("/tf", at, maker.make("tf2_msgs/msg/TFMessage", transforms=[
            maker.make("geometry_msgs/msg/TransformStamped", header=maker.header(at), child_frame_id=child, transform=maker.make(
                "geometry_msgs/msg/Transform", translation=maker.vector([x, 0, -1]), rotation=maker.quaternion([1, 0, 0, 0])))
            for child, x in (("base_link", i), ("sonar", -9))]))
    file = maker.close()
    bag = logs.read_bag(file, {"motion": {"odometry": "/tf[base_link]"}})
    assert list(bag.motion["vehicle_x_m"]) == [0, 1, 2, 3, 4]
    with pytest.raises(turbidock.ConfigError, match=r"/tf comes from 2 sources: say which of '/tf\[base_link\]', '/tf\[sonar\]'"):
        logs.read_bag(file, {"motion": {"odometry": "/tf"}})


def test_a_type_that_the_bag_does_not_define_is_named_and_may_be_given(tmp_path):
    """A .db3 as ROS 2 Humble writes it: no definition in the file."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("float64[4] newton\n", "heron_msgs/msg/Thrust"))
    with Writer(tmp_path / "dive", version=8) as bag:
        connection = bag.add_connection("/thrust", "heron_msgs/msg/Thrust", typestore=store)
        for i in range(3):
            message = store.types["heron_msgs/msg/Thrust"](np.arange(4.0) + i)
            bag.write(connection, START_NS + 10**8 * i, store.serialize_cdr(message, "heron_msgs/msg/Thrust"))
    with sqlite3.connect(tmp_path / "dive/dive.db3") as database:
        database.execute("DELETE FROM message_definitions")
    database.close()
    topics = {"motion": {"commands": {"topic": "/thrust", "field": "newton", "columns": [f"{name}_newton" for name in "abcd"]}}}
    with pytest.raises(turbidock.ConfigError, match="/thrust is of type heron_msgs/msg/Thrust, which the bag does not define .* types:"):
        logs.read_bag(tmp_path / "dive", topics)
    (tmp_path / "Thrust.msg").write_text("float64[4] newton\n")
    types = {"heron_msgs/msg/Thrust": str(tmp_path / "Thrust.msg")}
    assert list(logs.read_bag(tmp_path / "dive", topics | {"types": types}).motion["d_newton"]) == [3, 4, 5]
    (tmp_path / "Thrust.msg").write_text("float64[3] newton\n")
    with pytest.raises(turbidock.ConfigError, match="a message of /thrust is not as heron_msgs/msg/Thrust is defined"):
        logs.read_bag(tmp_path / "dive", topics | {"types": types})


def test_zeros_are_no_measurement_and_commands_take_an_offset(tmp_path):
    maker = Maker("sqlite", tmp_path)
    for i in range(5):
        at = START_NS + 10**8 * i
        maker.write("/odom", at, maker.odometry(at, [i, 0, -1], [1, 0, 0, 0], [0, 0, 0], [0, 0, 0]))
        maker.write("/thrust", at, maker.numbers([-1 + 0.5 * i, 0]))
        maker.write("/pressure", at, maker.make("std_msgs/msg/Float64", data=101325.0 + 9810 * i))
    file = maker.close()

    def motion(**commands):
        return logs.read_bag(file, {"motion": {
            "odometry": "/odom", "depth": {"topic": "/pressure", "scale": 1 / 9810, "offset": -101325 / 9810},
            "commands": {"topic": "/thrust", "columns": ["a_v", "b_v"], **commands}}})

    bag = motion(scale=2.5, offset=2.5)
    assert list(bag.motion["a_v"]) == [0, 1.25, 2.5, 3.75, 5] and list(bag.motion["b_v"]) == [2.5] * 5
    assert np.allclose(bag.motion["depth_m"], np.arange(5))
    assert not {"surge_mps", "yaw_rate_rad_s"} & set(bag.motion)
    assert "surge_mps, sway_mps, heave_mps are zero throughout: no measurement, left out." in bag.notes
    with pytest.raises(turbidock.ConfigError, match="motion.commands: a_v is -1 to 1, must be 0 to 5 V .* `scale: 2.5, offset: 2.5`"):
        motion()
    with pytest.raises(turbidock.ConfigError, match="motion.commands.offset is high, must be a number"):
        motion(offset="high")


def test_images_of_one_stamp_count_once(tmp_path):
    maker = Maker("sqlite", tmp_path)
    image = np.zeros((2, 2, 3), np.uint8)
    for i in range(10):
        at = START_NS + 10**8 * (i // 2)
        for side in ("left", "right"):
            maker.write(f"/{side}/image", at, maker.image(at, image + i))
    bag = logs.read_bag(maker.close(), {"images": {"left": "/left/image", "right": "/right/image"}})
    assert len(bag.pairs) == 5
    assert bag.notes == [f"/{side}/image: 5 images have the stamp of another and count once." for side in ("left", "right")]
    bag.save(tmp_path / "out")
    assert len(list((tmp_path / "out/left").iterdir())) == len(list((tmp_path / "out/right").iterdir())) == 5
    with pytest.raises(turbidock.ConfigError, match="images: /left/image is given for both sides"):
        logs.read_bag(tmp_path / "log", {"images": {"left": "/left/image", "right": "/left/image"}})


def test_the_rig_is_that_of_binned_images_and_what_estimate_says_arrives(tmp_path, capsys):
    """The footage, two by two pixels binned, of a sensor of which the images have a region; then grey."""
    sides, _ = films(6)
    rig = turbidock.Trial("sea_night_active").rig
    topics = {"images": {side: f"/{side}/image" for side in ("left", "right")},
              "camera_info": {side: f"/{side}/info" for side in ("left", "right")}}
    for name, form in (("whole", lambda pixels: pixels), ("grey", lambda pixels: pixels.mean(axis=2).astype(np.uint8)[:, :, None]),
                       ("binned", lambda pixels: pixels[::2, ::2])):
        (tmp_path / name).mkdir()
        maker = Maker("sqlite", tmp_path / name)
        for i in range(6):
            at = START_NS + 10**9 // 30 * i
            for side, images in zip(("left", "right"), sides):
                info = maker.camera_info(at, rig, side == "right")
                if name == "binned":  # of a sensor with 100 columns more on the left, 60 rows more on top
                    for matrix, row in ((info.k, 3), (info.p, 4)):
                        matrix[2], matrix[row + 2] = matrix[2] + 100, matrix[row + 2] + 60
                    info.width, info.height, info.binning_x, info.binning_y = rig.width + 100, rig.height + 60, 2, 2
                    info.roi = maker.make("sensor_msgs/msg/RegionOfInterest", x_offset=100, y_offset=60, width=rig.width,
                                          height=rig.height, do_rectify=False)
                maker.write(f"/{side}/info", at, info)
                pixels = form(images[i])
                maker.write(f"/{side}/image", at, maker.image(at, pixels, "mono8" if name == "grey" else "rgb8"))
        bag = logs.read_bag(maker.close(), topics)
        if name == "binned":
            assert f"image_width: {rig.width // 2}\nimage_height: {rig.height // 2}\n" in bag.rig["right"]
            numbers = [json.loads(line.split("data: ")[1].rstrip("}")) for line in bag.rig["right"].splitlines() if "data" in line]
            assert np.allclose(numbers[0], [rig.fx / 2, 0, rig.cx / 2, 0, rig.fy / 2, rig.cy / 2, 0, 0, 1])
            assert np.allclose(numbers[3][3], -rig.fx * rig.baseline_m / 2)
        elif name == "grey":
            bag.save(tmp_path / "grey/out")
            logs.estimate_bag(tmp_path / "grey/out")
            assert "is grey" in capsys.readouterr().err


def test_compressed_images_of_a_bayer_sensor_are_refused(tmp_path):
    maker = Maker("sqlite", tmp_path)
    for side in ("left", "right"):
        maker.write(f"/{side}/image", START_NS, maker.compressed(START_NS, b"\x89PNG", "bayer_rggb8; png compressed bayer_rggb8"))
    bag = logs.read_bag(maker.close(), {"images": {"left": "/left/image", "right": "/right/image"}})
    with pytest.raises(turbidock.ConfigError, match="/left/image: encoding bayer_rggb8, must be rgb8"):
        bag.save(tmp_path / "out")


def test_an_mcap_of_another_profile_is_named(tmp_path):
    trial = turbidock.run("sea_night_active", settings={"estimator.pose_source": "true_pose", "trial.duration_s": 1})
    logs.to_mcap(trial, tmp_path / "trial.mcap")
    with pytest.raises(turbidock.ConfigError, match="trial.mcap: an MCAP of profile '', must be ros2"):
        logs.read_bag(tmp_path / "trial.mcap", {"motion": {"imu": "/imu"}})


def test_what_is_no_bag_yet_is_named(tmp_path):
    (tmp_path / "dive.db3.zst").write_bytes(b"\x28\xb5\x2f\xfd")
    (tmp_path / "dive").mkdir()
    for name, words in (("dive.db3.zst", "is no bag: one that was packed is unpacked first"),
                        ("dive", "has no metadata.yaml: give its .mcap")):
        with pytest.raises(turbidock.ConfigError, match=f"{name}: {words}"):
            logs.read_bag(tmp_path / name, {"motion": {"imu": "/imu"}})
    maker = Maker("mcap", tmp_path / "dive")
    maker.write("/imu", START_NS, maker.imu(START_NS, [1, 0, 0, 0], [0, 0, 0]))
    cut = next(maker.close().glob("*.mcap"))
    cut.write_bytes(cut.read_bytes()[:-20])
    with pytest.raises(turbidock.ConfigError, match="`mcap recover` saves what is whole$"):
        logs.read_bag(cut, {"motion": {"imu": "/imu"}})


def test_an_autopilot_that_is_disarmed_or_begins_anew(tmp_path):
    topics = {"motion": {"commands": {"topic": "RCOU", "field": ["C1", "C2"], "columns": ["a_pwm_us", "b_pwm_us"]}}}

    def read(*rows):
        dataflash(tmp_path / "dive.bin", [("RCOU", at, *values) for at, *values in rows], {"RCOU": ("QHH", "TimeUS,C1,C2")})
        return logs.read_bag(tmp_path / "dive.bin", topics)

    bag = read((10**6, 0, 1600), (2 * 10**6, 1450, 1600))
    assert list(bag.motion["a_pwm_us"]) == [1500, 1450]
    assert bag.notes == ["motion.commands: a_pwm_us is 0, no pulse, in 1 messages: taken as 1500, neutral."]
    with pytest.raises(turbidock.ConfigError, match="motion.commands: b_pwm_us is 2 to 3, must be 1100 to 1900 microseconds"):
        read((10**6, 1500, 2), (2 * 10**6, 1450, 3))
    with pytest.raises(turbidock.ConfigError, match="RCOU: the clock runs backwards .*; the autopilot began anew: cut the log there$"):
        read((9 * 10**6, 1500, 1500), (10**6, 1500, 1500))


def test_a_damaged_log_is_said_to_be_in_one_line(tmp_path, capsys):
    dataflash(tmp_path / "dive.bin", [("CTUN", 10**5 * i, -1.5 - i) for i in range(5)], {"CTUN": ("Qf", "TimeUS,Alt")})
    whole = (tmp_path / "dive.bin").read_bytes()
    topics = {"motion": {"depth": {"topic": "CTUN", "field": "Alt", "columns": "depth_m", "scale": -1}}}
    assert list(logs.read_bag(tmp_path / "dive.bin", topics).motion["depth_m"]) == [1.5, 2.5, 3.5, 4.5, 5.5]
    assert capsys.readouterr().err == ""
    (tmp_path / "dive.bin").write_bytes(whole + bytes(2000))
    assert len(logs.read_bag(tmp_path / "dive.bin", topics).motion["depth_m"]) == 5
    line, = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{tmp_path}/dive.bin: is damaged, some is left out: bad header 0x")
    (tmp_path / "dive.mcap").write_bytes(b"")
    with pytest.raises(turbidock.ConfigError, match="logs of ArduSub and bags of ROS have no clock in common"):
        logs.read_bag([tmp_path / "dive.bin", tmp_path / "dive.mcap"], topics)
