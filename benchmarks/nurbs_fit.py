"""A smooth surface through scattered points: a wavy height field, 0.3 mm noise, with and without 5 % outliers."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed

SIDE = 150.0  # mm, half of it
CONTROL = 40
PLACES = 60


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    bumps = 14 * np.exp(-((x - 20) ** 2 + (y + 30) ** 2) / (2 * 25**2)) - 8 * np.exp(
        -((x + 50) ** 2 + y**2) / (2 * 18**2)
    )
    return 20 * np.sin(x / 60) * np.cos(y / 70) + bumps


def scene(count: int, outliers: float) -> Arrays:
    rng = np.random.default_rng(count)
    x, y = rng.uniform(-SIDE, SIDE, (2, count))
    z = height(x, y) + rng.normal(0, 0.3, count)
    bad = rng.random(count) < outliers
    z[bad] += rng.choice([-1, 1], bad.sum()) * rng.uniform(5, 50, bad.sum())
    side = np.linspace(-0.9 * SIDE, 0.9 * SIDE, PLACES)
    return {"points": np.stack([x, y, z], axis=1), "side": side, "control": np.array(CONTROL), "noise": np.array(0.3)}


def ours(inputs: Arrays, robust: bool, threads: int):
    context = sgrt.Context(threads=threads)
    surface = sgrt.Surface(inputs["points"])
    x, y = np.meshgrid(inputs["side"], inputs["side"], indexing="ij")

    def fit(_: int) -> Arrays:
        found.append(
            sgrt.nurbs_fit(
                surface,
                chart="plane",
                axis=(0, 0, 1),
                robust=robust,
                control_points=(CONTROL, CONTROL),
                context=context,
            )
        )
        return {}

    found: list[sgrt.NurbsFit] = []
    call = timed(fit)

    def call_and_evaluate(index: int) -> tuple[float, Arrays]:
        ms, _ = call(index)
        feet = np.stack([x.ravel(), y.ravel(), height(x, y).ravel()], axis=1)
        return ms, {"points": found[-1].evaluate(found[-1].nearest(feet)).points}

    return call_and_evaluate


def our_error(arrays: Arrays) -> float:
    x, y, z = arrays["points"].T
    return float(np.sqrt(np.mean((z - height(x, y)) ** 2)))


def peer_error(arrays: Arrays, side: np.ndarray) -> float:
    x, y = np.meshgrid(side, side, indexing="ij")
    return float(np.sqrt(np.mean((arrays["z"] - height(x, y)) ** 2)))


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    path = folder / "nurbs_fit.npz"
    for count, outliers, name in (
        (200_000, 0.0, "scipy LSQBivariateSpline"),
        (200_000, 0.05, "scipy LSQBivariateSpline"),
        (20_000, 0.0, "scipy SmoothBivariateSpline"),
    ):
        inputs = scene(count, outliers)
        np.savez(path, **inputs)
        with Peer(name, path, threads) as peer:
            ours_ms, peer_ms, a, b = alternate(ours(inputs, outliers > 0, threads), peer, repeats)
        errors = our_error(a[-1]), peer_error(b[-1], inputs["side"])
        work = f"fit {count} points, {CONTROL} x {CONTROL}{', 5 % outliers, robust' if outliers else ''}"
        yield row(work, ours_ms, name, peer_ms, *errors, "mm", threads)
