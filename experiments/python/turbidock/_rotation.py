"""Rotations: quaternions w, x, y, z along the last axis."""

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]


def quaternion_of(roll: Numbers, pitch: Numbers, yaw: Numbers) -> Numbers:
    """w, x, y, z of Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr, cp, sp, cy, sy = (f(0.5 * a) for a in (roll, pitch, yaw) for f in (np.cos, np.sin))
    return np.stack([cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy,
                     cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy], axis=-1)


def angles_of(q: Numbers) -> Numbers:
    """Roll, pitch, yaw of such quaternions."""
    w, x, y, z = (q[..., n] for n in range(4))
    return np.stack([np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), np.arcsin(np.clip(2 * (w * y - z * x), -1, 1)),
                     np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))], axis=-1)


def conjugate(q: Numbers) -> Numbers:
    return np.asarray(q * np.array([1.0, -1, -1, -1]))


def product(a: Numbers, b: Numbers) -> Numbers:
    """Of quaternions, w, x, y, z, along the last axis."""
    w, x, y, z = (a[..., n] for n in range(4))
    i, j, k, m = (b[..., n] for n in range(4))
    return np.stack([w * i - x * j - y * k - z * m, w * j + x * i + y * m - z * k,
                     w * k - x * m + y * i + z * j, w * m + x * k - y * j + z * i], axis=-1)


def vector_of(q: Numbers) -> Numbers:
    """The rotation vector of a quaternion, rad, at most half a turn."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    return np.asarray(q[..., 1:] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0))


def turned(v: Numbers) -> Numbers:
    """The quaternion of a rotation vector."""
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    half = 0.5 * np.sinc(0.5 * angle / np.pi)
    return np.concatenate([np.cos(0.5 * angle), half * v], axis=-1)


def rotated(q: Numbers, v: Numbers) -> Numbers:
    """v of B in W, by R_WB."""
    zero = np.zeros(v.shape[:-1] + (1,))
    return np.asarray(product(product(q, np.concatenate([zero, v], axis=-1)), conjugate(q))[..., 1:])
