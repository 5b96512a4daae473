"""Skin of a CT volume of 512 x 512 x 200: time, memory and error, beside scikit-image's marching cubes.

python benchmarks/volume.py
"""

from __future__ import annotations

import resource
import time

import numpy as np
import sgrt

SPACING = np.array([1.0, 1.0, 1.5])  # columns, rows, slices
SHAPE = (200, 512, 512)
SEMI = np.array([190.0, 120.0, 130.0])
CENTRE = np.array([3.3, -22.7, 1.9])


def body() -> tuple[np.ndarray, np.ndarray]:
    """An ellipsoid on a couch, partial volumes along all axes, 20 HU of noise."""
    nz, ny, nx = SHAPE
    x, y, z = (s * (np.arange(n) - (n - 1) / 2) for s, n in zip(SPACING, (nx, ny, nz), strict=True))
    volume = np.empty(SHAPE, np.int16)
    rng = np.random.default_rng(0)
    couch = ((y > CENTRE[1] + SEMI[1]) & (y < CENTRE[1] + SEMI[1] + 20))[:, None] & (np.abs(x) < 240)[None, :]
    for k in range(nz):
        u = ((x - CENTRE[0]) / SEMI[0])[None, :], ((y - CENTRE[1]) / SEMI[1])[:, None], (z[k] - CENTRE[2]) / SEMI[2]
        r = np.sqrt(u[0] ** 2 + u[1] ** 2 + u[2] ** 2)
        slope = np.sqrt((u[0] / SEMI[0]) ** 2 + (u[1] / SEMI[1]) ** 2 + (u[2] / SEMI[2]) ** 2) / np.maximum(r, 1e-9)
        tissue = 1 / (1 + np.exp((r - 1) / slope / 0.45))
        tissue[couch] = 0.9
        volume[k] = np.round(-1000 + 1000 * tissue + 20 * rng.standard_normal((ny, nx), np.float32))
    matrix = np.diag([*SPACING, 1.0])
    matrix[:3, 3] = x[0], y[0], z[0]
    return volume, matrix


def distance(points: np.ndarray) -> np.ndarray:
    """To the ellipsoid, positive outside: Newton on the foot's multiplier."""
    q, t = points - CENTRE, np.zeros(len(points))
    for _ in range(60):
        w = SEMI**2 + t[:, None]
        t += (np.sum(SEMI**2 * q**2 / w**2, axis=1) - 1) / np.sum(2 * SEMI**2 * q**2 / w**3, axis=1)
    foot = SEMI**2 * q / (SEMI**2 + t[:, None])
    return np.sign(t) * np.sqrt(np.sum((q - foot) ** 2, axis=1))


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def row(name: str, seconds: float, points: np.ndarray, peak: float, volume_mb: float) -> None:
    d = distance(points)
    d = d[np.abs(d) < 5]
    print(
        f"{name:34} {seconds:7.2f} s  RMS {np.sqrt(np.mean(d**2)):.3f} mm  mean {d.mean():+.3f} mm"
        f"  {len(points)} vertices  peak {peak:.2f} x the volume ({volume_mb:.0f} MB) beside it"
    )


def main() -> None:
    volume, matrix = body()
    mb = volume.nbytes / 2**20
    for threads in (2, 1):
        context = sgrt.Context(threads=threads)
        before, start = peak_mb(), time.perf_counter()
        result = sgrt.volume_skin(volume, matrix, down=(0, 1, 0), context=context)
        seconds = time.perf_counter() - start
        row(f"libsgrt, {threads} threads", seconds, result.points[result.flags == 0], (peak_mb() - before) / mb, mb)
    try:
        from skimage.measure import marching_cubes
    except ImportError:
        print("scikit-image is not installed: no peer")
        return
    before, start = peak_mb(), time.perf_counter()
    vertices = marching_cubes(volume, -480.0)[0]
    seconds = time.perf_counter() - start
    points = vertices[:, ::-1] * SPACING + matrix[:3, 3]
    points = points[points[:, 1] < CENTRE[1] + SEMI[1] - 4]  # without the couch that it cannot tell from the body
    row("scikit-image marching_cubes", seconds, points, (peak_mb() - before) / mb, mb)


if __name__ == "__main__":
    main()
