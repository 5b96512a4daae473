"""Calibration of one camera from made corners, beside OpenCV's calibrateCamera on the same; truth: the camera."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed

LENS = np.array([800.0, 803.0, 322.0, 238.5, -0.15, 0.08, 4e-4, -6e-4, 0.0])
SIZE = (640, 480)
NOISE = 0.1  # px


def rotation(w: np.ndarray) -> np.ndarray:
    angle = np.sqrt(np.sum(w * w))
    k = w / angle
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def pixels_of(x: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Pinhole and Brown's distortion of points in camera axes."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = lens
    u, v = x[:, 0] / x[:, 2], x[:, 1] / x[:, 2]
    r2 = u * u + v * v
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    a = u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
    b = v * radial + p1 * (r2 + 2 * v * v) + 2 * p2 * u * v
    return np.stack([fx * a + cx, fy * b + cy], axis=1)


def scene(images: int) -> Arrays:
    """The board of OpenCV's sample, 9 x 6 of 25 mm, in `images` placements that fill the image between them."""
    rng = np.random.default_rng(3)
    board = np.array([[j * 25.0, i * 25.0, 0.0] for i in range(6) for j in range(9)])
    views: list[np.ndarray] = []
    while len(views) < images:
        turn = rotation(rng.uniform([-0.7, -0.7, -0.5], [0.7, 0.7, 0.5]))
        at = np.array([rng.uniform(-80, 80), rng.uniform(-60, 60), rng.uniform(330, 600)])
        seen = pixels_of((board - board.mean(axis=0)) @ turn.T + at, LENS) + rng.normal(0, NOISE, (54, 2))
        if np.all((seen > 1) & (seen < np.array(SIZE) - 2)):
            views.append(seen)
    return {"board": board, "views": np.array(views), "size": np.array(SIZE)}


def error_px(lens: np.ndarray) -> float:
    """Of the projection over the middle of the image, its direction left free: a lens against the true one."""
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 9), np.linspace(-0.22, 0.22, 7))
    rays = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
    error = pixels_of(rays, lens) - pixels_of(rays, LENS)
    # A turn of the camera moves all pixels almost alike.
    base = np.concatenate(
        [(pixels_of(rays + 1e-5 * np.cross(axis, rays), LENS) - pixels_of(rays, LENS))[None] for axis in np.eye(3)]
    ).reshape(3, -1)
    left = error.ravel() - base.T @ np.linalg.lstsq(base.T, error.ravel(), rcond=None)[0]
    return float(np.sqrt(2 * np.mean(left**2)))


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    for images in (13, 100):
        inputs = scene(images)
        path = folder / f"calibration{images}.npz"
        np.savez(path, **inputs)
        index = np.array([(0, b, i) for b in range(images) for i in range(54)], np.int32)
        arguments = {
            "cameras": [("camera", SIZE)],
            "points": inputs["board"],
            "index": index,
            "pixels": inputs["views"].reshape(-1, 2),
            "placements": [f"{b:03}" for b in range(images)],
            "split_half": False,
        }

        def ours(_: int, arguments: dict = arguments) -> Arrays:
            camera = sgrt.calibration_solve(**arguments).rig.cameras[0]
            return {"lens": np.concatenate([camera.intrinsics, camera.distortion])}

        with Peer("OpenCV calibrateCamera", path, threads) as peer:
            ours_ms, peer_ms, mine, theirs = alternate(timed(ours), peer, repeats)
        errors = error_px(mine[0]["lens"]), error_px(theirs[0]["lens"])
        yield row(f"calibration, {images} images", ours_ms, "OpenCV calibrateCamera", peer_ms, *errors, "px", threads)
