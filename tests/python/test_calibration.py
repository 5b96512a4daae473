"""Calibration through the bindings and the command line: made correspondences, rendered boards, real images."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sgrt
from conftest import DATA, ROOT
from sgrt.boards import find_boards, parse_board
from sgrt.cli import main
from sgrt.io import write_image

OPENCV = DATA / "calib" / "opencv"
LENS = np.array([620.0, 622.0, 322.5, 238.0, -0.12, 0.06, 5e-4, -8e-4, 0.0])
BASE = 120.0


def rotation(w: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(w)
    k = w / angle if angle > 0 else w
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def pixel_of(points: np.ndarray, right: bool) -> np.ndarray:
    """The pinhole with Brown's distortion written out; the right camera stands BASE to the right."""
    p = points - [BASE, 0, 0] if right else points
    x, y = p[:, 0] / p[:, 2], p[:, 1] / p[:, 2]
    fx, fy, cx, cy, k1, k2, p1, p2, _ = LENS
    u = x * x + y * y
    radial = 1 + u * (k1 + u * k2)
    return np.stack(
        [
            fx * (x * radial + 2 * p1 * x * y + p2 * (u + 2 * x * x)) + cx,
            fy * (y * radial + p1 * (u + 2 * y * y) + 2 * p2 * x * y) + cy,
        ],
        axis=1,
    )


def board_pose(rng: np.random.Generator, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    turn = rotation(rng.uniform([-0.6, -0.6, -0.3], [0.6, 0.6, 0.3]))
    at = np.array([rng.uniform(0, 120), rng.uniform(-60, 60), rng.uniform(480, 700)])
    return turn, at - turn @ middle


def correspondences(boards: int = 14, noise: float = 0.05, seed: int = 1) -> dict:
    rng = np.random.default_rng(seed)
    points = sgrt.board_points("chessboard", 9, 6, 22.0)
    middle = points.mean(axis=0)
    index, pixels = [], []
    for b in range(boards):
        turn, at = board_pose(rng, middle)
        for camera in range(2):
            seen = pixel_of(points @ turn.T + at, camera == 1) + rng.normal(0, noise, (len(points), 2))
            inside = np.all((seen > 0) & (seen < [639, 479]), axis=1)
            index += [(camera, b, i) for i in np.flatnonzero(inside)]
            pixels += list(seen[inside])
    return {
        "cameras": [("left", (640, 480)), ("right", (640, 480))],
        "points": points,
        "index": np.array(index, np.int32),
        "pixels": np.array(pixels),
        "placements": [f"{b:02}.png" for b in range(boards)],
    }


def test_the_rig_comes_back_within_its_uncertainty():
    result = sgrt.calibration_solve(**correspondences(), pairs=[("pod", "left", "right")], rig_id="made")
    assert result.status == "ok" and result.noise_px == pytest.approx(0.05, rel=0.1)
    rig = result.rig
    assert rig.id == "made" and rig.room == "camera left" and [p.id for p in rig.pairs] == ["pod"]
    sigma = np.sqrt(np.diag(result.covariance))
    left, right = rig.cameras
    assert np.all(np.abs(left.intrinsics - LENS[:4]) < 4.5 * sigma[:4])
    assert np.all(np.abs(left.distortion - LENS[4:]) < 4.5 * sigma[4:9])
    assert np.all(np.abs(right.camera_from_room[:3, 3] - [-BASE, 0, 0]) < 4.5 * sigma[-3:])
    assert result.parameters[0] == "left.fx" and result.parameters[-1] == "right.tz"
    report = json.loads(result.report)
    assert report["schema"] == "sgrt-calibration/1" and len(report["cameras"]) == 2
    assert report["cameras"][0]["split_half"]["predicted_px"] > 0
    # The text of the rig carries the uncertainty.
    again = sgrt.Rig(rig.to_json())
    x = np.array([[50.0, 0, 600]])
    c = sgrt.rig_pixel_covariance(again, "right", x)[0]
    assert 0 < c[0] < 1 and c[0] * c[2] > c[1] ** 2
    assert np.all(sgrt.rig_point_covariance(again, "pod", x, noise_px=0.05)[0, [0, 3, 5]] > 0)


def test_check_and_errors():
    rig = sgrt.calibration_solve(**correspondences(), split_half=False).rig
    fresh = sgrt.calibration_check(rig, **correspondences(6, seed=9))
    assert fresh.rms_px == pytest.approx(fresh.expected_rms_px, rel=0.2) and fresh.rig is None
    data = correspondences(2)
    with pytest.raises(sgrt.InsufficientData, match="expected at least 3") as caught:
        sgrt.calibration_solve(**data)
    assert json.loads(caught.value.result.report)["status"] == "insufficient_data"
    with pytest.raises(sgrt.InvalidArgument, match="stands twice"):
        sgrt.calibration_solve(**data | {"cameras": [("a", (640, 480)), ("a", (640, 480))]})
    with pytest.raises(sgrt.InvalidArgument, match="not among the cameras"):
        sgrt.calibration_solve(**data, pairs=[("pod", "left", "up")])
    with pytest.raises(sgrt.InvalidArgument, match="spacing_mm"):
        sgrt.board_points("chessboard", 9, 6, -1.0)
    with pytest.raises(sgrt.InvalidArgument, match="kind"):
        sgrt.board_points("dots", 9, 6, 1.0)
    with pytest.raises(sgrt.InvalidArgument, match="states"):
        sgrt.rig_pixel_covariance(sgrt.Rig(plain_rig(rig)), "left", np.zeros((1, 3)))


def plain_rig(rig: sgrt.Rig) -> str:
    document = json.loads(rig.to_json())
    del document["uncertainty"]
    return json.dumps(document)


def wave(squares: np.ndarray, count: int) -> np.ndarray:
    """+1 and -1 by turns from square to square, 0 on the lines, changing over about a pixel."""
    per_pixel = np.hypot(*np.gradient(squares))
    line = np.clip(np.round(squares), 0, count)
    sign = np.where(line % 2 == 0, -1.0, 1.0)
    return sign * np.tanh((line - squares) / per_pixel * 1.3)


def rendered(turn: np.ndarray, at: np.ndarray, right: bool, seed: int) -> np.ndarray:
    """A 9 x 6 chessboard of 22 mm, its edges smooth, through the undistorted rays."""
    u, v = np.meshgrid(np.arange(640.0), np.arange(480.0))
    fx, fy, cx, cy, k1, k2, p1, p2, _ = LENS
    xd, yd = (u - cx) / fx, (v - cy) / fy
    x, y = xd, yd
    for _ in range(12):
        r = x * x + y * y
        radial = 1 + r * (k1 + r * k2)
        x, y = (
            (xd - 2 * p1 * x * y - p2 * (r + 2 * x * x)) / radial,
            (yd - p1 * (r + 2 * y * y) - 2 * p2 * x * y) / radial,
        )
    centre = np.array([BASE if right else 0.0, 0, 0])
    normal = turn[:, 2]
    t = (normal @ (at - centre)) / (normal[0] * x + normal[1] * y + normal[2])
    hits = np.stack([t * x, t * y, t], axis=-1) + centre - at
    i, j = (hits @ turn[:, 1]) / 22 + 1, (hits @ turn[:, 0]) / 22 + 1  # in squares from the outer corner
    inside = (i > 0) & (i < 7) & (j > 0) & (j < 10)
    paper = (i > -1) & (i < 8) & (j > -1) & (j < 11)
    chess = 120.0 - 80.0 * wave(i, 7) * wave(j, 10)
    grey = np.where(inside, chess, np.where(paper, 200.0, 100.0))
    noise = np.random.default_rng(seed).normal(0, 1.5, grey.shape)
    return np.clip(np.round(grey + noise), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def folders(tmp_path_factory) -> Path:
    """left/ and right/ with seven placements; one image of nothing."""
    root = tmp_path_factory.mktemp("boards")
    rng = np.random.default_rng(4)
    middle = sgrt.board_points("chessboard", 9, 6, 22.0).mean(axis=0)
    for b in range(7):
        turn, at = board_pose(rng, middle)
        for name in ("left", "right"):
            (root / name).mkdir(exist_ok=True)
            write_image(root / name / f"{b}.png", rendered(turn, at, name == "right", b))
    write_image(root / "left" / "nothing.png", np.full((480, 640), 128, np.uint8))
    return root


def arguments(root: Path, *more: str) -> list[str]:
    return [
        "calibrate",
        "--board",
        "chessboard:9x6:22",
        "--camera",
        f"left={root}/left",
        "--camera",
        f"right={root}/right",
        *more,
    ]


def test_command_from_folders_to_rig_check_room_and_daily_check(folders, tmp_path, capsys):
    rig_file, page = tmp_path / "rig.json", tmp_path / "page.png"
    assert (
        main(arguments(folders, "--pair", "pod=left,right", "--out", str(rig_file), "--picture", str(page), "--json"))
        == 0
    )
    report = json.loads(capsys.readouterr().out)
    assert report["status"] == "ok" and report["images_without_board"][0]["image"] == "nothing.png"
    assert report["rms_px"] < 0.08
    assert page.read_bytes()[:4] == b"\x89PNG"
    rig = sgrt.io.read_rig(rig_file)
    assert rig.cameras[0].intrinsics[:2] == pytest.approx(LENS[:2], rel=2e-3)
    assert rig.cameras[1].camera_from_room[0, 3] == pytest.approx(-BASE, abs=0.2)
    assert main(arguments(folders, "--check", str(rig_file))) == 0
    assert "RMS" in capsys.readouterr().out

    # A plate at the isocentre, as the first image shows it, gives the room; the check after it passes, moved it fails.
    rng = np.random.default_rng(4)
    turn, at = board_pose(rng, sgrt.board_points("chessboard", 9, 6, 22.0).mean(axis=0))
    pose = np.eye(4)
    pose[:3, 3] = [-88, -55, 0]
    phantom = {"schema": "sgrt-phantom/1", "board": "chessboard:9x6:22", "room_from_board": pose.tolist()}
    (tmp_path / "phantom.json").write_text(json.dumps(phantom))
    images = ["--images", f"left={folders}/left/0.png", "--images", f"right={folders}/right/0.png"]
    points = ["--points", str(tmp_path / "phantom.json"), *images]
    room_file = tmp_path / "room.json"
    assert main(["calibrate", "room", "--rig", str(rig_file), *points, "--out", str(room_file)]) == 0
    room = sgrt.io.read_rig(room_file)
    assert room.room == "IEC 61217 fixed, mm"
    expected = np.eye(4)
    expected[:3, :3], expected[:3, 3] = turn, at - turn @ pose[:3, 3]
    assert np.abs(room.cameras[0].camera_from_room - expected)[:3, :3].max() < 2e-3
    assert np.abs(room.cameras[0].camera_from_room - expected)[:3, 3].max() < 0.5
    trend = tmp_path / "trend.jsonl"
    check = ["check", "--rig", str(room_file), *points, "--trend", str(trend)]
    assert main(check) == 0 and main([*check, "--json"]) == 0
    phantom["room_from_board"][2][3] = 1.5
    (tmp_path / "phantom.json").write_text(json.dumps(phantom))
    assert main(check) == 1
    assert [json.loads(line)["pass"] for line in trend.read_text().splitlines()] == [True, True, False]
    capsys.readouterr()


@pytest.mark.parametrize(
    ("words", "code", "change"),
    [
        ("saw 9 x 6", 1, {"--board": "chessboard:8x6:22"}),
        ("expected more than 0", 2, {"--board": "chessboard:9x6:-3"}),
        ("expected more than 0", 2, {"--board": "chessboard:9x6:0"}),
        ("expected chessboard:", 2, {"--board": "9x6"}),
        ("--out is missing", 2, {"--out": None}),
        ("no camera 'up'", 2, {"--pair": "pod=left,up"}),
    ],
)
def test_command_says_what_is_wrong(folders, tmp_path, capsys, words, code, change):
    options = {
        "--board": "chessboard:9x6:22",
        "--camera": f"left={folders}/left",
        "--out": str(tmp_path / "rig.json"),
    } | change
    assert main(["calibrate", *[part for key, value in options.items() if value for part in (key, value)]]) == code
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1
    assert not (tmp_path / "rig.json").exists()


def test_command_on_bad_files(folders, tmp_path, capsys):
    shutil.copytree(folders / "left", tmp_path / "bad")
    base = ["calibrate", "--board", "chessboard:9x6:22", "--out", str(tmp_path / "rig.json"), "--camera"]
    (tmp_path / "bad" / "3.png").write_bytes(b"not an image")
    assert main([*base, f"left={tmp_path}/bad"]) == 2
    assert "3.png" in capsys.readouterr().err
    write_image(tmp_path / "bad" / "3.png", np.zeros((100, 100), np.uint8))
    assert main([*base, f"left={tmp_path}/bad"]) == 2
    assert "100 x 100" in capsys.readouterr().err
    assert main([*base, f"left={tmp_path}/absent"]) == 2
    assert main([*base, f"left={folders}/left", "--camera", f"left={folders}/right"]) == 2
    assert "two cameras with one id" in capsys.readouterr().err


def test_threads_do_not_change_the_boards(folders):
    board = parse_board("chessboard:9x6:22")
    one, two = (find_boards(board, [("left", folders / "left")], threads=n) for n in (1, 3))
    assert np.array_equal(one.pixels, two.pixels) and np.array_equal(one.index, two.index)


def test_printed_boards(tmp_path):
    for board in ("chessboard:9x6:22", "circles:4x11:15"):
        files = [tmp_path / "board.svg", tmp_path / "board.pdf"]
        subprocess.run([sys.executable, ROOT / "calib" / "make_board.py", board, *files], check=True)
        svg, pdf = (file.read_bytes() for file in files)
        dark = svg.count(b"<circle") if board.startswith("circles") else svg.count(b"<rect") - 1
        assert dark == (44 if board.startswith("circles") else 35)
        assert pdf.startswith(b"%PDF-1.4") and pdf.rstrip().endswith(b"%%EOF") and b"100 mm" in pdf


@pytest.mark.skipif(not OPENCV.exists(), reason=f"no {OPENCV}")
def test_opencv_sample_images(tmp_path, capsys):
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for path in OPENCV.glob(f"{side}*.jpg"):
            shutil.copy(path, tmp_path / side / path.name[len(side) :])
    rms = {}
    for sides in (["left"], ["right"], ["left", "right"]):
        cameras = [part for side in sides for part in ("--camera", f"{side}={tmp_path}/{side}")]
        out = tmp_path / "rig.json"
        assert main(["calibrate", "--board", "chessboard:9x6:25", *cameras, "--out", str(out), "--json"]) == 0
        report = json.loads(capsys.readouterr().out)
        assert not report["images_without_board"]
        rms["+".join(sides)] = report["rms_all_px"]
    assert rms["left"] <= 0.195 and rms["right"] <= 0.207 and rms["left+right"] <= 0.215
