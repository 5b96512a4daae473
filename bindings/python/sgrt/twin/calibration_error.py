"""A drawn calibration error, correlated as a real calibration's is.

Per pod the linearised calibration is solved: both cameras' nine intrinsics, the right camera's pose relative
to the left one's and every board's pose, from a board held in 24 poses through the working volume, equal
noise on each corner. One draw from the covariance of that solve perturbs the cameras. Then the pod is put
into the room as a clinic does it: its six degrees of freedom are fitted to the images of a phantom's 27
points about the isocentre, found with the same noise. The fit absorbs what it can of the first error. All
of it is linear in the noise, so one factor gives the wanted expected pixel error (0.1 px: a noise of about
0.24 px, a printed board). Theory: docs/theory/twin.md.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from .camera import Camera
from .checks import Array
from .sensor import stream

BOARDS = 24
BOARD_POINTS = np.array([[x, y, 0.0] for x in range(-4, 5) for y in range(-3, 4)]) * 40.0
ROOM_POINTS = np.array([[x, y, z] for x in (-60, 0, 60) for y in (-60, 0, 60) for z in (-60, 0, 60)], float)
VOLUME_POINTS = np.array(  # the middles of the cells of a box of 400 x 500 x 200 mm
    [[x, y, z] for x in (-150, -50, 50, 150) for y in (-188, -62, 62, 188) for z in (-17, 50, 117)], float
)
PRIOR_K3 = 0.2  # one sigma: the field is too narrow to fix k3 by itself


def perturbed_pod(left: Camera, right: Camera, seed: int, sigma_px: float) -> tuple[Camera, Camera]:
    """The pod's two cameras as a calibration would have found them.

    `sigma_px` is the expected root mean square, per pixel coordinate, of the change of projection over the
    working volume.
    """
    if sigma_px == 0.0:
        return left, right
    root = _root((left, right))
    change = _dot(_stacked((left, right), VOLUME_POINTS), root)
    expected_px = np.sqrt(np.mean(np.sum(change**2, axis=1)))
    noise = stream(seed, left.id, "calibration").standard_normal((root.shape[1], 1))
    error = _dot(root, noise)[:, 0] * (sigma_px / expected_px)
    return _moved(left, error[:9], error[18:24]), _moved(right, error[9:18], error[24:30])


@functools.lru_cache(maxsize=8)
def _root(pair: tuple[Camera, Camera]) -> Array:
    """S, (30, n): S S^T is the covariance that a noise of 1 px on every found point leaves.

    The 30 parameters: left and right intrinsics (fx fy cx cy k1 k2 p1 p2 k3 each), left and right pose.
    """
    inner = _board_spread(pair)
    pod = np.zeros((30, inner.shape[1]))
    pod[:18], pod[24:30] = inner[:18], inner[18:24]
    # The room fit moves both cameras by one twist; it sees the error of the boards and its own noise.
    rigid, seen = _rigid(pair), _stacked(pair, ROOM_POINTS)
    effect = _dot(seen, rigid)
    fit = np.linalg.solve(_dot(effect.T, effect), effect.T)
    return np.hstack([pod - _dot(rigid, _dot(fit, _dot(seen, pod))), -_dot(rigid, fit)])


def _dot(a: np.ndarray, b: np.ndarray) -> Array:
    """The matrix product in a fixed order: a BLAS sums in an order that depends on its threads."""
    product: Array = np.einsum("ij,jk->ik", a, b)
    return product


def _stacked(pair: tuple[Camera, Camera], points: Array) -> Array:
    """d pixel / d parameter of both cameras, (4N, 30)."""
    return np.vstack([_jacobian(camera, points, side) for side, camera in enumerate(pair)])


def _rigid(pair: tuple[Camera, Camera]) -> Array:
    """(30, 6): how both camera poses change, in their own increments, with a small twist of the room."""
    out = np.zeros((30, 6))
    for side, camera in enumerate(pair):
        rotation, shift = camera.matrix[:3, :3], camera.matrix[:3, 3]
        # exp(a) T = T exp(b): a_rot = R b_rot, a_shift = R b_shift + t x (R b_rot)
        rows = slice(18 + 6 * side, 24 + 6 * side)
        out[rows, :3] = np.vstack([rotation, _cross(shift) @ rotation])
        out[rows, 3:] = np.vstack([np.zeros((3, 3)), rotation])
    return out


def _board_spread(pair: tuple[Camera, Camera]) -> Array:
    """(24, 24): a root of the covariance of both intrinsics and the right pose, for corner noise of 1 px."""
    rng = stream(0, pair[0].id, "boards")
    information = np.zeros((24, 24))
    for board in range(BOARDS):
        room_from_board = _board_pose(pair[0], rng, board)
        corners = BOARD_POINTS @ room_from_board[:3, :3].T + room_from_board[:3, 3]
        on_sensor = np.concatenate([_inside(camera, corners) for camera in pair])
        jacobian = _stacked(pair, corners)[on_sensor]
        wanted = np.hstack([jacobian[:, :18], jacobian[:, 24:]])  # the left pose is held
        moved = _dot(jacobian, _rigid(pair))  # by the board's own pose, which is eliminated (Schur)
        cross = _dot(moved.T, wanted)
        information += _dot(wanted.T, wanted) - _dot(cross.T, np.linalg.solve(_dot(moved.T, moved), cross))
    for k3 in (8, 17):
        information[k3, k3] += 1.0 / PRIOR_K3**2
    scale = 1.0 / np.sqrt(np.diag(information))
    lower = np.linalg.cholesky(information * np.outer(scale, scale))
    return scale[:, None] * np.linalg.solve(lower.T, np.eye(24))


def _board_pose(camera: Camera, rng: np.random.Generator, number: int) -> Array:
    """A board somewhere in the working volume, tilted up to 40 degrees against the left camera."""
    axes = camera.matrix[:3, :3].T  # columns: the camera's axes in the room
    a, b, c = np.deg2rad(rng.uniform(-40, 40, 3)) * [1.0, 1.0, 2.0]
    tilt = _turn(0, a) @ _turn(1, b) @ _turn(2, c)
    out = np.eye(4)
    out[:3, :3] = axes @ tilt
    across = np.array([((number % 3) - 1) * 240.0, ((number // 3) % 3 - 1) * 180.0, 0.0])
    out[:3, 3] = axes @ (across + rng.uniform(-40, 40, 3) + [0, 0, 250.0 * rng.uniform(-1, 1)])
    return out


def _turn(axis: int, angle: float) -> Array:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out = np.eye(3)
    out[i, i] = out[j, j] = np.cos(angle)
    out[j, i] = np.sin(angle)
    out[i, j] = -out[j, i]
    return out


def _inside(camera: Camera, points: Array) -> np.ndarray:
    """Row mask (2N,): the image of the point lies on the sensor."""
    pixels = camera.project(points)
    width, height = camera.image_size
    good = (pixels[:, 0] > 0) & (pixels[:, 0] < width - 1) & (pixels[:, 1] > 0) & (pixels[:, 1] < height - 1)
    return np.repeat(good, 2)


def _jacobian(camera: Camera, points: Array, side: int) -> Array:
    """d pixel / d parameter, (2N, 30), by central differences; `side` 0 is left, 1 right."""
    steps = np.array([1e-2] * 4 + [1e-5] * 5 + [1e-7] * 3 + [1e-3] * 3)
    out = np.zeros((2 * len(points), 30))
    for k, step in enumerate(steps):
        delta = np.zeros(15)
        delta[k] = step
        ahead = _moved(camera, delta[:9], delta[9:]).project(points)
        behind = _moved(camera, -delta[:9], -delta[9:]).project(points)
        column = 9 * side + k if k < 9 else 18 + 6 * side + k - 9
        out[:, column] = ((ahead - behind) / (2 * step)).ravel()
    return out


def _moved(camera: Camera, intrinsics: Array, twist: Array) -> Camera:
    """The camera with its intrinsics changed and its pose turned and shifted (rad, mm) in its own frame."""
    change = np.eye(4)
    angle = float(np.sqrt(np.sum(twist[:3] ** 2)))
    w = _cross(twist[:3])
    if angle > 0.0:
        change[:3, :3] += np.sinc(angle / np.pi) * w + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * (w @ w)
    change[:3, 3] = twist[3:]
    return dataclasses.replace(
        camera,
        intrinsics=tuple((np.array(camera.intrinsics) + intrinsics[:4]).tolist()),
        distortion=tuple((np.array(camera.distortion) + intrinsics[4:9]).tolist()),
        camera_from_room=tuple((change @ camera.matrix).ravel().tolist()),
    )


def _cross(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
