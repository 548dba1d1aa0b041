"""Pairs of images of a log, and the rig that took them."""

from __future__ import annotations

import pathlib
from typing import Any, Mapping, Sequence

import numpy as np
from PIL import Image

from .._core import ConfigError
from .motion import TURN_RATE, Motion

SIDES = ("left", "right")
MODES = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}
TOGETHER_NS = 1_000_000  # of the images of a pair: nearer ones count as taken at once


def write_image(message: Any, stem: pathlib.Path, topic: str) -> None:
    """As PNG, or as it was compressed. ConfigError for an encoding that is no picture yet."""
    data = np.asarray(message.data, np.uint8)
    encoding = getattr(message, "encoding", "") or message.format.split(";")[0].strip()
    if encoding.startswith("bayer") or not hasattr(message, "format") and encoding not in MODES:
        raise ConfigError(f"{topic}: encoding {encoding}, must be {', '.join(MODES)} (image_proc makes them)")
    if hasattr(message, "format"):
        start = data[:4].tobytes()
        kind = ".jpg" if start.startswith(b"\xff\xd8") else ".png" if start == b"\x89PNG" else ""
        if not kind:
            raise ConfigError(f"{topic}: an image of format '{message.format}' is neither JPEG nor PNG")
        stem.with_suffix(kind).write_bytes(data.tobytes())
        return
    channels = MODES[encoding]
    if len(data) != message.height * message.step or message.step < message.width * channels:
        raise ConfigError(f"{topic}: an image of {message.width} x {message.height} with {len(data)} bytes")
    pixels = data.reshape(message.height, message.step)[:, :message.width * channels]
    pixels = pixels.reshape(message.height, message.width, channels)
    pixels = pixels[:, :, 2::-1] if encoding.startswith("bgr") else pixels[:, :, :3]
    Image.fromarray(pixels.squeeze(2) if channels == 1 else pixels).save(stem.with_suffix(".png"), compress_level=1)


def pairs_of(times_ns: Mapping[str, Sequence[int]], images: Mapping[str, str], notes: list[str]) -> list[tuple[int, int]]:
    """Images of both sides that are each other's nearest, and nearer than half a step. ConfigError for none."""
    left, right = (np.unique(np.array(times_ns[images[side]], np.int64)) for side in SIDES)
    for side, once in zip(SIDES, (left, right)):
        if twins := len(times_ns[images[side]]) - len(once):
            notes.append(f"{images[side]}: {twins} images have the stamp of another and count once.")
    steps = [np.median(np.diff(side)) for side in (left, right) if len(side) > 1]
    within_ns = min(steps, default=40e6) / 2

    def nearest(of: Any, to: Any) -> Any:
        after = np.clip(np.searchsorted(to, of), 1, max(len(to) - 1, 1))
        last = np.minimum(after, len(to) - 1)
        return np.where(of - to[after - 1] <= abs(to[last] - of), after - 1, last)

    partner, back = nearest(left, right), nearest(right, left)
    apart = abs(right[partner] - left)
    pairs = [(int(left[i]), int(right[j])) for i, j in enumerate(partner) if back[j] == i and apart[i] < within_ns]
    if not pairs:
        raise ConfigError(f"{images['left']} and {images['right']}: no pair of images: the nearest are "
                          f"{apart.min() / 1e9:.3f} s apart, half a step is {within_ns / 1e9:.3f} s")
    for side, every, paired in zip(SIDES, (left, right), zip(*pairs)):
        if alone := len(every) - len(paired):
            first = np.flatnonzero(~np.isin(every, paired))[0]
            notes.append(f"{images[side]}: {alone} of {len(every)} images have no partner within {within_ns / 1e9:.3f} s and are "
                         f"left out, the first is number {first}.")
    return pairs


def apart_note(pairs: Sequence[tuple[int, int]], infos: Mapping[str, Any]) -> list[str]:
    """How far apart in time the images of the pairs are, and what motion makes of it: the marker of a vehicle that moves aside by
    dy between them seems to be dx = x dy / baseline farther or nearer, x its distance."""
    apart_s = np.array([abs(right - left) for left, right in pairs]) / 1e9
    middle = float(np.median(apart_s))
    if max(apart_s) * 1e9 < TOGETHER_NS:
        return []
    aside_m = 0.1 * middle
    words = f"at 0.1 m/s aside that is {1000 * aside_m:.1f} mm"
    P = [float(value) for value in _of(infos["right"], "P")] if "right" in infos else []
    if len(P) == 12 and P[0] and P[3]:
        words += f", which makes x wrong by {1000 * aside_m / abs(P[3] / P[0]):.0f} mm at 1 m"
    return [f"left and right images are {1000 * middle:.1f} ms apart (median; {1000 * max(apart_s):.1f} ms at most): {words}."]


def widen(records: Sequence[Mapping[str, Any]], pairs: Sequence[Mapping[str, str]], motion: Motion, baseline_m: float) -> None:
    """The records' deviations, by how far the marker shifts as the vehicle turns between a pair's images, aside, up, and by that
    x dy / baseline ahead. `pairs`: rows of times.csv. The camera head is taken to have the vehicle's axes."""
    there = np.isfinite([motion[column] for column in TURN_RATE]).all(axis=0)
    for record, pair in zip(records, pairs):
        if record["position_deviation_m"] is not None:
            rate = [np.interp(float(pair["time_s"]), motion["time_s"][there], motion[column][there]) for column in TURN_RATE]
            _, left, up = np.cross(record["position_m"], rate) * (int(pair["right_ns"]) - int(pair["left_ns"])) / 1e9
            shift = record["position_m"][0] * left / baseline_m, left, up
            record["position_deviation_m"][:] = np.hypot(record["position_deviation_m"], shift).tolist()


def _of(info: Any, name: str) -> Any:
    """A field of a camera_info, which ROS 1 and ROS 2 write differently."""
    return getattr(info, name, getattr(info, name.lower(), ()))


def rig_text(info: Any, topic: str) -> str:
    """A camera_info as `estimate --rig` takes it: of its images, which may be a region of the sensor's and binned
    (sensor_msgs/CameraInfo; image_geometry's PinholeCameraModel)."""
    K, D, R, P = ([float(v) for v in _of(info, name)] for name in "KDRP")
    if not any(K):
        raise ConfigError(f"{topic}: its camera matrix is zero: the camera is not calibrated")
    across, down = max(info.binning_x, 1), max(info.binning_y, 1)
    width, height = info.roi.width or info.width, info.roi.height or info.height
    for matrix, row in ((K, 3), (P, 4)):
        matrix[2] -= info.roi.x_offset
        matrix[row + 2] -= info.roi.y_offset
        matrix[:row] = [value / across for value in matrix[:row]]
        matrix[row:2 * row] = [value / down for value in matrix[row:2 * row]]
    model, D = info.distortion_model or "plumb_bob", D or [0.0] * 5
    return (f"# from {topic}\nimage_width: {width // across}\nimage_height: {height // down}\ndistortion_model: {model}\n"
            + "".join(f"{key}: {{rows: {rows}, cols: {len(values) // rows}, data: {values}}}\n" for key, rows, values in (
                ("camera_matrix", 3, K), ("distortion_coefficients", 1, D), ("rectification_matrix", 3, R), ("projection_matrix", 3, P))))
