"""Honesty of a calibration's covariance over trials: .venv/bin/python benchmarks/calibration_accuracy.py [--trials N]

A pod of two cameras (1280 x 1024, 2400 px, base 250 mm, 2 m away) sees 20 boards (11 x 8, 30 mm), noise 0.05 px a
coordinate. Prints the noise found, the mean of e^T C^-1 e over the parameters, and the sampled over the predicted sigma
of the right camera's projection over its image and from 1.5 to 2.5 m; then times of four cameras with 25 to 100 boards.
"""

import argparse
import time

import numpy as np
import sgrt
from calibration import pixels_of, rotation

SIZE = (1280, 1024)
NOISE = 0.05
LENS = np.array([2400.0, 2404.8, 645.3, 504.8, -0.11, 0.13, 4e-4, -3e-4, -0.05])
BOARD = np.array([[j * 30.0, i * 30.0, 0.0] for i in range(8) for j in range(11)])


def pod(x_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """R and t, camera from the first one's frame: x_mm to the right, turned to a point 2 m ahead of x = 125."""
    turn = rotation(np.array([0.0, np.arctan((x_mm - 125) / 2000), 0.0]) + 1e-12)
    return turn, -turn @ np.array([x_mm, 0.0, 0.0])


def cameras(count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    all_ = [pod(250.0 * i - (300 if i > 1 else 0)) for i in range(count)]
    first = all_[0]
    return [(r @ first[0].T, t - r @ first[0].T @ first[1]) for r, t in all_]


def see(count: int, boards: int, seed: int) -> dict:
    rng = np.random.default_rng(seed)
    index, pixels = [], []
    for b in range(boards):
        turn = rotation(rng.uniform(-0.7, 0.7, 3))
        middle = np.array([0.0, 0.0, 2000.0]) + rng.uniform([-250, -200, -300], [250, 200, 300])
        world = (BOARD - BOARD.mean(axis=0)) @ turn.T + middle
        for c, (r, t) in enumerate(cameras(count)):
            seen = pixels_of(world @ r.T + t, LENS) + rng.normal(0, NOISE, (len(BOARD), 2))
            inside = np.all((seen > 0) & (seen < np.array(SIZE) - 1), axis=1)
            index += [(c, b, i) for i in np.flatnonzero(inside)]
            pixels.append(seen[inside])
    return {
        "cameras": [(f"camera{c}", SIZE) for c in range(count)],
        "points": BOARD,
        "index": np.array(index, np.int32),
        "pixels": np.concatenate(pixels),
        "placements": [f"{b:03}" for b in range(boards)],
        "split_half": False,
    }


def errors(rig: sgrt.Rig) -> np.ndarray:
    """Truth less estimate, in the order of the covariance; a small turn stands for its logarithm."""
    out = []
    for camera, (r, t) in zip(rig.cameras, cameras(len(rig.cameras)), strict=True):
        pose = camera.camera_from_room
        d = r @ pose[:3, :3].T
        turn = 0.5 * np.array([d[2, 1] - d[1, 2], d[0, 2] - d[2, 0], d[1, 0] - d[0, 1]])
        out += [LENS - np.concatenate([camera.intrinsics, camera.distortion]), turn, t - d @ pose[:3, 3]]
    return np.concatenate(out)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=200)
    trials = parser.parse_args().trials
    r, t = cameras(2)[1]
    u, v = np.meshgrid(np.linspace(0.1, 0.9, 7), np.linspace(0.1, 0.9, 5))
    rays = np.stack([(u.ravel() * SIZE[0] - LENS[2]) / LENS[0], (v.ravel() * SIZE[1] - LENS[3]) / LENS[1]], axis=1)
    rays = np.column_stack([rays, np.ones(len(rays))])
    points = np.concatenate([(z * rays - t) @ r for z in (1500.0, 2000.0, 2500.0)])
    truth = pixels_of(points @ r.T + t, LENS)
    noise, nees, sampled, predicted = [], [], 0.0, 0.0
    for trial in range(trials):
        result = sgrt.calibration_solve(**see(2, 20, trial))
        noise.append(result.noise_px)
        free = np.diag(result.covariance) > 0
        scale = np.sqrt(np.diag(result.covariance)[free])
        e = errors(result.rig)[free] / scale
        c = result.covariance[np.ix_(free, free)] / np.outer(scale, scale)
        nees.append(e @ np.linalg.solve(c, e) / free.sum())
        off = result.rig.project("camera1", points) - truth
        sampled = sampled + np.sum(off**2, axis=1) / trials
        predicted = predicted + sgrt.rig_pixel_covariance(result.rig, "camera1", points)[:, [0, 2]].sum(axis=1) / trials
    ratio = np.sqrt(sampled / predicted)
    print(f"noise found {np.sqrt(np.mean(np.square(noise))):.5f} px of {NOISE}; NEES/dof {np.mean(nees):.3f}")
    print(f"projection, sampled over predicted sigma: {ratio.min():.3f} to {ratio.max():.3f}, {trials} trials")
    for boards in (25, 50, 100):
        data = see(4, boards, 1)
        start = time.process_time()
        sgrt.calibration_solve(**data | {"split_half": True})
        print(f"four cameras, {boards} boards, split halves too: {time.process_time() - start:.2f} s of CPU")


if __name__ == "__main__":
    main()
