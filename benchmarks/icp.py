"""Fine registration of a torso-like surface: 11 mm and 2.7 deg away, 0.2 mm noise, 20,000 and 100,000 points."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed

POINTS = (20_000, 100_000)
PEERS = ("small_gicp GICP", "small_gicp PLANE_ICP", "Open3D point-to-plane")
ISOCENTRE_MM = np.array([10.0, -20.0, 15.0])


def torso(count: int, rng: np.random.Generator) -> np.ndarray:
    """Points on a flattened trunk with breasts, a navel and shoulders that rise: all six motions are observable."""
    x, y = rng.uniform(-150, 150, count), rng.uniform(-220, 220, count)
    z = 110 * np.sqrt(1 - (x / 190) ** 2) + 0.0004 * y**2 - 0.05 * y
    for u, v, height, width in ((-75, 70, 22, 45), (75, 70, 20, 45), (0, -110, -9, 14), (-20, 190, -15, 40)):
        z += height * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * width**2))
    return np.stack([x, y, z - 60], axis=1)


def displacement() -> np.ndarray:
    """D: 11 mm and 2.7 deg about the isocentre, along and about slanted axes, as 4 x 4."""
    axis = np.array([1.0, -2.0, 1.5]) / np.linalg.norm([1.0, -2.0, 1.5])
    angle = np.radians(2.7)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    d = np.eye(4)
    d[:3, :3] = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    d[:3, 3] = 11 * np.array([2.0, 1.0, -2.0]) / 3 + ISOCENTRE_MM - d[:3, :3] @ ISOCENTRE_MM
    return d


def scene(count: int, rounds: int) -> Arrays:
    """Newly drawn points and noise for each round."""
    rng = np.random.default_rng(count)
    d = displacement()
    reference, body = (np.stack([torso(count, rng) for _ in range(rounds)]) for _ in range(2))
    live = body @ d[:3, :3].T + d[:3, 3]
    return {name: x + rng.normal(0, 0.2, x.shape) for name, x in (("reference", reference), ("live", live))}


def errors(reference_from_live: np.ndarray) -> tuple[float, float]:
    """Distance at the isocentre, mm, and angle, deg, between the displacement found and the true one."""
    if not np.isfinite(reference_from_live).all():
        return np.nan, np.nan
    found, true = np.linalg.inv(reference_from_live), displacement()
    shift = (found - true)[:3, :3] @ ISOCENTRE_MM + (found - true)[:3, 3]
    turn = found[:3, :3] @ true[:3, :3].T
    sine = np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    return float(np.linalg.norm(shift)), float(np.degrees(np.arctan2(sine, (np.trace(turn) - 1) / 2)))


def ours(inputs: Arrays, threads: int):
    context = sgrt.Context(threads=threads)

    def prepare(points):
        return sgrt.Surface(points, sigma_mm=np.full(len(points), 0.2))

    def align(reference, live):
        try:
            if isinstance(reference, sgrt.Surface):
                reference = sgrt.Reference(reference, context=context)
            result = reference.align(live, isocentre_mm=ISOCENTRE_MM, context=context)
        except sgrt.Error:
            return {"reference_from_live": np.full((4, 4), np.nan)}
        return {"reference_from_live": result.reference_from_live}

    pairs = list(zip(inputs["reference"], inputs["live"], strict=True))
    if inputs["with_preparation"]:
        return timed(lambda index: align(*map(prepare, pairs[index])))
    ready = [(sgrt.Reference(prepare(a), context=context), prepare(b)) for a, b in pairs]
    return timed(lambda index: align(*ready[index]))


def rms_errors(rounds: list[Arrays]) -> tuple[float, float]:
    """mm and deg over the rounds; NaN if any of them had no answer."""
    mm, deg = np.sqrt(np.mean([np.square(errors(arrays["reference_from_live"])) for arrays in rounds], axis=0))
    return float(mm), float(deg)


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    for count in POINTS:
        clouds = scene(count, repeats)
        for with_preparation in (False, True):
            inputs = clouds | {"with_preparation": np.array(with_preparation)}
            path = folder / "icp.npz"
            np.savez(path, **inputs)
            work = f"icp {count} points, {'preparation included' if with_preparation else 'prepared'}"
            for name in PEERS:
                with Peer(name, path, threads) as peer:
                    ours_ms, peer_ms, a, b = alternate(ours(inputs, threads), peer, repeats)
                for ours_error, peer_error, unit in zip(rms_errors(a), rms_errors(b), ("mm", "deg"), strict=True):
                    yield row(work, ours_ms, name, peer_ms, ours_error, peer_error, unit, threads)
