"""A depth map of 640 x 480 with noise: two domes behind a step. Error: RMS against the true depth, all points."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed

SIGMA = 0.5  # mm
# Each filter at the radius at which it errs least here, mm, at a spacing of 1 mm.
RADIUS, PEER_RADIUS = 7.0, 4.0


def scene() -> Arrays:
    rng = np.random.default_rng(3)
    y, x = np.mgrid[-240:240.0, -320:320.0]
    z = np.where(x < 0, 40.0, 0.0)
    for centre, radius in ((-160, 60), (160, 120)):
        z += np.sqrt(np.maximum(0, radius**2 - (x - centre) ** 2 - y**2))
    noisy = z + SIGMA * rng.standard_normal(z.shape)
    return {"x": x, "y": y, "truth": z, "noisy": noisy}


def error(z: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean((z - truth) ** 2)))


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    inputs = scene() | {"radius": np.array(PEER_RADIUS), "sigma": np.array(SIGMA)}
    np.savez(folder / "filter.npz", **inputs)
    context = sgrt.Context(threads=threads)
    points = np.stack([inputs["x"], inputs["y"], inputs["noisy"]], axis=-1)
    noisy = sgrt.Surface(points, sigma_mm=np.full(points.shape[:2], SIGMA)).estimate_normals(context=context)

    def ours(_: int) -> Arrays:
        filtered = sgrt.surface_filter(noisy, radius_mm=RADIUS, context=context)
        return {"z": filtered.surface.points[..., 2]}

    with Peer("OpenCV bilateralFilter", folder / "filter.npz", threads) as peer:
        ms, peer_ms, a, b = alternate(timed(ours), peer, repeats)
    yield row(
        "filter a depth map of 640 x 480",
        ms,
        "OpenCV bilateralFilter",
        peer_ms,
        error(a[-1]["z"], inputs["truth"]),
        error(b[-1]["z"], inputs["truth"]),
        "mm",
        threads,
    )
