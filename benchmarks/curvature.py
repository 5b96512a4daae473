"""Curvature of noisy surfaces: convergence, errors beside predicted sigma, and libigl.

    python benchmarks/curvature.py [--only convergence,noise,peer] [--trials 4] [--peer-python .venv-peers/bin/python]

Errors are RMS over the points, relative to the RMS of the true H over the same points (H of a torus passes through 0);
of saddles, whose H is nearly 0, to the RMS of the curvedness. Points are spread evenly, noise is normal along the
normal, normals are off by 0.1 rad, so that nothing exact is handed over. `best fixed` is the quadric of the one radius
that turned out best on that very surface, which nobody knows beforehand. libigl runs in a Python of its own, where it
is installed (benchmarks/peers.txt); its radius is swept, in units of the mean edge.
"""

from __future__ import annotations

import argparse
import dataclasses
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
GOLDEN = np.pi * (3 - np.sqrt(5))
WIDE = 0.1  # rad, of a normal's error
RADII = np.array([3.5, 4.4, 5.5, 6.9, 8.6, 10.7, 13.4, 16.8])  # over the spacing
IGL_RADII = (5, 8, 11, 14, 18, 22, 26)


@dataclasses.dataclass
class Shape:
    points: np.ndarray
    normals: np.ndarray
    k1: np.ndarray
    k2: np.ndarray
    inner: np.ndarray  # away from the border
    saddle: bool = False

    @property
    def mean(self) -> np.ndarray:
        return 0.5 * (self.k1 + self.k2)

    def size(self, ok: np.ndarray) -> float:
        """What errors are relative to, 1/mm."""
        square = 0.5 * (self.k1**2 + self.k2**2) if self.saddle else self.mean**2
        return float(np.sqrt(np.mean(square[ok])))


def revolved(rho: Callable, z: Callable, end: float, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Parameter of the profile and angle of evenly spread points on a surface of revolution."""
    t = np.linspace(0, end, 20001)
    r, length = rho(t), np.hypot(np.gradient(rho(t), t), np.gradient(z(t), t))
    area = np.concatenate([[0], np.cumsum(0.5 * (r[1:] * length[1:] + r[:-1] * length[:-1]) * np.diff(t))])
    count = int(2 * np.pi * area[-1] / spacing**2)
    return np.interp((np.arange(count) + 0.5) / count * area[-1], area, t), GOLDEN * np.arange(count)


def ellipsoid(a: float, b: float, spacing: float) -> Shape:
    """Half axes a, b, b."""
    t, p = revolved(lambda t: b * np.sin(t), lambda t: a * np.cos(t), np.pi, spacing)
    w = np.hypot(a * np.sin(t), b * np.cos(t))
    points = np.stack([b * np.sin(t) * np.cos(p), b * np.sin(t) * np.sin(p), a * np.cos(t)], -1)
    normals = np.stack([a * np.sin(t) * np.cos(p), a * np.sin(t) * np.sin(p), b * np.cos(t)], -1) / w[:, None]
    along, around = a * b / w**3, a / (b * w)
    return Shape(points, normals, np.maximum(along, around), np.minimum(along, around), np.ones(t.size, bool))


def torus(outer: float, r: float, spacing: float) -> Shape:
    t, p = revolved(lambda t: outer + r * np.cos(t), lambda t: r * np.sin(t), 2 * np.pi, spacing)
    rho = outer + r * np.cos(t)
    points = np.stack([rho * np.cos(p), rho * np.sin(p), r * np.sin(t)], -1)
    normals = np.stack([np.cos(t) * np.cos(p), np.cos(t) * np.sin(p), np.sin(t)], -1)
    return Shape(points, normals, np.full(t.size, 1 / r), np.cos(t) / rho, np.ones(t.size, bool))


def height(f: Callable, half: float, spacing: float, margin: float, saddle: bool = False, jitter: float = 0.3) -> Shape:
    """z = f(x, y) on a jittered grid; f gives z, z_x, z_y, z_xx, z_xy, z_yy."""
    rng = np.random.default_rng(1)
    side = np.arange(-half, half + spacing / 2, spacing)
    x, y = (q.ravel() + jitter * spacing * rng.uniform(-1, 1, side.size**2) for q in np.meshgrid(side, side))
    z, fx, fy, fxx, fxy, fyy = (np.broadcast_to(v, x.shape) for v in f(x, y))
    g = np.sqrt(1 + fx**2 + fy**2)
    mean = -((1 + fy**2) * fxx - 2 * fx * fy * fxy + (1 + fx**2) * fyy) / (2 * g**3)
    apart = np.sqrt(np.maximum(mean**2 - (fxx * fyy - fxy**2) / g**4, 0))
    inner = np.maximum(abs(x), abs(y)) < half - margin
    normals = np.stack([-fx, -fy, np.ones_like(x)], -1) / g[:, None]
    return Shape(np.stack([x, y, z], -1), normals, mean + apart, mean - apart, inner, saddle)


def wave(x, y):
    cx, sx, cy, sy = np.cos(x / 15), np.sin(x / 15), np.cos(y / 20), np.sin(y / 20)
    return 8 * cx * cy, -8 / 15 * sx * cy, -8 / 20 * cx * sy, -8 / 225 * cx * cy, 8 / 300 * sx * sy, -8 / 400 * cx * cy


def saddle(x, y):
    return (x * x - y * y) / 60, x / 30, -y / 30, 1 / 30, 0.0, -1 / 30


def monkey(x, y):
    return (x**3 - 3 * x * y * y) / 1200, (x * x - y * y) / 400, -x * y / 200, x / 200, -y / 200, -x / 200


def plane(x, y):
    return 0.2 * x - 0.1 * y, 0.2, -0.1, 0.0, 0.0, 0.0


def twin_head(spacing: float) -> Shape:
    """The part above the neck of the twin's head, whose curvature is exact."""
    from sgrt.twin.bodies import head

    body = head()
    points = body.mesh(spacing)[0]
    mean, gauss = body.curvature(points)
    apart = np.sqrt(np.maximum(mean**2 - gauss, 0))
    return Shape(points, body.normal(points), mean + apart, mean - apart, np.ones(len(points), bool))


def noisy(shape: Shape, noise: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    normals = shape.normals + WIDE * rng.normal(size=shape.normals.shape)
    points = shape.points + noise * rng.normal(size=(len(shape.points), 1)) * shape.normals
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def fields(sgrt, surfaces: list, **options) -> list:
    found = []
    for surface in surfaces:
        try:
            found.append(sgrt.surface_curvature(surface, **options))
        except sgrt.InsufficientData:
            continue
    return found


def error(shape: Shape, found: list) -> tuple[float, float]:
    """Relative RMS of H, and the share of inner points that have one."""
    square = known = 0.0
    for c in found:
        ok = (c.reason == 0) & shape.inner
        square += np.mean((c.mean - shape.mean)[ok] ** 2) / shape.size(ok) ** 2 / len(found)
        known += ok.sum() / shape.inner.sum() / len(found)
    return float(np.sqrt(square)), float(known)


def over_sigma(shape: Shape, found: list) -> list[float]:
    """RMS of the error over RMS of the predicted sigma: H, k1, k2, K, S."""
    truth = {
        "mean": shape.mean,
        "k1": shape.k1,
        "k2": shape.k2,
        "gauss": shape.k1 * shape.k2,
        "shape_index": 2 / np.pi * np.arctan2(shape.k1 + shape.k2, shape.k1 - shape.k2),
    }
    out = []
    for name, true in truth.items():
        error2 = sigma2 = 0.0
        for c in found:
            ok = (c.reason == 0) & shape.inner & np.isfinite(getattr(c, "sigma_" + name))
            error2 += np.sum((getattr(c, name) - true)[ok] ** 2)
            sigma2 += np.sum(getattr(c, "sigma_" + name)[ok] ** 2)
        out.append(float(np.sqrt(error2 / sigma2)))
    return out


def convergence(sgrt) -> None:
    print("Convergence: RMS error of H, 1/mm, inside, exact points, radius 3.6 h (degree 4: 4.6 h)")
    print(f"{'shape':22s} degree" + "".join(f"   h = {h:<5g}" for h in (2, 1, 0.5)) + "   order")
    sheets = {"plane": plane, "saddle": saddle, "monkey saddle": monkey, "wave": wave}
    closed = {"sphere 20": lambda h: ellipsoid(20, 20, h), "torus 40, 20": lambda h: torus(40, 20, h)}
    for name in [*sheets, *closed]:
        for grid in (True, False) if name in sheets else (False,):
            for degree in (2, 3, 4):
                errors = []
                for h in (2.0, 1.0, 0.5):
                    jitter = 0.0 if grid else 0.3
                    s = height(sheets[name], 20.0, h, 12.0, jitter=jitter) if name in sheets else closed[name](h)
                    c = sgrt.surface_curvature(
                        sgrt.Surface(s.points, normals=s.normals),
                        degree=degree,
                        radius_mm=(4.6 if degree == 4 else 3.6) * h,
                        max_sigma_per_mm=10.0,
                    )
                    errors.append(float(np.sqrt(np.nanmean((c.mean - s.mean)[s.inner] ** 2))))
                order = np.log2(errors[0] / errors[2]) / 2 if min(errors) > 1e-11 else np.nan
                kind = (" (grid)" if grid else " (cloud)") if name in sheets else " (cloud)"
                print(f"{name + kind:22s} {degree:6d}" + "".join(f"   {e:9.2e}" for e in errors) + f"   {order:5.1f}")


def noise_table(sgrt, trials: int) -> None:
    cases = [
        ("sphere 10", 0.3, 1.0, lambda h: ellipsoid(10, 10, h)),
        ("sphere 20", 0.3, 1.0, lambda h: ellipsoid(20, 20, h)),
        ("ellipsoid 20, 10, 10", 0.3, 1.0, lambda h: ellipsoid(20, 10, h)),
        ("ellipsoid 10, 20, 20", 0.3, 1.0, lambda h: ellipsoid(10, 20, h)),
        ("ellipsoid 40, 20, 20", 0.3, 1.0, lambda h: ellipsoid(40, 20, h)),
        ("torus 20, 10", 0.3, 1.0, lambda h: torus(20, 10, h)),
        ("torus 40, 20", 0.3, 1.0, lambda h: torus(40, 20, h)),
        ("frame: sphere 10", 1.0, 3.6, lambda h: ellipsoid(10, 10, h)),
        ("frame: ell. 20, 10, 10", 1.0, 3.6, lambda h: ellipsoid(20, 10, h)),
        ("frame: torus 20, 10", 1.0, 3.6, lambda h: torus(20, 10, h)),
        ("* ellipsoid 45, 15, 15", 0.3, 1.0, lambda h: ellipsoid(45, 15, h)),
        ("* ellipsoid 15, 30, 30", 0.3, 1.0, lambda h: ellipsoid(15, 30, h)),
        ("* torus 35, 12", 0.3, 1.0, lambda h: torus(35, 12, h)),
        ("* saddle", 0.3, 1.0, lambda h: height(saddle, 30, h, 10, saddle=True)),
        ("* monkey saddle", 0.3, 1.0, lambda h: height(monkey, 30, h, 10, saddle=True)),
        ("* twin's head", 0.3, 1.5, twin_head),
        ("* twin's head", 0.6, 1.5, twin_head),
    ]
    print("\nNoise: s, h mm; error of H; error over sigma of H, k1, k2, K, S (* tried once all was set)")
    print(f"{'shape':24s}    s    h    error  best fixed (at)   known   H    k1   k2   K    S     radius")
    for name, noise, h, make in cases:
        shape = make(h)
        count = trials if len(shape.points) < 20_000 else 1
        draws = (noisy(shape, noise, np.random.default_rng(k)) for k in range(count))
        surfaces = [sgrt.Surface(p, normals=n) for p, n in draws]
        found = fields(sgrt, surfaces)
        relative, known = error(shape, found)
        best = (np.inf, 0.0)
        for radius in RADII * h:
            fixed = fields(sgrt, surfaces[:1], radius_mm=float(radius), max_sigma_per_mm=10.0)
            if fixed and error(shape, fixed)[1] > 0.9 * known:
                best = min(best, (error(shape, fixed)[0], float(radius)))
        ratios = " ".join(f"{v:4.2f}" for v in over_sigma(shape, found))
        radius = np.nanmedian(np.concatenate([c.radius_mm[c.reason == 0] for c in found]))
        print(
            f"{name:24s} {noise:4.1f} {h:4.1f}  {100 * relative:5.1f} %   {100 * best[0]:5.1f} % ({best[1]:4.1f})"
            f"   {100 * known:5.1f}   {ratios}   {radius:5.1f}",
            flush=True,
        )


def igl_table(source: str) -> None:
    """Run by the peer's Python: error and time by radius."""
    import igl

    data = np.load(source)
    for radius in IGL_RADII:
        start = time.process_time()
        out = igl.principal_curvature(data["points"], data["faces"].astype(np.int64), radius)
        taken = (time.process_time() - start) / len(data["points"])
        # Its sign follows its own normals: the better of the two is taken.
        e = min(np.sqrt(np.mean((0.5 * s * (out[2] + out[3]) - data["mean"])[data["inner"]] ** 2)) for s in (1, -1))
        print(f"libigl, radius {radius:2d}", f"{1e6 * taken:.2f}", f"{100 * e / data['size']:.1f}", flush=True)


def igl_rows(python: str, points: np.ndarray, faces: np.ndarray, shape: Shape) -> list[tuple[str, float, float]]:
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "mesh.npz"
        size = shape.size(shape.inner)
        np.savez(source, points=points, faces=faces, mean=shape.mean, inner=shape.inner, size=size)
        run = subprocess.run([python, __file__, "--igl", source], capture_output=True, text=True, check=True)
    return [(name, float(us), float(e)) for name, us, e in (r.rsplit(" ", 2) for r in run.stdout.splitlines())]


def peer_table(sgrt, python: str) -> None:
    """A mesh of 40,000 vertices."""
    print("\nMesh of 200 x 200 vertices (wave), CPU time of one thread and relative RMS of H, 20 mm off the border")
    side = 200
    for noise in (0.3, 0.1):
        shape = height(wave, 99.5, 1.0, 20)
        i = np.arange(side * side).reshape(side, side)
        a, b, c, d = (q.ravel() for q in (i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]))
        faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).astype(np.int32)
        points, _ = noisy(shape, noise, np.random.default_rng(7))
        surface = sgrt.Surface(points, faces=faces)
        rows = []
        for options in ({}, {"radius_mm": 8.0}, {"radius_mm": 12.0}):
            taken = []
            for _ in range(5):
                start = time.process_time()
                found = sgrt.surface_curvature(surface, **options)
                taken.append((time.process_time() - start) / len(points))
            relative = error(shape, [found])[0]
            name = f"sgrt, radius {options['radius_mm']:g} mm" if options else "sgrt, radius chosen"
            rows.append((name, 1e6 * float(np.median(taken)), 100 * relative))
        try:
            rows += igl_rows(python, points, faces, shape)
        except (OSError, subprocess.CalledProcessError) as why:
            said = (getattr(why, "stderr", "") or str(why)).strip().splitlines()
            print(f"libigl: skipped, {said[-1] if said else why}")
        print(f"noise {noise} mm")
        for name, taken, relative in rows:
            times = taken / rows[0][1]
            print(f"  {name:22s} {taken:7.2f} us a vertex   {relative:6.1f} %   {times:5.1f} x the time of the first")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--only", default="convergence,noise,peer")
    arguments.add_argument("--trials", type=int, default=4)
    arguments.add_argument("--peer-python", default=str(ROOT / ".venv-peers/bin/python"))
    arguments.add_argument("--igl", help=argparse.SUPPRESS)
    options = arguments.parse_args()
    if options.igl:
        return igl_table(options.igl)
    import sgrt

    wanted = options.only.split(",")
    if "convergence" in wanted:
        convergence(sgrt)
    if "noise" in wanted:
        noise_table(sgrt, options.trials)
    if "peer" in wanted:
        peer_table(sgrt, options.peer_python)
    return None


if __name__ == "__main__":
    sys.exit(main())
