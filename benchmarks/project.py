"""Pixels of points and rays of pixels through a distorted camera. Truth: docs/theory/rig.md in NumPy."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed

COUNT = 100_000
SIZE = (1280, 1024)
INTRINSICS = (2400.0, 2405.0, 635.0, 515.0)
DISTORTION = (-0.12, 0.09, 0.0004, -0.0003, 0.02)


def camera_from_room() -> np.ndarray:
    """2 m above the isocentre, tilted by 20 deg, looking down at it."""
    c, s = np.cos(np.radians(20)), np.sin(np.radians(20))
    pose = np.eye(4)
    pose[:3, :3] = np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ np.diag([1.0, -1.0, -1.0])
    pose[2, 3] = 2000
    return pose


def rig() -> sgrt.Rig:
    camera = {
        "id": "camera",
        "image_size": SIZE,
        "model": "brown5",
        "intrinsics": INTRINSICS,
        "distortion": DISTORTION,
        "camera_from_room": camera_from_room().tolist(),
    }
    text = {"schema": "sgrt-rig/1", "id": "benchmark", "room": "IEC 61217 fixed, mm", "cameras": [camera], "pairs": []}
    return sgrt.Rig(json.dumps(text))


def pixels_of(x: np.ndarray) -> np.ndarray:
    """Pinhole and Brown-Conrady distortion of points in camera axes."""
    u, v = x[:, 0] / x[:, 2], x[:, 1] / x[:, 2]
    k1, k2, p1, p2, k3 = DISTORTION
    r2 = u * u + v * v
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    a = u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
    b = v * radial + p1 * (r2 + 2 * v * v) + 2 * p2 * u * v
    fx, fy, cx, cy = INTRINSICS
    return np.stack([fx * a + cx, fy * b + cy], axis=1)


def scene() -> Arrays:
    rng = np.random.default_rng(7)
    pose = camera_from_room()
    fx, fy, cx, cy = INTRINSICS
    points = np.stack([rng.uniform(-500, 500, COUNT), rng.uniform(-400, 400, COUNT), rng.uniform(-200, 200, COUNT)], 1)
    return {
        "points": points,
        "pixels": rng.uniform(0, SIZE, (COUNT, 2)),
        "camera_from_room": pose,
        "matrix": np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]),
        "distortion": np.array(DISTORTION),
    }


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    inputs = scene()
    path = folder / "project.npz"
    np.savez(path, **inputs)
    ours, context = rig(), sgrt.Context(threads=threads)
    pose = inputs["camera_from_room"]
    true_pixels = pixels_of(inputs["points"] @ pose[:3, :3].T + pose[:3, 3])

    def project_error(arrays: Arrays) -> float:
        return rms(arrays["pixels"] - true_pixels)

    def unproject_error(arrays: Arrays) -> float:  # there and back
        return rms(pixels_of(arrays["directions"] @ pose[:3, :3].T) - inputs["pixels"])

    works = (
        (
            "project",
            "OpenCV projectPoints",
            lambda _: {"pixels": ours.project("camera", inputs["points"], context=context)},
            project_error,
        ),
        (
            "unproject",
            "OpenCV undistortPoints",
            lambda _: {"directions": ours.unproject("camera", inputs["pixels"], context=context)[0]},
            unproject_error,
        ),
    )
    for work, name, call, error in works:
        with Peer(name, path, threads) as peer:
            ours_ms, peer_ms, a, b = alternate(timed(call), peer, repeats)
        yield row(f"{work} {COUNT} points", ours_ms, name, peer_ms, error(a[-1]), error(b[-1]), "px", threads)
