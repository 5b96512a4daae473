"""Figures of time of flight by simulation: sigma, bias, unwrapping, flying pixels.

.venv/bin/python benchmarks/tof_accuracy.py
"""

import json

import numpy as np
import sgrt
from sgrt.twin import tof as twin
from sgrt.twin.camera import Camera

LIGHT = 299_792_458e3
QUARTERS = np.arange(4) * np.pi / 2


def rig(width: int, height: int, frequencies: tuple[float, ...]) -> sgrt.Rig:
    camera = Camera("c", (width, height), (500.0, 500.0, width / 2, height / 2), (0.0,) * 5, tuple(np.eye(4).ravel()))
    unit = twin.TofCamera(camera, modulation_hz=frequencies, electrons_per_count=1.0, read_noise_e=0.0)
    return sgrt.Rig(unit.rig_json())


def draw(rng, d: np.ndarray, offset: float, amplitude: float, frequencies: tuple[float, ...]) -> np.ndarray:
    """Poisson taps, written out from eq. 1."""
    phase = [4 * np.pi * f * 1.00027 * d / LIGHT for f in frequencies]
    taps = [[rng.poisson(offset + amplitude * np.cos(p - q)) for q in QUARTERS] for p in phase]
    return np.array(taps, dtype=np.float32)


def sigma_and_bias() -> None:
    rng = np.random.default_rng(1)
    for f, d, offset, amplitude in ((20e6, 1500, 20_000, 8000), (20e6, 5000, 2000, 1000), (60e6, 900, 30_000, 15_000)):
        errors, predicted = [], []
        for _ in range(4):
            taps = draw(rng, np.full((480, 640), float(d)), offset, amplitude, (f,))
            result = sgrt.tof_measure(rig(640, 480, (f,)), "tof0", taps)
            errors.append(result.range_mm - d)
            predicted.append(result.sigma_mm)
        rms, mean = np.std(errors), np.mean(errors)
        ratio = rms / np.sqrt(np.mean(np.square(predicted)))
        law = LIGHT / 1.00027 / (4 * np.sqrt(2) * np.pi * f) * np.sqrt(offset) / amplitude
        print(
            f"{f / 1e6:.0f} MHz, {d} mm, B {offset}, A {amplitude}: sampled {rms:.3f} mm, over predicted {ratio:.4f},"
            f" over the law {rms / law:.4f}; mean {mean:+.4f} mm (its sigma {rms / np.sqrt(4 * 640 * 480):.4f})"
        )


def unwrapping() -> None:
    rng = np.random.default_rng(2)
    low_pair, high_pair = (20e6, 21e6), (60e6, 80e6)
    for frequencies, high, window in ((high_pair, 7300, None), (low_pair, 10_000, None), (low_pair, 10_000, 1e4)):
        d = rng.uniform(200, high, (480, 640))
        taps = draw(rng, d, 2000, 4 * np.sqrt(2000), frequencies)
        options = {} if window is None else {"range_max_mm": window}
        result = sgrt.tof_measure(rig(640, 480, frequencies), "tof0", taps, **options)
        step = LIGHT / 1.00027 / 2 / max(frequencies)
        right = np.abs(result.range_mm - d) < step / 2
        sure = (result.flags & 16) == 0
        print(
            f"{[f / 1e6 for f in frequencies]} MHz, 200 to {high} mm, A / sqrt(B) = 4, window {result.range_window_mm}:"
            f" right {100 * right.mean():.3f} %; not flagged as wrapped {100 * sure.mean():.2f} %,"
            f" of these right {100 * right[sure].mean():.4f} %"
        )


def flying() -> None:
    """Discs before a wall: a pixel is mixed where its sub-rays meet both, and flies where it lies 20 mm from either."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        pose = np.diag([1.0, -1, -1, 1])
        pose[2, 3] = 1300
        camera = Camera("c", (200, 200), (275.0, 275.0, 99.5, 99.5), (-0.1, 0.05, 0, 0, 0), tuple(pose.ravel()))
        unit = twin.TofCamera(camera, power_e=2e5, electrons_per_count=8.0, sub=5)
        wall = twin.plane([0, 0, -150], [*rng.uniform(-0.2, 0.2, 2), 1.0])
        front = twin.plane([*rng.uniform(-80, 80, 2), 350], [*rng.uniform(-0.4, 0.4, 2), 1.0], radius_mm=200)
        scene = twin.nearest(wall, front)
        result = sgrt.tof_measure(sgrt.Rig(unit.rig_json()), "tof0", unit.capture(scene, seed=seed))
        centre, rays = unit.rays(unit.sub)
        shape = (200, unit.sub, 200, unit.sub)
        ranges = scene(centre, rays.reshape(-1, 3))[0].reshape(shape)
        share = np.isfinite(front(centre, rays.reshape(-1, 3))[0]).reshape(shape).mean(axis=(1, 3))
        mixed = (share > 0) & (share < 1)
        low, high = np.min(ranges, axis=(1, 3)), np.max(ranges, axis=(1, 3))
        flies = mixed & (result.range_mm > low + 20) & (result.range_mm < high - 20)
        found = (result.flags & 8) != 0
        print(
            f"scene {seed}: {flies.sum()} flying of {mixed.sum()} mixed pixels; found {100 * found[flies].mean():.1f} %"
            f" ({100 * found[mixed].mean():.1f} % of all mixed), false {100 * found[~mixed].mean():.3f} %"
        )


if __name__ == "__main__":
    sigma_and_bias()
    unwrapping()
    flying()
    print(json.dumps({"version": sgrt.__version__}))
