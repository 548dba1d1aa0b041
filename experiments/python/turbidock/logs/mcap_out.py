"""Trials and estimates as MCAP, which Foxglove, Rerun and every reader of MCAP open: `to_mcap`, `turbidock-mcap`; with `--ros2`
as messages of ROS 2, /left/camera_info for /left/calibration and without /scene.

Messages are protobuf with Foxglove's schemas; rows of numbers have a schema of their own, which the file holds. Logged when the vehicle
acted (simulated seconds); an image and an estimate are stamped with the image's exposure, cameras.delay_frames before.

| Topic | Schema | |
|---|---|---|
| `/tf`, `/tf_static` | foxglove.FrameTransforms | world > vehicle > camera_head > left_camera, right_camera; |
| | | world > marker, the truth; camera_head > marker_estimated |
| `/estimate`, `/truth`, `/truth_at_image` | foxglove.PoseInFrame | of the marker in camera_head |
| `/left/image`, `/left/calibration`, `/right/...` | foxglove.CompressedImage, CameraCalibration | |
| `/commands` | turbidock.Commands | of each thruster |
| `/state` | turbidock.State | stage, F (`fitness`), desired pose, speeds, forces: the other columns of trajectory.csv |
| `/motion` | turbidock.Motion | motion.csv of `run --motion`, where there is one: a row a step of the physics |
| `/log` | foxglove.Log | changes of stage with their reasons, settings that were changed, the outcome |
| `/scene` | foxglove.SceneUpdate | station, vehicle and marker as MuJoCo has them; the estimated balls, transparent |

result.json and resolved.yaml are attached. Needs `pip install '.[logs]'`.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import json
import os
import pathlib
import re
import tempfile
from typing import Any, Iterable, Iterator, Mapping, Sequence

import numpy as np
from foxglove_schemas_protobuf import (CameraCalibration_pb2, Color_pb2, CompressedImage_pb2, CubePrimitive_pb2,
                                       CylinderPrimitive_pb2, FrameTransform_pb2, FrameTransforms_pb2, Log_pb2, Point3_pb2,
                                       Pose_pb2, PoseInFrame_pb2, Quaternion_pb2, SceneEntity_pb2, SceneUpdate_pb2,
                                       SpherePrimitive_pb2, TriangleListPrimitive_pb2, Vector3_pb2)
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.well_known import MessageEncoding
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema
from PIL import Image
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from .. import _core
from .._rotation import product, rotated
from ..results import Result
from ..scenario import Path, Scenario
from ..trial import Trial
from .motion import Motion, read_motion, whole_file

Place = Sequence[float]  # x, y, z [m], qw, qx, qy, qz
# What Foxglove's messages are in ROS 2, and where the fields of that are in them ("": they themselves).
ROS = {"FrameTransforms": "tf2_msgs/msg/TFMessage", "PoseInFrame": "geometry_msgs/msg/PoseStamped", "Log": "rcl_interfaces/msg/Log",
       "CompressedImage": "sensor_msgs/msg/CompressedImage", "CameraCalibration": "sensor_msgs/msg/CameraInfo"}
NAMES = {"header": "", "transform": "", "stamp": "timestamp", "sec": "seconds", "nanosec": "nanos", "msg": "message"} | {
    name.lower(): name for name in "DKRP"}


class McapFile(contextlib.AbstractContextManager["McapFile"]):
    """An MCAP file that is being written; it has its name once it is whole. Times are nanoseconds."""

    def __init__(self, file: Path, profile: str = "") -> None:
        self._types: dict[str, type[Message]] = {}
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._file = whole_file(file)
        try:
            self._writer = Writer(self._file.__enter__())
        except OSError as error:
            raise _core.ConfigError(f"{os.fspath(file)}: {error.strerror}") from None
        self._writer.start(profile=profile, library=f"turbidock {_core.version()}")

    def __exit__(self, _: object, error: BaseException | None, *__: object) -> None:
        with contextlib.ExitStack() as stack:
            stack.push(self._file)
            if error is not None:
                raise error
            self._writer.finish()  # type: ignore[no-untyped-call]

    def write(self, topic: str, message: Message, log_ns: int, stamp_ns: int | None = None) -> None:
        """A message, published at its stamp: when it was logged unless given."""
        if topic not in self._channels:
            kind = message.DESCRIPTOR.full_name
            if kind not in self._schemas:
                self._schemas[kind] = register_schema(self._writer, type(message))
            self._channels[topic] = self._writer.register_channel(topic, MessageEncoding.Protobuf, self._schemas[kind])
        self._writer.add_message(self._channels[topic], log_ns, message.SerializeToString(), log_ns if stamp_ns is None else stamp_ns)

    def write_row(self, topic: str, name: str, row: Mapping[str, float | str], log_ns: int) -> None:
        """Numbers and words by their names, as a message turbidock.NAME whose fields are the first row's."""
        if topic not in self._types:
            self._types[topic] = _row_type(name, row)
        self.write(topic, self._types[topic](**{re.sub(r"\W", "_", key): value for key, value in row.items()}), log_ns)

    def log(self, words: str, log_ns: int, warning: bool = False) -> None:
        """A line of the topic /log."""
        self.write("/log", Log_pb2.Log(timestamp=stamp(log_ns), level=Log_pb2.Log.WARNING if warning else Log_pb2.Log.INFO,
                                       name="turbidock", message=words), log_ns)

    def write_transforms(self, topic: str, log_ns: int, *transforms: tuple[str, str, Place, int]) -> None:
        """Parent, child, pose of the child in the parent, and the moment of each."""
        self.write(topic, FrameTransforms_pb2.FrameTransforms(transforms=[
            FrameTransform_pb2.FrameTransform(timestamp=stamp(at), parent_frame_id=parent, child_frame_id=child, translation=_vector(*p[:3]),
                                              rotation=_pose(p).orientation) for parent, child, p, at in transforms]), log_ns)

    def write_pose(self, topic: str, pose: Place, log_ns: int, stamp_ns: int) -> None:
        """A pose of the marker in the camera head."""
        self.write(topic, PoseInFrame_pb2.PoseInFrame(timestamp=stamp(stamp_ns), frame_id="camera_head", pose=_pose(pose)),
                   log_ns, stamp_ns)

    def attach(self, words: dict[str, str], *files: pathlib.Path) -> None:
        """The metadata `turbidock`, and files as attachments."""
        self._writer.add_metadata("turbidock", words)
        for file in files:
            self._writer.add_attachment(0, 0, file.name, f"application/{file.suffix[1:]}", file.read_bytes())


class Ros2File(McapFile):
    """The same as messages of ROS 2, but for the scene: for rosbag2 and `turbidock-bag`. Rows have no stamp."""

    def __init__(self, file: Path) -> None:
        super().__init__(file, "ros2")
        self._store: Any = get_typestore(Stores.ROS2_HUMBLE)

    def write(self, topic: str, message: Message, log_ns: int, stamp_ns: int | None = None) -> None:
        name = message.DESCRIPTOR.name
        if name == "SceneUpdate":
            return
        kind = ROS.get(name, f"turbidock_msgs/msg/{name}")
        if kind not in self._store.types:
            fields = message.DESCRIPTOR.fields
            self._store.register(get_types_from_msg("".join(
                f"{'string' if field.type == field.TYPE_STRING else 'float64'} {field.name}\n" for field in fields), kind))
        if topic not in self._channels:
            text, _ = self._store.generate_msgdef(kind, ros_version=2)
            schema = self._writer.register_schema(kind, "ros2msg", text.encode())
            self._channels[topic] = self._writer.register_channel(topic.replace("calibration", "camera_info"), "cdr", schema)
        self._writer.add_message(self._channels[topic], log_ns, bytes(self._store.serialize_cdr(self._made(kind, message), kind)),
                                 log_ns if stamp_ns is None else stamp_ns)

    def _made(self, kind: str, given: Any) -> Any:
        """A message of ROS 2 with what one of Foxglove's has; what that lacks is zero or empty."""
        made: dict[str, Any] = {}
        for name, (node, of) in self._store.fielddefs[kind][1]:
            way = "parent_frame_id" if hasattr(given, "parent_frame_id") and name == "frame_id" else NAMES.get(name, name)
            value: Any = getattr(given, way, None) if way else given
            if node.name == "NAME":
                made[name] = self._made(of, value)
            elif node.name == "BASE":
                made[name] = ("" if of[0] == "string" else 0) if value is None else 10 * value if name == "level" else value
            elif of[0][0].name == "NAME":
                made[name] = [self._made(of[0][1], each) for each in value]
            else:
                made[name] = np.frombuffer(value, np.uint8) if isinstance(value, bytes) else np.array(value)
        return self._store.types[kind](**made)


def stamp(ns: int) -> Timestamp:
    """Nanoseconds as protobuf has them."""
    return Timestamp(seconds=ns // 10**9, nanos=ns % 10**9)


def _row_type(name: str, row: Mapping[str, float | str]) -> type[Message]:
    file = FileDescriptorProto(name=f"turbidock/{name}.proto", package="turbidock", syntax="proto3")
    fields = file.message_type.add(name=name).field
    for number, (key, value) in enumerate(row.items(), 1):
        kind = FieldDescriptorProto.TYPE_STRING if isinstance(value, str) else FieldDescriptorProto.TYPE_DOUBLE
        fields.add(name=re.sub(r"\W", "_", key), number=number, label=FieldDescriptorProto.LABEL_OPTIONAL, type=kind)
    pool = DescriptorPool()
    pool.AddSerializedFile(file.SerializeToString())
    return GetMessageClass(pool.FindMessageTypeByName(f"turbidock.{name}"))


def _vector(x: float, y: float, z: float) -> Vector3_pb2.Vector3:
    return Vector3_pb2.Vector3(x=x, y=y, z=z)


def _pose(p: Place) -> Pose_pb2.Pose:
    return Pose_pb2.Pose(position=_vector(*p[:3]), orientation=Quaternion_pb2.Quaternion(w=p[3], x=p[4], y=p[5], z=p[6]))


def _compose(a: Place, b: Place) -> Place:
    """X_AC of X_AB and X_BC."""
    turn = np.asarray(a[3:], float)
    return [*(rotated(turn, np.asarray(b[:3], float)) + a[:3]), *product(turn, np.asarray(b[3:], float))]


def _primitives(geom: Mapping[str, Any], meshes: Sequence[Mapping[str, Any]]) -> dict[str, list[Message]]:
    """A geom of the scene as primitives by their kind."""
    a, b, c = geom["size_m"]
    shape, place = geom["shape"], geom["pose"]
    # albedo is linear; what surrounds the station is seen through
    r, g, blue, alpha = (min(max(share, 0), 1) for share in geom["rgba"])
    color = Color_pb2.Color(r=r ** (1 / 2.2), g=g ** (1 / 2.2), b=blue ** (1 / 2.2), a=0.15 if geom["part"] == "environment" else alpha)

    def ball(at: Place, x: float, y: float, z: float) -> Message:
        return SpherePrimitive_pb2.SpherePrimitive(pose=_pose(at), size=_vector(2 * x, 2 * y, 2 * z), color=color)

    if shape in ("box", "plane"):
        x, y, z = (a, b, c) if shape == "box" else (a or 15, b or 15, 0.0005)
        return {"cubes": [CubePrimitive_pb2.CubePrimitive(pose=_pose(place), size=_vector(2 * x, 2 * y, 2 * z), color=color)]}
    if shape in ("sphere", "ellipsoid"):
        return {"spheres": [ball(place, a, *((a, a) if shape == "sphere" else (b, c)))]}
    if shape == "mesh":
        mesh = meshes[geom["mesh"]]
        points = [Point3_pb2.Point3(x=x, y=y, z=z) for x, y, z in zip(*(mesh["vertices_m"][i::3] for i in range(3)))]
        return {"triangles": [TriangleListPrimitive_pb2.TriangleListPrimitive(pose=_pose(place), points=points, color=color,
                                                                              indices=mesh["triangles"])]}
    tube = CylinderPrimitive_pb2.CylinderPrimitive(pose=_pose(place), size=_vector(2 * a, 2 * a, 2 * b), bottom_scale=1, top_scale=1, color=color)
    ends = [ball(_compose(place, (0, 0, z, 1, 0, 0, 0)), a, a, a) for z in (-b, b)] if shape == "capsule" else []
    return {"cylinders": [tube], "spheres": ends}


def _scene(model: Mapping[str, Any]) -> SceneUpdate_pb2.SceneUpdate:
    """Every part of the scene, in the frame that it moves with, and the estimate's balls."""
    entities: dict[str, SceneEntity_pb2.SceneEntity] = {}

    def entity(name: str, frame: str) -> SceneEntity_pb2.SceneEntity:
        return entities.setdefault(name + frame, SceneEntity_pb2.SceneEntity(timestamp=stamp(0), id=f"{name} of {frame}",
                                                                             frame_id=frame, frame_locked=True))

    for geom in model["scene"]["geoms"]:
        part = entity(geom["part"], "marker" if geom["fixed_to"] == "moored_body" else geom["fixed_to"])
        for kind, primitives in _primitives(geom, model["scene"]["meshes"]).items():
            getattr(part, kind).extend(primitives)
    for ball in model["marker"]["balls"]:
        size, (r, g, b) = 2 * ball["radius_m"], ball["display_rgb"]
        entity("estimate", "marker_estimated").spheres.append(SpherePrimitive_pb2.SpherePrimitive(
            pose=_pose([*ball["p_MQ_m"], 1, 0, 0, 0]), size=_vector(size, size, size), color=Color_pb2.Color(r=r, g=g, b=b, a=0.5)))
    return SceneUpdate_pb2.SceneUpdate(entities=entities.values())


def _kept(folder: pathlib.Path, frames: Iterable[int]) -> Iterator[list[bytes]]:
    """JPEG of both cameras by frame, left and right, that `run --out` kept; empty where there are none."""
    for frame in frames:
        files = [folder / f"{frame:06}_{side}.jpg" for side in ("left", "right")]
        yield [file.read_bytes() for file in files if all(each.exists() for each in files)]


def _flown_again(scenario: Scenario, frames: Iterable[int], digest: str) -> Iterator[list[bytes]]:
    """All of them, in full size: the trial is run again."""
    if scenario["estimator.pose_source"] != "cameras":
        raise _core.ConfigError("estimator.pose_source is true_pose: the trial has no images")
    trial = Trial(scenario, images=True)
    for frame in frames:
        trial.step()
        if trial.frame.frame != frame:
            raise _core.SimulatorFault(f"frame {frame} of the record is {trial.frame.frame} now")
        pictures = [io.BytesIO() for _ in trial.images]
        for image, jpeg in zip(trial.images, pictures):
            Image.fromarray(image).save(jpeg, "JPEG", quality=90)
        yield [jpeg.getvalue() for jpeg in pictures]
    while not trial.ended:
        trial.step()
    if (now := trial.result().digest) != digest:
        raise _core.SimulatorFault(f"the trial was recorded with digest {digest}, and run again it has {now}")


def _calibration(rig: Mapping[str, Any], side: str, jpeg: bytes) -> CameraCalibration_pb2.CameraCalibration:
    """Of images as large as this one: the rig's, scaled about the image's corner."""
    width, height = Image.open(io.BytesIO(jpeg)).size
    share, eye = width / rig["width_px"], rig[side]
    fx, fy = eye["fx_px"] * share, eye["fy_px"] * share
    cx, cy = (eye["cx_px"] + 0.5) * share - 0.5, (eye["cy_px"] + 0.5) * share - 0.5
    # the left camera's y less this one's: the way to the right
    way_m = rig["left"]["X_HC"][1] - eye["X_HC"][1]
    return CameraCalibration_pb2.CameraCalibration(
        timestamp=stamp(0), frame_id=f"{side}_camera", width=width, height=height, distortion_model="plumb_bob", D=[0] * 5,
        K=[fx, 0, cx, 0, fy, cy, 0, 0, 1], R=[1, 0, 0, 0, 1, 0, 0, 0, 1], P=[fx, 0, cx, -fx * way_m, 0, fy, cy, 0, 0, 0, 1, 0])


def to_mcap(run: Path | Result, file: Path = "", *, images: bool = False, ros2: bool = False, plugins: Iterable[type] = ()) -> str:
    """Writes a trial as MCAP and returns the file's name, FOLDER/trial.mcap unless given. `run` is the folder that `turbidock
    run --out` or `turbidock replay` wrote, or a Result. Its pictures are those that the folder has, two a second; `images`
    flies the trial again for all of them. `ros2`: messages of ROS 2 instead of Foxglove's. `plugins`: classes of its controller or
    estimator. ConfigError for what is no trial's folder, SimulatorFault where it flies otherwise; nothing is left half written."""
    if isinstance(run, Result):
        if not file:
            raise _core.ConfigError("a Result has no folder: name the file")
        with tempfile.TemporaryDirectory() as kept:
            run.save(kept)
            return to_mcap(kept, file, images=images, ros2=ros2, plugins=plugins)
    folder = pathlib.Path(run)
    if missing := [name for name in ("result.json", "resolved.yaml", "trajectory.csv") if not (folder / name).is_file()]:
        raise _core.ConfigError(f"{folder}: is no trial's folder: it has no {missing[0]}")
    try:
        record = json.loads((folder / "result.json").read_text("utf-8"))
    except ValueError as error:
        raise _core.ConfigError(f"{folder / 'result.json'}: is no JSON: {error}") from None
    scenario = Scenario.parse((folder / "resolved.yaml").read_text("utf-8"), str(folder / "resolved.yaml"), plugins)
    model = json.loads(_core.trial_model(scenario._cpp))
    if not model["scene"]:
        raise _core.ConfigError(f"{folder}: {model['missing'][0]}")
    rows = read_motion(folder / "trajectory.csv")
    with open(folder / "trajectory.csv", newline="", encoding="utf-8") as text:
        stages = [row["stage"] for row in csv.DictReader(text)]
    frames = rows["frame"].astype(int).tolist()
    pictures = _flown_again(scenario, frames, record["digest"]) if images else _kept(folder / "cameras", frames)
    name = os.fspath(file) or str(folder / "trial.mcap")
    with Ros2File(name) if ros2 else McapFile(name) as out:
        out.attach({"version": record["version"], "digest": record["digest"], "seed": str(record["seed"]), "outcome": record["outcome"],
                    "scenario": str(scenario["description"])}, folder / "result.json", folder / "resolved.yaml")
        _write_trial(out, model, rows, stages, record, pictures)
        if (folder / "motion.csv").exists():
            motion = read_motion(folder / "motion.csv")
            for time_s, values in zip(motion["time_s"], zip(*motion.values())):
                out.write_row("/motion", "Motion", dict(zip(motion, values)), round(1e9 * time_s))
    return name


def _write_trial(out: McapFile, model: Mapping[str, Any], rows: Motion, stages: Sequence[str], record: Mapping[str, Any],
                 pictures: Iterator[list[bytes]]) -> None:
    scene, rig = model["scene"], model["rig"]
    out.write("/scene", _scene(model), 0)
    out.write_transforms("/tf_static", 0, ("vehicle", "camera_head", scene["X_BH"], 0),
                         *(("camera_head", f"{side}_camera", rig[side]["X_HC"], 0) for side in ("left", "right")))
    out.log(model["title"], 0)
    said = [(entry["frame"], f"{entry['from']} -> {entry['to']}: {entry['reason']}") for entry in record["transitions"]]
    said += [(entry["frame"], f"{entry['key']} = {entry['value']}") for entry in record["changes"]]
    poses = {of: [f"{of}_{axis}" for axis in ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")]
             for of in ("est", "true", "true_at_image", "vehicle")}
    placed = {"image_time_s", *(column for columns in poses.values() for column in columns)}
    commands = [column for column in rows if column.endswith("_v")]
    state = [column for column in rows if column not in placed and column not in commands and column != "stage"]
    seen_ns, at = -1, 0
    for i, (images, stage) in enumerate(zip(pictures, stages)):  # in this order, so that all pictures are asked for
        at, image_at, frame = round(1e9 * rows["time_s"][i]), round(1e9 * rows["image_time_s"][i]), int(rows["frame"][i])
        pose = {of: [float(rows[column][i]) for column in columns] for of, columns in poses.items()}
        marker = _compose(_compose(pose["vehicle"], scene["X_BH"]), pose["true"])
        out.write_transforms("/tf", at, ("world", "vehicle", pose["vehicle"], at), ("world", "marker", marker, at),
                             ("camera_head", "marker_estimated", pose["est"], image_at))
        for topic, of, then in (("/estimate", "est", image_at), ("/truth", "true", at), ("/truth_at_image", "true_at_image", image_at)):
            out.write_pose(topic, pose[of], at, then)
        out.write_row("/commands", "Commands", {column: rows[column][i] for column in commands}, at)
        out.write_row("/state", "State", {"stage": stage} | {column: rows[column][i] for column in state}, at)
        for words in (words for when, words in said if when == frame):
            out.log(words, at)
        for side, jpeg in zip(("left", "right"), images):
            if image_at > seen_ns:
                if seen_ns < 0:
                    out.write(f"/{side}/calibration", _calibration(rig, side, jpeg), at)
                out.write(f"/{side}/image", CompressedImage_pb2.CompressedImage(
                    timestamp=stamp(image_at), frame_id=f"{side}_camera", data=jpeg, format="jpeg"), at, image_at)
        seen_ns = image_at
    out.log(f"{record['outcome']}: {record['reason']}", at, warning=record["outcome"] != "success")


def main(words: Sequence[str] | None = None, plugins: Sequence[type] = ()) -> None:
    """turbidock-mcap, with the words of its command line. `plugins`: as to_mcap."""
    parser = argparse.ArgumentParser(prog="turbidock-mcap", description="A recorded trial as MCAP, for Foxglove and Rerun.")
    parser.add_argument("run", help="folder that `turbidock run --out` or `turbidock replay` wrote")
    parser.add_argument("file", nargs="?", default="", help="the file to write; RUN/trial.mcap")
    parser.add_argument("--images", action="store_true", help="fly the trial again for an image of every frame, in full size")
    parser.add_argument("--ros2", action="store_true", help="messages of ROS 2, for rosbag2 and turbidock-bag")
    arguments = parser.parse_args(words)
    print(to_mcap(arguments.run, arguments.file, images=arguments.images, ros2=arguments.ros2, plugins=plugins))
