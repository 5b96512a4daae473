"""Scenes that every test file uses: a body without symmetry, a rig of one pod, and files of them."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sgrt
from sgrt.cli import main

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"


@pytest.fixture
def run(capfd):
    """The command line in this process: exit code, standard output, standard error."""

    def call(*arguments):
        code = main([str(a) for a in arguments])
        output = capfd.readouterr()
        return code, output.out, output.err

    return call


def body_points(count: int, seed: int) -> np.ndarray:
    """Points of a smooth body about 300 x 360 mm, seen from above, that a rigid motion cannot map to itself."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-150, 150, count), rng.uniform(-180, 180, count)
    return np.stack([x, y, body_height(x, y)], axis=1)


def body_height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 120 * np.sqrt(1 - (x / 180) ** 2 - (y / 600) ** 2) + 12 * np.sin(x / 35) * np.cos(y / 50)


def rotation(pitch_deg: float, roll_deg: float, rtn_deg: float) -> np.ndarray:
    """Rz(rtn) Rx(pitch) Ry(roll), written out from the contract, not with the library."""
    a, b, c = np.radians([pitch_deg, roll_deg, rtn_deg])
    rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    rz = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return rz @ rx @ ry


def displaced(points: np.ndarray, shift: dict[str, float], isocentre: np.ndarray) -> np.ndarray:
    """D(x) = R (x - iso) + iso + t."""
    turn = rotation(shift["pitch_deg"], shift["roll_deg"], shift["rtn_deg"])
    t = np.array([shift["lat_mm"], shift["lng_mm"], shift["vrt_mm"]])
    return (points - isocentre) @ turn.T + isocentre + t


SHIFT = {"lat_mm": 3.0, "lng_mm": -4.0, "vrt_mm": 5.0, "pitch_deg": 1.0, "roll_deg": -1.5, "rtn_deg": 2.0}
ISOCENTRE = np.array([10.0, 20.0, -30.0])


@pytest.fixture(scope="session")
def reference() -> sgrt.Surface:
    return sgrt.Surface(body_points(8000, 1), sigma_mm=np.full(8000, 0.1)).estimate_normals()


@pytest.fixture(scope="session")
def live() -> sgrt.Surface:
    """Other points of the same body, displaced by SHIFT about ISOCENTRE, with 0.1 mm of noise."""
    rng = np.random.default_rng(2)
    points = displaced(body_points(8000, 3), SHIFT, ISOCENTRE) + rng.normal(0, 0.1, (8000, 3))
    return sgrt.Surface(points, sigma_mm=np.full(8000, 0.1)).estimate_normals()


FOCAL, BASE, DEPTH = 800.0, 100.0, 1000.0
WIDTH, HEIGHT = 320, 240


def camera_from_room(x_mm: float) -> np.ndarray:
    """A camera above the origin that looks down: x right, y down, z forward, at (x_mm, 0, DEPTH)."""
    pose = np.eye(4)
    pose[:3, :3] = np.diag([1.0, -1.0, -1.0])
    pose[:3, 3] = -pose[:3, :3] @ [x_mm, 0, DEPTH]
    return pose


def rig_document() -> dict[str, Any]:
    def camera(name: str, x_mm: float) -> dict[str, Any]:
        return {
            "id": name,
            "image_size": [WIDTH, HEIGHT],
            "model": "brown5",
            "intrinsics": [FOCAL, FOCAL, (WIDTH - 1) / 2, (HEIGHT - 1) / 2],
            "distortion": [0.0, 0.0, 0.0, 0.0, 0.0],
            "camera_from_room": camera_from_room(x_mm).tolist(),
        }

    return {
        "schema": "sgrt-rig/1",
        "id": "test room",
        "room": "IEC 61217 fixed, mm",
        "cameras": [camera("left", -BASE / 2), camera("right", BASE / 2)],
        "pairs": [{"id": "pod1", "left": "left", "right": "right"}],
        "a key of tomorrow": 7,
    }


@pytest.fixture(scope="session")
def rig() -> sgrt.Rig:
    return sgrt.Rig(json.dumps(rig_document()))


def speckle(u: np.ndarray, v: np.ndarray, seed: int = 5) -> np.ndarray:
    """A smooth random pattern in grey levels, defined for real u, v: no image is ever resampled."""
    rng = np.random.default_rng(seed)
    value = np.zeros(np.broadcast(u, v).shape)
    for _ in range(120):
        frequency, phase = rng.uniform(-1.4, 1.4, 2), rng.uniform(0, 2 * np.pi)
        value += np.cos(frequency[0] * u + frequency[1] * v + phase)
    return 128 + 100 * np.tanh(value / np.sqrt(60))


@pytest.fixture(scope="session")
def images() -> tuple[np.ndarray, np.ndarray]:
    """What the rig's cameras see of a speckled board in the plane z = 0 of the room."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    shift = FOCAL * BASE / DEPTH
    rng = np.random.default_rng(6)
    pair = [speckle(u - s, v) + rng.normal(0, 0.5, u.shape) for s in (0.0, -shift)]
    left, right = (np.clip(np.rint(image), 0, 255).astype(np.uint8) for image in pair)
    return left, right


@pytest.fixture(scope="session")
def stereo(rig: sgrt.Rig, images: tuple[np.ndarray, np.ndarray]) -> sgrt.Stereo:
    return sgrt.stereo_match(rig, "pod1", *images)


def take_ctrl_c() -> None:
    """For a child that is to be interrupted: a shell that runs the tests in the background lets it ignore SIGINT."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
