"""Stereo on real pairs: a projected pattern on dark walls, and a room without any speckle."""

import json

import numpy as np
import pytest
import sgrt
from conftest import DATA

PATTERN = DATA / "speckle" / "d415-ir"
ROOM = DATA / "stereo" / "skimage-motorcycle"


def rig_of(width: int, height: int, focal: float, cx: tuple[float, float], cy: float, base: float) -> sgrt.Rig:
    cameras = []
    for name, x_mm, at in (("left", 0.0, cx[0]), ("right", base, cx[1])):
        pose = np.eye(4)
        pose[0, 3] = -x_mm
        intrinsics = [focal, focal, at, cy]
        size = [width, height]
        cameras.append(
            {"id": name, "image_size": size, "model": "pinhole", "intrinsics": intrinsics, "camera_from_room": pose}
        )
    pair = {"id": "pod", "left": "left", "right": "right"}
    document = {"schema": "sgrt-rig/1", "id": "real", "room": "camera left", "cameras": cameras, "pairs": [pair]}
    return sgrt.Rig(json.dumps(document, default=lambda matrix: matrix.tolist()))


def within(rig, left, right, depth_mm, **options):
    low, high = (-np.inf, -np.inf, depth_mm[0]), (np.inf, np.inf, depth_mm[1])
    return sgrt.stereo_match(rig, "pod", left, right, volume_min_mm=low, volume_max_mm=high, **options)


@pytest.mark.skipif(not PATTERN.is_dir(), reason=f"the pair is not at {PATTERN}")
@pytest.mark.parametrize(("options", "covered"), [({}, 0.55), ({"max_sigma_px": 1.0}, 0.7)])
def test_a_projected_pattern(options, covered):
    left, right = (sgrt.io.read_image(PATTERN / f"image{i}.png") for i in (0, 1))
    height, width = left.shape
    rig = rig_of(width, height, 640, (width / 2, width / 2), height / 2, 55)
    found = within(rig, left, right, (640 * 55 / 128, 1e6), **options)
    assert found.point_count > covered * found.reason.size
    # Its walls and boards are flat: a match differs little from its neighbours' plane, as the sigma says.
    disparity = found.left_px[..., 0] - found.right_px[..., 0]
    bent = disparity[:, 4:] - 2 * disparity[:, 2:-2] + disparity[:, :-4]
    assert np.nanquantile(np.abs(bent), 0.95) < 0.5


@pytest.mark.skipif(not ROOM.is_dir(), reason=f"the pair is not at {ROOM}")
@pytest.mark.parametrize(("options", "covered", "bad"), [({}, 0.33, 0.02), ({"max_sigma_px": 1.0}, 0.48, 0.03)])
def test_a_room_without_speckle(options, covered, bad):
    def image(side):
        colours = sgrt.io.read_image(ROOM / f"motorcycle_{side}.png")
        return colours if colours.ndim == 2 else np.rint(colours.mean(axis=2)).astype(np.uint8)

    left, right = image("left"), image("right")
    height, width = left.shape
    with np.load(ROOM / "motorcycle_disp.npz") as file:
        truth = file[file.files[0]]
    focal, base = 994.978, 193.001
    rig = rig_of(width, height, focal, (311.193, 311.193 + 31.086), 254.877, base)
    found = within(rig, left, right, (focal * base / (31.086 + 80), focal * base / (31.086 + 1)), **options)
    column, row = np.rint(found.left_px).astype(int).transpose(2, 0, 1)
    true = truth[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
    error = (found.left_px[..., 0] - found.right_px[..., 0] - true)[np.isfinite(true)]
    known = np.isfinite(error)
    assert known.mean() > covered
    assert np.mean(np.abs(error[known]) > 2) < bad
