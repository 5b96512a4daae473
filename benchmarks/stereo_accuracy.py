"""Speckle stereo against exact truth: .venv/bin/python benchmarks/stereo_accuracy.py [--json] [--seeds N] [--noise G]

Error of disparity where it counts (speckle_scenes.truth): RMS, bias, amplitude against the fractional part of the
disparity (pixel locking), predicted over sampled sigma, share of grid points with an answer; OpenCV BM and SGBM on the
same pairs in the same run, at the pixels nearest to ours.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
import sgrt
import speckle_scenes
from harness import Peer

PEERS = ("OpenCV BM", "OpenCV SGBM", "OpenCV SGBM 3-way")
LEVELS = 128


def locking(error: np.ndarray, disparity: np.ndarray) -> float | None:
    """Amplitude of the error's first harmonic in the fraction of the disparity; None where all fractions are one."""
    turn = 2 * np.pi * (disparity % 1)
    if np.abs(np.mean(np.exp(1j * turn))) > 0.5:
        return None
    design = np.column_stack([np.ones_like(turn), np.cos(turn), np.sin(turn)])
    fit = np.linalg.lstsq(design, error, rcond=None)[0]
    return float(np.hypot(fit[1], fit[2]))


def figures(error: np.ndarray, disparity: np.ndarray, share: float) -> dict:
    return {
        "rms_px": float(np.sqrt(np.mean(error**2))),
        "bias_px": float(np.mean(error)),
        "locking_px": locking(error, disparity),
        "share": share,
        "count": len(error),
    }


def measure(scene: speckle_scenes.Scene, seeds: int, noise: float, folder: Path) -> list[dict]:
    rig, (true, counts) = speckle_scenes.rig_of(scene), speckle_scenes.truth(scene)
    found: dict[str, list] = {name: [] for name in ("ours", *PEERS)}
    sigmas = []
    asked = 0
    for seed in range(1, seeds + 1):
        left, right = speckle_scenes.render(scene, seed, noise=noise)
        result = sgrt.stereo_match(
            rig, "pod", left, right, volume_min_mm=(-2000, -2000, 1500), volume_max_mm=(2000, 2000, 2700)
        )
        column, row = (np.rint(result.left_px[..., k]).astype(int) for k in (0, 1))
        inside = (column >= 0) & (row >= 0) & (column < scene.width) & (row < scene.height)
        inside[inside] = counts[row[inside], column[inside]]
        at = result.left_px[inside]
        asked += len(at)
        disparity = speckle_scenes.disparity(scene, at[:, 0], at[:, 1])
        error = at[:, 0] - result.right_px[inside][:, 0] - disparity
        known = np.isfinite(error)
        found["ours"].append((error[known], disparity[known]))
        sigmas.append(result.sigma_px[inside][known])
        path = folder / "pair.npz"
        np.savez(path, left=left, right=right, levels=np.array(LEVELS))
        for name in PEERS:
            with Peer(name, path, 1) as peer:
                map_ = peer(0)[1]["disparity"]
            there = true[row[inside], column[inside]]
            error = map_[row[inside], column[inside]] - there
            known = np.isfinite(error)
            found[name].append((error[known], there[known]))
    rows = []
    for name, parts in found.items():
        error, disparity = (np.concatenate(part) for part in zip(*parts, strict=True))
        line = {"scene": scene.name, "matcher": name} | figures(error, disparity, len(error) / asked)
        if name == "ours":
            sigma = np.concatenate(sigmas)
            line["predicted_over_sampled"] = float(1 / np.sqrt(np.median((error / sigma) ** 2) / 0.4549))
        rows.append(line)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="one JSON document, a list of rows")
    parser.add_argument("--seeds", type=int, default=2, help="pairs a scene (2)")
    parser.add_argument("--noise", type=float, default=2.55, help="grey levels of 255 (2.55: 1 %% of full scale)")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for scene in speckle_scenes.scenes():
            for row in measure(scene, arguments.seeds, arguments.noise, Path(folder)):
                rows.append(row)
                if not arguments.json:
                    print("  ".join(f"{k} {v:.4f}" if isinstance(v, float) else f"{v}" for k, v in row.items()))
    if arguments.json:
        print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
