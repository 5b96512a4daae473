"""A camera: pinhole plus Brown's distortion (`brown5`: k1 k2 p1 p2 k3 in OpenCV's order), and its inverse.

    x = X/Z, y = Y/Z, r2 = x^2 + y^2, c = 1 + k1 r2 + k2 r2^2 + k3 r2^3
    xd = x c + 2 p1 x y + p2 (r2 + 2 x^2),  yd = y c + p1 (r2 + 2 y^2) + 2 p2 x y
    (u, v) = (fx xd + cx, fy yd + cy)

Camera frame: x right, y down, z forward; pixel (0, 0) is the centre of the top-left pixel.
Theory: docs/theory/twin.md.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .checks import Array

NEAR_MM = 1.0  # a point nearer than this in front of the centre has no image
INVERSE_STEPS = 12
TABLE_PITCH = 8  # px between the nodes of the ray table's first guess


@dataclass(frozen=True)
class Camera:
    """One calibrated camera. `camera_from_room` holds the 16 numbers of the row-major 4 x 4 matrix, mm."""

    id: str
    image_size: tuple[int, int]
    intrinsics: tuple[float, float, float, float]
    distortion: tuple[float, float, float, float, float]
    camera_from_room: tuple[float, ...]
    gain: float = 1.0
    offset_counts: float = 0.0

    @property
    def matrix(self) -> Array:
        """camera_from_room, shape (4, 4), mm."""
        return np.array(self.camera_from_room).reshape(4, 4)

    @property
    def centre(self) -> Array:
        """The projection centre in the room frame, mm, shape (3,)."""
        m = self.matrix
        return -m[:3, :3].T @ m[:3, 3]

    def project(self, points_in_room: ArrayLike) -> Array:
        """Pixels (N, 2) of room points (N, 3), mm; NaN for a point that is not in front of the camera."""
        p = checks.points("points_in_room", points_in_room)
        x, y, z = into_frame(self.camera_from_room, *(p[:, i] for i in range(3)))
        z = np.where(z > NEAR_MM, z, np.nan)
        u, v = self.pixel(x / z, y / z)
        return np.stack([u, v], axis=-1)

    def pixel(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Pixel coordinates of the normalised (undistorted) image point x = X/Z, y = Y/Z."""
        fx, fy, cx, cy = self.intrinsics
        xd, yd = distort(self.distortion, x, y)
        return fx * xd + cx, fy * yd + cy

    def ray(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Normalised image point (x, y) of pixels (u, v): the ray is (x, y, 1) in the camera frame."""
        fx, fy, cx, cy = self.intrinsics
        return undistort(self.distortion, (u - cx) / fx, (v - cy) / fy)

    def room_rays(self, pixels: ArrayLike) -> tuple[Array, Array]:
        """The centre (3,), mm, and unit directions (N, 3), room frame, of pixels (N, 2)."""
        p = checks.points("pixels", pixels, 2)
        x, y = self.ray(p[:, 0], p[:, 1])
        d = np.stack(turned_back(self.camera_from_room, x, y, np.ones_like(x)), axis=-1)
        return self.centre, d / np.sqrt(np.sum(d * d, axis=1, keepdims=True))


def distort(k: tuple[float, ...], x: Array, y: Array) -> tuple[Array, Array]:
    """Brown's distortion of normalised coordinates."""
    k1, k2, p1, p2, k3 = k
    r2 = x * x + y * y
    c = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    xy2 = 2.0 * x * y
    return x * c + p1 * xy2 + p2 * (r2 + 2.0 * x * x), y * c + p1 * (r2 + 2.0 * y * y) + p2 * xy2


def undistort(k: tuple[float, ...], xd: Array, yd: Array, steps: int = INVERSE_STEPS) -> tuple[Array, Array]:
    """Newton's inverse of `distort`, from the distorted point as the first guess."""
    return _newton(k, xd, yd, np.array(xd, dtype=np.float64), np.array(yd, dtype=np.float64), steps)


def _newton(k, xd: Array, yd: Array, x: Array, y: Array, steps: int) -> tuple[Array, Array]:
    k1, k2, p1, p2, k3 = k
    for _ in range(steps):
        r2 = x * x + y * y
        c = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2))  # dc/dx = slope x
        ex = x * c + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) - xd
        ey = y * c + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y - yd
        a = c + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
        b = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
        d = c + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
        det = a * d - b * b
        dx, dy = (d * ex - b * ey) / det, (a * ey - b * ex) / det
        x -= dx
        y -= dy
        if max(np.max(np.abs(dx), initial=0.0), np.max(np.abs(dy), initial=0.0)) < 1e-15:
            break
    return x, y


@functools.lru_cache(maxsize=8)
def ray_table(camera: Camera) -> tuple[Array, Array]:
    """The undistorted (x, y) of every pixel, each (height, width) float64, read-only, computed once.

    Nodes every 8 px are inverted exactly, spread by cubic interpolation and polished by two Newton steps.
    """
    width, height = camera.image_size
    fx, fy, cx, cy = camera.intrinsics
    u = np.arange(-TABLE_PITCH, width + 3 * TABLE_PITCH, TABLE_PITCH, dtype=np.float64)
    v = np.arange(-TABLE_PITCH, height + 3 * TABLE_PITCH, TABLE_PITCH, dtype=np.float64)
    nodes = camera.ray(*np.meshgrid(u, v))
    guess = [np.ascontiguousarray(spread(n, TABLE_PITCH)[:height, :width]) for n in nodes]
    xd = np.broadcast_to((np.arange(width) - cx) / fx, (height, width))
    yd = np.broadcast_to(((np.arange(height) - cy) / fy)[:, None], (height, width))
    for start in range(0, height, 16):  # bands that stay in the cache
        rows = slice(start, start + 16)
        guess[0][rows], guess[1][rows] = _newton(
            camera.distortion, xd[rows], yd[rows], guess[0][rows], guess[1][rows], 2
        )
    for table in guess:
        table.flags.writeable = False
    return guess[0], guess[1]


def spread(nodes: Array, pitch: int) -> Array:
    """Four-point cubic interpolation of a node grid, `pitch` samples a cell.

    Of R x C nodes the outermost ring is support only: the result has ((R - 3) pitch, (C - 3) pitch) samples
    and starts on node (1, 1). Sums run in a fixed order, so the result does not depend on a linear-algebra
    library.
    """
    return _spread_rows(np.ascontiguousarray(_spread_rows(nodes.T, pitch).T), pitch)


def _spread_rows(a: Array, pitch: int) -> Array:
    cells = a.shape[0] - 3
    out = np.empty((cells, pitch, a.shape[1]), dtype=a.dtype)
    for phase in range(pitch):
        s = phase / pitch
        weights = (
            -s * (s - 1) * (s - 2) / 6,
            (s + 1) * (s - 1) * (s - 2) / 2,
            -(s + 1) * s * (s - 2) / 2,
            (s + 1) * s * (s - 1) / 6,
        )
        total = a.dtype.type(weights[0]) * a[:cells]
        for k in range(1, 4):
            total += a.dtype.type(weights[k]) * a[k : k + cells]
        out[:, phase] = total
    return out.reshape(cells * pitch, a.shape[1])


def into_frame(matrix: tuple[float, ...], x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Map points by a row-major 4 x 4 matrix, coordinate by coordinate."""
    m = matrix
    return (
        m[0] * x + m[1] * y + m[2] * z + m[3],
        m[4] * x + m[5] * y + m[6] * z + m[7],
        m[8] * x + m[9] * y + m[10] * z + m[11],
    )


def turned_back(matrix: tuple[float, ...], x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Turn directions by the transposed rotation of a row-major 4 x 4 matrix."""
    m = matrix
    return m[0] * x + m[4] * y + m[8] * z, m[1] * x + m[5] * y + m[9] * z, m[2] * x + m[6] * y + m[10] * z
