"""Stripe extraction beside a memcpy and plain NumPy (rows of run.py); the laser against exact truth, by hand:

.venv/bin/python benchmarks/laser.py [speed] [stripe] [sweep] [motion] [calibration]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed
from sgrt import twin

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests/python"))
import test_laser as scenes


def stripe_image() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    v, u = np.mgrid[0:1024, 0:1280]
    centre = 640 + 80 * np.sin(v / 150)
    image = 20 + 150 * np.exp(-((u - centre) ** 2) / 2 / 1.5**2) + rng.normal(0, 3, v.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), centre[:, 0]


def cpu_us(context: sgrt.Context) -> dict[str, tuple[float, float]]:
    """CPU time and its ratio to a memcpy of the image, each image of a stream in turn; medians."""
    image, _ = stripe_image()
    frames = np.stack([np.roll(image, k, axis=0) for k in range(48)])  # 63 MB: a stream does not lie in the cache
    copies = np.empty_like(frames)
    times: dict[str, list[float]] = {"memcpy": [], "centroid": [], "gaussian": [], "ridge": []}
    for _ in range(2):
        for name, series in times.items():
            for k, frame in enumerate(frames):
                start = time.process_time_ns()
                if name == "memcpy":
                    np.copyto(copies[k], frame)
                else:
                    sgrt.stripe_extract(frame, method=name, context=context)
                series.append(time.process_time_ns() - start)
    base = np.array(times["memcpy"])
    return {name: (float(np.median(t)) / 1e3, float(np.median(np.array(t) / base))) for name, t in times.items()}


def speed() -> None:
    for name, (us, ratio) in cpu_us(sgrt.Context(threads=1)).items():
        print(f"{name}, 1280 x 1024 u8: {us:.0f} us, {ratio:.2f} x memcpy")


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    """A centre a row of 1280 x 1024 bytes; error: RMS of the centres. The peer: maximum, its background, centroid."""
    image, truth = stripe_image()
    frames = np.stack([np.roll(image, k, axis=0) for k in range(16)])  # a stream does not lie in the cache
    np.savez(folder / "laser.npz", frames=frames)
    context = sgrt.Context(threads=threads)
    measured = cpu_us(sgrt.Context(threads=1))

    for method in ("centroid", "gaussian", "ridge"):

        def ours(_: int, method: str = method) -> Arrays:
            found = [sgrt.stripe_extract(frame, method=method, context=context).centre for frame in frames]
            return {"centre": found[0]}

        with Peer("NumPy centroid", folder / "laser.npz", threads) as peer:
            ms, peer_ms, a, b = alternate(timed(ours), peer, repeats)
        ms, peer_ms = ms / len(frames), peer_ms / len(frames)
        yield row(
            f"stripe, {method}, {measured[method][1]:.1f} x memcpy",
            ms,
            "NumPy centroid",
            peer_ms,
            error(a[-1]["centre"], truth),
            error(b[-1]["centre"], truth),
            "px",
            threads,
        )


def error(centre: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean((centre - truth) ** 2)))


def stripe() -> None:
    """Error perpendicular to the stripe beside the bound, sigma 1.5 px, noise 3.2 % of the peak."""
    rng = np.random.default_rng(1)
    for slope in (0, 15, 30, 45, 60):
        tan, cos = np.tan(np.radians(slope)), np.cos(np.radians(slope))
        errors: dict[str, list[np.ndarray]] = {"centroid": [], "gaussian": [], "ridge": []}
        for trial in range(6):
            rows = np.arange(600)
            centre = 100.3 + 0.17 * trial + tan * rows
            columns = np.arange(int(centre[-1]) + 100)
            profile = 100 * np.exp(-(((columns - centre[:, None]) * cos) ** 2) / 2 / 1.5**2)
            image = (20 + profile + rng.normal(0, 3.2, profile.shape)).astype(np.float32)
            for method, series in errors.items():
                found = sgrt.stripe_extract(image, method=method).centre
                series.append(((found - centre) * cos)[np.isfinite(found)])
        bound = cos * np.sqrt(2 * 1.5 / cos / np.sqrt(np.pi)) * 0.032
        for method, series in errors.items():
            e = np.concatenate(series)
            print(
                f"{slope:2} deg {method:8}: RMS {np.std(e):.4f} px, {np.std(e) / bound:.2f} x bound,"
                f" bias {np.mean(e):+.4f}, {100 * len(e) / 3600:.1f} % found"
            )


def surface_errors(scanner: twin.Scanner, phantom: twin.Phantom, laser: sgrt.Laser) -> str:
    assert laser.surface is not None
    x = laser.surface.points.reshape(-1, 3)
    good = np.isfinite(x[:, 0])
    e = phantom.distance(x[good])
    z = e / laser.surface.sigma_mm.reshape(-1)[good]
    return (
        f"{good.sum()} points, {np.sqrt(np.mean(e**2)):.3f} mm RMS, mean {e.mean():+.3f}, 99 % within"
        f" {np.quantile(np.abs(e), 0.99):.3f}, error over sigma {np.sqrt(np.mean(z**2)):.2f}"
    )


def sweep(motion: bool = False) -> None:
    """The torso at 2 m, base 600 mm, f 2400 px, 1280 x 1024, exact rig."""
    scanner = twin.Scanner(scenes.small_scanner(1280, 1024).camera, twin.default_mirror(1))
    rig, phantom = sgrt.Rig(scanner.rig_json()), twin.torso()
    count = 24
    readings = [scenes.reading_for(scanner, x, 80) for x in np.linspace(-170, 170, count)]
    times = np.linspace(0, 6, count)
    poses = np.stack([np.eye(4)] * count)
    if motion:
        poses = np.stack([twin.displacement(vrt_mm=10 * t / 6, lng_mm=2 * np.sin(t), pitch_deg=0.2 * t) for t in times])
    session = sgrt.LaserSession(rig, "scanner")
    for a, t, pose in zip(readings, times, poses, strict=True):
        session.push(scanner.capture(phantom, a, pose, seed=4).image, angle_rad=a, time_s=t)
    if motion:
        print("without the track:", surface_errors(scanner, phantom, session.finish()))
    laser = session.finish(track_time_s=times, room_from_body=poses)
    print("motion of 10 mm, with its track:" if motion else "sweep:", surface_errors(scanner, phantom, laser))


def calibration() -> None:
    """A mirror unit from nine places of a board, worst depth error of a 600 mm sweep at 2 m; ten draws."""
    errors, predicted = [], []
    wide = scenes.WIDE
    readings = np.array([scenes.reading_for(wide, x) for x in np.linspace(-330, 330, 31)])
    for draw in range(10):
        views = [scenes.board_images(wide, pose, readings, 100 * draw + i) for i, pose in enumerate(scenes.POSES)]
        rig = sgrt.Rig(wide.rig_json(twin.default_mirror(50 + draw)))
        result = sgrt.calibration_laser(rig, "scanner", **scenes.calibration_arguments(wide, views), noise_px=0.05)
        assert result.rig is not None
        errors.append(scenes.plane_error_mm(result.rig, wide))
        predicted.append(float(result.report.split('"point_sigma_mm":')[1].split(",")[0]))
    print(
        f"mirror unit: worst error of a 600 mm sweep at 2 m {np.median(errors):.3f} mm (median of ten draws),"
        f" {max(errors):.3f} at most; predicted sigma {np.median(predicted):.3f} mm"
    )


if __name__ == "__main__":
    wanted = sys.argv[1:] or ["speed", "stripe", "sweep", "motion", "calibration"]
    for name in wanted:
        sweep(motion=True) if name == "motion" else globals()[name]()
