"""Trials as MCAP: what a reader finds in the file is what was recorded."""

import base64
import io
import json
import os
import pathlib
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import Default, DescriptorPool
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from mcap_ros2.decoder import DecoderFactory as Ros2Factory
from PIL import Image

import turbidock
from conftest import QUICK
from turbidock import logs
from turbidock.frames import rotation
from turbidock.logs.motion import read_motion

HERE = pathlib.Path(__file__).parent
POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")


def recorded(folder, *sets, more=()):
    """A trial's folder, as the program writes it."""
    subprocess.run([os.environ.get("PROGRAM", "build/bin/turbidock"), "run", "sea_night_active", "--seed", "77", "--quiet",
                    *more, "--out", str(folder), *(word for each in sets for word in ("--set", each))], check=True)
    return folder


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    folder = recorded(tmp_path_factory.mktemp("trial"), "trial.duration_s=1.6", "cameras.delay_frames=3")
    logs.to_mcap(folder)
    return folder


@pytest.fixture(scope="module")
def docked(tmp_path_factory):
    folder = recorded(tmp_path_factory.mktemp("docked"), "estimator.pose_source=true_pose")
    logs.to_mcap(folder)
    return folder


def messages(file, topic, decoder=DecoderFactory):
    """Log time [ns], publish time [ns] and message of each, decoded by the schemas in the file alone."""
    with open(file, "rb") as stream:
        return [(message.log_time, message.publish_time, decoded) for _, _, message, decoded in
                make_reader(stream, decoder_factories=[decoder()]).iter_decoded_messages(topics=[topic])]


def place(pose, at="position", turn="orientation"):
    p, q = getattr(pose, at), getattr(pose, turn)
    return [p.x, p.y, p.z, q.w, q.x, q.y, q.z]


def rows(folder):
    log = pd.read_csv(folder / "trajectory.csv", dtype=str)
    return pd.DataFrame({name: words if name == "stage" else [float(word) for word in words] for name, words in log.items()})


def nanoseconds(column):
    return [round(1e9 * time_s) for time_s in column]


@pytest.mark.parametrize("topic, of, moment", [("/estimate", "est", "image_time_s"), ("/truth", "true", "time_s"),
                                               ("/truth_at_image", "true_at_image", "image_time_s")])
def test_poses_and_their_moments_are_those_of_the_trajectory(trial, topic, of, moment):
    found, log = messages(trial / "trial.mcap", topic), rows(trial)
    assert [log_ns for log_ns, _, _ in found] == nanoseconds(log["time_s"])
    assert [ns for _, ns, _ in found] == nanoseconds(log[moment])
    assert [m.timestamp.seconds * 10**9 + m.timestamp.nanos for _, _, m in found] == nanoseconds(log[moment])
    assert {m.frame_id for _, _, m in found} == {"camera_head"}
    assert np.array_equal([place(m.pose) for _, _, m in found], log[[f"{of}_{axis}" for axis in POSE]])


def test_commands_and_state_are_the_other_columns(trial):
    log = rows(trial)
    commands, state = messages(trial / "trial.mcap", "/commands"), messages(trial / "trial.mcap", "/state")
    for found in (commands, state):
        assert [log_ns for log_ns, _, _ in found] == nanoseconds(log["time_s"])
    names = [[field.name for field in found[0][2].DESCRIPTOR.fields] for found in (commands, state)]
    assert names[0] == ["surge_left_v", "surge_right_v", "sway_v", "heave_v"]
    for found, columns in zip((commands, state), names):
        for name in columns:
            assert [getattr(m, name) for _, _, m in found] == list(log[name]), name
    posed = [column for column in log if column.startswith(("est_", "true_", "vehicle_"))]
    assert {*names[0], *names[1], *posed, "image_time_s"} == set(log)


def test_steps_of_the_physics_come_along(tmp_path):
    folder = recorded(tmp_path / "steps", "estimator.pose_source=true_pose", "trial.duration_s=0.5", more=["--motion"])
    found, log = messages(logs.to_mcap(folder), "/motion"), read_motion(folder / "motion.csv")
    assert len(found) == len(log["time_s"]) > 200
    assert [log_ns for log_ns, _, _ in found] == nanoseconds(log["time_s"])
    assert {field.name for field in found[0][2].DESCRIPTOR.fields} == set(log)
    for column, values in log.items():
        assert np.array_equal([getattr(m, column) for _, _, m in found], values, equal_nan=True)


def test_as_messages_of_ros_2_it_is_the_same_for_their_readers(trial, tmp_path):
    """Read by the schemas in the file alone, and by turbidock-bag."""
    file, log = logs.to_mcap(trial, tmp_path / "ros2.mcap", ros2=True), rows(trial)

    def found(topic):
        return messages(file, topic, Ros2Factory)

    for _, ns, m in found("/estimate"):
        assert (m.header.stamp.sec * 10**9 + m.header.stamp.nanosec, m.header.frame_id) == (ns, "camera_head")
    assert np.array_equal([place(m.pose) for _, _, m in found("/estimate")], log[[f"est_{axis}" for axis in POSE]])
    moving = [{t.child_frame_id: t for t in m.transforms} for _, _, m in found("/tf")]
    assert {child: t.header.frame_id for child, t in moving[3].items()} == {
        "vehicle": "world", "marker": "world", "marker_estimated": "camera_head"}
    assert [m.stage for _, _, m in found("/state")] == list(log["stage"])
    assert [m.level for _, _, m in found("/log")][::2] == [20, 30]  # information, warning
    for topic in ("/left/image", "/right/image"):
        assert [(ns, m.data) for _, ns, m in found(topic)] == [(ns, m.data) for _, ns, m in messages(trial / "trial.mcap", topic)]
    (_, _, info), (_, _, known) = found("/right/camera_info")[0], messages(trial / "trial.mcap", "/right/calibration")[0]
    assert (info.width, list(info.k), list(info.p)) == (known.width, list(known.K), list(known.P))
    volts = ["surge_left_v", "surge_right_v", "sway_v", "heave_v"]
    bag = logs.read_bag(file, {"images": {side: f"/{side}/image" for side in ("left", "right")},
                               "camera_info": {side: f"/{side}/camera_info" for side in ("left", "right")},
                               "motion": {"odometry": "/tf[vehicle]",
                                          "commands": {"topic": "/commands", "field": volts, "columns": volts}}})
    assert len(bag.pairs) == len(found("/left/image")) > 2
    assert bag.notes == ["/commands: its messages say no time, the log's is taken."]  # not of /tf, whose first stamp is 0, as it is logged
    for column in ["time_s", *volts, *(f"vehicle_{axis}" for axis in POSE)]:
        assert np.allclose(bag.motion[column], log[column], atol=1e-9), column


def test_the_frames_put_the_marker_where_the_scene_has_it(docked):
    """This station does not move: the marker, which the truth has in the camera head, stands still in the world."""
    (_, _, static), = messages(docked / "trial.mcap", "/tf_static")
    mounted = {t.child_frame_id: place(t, "translation", "rotation") for t in static.transforms}
    scene = json.loads(turbidock._core.trial_model(turbidock.Scenario("sea_night_active")._cpp))["scene"]
    for (log_ns, _, moving), row in zip(messages(docked / "trial.mcap", "/tf"), rows(docked).itertuples(), strict=True):
        frames = {t.child_frame_id: (t.parent_frame_id, place(t, "translation", "rotation")) for t in moving.transforms}
        assert {child: parent for child, (parent, _) in frames.items()} == {
            "vehicle": "world", "marker": "world", "marker_estimated": "camera_head"}
        assert np.allclose(frames["marker"][1], scene["X_WM"], atol=1e-5)
        vehicle = frames["vehicle"][1]
        head = rotation(vehicle[3:]) @ mounted["camera_head"][:3] + vehicle[:3]
        assert np.linalg.norm(frames["marker"][1][:3] - head) == pytest.approx(
            np.linalg.norm([row.true_x_m, row.true_y_m, row.true_z_m]), abs=1e-5)
        stamps = {t.child_frame_id: t.timestamp.ToNanoseconds() for t in moving.transforms}
        assert stamps == {"vehicle": log_ns, "marker": log_ns, "marker_estimated": round(1e9 * row.image_time_s)}


def test_pictures_are_those_kept_and_show_the_balls_where_the_truth_at_their_stamp_says(trial):
    log = rows(trial).set_index("frame")
    truths = {ns: place(m.pose) for _, ns, m in messages(trial / "trial.mcap", "/truth_at_image")}
    (_, _, static), = messages(trial / "trial.mcap", "/tf_static")
    mounted = {t.child_frame_id: place(t, "translation", "rotation") for t in static.transforms}
    for side in ("left", "right"):
        files = sorted((trial / "cameras").glob(f"*_{side}.jpg"))
        files = [file for file in files if log["image_time_s"][int(file.name[:6])] > 0]
        found = [each for each in messages(trial / "trial.mcap", f"/{side}/image") if each[1] > 0]
        assert len(found) == len(files) > 2
        (_, _, camera), = messages(trial / "trial.mcap", f"/{side}/calibration")
        K, P = np.reshape(camera.K, (3, 3)), np.reshape(camera.P, (3, 4))
        eye = mounted[f"{side}_camera"]
        for file, (log_ns, ns, m) in zip(files, found):
            assert m.data == file.read_bytes() and (m.format, m.frame_id) == ("jpeg", f"{side}_camera")
            assert log_ns == round(1e9 * log["time_s"][int(file.name[:6])]) == ns + 10**8
            image = np.asarray(Image.open(io.BytesIO(m.data)), float)
            assert image.shape == (camera.height, camera.width, 3)
            truth = truths[ns]
            for channel, ball in enumerate([(0, 0, 0.07), (-0.07, 0, 0), (0, -0.07, 0)]):  # red, green, blue
                in_head = rotation(truth[3:]) @ ball + truth[:3]
                in_eye = rotation(eye[3:]).T @ (in_head - eye[:3])
                u, v, w = K @ in_eye
                left = rotation(mounted["left_camera"][3:]).T @ (in_head - mounted["left_camera"][:3])
                assert np.allclose(P @ [*left, 1], [u, v, w], atol=1e-3)
                patch = image[round(v / w) - 1:round(v / w) + 2, round(u / w) - 1:round(u / w) + 2].mean(axis=(0, 1))
                assert patch.argmax() == channel, (side, ns, ball, patch)


def test_stages_reasons_and_the_outcome_are_log_messages(docked):
    record = json.loads((docked / "result.json").read_text())
    fps = turbidock.Scenario("sea_night_active").trial.clock.frames_per_second
    found = messages(docked / "trial.mcap", "/log")
    said = [(log_ns, m.message) for log_ns, _, m in found]
    assert len(record["transitions"]) == 3
    for change in record["transitions"]:
        assert (round(1e9 * change["frame"] / fps), f"{change['from']} -> {change['to']}: {change['reason']}") in said
    assert said[-1][1] == f"success: {record['reason']}" and len(said) == 2 + 3
    assert [m.level for _, _, m in found] == [2] * 5  # INFO


def test_what_did_not_dock_ends_with_a_warning(trial):
    last = messages(trial / "trial.mcap", "/log")[-1][2]
    assert last.message.startswith("timeout: ") and last.level == 3


def test_the_scene_has_station_vehicle_and_marker(docked):
    (_, _, update), = messages(docked / "trial.mcap", "/scene")
    entities = {entity.id: entity for entity in update.entities}
    assert {e.frame_id for e in update.entities} == {"world", "vehicle", "marker_estimated"}
    scene = json.loads(turbidock._core.trial_model(turbidock.Scenario("sea_night_active")._cpp))["scene"]
    drawn = sum(len(e.cubes) + len(e.cylinders) + len(e.triangles) + len(e.spheres) for e in update.entities)
    capsules = sum(geom["shape"] == "capsule" for geom in scene["geoms"])
    assert drawn == len(scene["geoms"]) + 2 * capsules + 3  # both ends of each, and the estimate's balls
    balls = sorted((ball.pose.position.x, ball.pose.position.y, ball.pose.position.z) for ball in
                   entities["estimate of marker_estimated"].spheres)
    assert np.allclose(balls, [(-0.07, 0, 0), (0, -0.07, 0), (0, 0, 0.07)])
    box = entities["marker of world"].cubes[0]
    assert (box.size.x, box.size.y, box.size.z) == pytest.approx((0.1, 0.1, 0.1))
    assert box.pose.position.z == pytest.approx(scene["X_WM"][2])
    # A capsule: the pole's ends are 0.5 m ahead of B and where its fromto begins, less a radius.
    pole = entities["pole of vehicle"]
    reach = [ball.pose.position.x + side * ball.size.x / 2 for side, ball in zip((1, -1), pole.spheres)]
    assert reach == pytest.approx([0.5, -0.0175], abs=1e-5)


def test_every_schema_is_whole_and_foxgloves_own(trial):
    with open(trial / "trial.mcap", "rb") as stream:
        schemas = list(make_reader(stream).get_summary().schemas.values())
    assert len(schemas) == 8
    for schema in schemas:
        pool, files = DescriptorPool(), FileDescriptorSet.FromString(schema.data).file
        for file in files:  # each after what it needs, or this raises
            pool.AddSerializedFile(file.SerializeToString())
        message = pool.FindMessageTypeByName(schema.name)
        if schema.name.startswith("foxglove."):
            known = Default().FindMessageTypeByName(schema.name)
            assert [(f.name, f.number, f.type) for f in message.fields] == [(f.name, f.number, f.type) for f in known.fields]
        else:
            assert schema.name in ("turbidock.State", "turbidock.Commands")


def test_the_record_comes_along(trial):
    with open(trial / "trial.mcap", "rb") as stream:
        reader = make_reader(stream)
        attached = {each.name: each.data for each in reader.iter_attachments()}
        stream.seek(0)
        said, = reader.iter_metadata()
    record = json.loads((trial / "result.json").read_text())
    assert attached == {name: (trial / name).read_bytes() for name in ("result.json", "resolved.yaml")}
    assert said.name == "turbidock" and said.metadata["digest"] == record["digest"]


def test_the_reader_of_web_pages_finds_the_same(trial):
    read = subprocess.run(["node", HERE / "mcap_reader/read.mjs", trial / "trial.mcap"], check=True, capture_output=True, text=True)
    topics, log = json.loads(read.stdout), rows(trial)
    estimate = [each["value"]["pose"] for each in topics["/estimate"]]
    assert np.array_equal([[p["position"][a] for a in "xyz"] + [p["orientation"][a] for a in "wxyz"] for p in estimate],
                          log[[f"est_{axis}" for axis in POSE]])
    assert [each["publish_ns"] for each in topics["/estimate"]] == nanoseconds(log["image_time_s"])
    for topic, columns in (("/state", ["fitness", "stage", "heave_mps"]), ("/commands", ["sway_v"])):
        for column in columns:
            assert [each["value"][column] for each in topics[topic]] == list(log[column])
    kept = {base64.b64encode(file.read_bytes()).decode() for file in (trial / "cameras").glob("*_left.jpg")}
    assert {each["value"]["data"] for each in topics["/left/image"]} == kept


def test_all_images_by_flying_again(tmp_path, trial):
    file = logs.to_mcap(trial, tmp_path / "all.mcap", images=True)
    log = rows(trial)
    found = messages(file, "/right/image")
    assert [ns for _, ns, _ in found] == sorted(set(nanoseconds(log["image_time_s"])))
    (_, _, camera), = messages(file, "/right/calibration")
    rig = turbidock.Trial("sea_night_active").rig
    assert (camera.width, camera.height) == (rig.width, rig.height)
    assert camera.K == [rig.fx, 0, rig.cx, 0, rig.fy, rig.cy, 0, 0, 1]
    assert camera.P[3] == pytest.approx(-rig.fx * rig.baseline_m)
    assert Image.open(io.BytesIO(found[-1][2].data)).size == (rig.width, rig.height)


def test_a_result_and_a_replay_of_a_batch_are_trials_too(tmp_path):
    result = turbidock.run("pool_active", seed=3, settings={**QUICK, "trial.duration_s": 1})
    file = logs.to_mcap(result, tmp_path / "result.mcap")
    assert len(messages(file, "/tf")) == len(result.trajectory)
    turbidock.batch({"scenario": "pool_active", "seeds": 2, "set": {**QUICK, "trial.duration_s": 1}}, tmp_path / "b.db", workers=1)
    subprocess.run([os.environ.get("PROGRAM", "build/bin/turbidock"), "replay", tmp_path / "b.db", "1", "--no-video", "--quiet",
                    "--out", tmp_path / "replay"], check=True)
    assert len(messages(logs.to_mcap(tmp_path / "replay"), "/tf")) == 30


def test_the_record_of_another_trial_is_said_and_nothing_is_left(tmp_path, trial):
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("result.json", "resolved.yaml", "trajectory.csv"):
        (copy / name).write_bytes((trial / name).read_bytes())
    record = json.loads((copy / "result.json").read_text())
    (copy / "result.json").write_text(json.dumps(record | {"digest": "0123456789abcdef"}))
    with pytest.raises(turbidock.SimulatorFault, match="digest 0123456789abcdef, and run again"):
        logs.to_mcap(copy, images=True)
    assert {file.name for file in copy.iterdir()} == {"result.json", "resolved.yaml", "trajectory.csv"}


def test_bad_input_is_one_line(tmp_path, docked):
    def command(*words):
        done = subprocess.run([sys.executable, "-c", "from turbidock import _program; _program.mcap()", *map(str, words)],
                              capture_output=True, text=True)
        assert (done.returncode, done.stdout) == (2, "")
        line, = done.stderr.splitlines()
        return line

    assert command(tmp_path).endswith("is no trial's folder: it has no result.json")
    assert "true_pose: the trial has no images" in command(docked, tmp_path / "a.mcap", "--images")
    assert "result.json: cannot be made: File exists" in command(docked, docked / "result.json/a.mcap")
    assert "result.json/b: cannot be made: Not a directory" in command(docked, docked / "result.json/b/a.mcap")
    for name in ("result.json", "resolved.yaml", "trajectory.csv"):
        (tmp_path / name).write_bytes((docked / name).read_bytes())
    cut = (docked / "trajectory.csv").read_text()[:5000]
    (tmp_path / "trajectory.csv").write_text(cut)
    assert f"trajectory.csv:{cut.count(chr(10)) + 1}: has " in command(tmp_path)
    (tmp_path / "trajectory.csv").write_bytes((docked / "trajectory.csv").read_bytes())
    (tmp_path / "result.json").write_text("{")
    assert "result.json: is no JSON" in command(tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"result.json", "resolved.yaml", "trajectory.csv"}


def test_without_the_extra_everything_else_works_and_this_says_what_to_install():
    code = "import sys; sys.modules['mcap'] = None; import turbidock; turbidock.keys(); from turbidock import logs; logs.to_mcap('x')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "ImportError: mcap" in done.stderr.splitlines()[-1] and "pip install '.[logs]'" in done.stderr.splitlines()[-1]
