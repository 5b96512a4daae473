"""A rectified pair of speckle images, 1280 x 1024, 0.6 % noise, with known disparity: error, holes and time."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed

PEERS = ("OpenCV BM", "OpenCV SGBM", "OpenCV SGBM 3-way")
STRIDES_PX = (3,)  # of ours; the peers give a disparity for every pixel
WIDTH, HEIGHT = 1280, 1024
LEVELS = 128  # disparities 0 to 128 px are searched by all
FOCAL_PX, BASE_MM, OFFSET_PX = 2400.0, 250.0, 280.0  # the offset of the principal points brings 2 m to 20 px
SPECKLE_PX = 1.3  # sigma of a dot
NOISE = 0.006 * 255


def disparity_at_right(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 24 + 8 * np.cos(x / 240) * np.cos(y / 210)


def disparity_at_left(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """d with x - d the right pixel: a fixed point, contracting by 1/30 a step."""
    d = np.full(np.broadcast(x, y).shape, 24.0)
    for _ in range(12):
        d = disparity_at_right(x - d, y)
    return d


def render(dots: np.ndarray, start_of: np.ndarray, left_of) -> np.ndarray:
    """The image whose pixel (x, y) shows the pattern at (left_of(x, y), y). start_of: about where each dot appears."""
    reach = np.arange(-6, 7)
    u, v, height = (column[:, None, None] for column in dots.T)
    x = np.rint(start_of)[:, None, None].astype(int) + reach[None, None, :]
    y = np.rint(v).astype(int) + reach[None, :, None]
    value = height * np.exp(-((left_of(x, y) - u) ** 2 + (y - v) ** 2) / (2 * SPECKLE_PX**2))
    x, y = np.broadcast_arrays(x, y)
    inside = (x >= 0) & (x < WIDTH) & (y >= 0) & (y < HEIGHT)
    image = np.bincount((y * WIDTH + x)[inside], value[inside], WIDTH * HEIGHT)
    return 25 + image.reshape(HEIGHT, WIDTH)


def scene() -> Arrays:
    rng = np.random.default_rng(11)
    count = WIDTH * HEIGHT // 25
    dots = np.stack([rng.uniform(-10, WIDTH + 60, count), rng.uniform(-10, HEIGHT + 10, count)], axis=1)
    dots = np.column_stack([dots, rng.uniform(20, 110, count)])
    right_start = dots[:, 0] - disparity_at_left(dots[:, 0], dots[:, 1])
    left = render(dots, dots[:, 0], lambda x, y: x)
    right = render(dots, right_start, lambda x, y: x + disparity_at_right(x, y))
    noisy = (image + rng.normal(0, NOISE, image.shape) for image in (left, right))
    left, right = (np.clip(np.rint(image), 0, 255).astype(np.uint8) for image in noisy)
    return {"left": left, "right": right, "levels": np.array(LEVELS)}


def rig() -> sgrt.Rig:
    cameras = []
    for name, x_mm, cx in (("left", 0.0, 499.5), ("right", BASE_MM, 499.5 + OFFSET_PX)):
        pose = np.eye(4)
        pose[0, 3] = -x_mm
        cameras.append(
            {
                "id": name,
                "image_size": [WIDTH, HEIGHT],
                "model": "pinhole",
                "intrinsics": [FOCAL_PX, FOCAL_PX, cx, 511.5],
                "camera_from_room": pose.tolist(),
            }
        )
    pairs = [{"id": "pod", "left": "left", "right": "right"}]
    text = {"schema": "sgrt-rig/1", "id": "benchmark", "room": "camera left", "cameras": cameras, "pairs": pairs}
    return sgrt.Rig(json.dumps(text))


def compare(left_px: np.ndarray, right_px: np.ndarray, peer: np.ndarray) -> tuple[list[float], list[float]]:
    """RMS disparity error where both have an answer, and the share without one where both images see the scene.

    left_px, right_px: ours, on a grid, NaN where absent. peer: a disparity a pixel of the left image, NaN where absent;
    it is judged at the pixels nearest to ours.
    """
    column, line = (np.rint(left_px[..., k]).astype(int) for k in (0, 1))
    seen = (column >= LEVELS) & (column < WIDTH) & (line >= 0) & (line < HEIGHT)
    column, line, left_px, right_px = column[seen], line[seen], left_px[seen], right_px[seen]
    ours_error = left_px[:, 0] - right_px[:, 0] - disparity_at_left(left_px[:, 0], left_px[:, 1])
    peer_error = peer[line, column] - disparity_at_left(column.astype(float), line.astype(float))
    both = np.isfinite(ours_error) & np.isfinite(peer_error)
    rms = [float(np.sqrt(np.mean(error[both] ** 2))) for error in (ours_error, peer_error)]
    return rms, [float(np.mean(~np.isfinite(error))) for error in (ours_error, peer_error)]


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    inputs = scene()
    path = folder / "stereo.npz"
    np.savez(path, **inputs)
    ours, context = rig(), sgrt.Context(threads=threads)
    depth_mm = [FOCAL_PX * BASE_MM / (OFFSET_PX + disparity) for disparity in (LEVELS, 0)]
    volume = {
        "volume_min_mm": (-np.inf, -np.inf, depth_mm[0]),
        "volume_max_mm": (np.inf, np.inf, depth_mm[1]),
    }
    for stride in STRIDES_PX:
        session = sgrt.StereoSession(ours, "pod", stride_px=stride, context=context, **volume)

        def match(_: int, session: sgrt.StereoSession = session) -> Arrays:
            found = session.push(inputs["left"], inputs["right"], time_s=0.0, context=context)
            return {"left_px": found.left_px, "right_px": found.right_px}

        for name in PEERS:
            with Peer(name, path, threads) as peer:
                ours_ms, peer_ms, a, b = alternate(timed(match), peer, repeats)
            rms, missing = compare(a[-1]["left_px"], a[-1]["right_px"], b[-1]["disparity"])
            work = f"stereo {WIDTH} x {HEIGHT}, a point every {stride} px"
            yield row(f"{work}: disparity", ours_ms, name, peer_ms, *rms, "px", threads)
            yield row(f"{work}: missing", ours_ms, name, peer_ms, *missing, "share", threads)
