"""One frame of a time-of-flight camera, 640 x 480, four uint16 taps, shot noise: phase, amplitude, sigma and points.

Ours is a session in Python; flags and flying pixels are its extra work. Error: RMS of the
range. The NumPy peer does the textbook's four-tap formulas on float32 arrays, its rays prepared.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed

WIDTH, HEIGHT, FOCAL_PX = 640, 480, 550.0
FREQUENCY_HZ, AIR = 20e6, 1.00027
MM_PER_RAD = 299_792_458e3 / (4 * np.pi * FREQUENCY_HZ * AIR)
OFFSET_E, AMPLITUDE_E = 20_000.0, 8_000.0  # a count is an electron


def rays() -> np.ndarray:
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    d = np.stack([(u - 319.5) / FOCAL_PX, (v - 239.5) / FOCAL_PX, np.ones(u.shape)], axis=-1)
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def scene() -> Arrays:
    """A dome of 300 mm radius before a wall at 1.5 m."""
    e = rays()
    middle = np.array([0, 0, 1500.0])
    b = e @ middle
    inside = b**2 - (middle @ middle - 300.0**2)
    truth = np.where(inside > 0, b - np.sqrt(np.maximum(inside, 0)), 1500 / e[..., 2])
    rng = np.random.default_rng(5)
    phase = truth / MM_PER_RAD
    taps = [rng.poisson(OFFSET_E + AMPLITUDE_E * np.cos(phase - k * np.pi / 2)) for k in range(4)]
    return {"taps": np.stack(taps).astype(np.uint16)[None], "truth": truth, "rays": e.astype(np.float32)}


def rig() -> sgrt.Rig:
    quarters = [0, np.pi / 2, np.pi, 3 * np.pi / 2]
    unit = {"id": "tof0", "camera": "c", "modulation_hz": [FREQUENCY_HZ], "tap_phase_rad": quarters}
    camera = {
        "id": "c",
        "image_size": [WIDTH, HEIGHT],
        "model": "pinhole",
        "intrinsics": [FOCAL_PX, FOCAL_PX, 319.5, 239.5],
        "camera_from_room": np.eye(4).tolist(),
    }
    document = {"schema": "sgrt-rig/1", "id": "b", "room": "camera", "cameras": [camera], "tofs": [unit]}
    return sgrt.Rig(json.dumps(document))


def error(range_mm: np.ndarray, truth: np.ndarray) -> float:
    good = np.abs(range_mm - truth) < 200
    return float(np.sqrt(np.mean((range_mm - truth)[good] ** 2)))


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    inputs = scene()
    np.savez(folder / "tof.npz", mm_per_rad=np.array(MM_PER_RAD), **inputs)
    context = sgrt.Context(threads=threads)
    session = sgrt.TofSession(rig(), "tof0", context=context)

    def ours(_: int) -> Arrays:
        result = session.push(inputs["taps"], time_s=0.0, surface=False, context=context)
        return {
            "range": result.range_mm[::8, ::8].copy()
        }  # all of it would keep the session from using its memory again

    with Peer("NumPy", folder / "tof.npz", threads) as peer:
        ms, peer_ms, a, b = alternate(timed(ours), peer, repeats)
    yield row(
        "TOF 640 x 480, four taps to points with sigma",
        ms,
        "NumPy",
        peer_ms,
        error(a[-1]["range"], inputs["truth"][::8, ::8]),
        error(b[-1]["range"], inputs["truth"]),
        "mm",
        threads,
    )
