"""Stripes found in a real scan, drawn over its frames; the jitter along the flat wall; the calibrated light plane.

python scripts/laser_picture.py DATA_FOLDER OUT.png      (DATA_FOLDER holds scan, laser_calib and npy)
"""

from __future__ import annotations

import json
import re
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import sgrt
from numpy.typing import NDArray
from PIL import Image
from sgrt.boards import Board
from sgrt.stripes import find_corners

BOARD = Board("chessboard", 8, 6, 40.0)
WALL_ROWS = slice(10, 180)  # of the scan's frames: nothing but the flat wall


def frames_of(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.jpg"), key=lambda p: int(re.findall(r"\d+", p.stem)[-1]))


def jitter(centre: NDArray[np.float64]) -> float:
    """RMS of the wall's centres about a smooth curve (cubic), px."""
    rows = np.arange(len(centre))[WALL_ROWS]
    x = centre[WALL_ROWS]
    good = np.isfinite(x)
    for _ in range(3):
        left = x - np.polyval(np.polyfit(rows[good], x[good], 3), rows)
        good = np.isfinite(x) & (np.abs(left) < 4 * np.std(left[good]))
    return float(np.std(left[good]))


def rig_of(data: Path) -> sgrt.Rig:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        k = np.load(data / "npy/cameraCalibMatrix4.npy")
        d = np.load(data / "npy/cameraCalibDistCoeff4.npy").ravel()
    camera = {
        "id": "cam",
        "image_size": [640, 480],
        "model": "brown5",
        "intrinsics": [k[0, 0], k[1, 1], k[0, 2], k[1, 2]],
        "distortion": d.tolist(),
        "camera_from_room": np.eye(4).tolist(),
    }
    return sgrt.Rig(json.dumps({"schema": "sgrt-rig/1", "id": "desktop", "room": "camera cam", "cameras": [camera]}))


def views_of(data: Path) -> list[dict[str, Any]]:
    """Corners and stripe of each calibration image: a faint green line in daylight, found in the green excess."""
    views = []
    for path in frames_of(data / "laser_calib"):
        image = Image.open(path).convert("RGB")
        rgb = np.asarray(image).astype(np.float32)
        try:
            corners = find_corners(BOARD, [np.asarray(image.convert("L"))], path.name)
            stripe = sgrt.stripe_extract(rgb[..., 1] - (rgb[..., 0] + rgb[..., 2]) / 2)
        except sgrt.NotFound:
            continue
        rows = np.flatnonzero(np.isfinite(stripe.centre))
        views.append(
            {
                "name": path.name,
                "corners": corners,
                "px": np.stack([stripe.centre[rows], rows], axis=1),
                "sigma": np.maximum(np.asarray(stripe.sigma_px, np.float64)[rows], 0.05),
            }
        )
    return views


def calibrate(rig: sgrt.Rig, views: list[dict[str, Any]]) -> sgrt.Calibration:
    index, corners = [], []
    for i, view in enumerate(views):
        seen = np.flatnonzero(np.isfinite(view["corners"][:, 0]))
        index.append(np.stack([np.zeros(len(seen)), np.full(len(seen), i), seen], axis=1))
        corners.append(view["corners"][seen])
    count = [len(view["px"]) for view in views]
    return sgrt.calibration_laser(
        rig,
        "line",
        [("cam", (640, 480))],
        BOARD.points,
        np.concatenate(index).astype(np.int32),
        np.concatenate(corners),
        placements=[view["name"] for view in views],
        stripe_placement=np.repeat(np.arange(len(views)), count).astype(np.int32),
        stripe_angle_rad=np.zeros(sum(count)),
        stripe_px=np.concatenate([view["px"] for view in views]),
        stripe_sigma_px=np.concatenate([view["sigma"] for view in views]),
        half_turn_ambiguous=BOARD.half_turn_ambiguous,
        fixed=True,
    )


def depth_of(plane: NDArray[np.float64], rays: NDArray[np.float64]) -> NDArray[np.float64]:
    return plane[3] / (rays @ plane[:3])


def report_plane(data: Path) -> None:
    rig, views = rig_of(data), views_of(data)
    whole = calibrate(rig, views)
    assert whole.rig is not None and whole.corners is not None
    print(f"light plane from {whole.view_count} images, {whole.corner_count} points: {whole.rms_px:.3f} px RMS")
    for warning in whole.warnings:
        print("warning:", warning)
    pixels = whole.corners[whole.corners[:, 7] > 0, 3:5]
    rays = rig.unproject("cam", pixels)[0]
    planes = [np.asarray(sgrt.laser_plane(whole.rig, "line", 0.0))]
    sigma = []
    for half in (views[::2], views[1::2]):
        result = calibrate(rig, half)
        assert result.rig is not None
        planes.append(np.asarray(sgrt.laser_plane(result.rig, "line", 0.0)))
        sigma.append(json.loads(result.report)["point_sigma_mm"])
        print(f"half: {result.view_count} images, {result.rms_px:.3f} px RMS, a point good to {sigma[-1]:.2f} mm")
    apart = depth_of(planes[1], rays) - depth_of(planes[2], rays)
    print(f"halves differ by {np.sqrt(np.mean(apart**2)):.2f} mm RMS, predicted {np.hypot(*sigma):.2f}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        author = np.load(data / "npy/LaserPlane4.npy").ravel()
    # Its author's camera has y up and z backward.
    author = np.array([author[0], -author[1], -author[2], -1000 * author[3]]) / np.linalg.norm(author[:3])
    off = depth_of(planes[0], rays) - depth_of(author, rays)
    angle = np.degrees(np.arccos(min(1.0, abs(planes[0][:3] @ author[:3]))))
    print(f"LaserPlane4, y and z turned round: {angle:.2f} deg, {np.median(off):+.1f} mm (median along the rays) away")


def main(data: Path, out: Path) -> None:
    tiles, jitters, share = [], [], []
    frames = frames_of(data / "scan")
    for i, path in enumerate(frames):
        image = Image.open(path).convert("RGB")
        grey = np.asarray(image.convert("L"))
        stripe = sgrt.stripe_extract(grey)
        jitters.append(jitter(stripe.centre))
        share.append(stripe.found_count / len(stripe.centre))
        if i % (len(frames) // 4) == 0 and len(tiles) < 4:
            drawn = np.array(image)
            for row in np.flatnonzero(np.isfinite(stripe.centre)):
                at = round(float(stripe.centre[row]))
                drawn[row, max(0, at - 1) : at + 2] = (255, 0, 0)
            tiles.append(drawn[:, 140:500])
    print(f"{len(frames)} frames: a centre in {100 * min(share):.0f} to {100 * max(share):.0f} % of the rows;", end=" ")
    print(f"jitter along the wall {np.median(jitters):.3f} px (median), 90 % below {np.quantile(jitters, 0.9):.3f}")
    Image.fromarray(np.concatenate(tiles, axis=1)).save(out)
    report_plane(data)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
