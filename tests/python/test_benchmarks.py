"""The arithmetic of the benchmarks: alternation, medians, rows, errors against known answers."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

import harness
import icp
import project
import stereo


def test_calls_alternate_and_medians_leave_the_first_round_out():
    order = []

    def side(name, times):
        times = iter(times)

        def call(index):
            order.append(f"{name}{index}")
            return next(times), {"name": np.array(name)}

        return call

    ours, peer, a, b = harness.alternate(side("a", [900, 1, 5, 2]), side("b", [900, 30, 10, 90]), repeats=3)
    assert "".join(order) == "a0b0a0b0a1b1a2b2"
    assert (ours, peer) == (2, 30)
    assert [str(arrays["name"]) for arrays in a + b] == list("aaabbb")


def test_row():
    row = harness.row("work", 2.0, "peer", 5.0, 0.012345678, np.nan, "mm", 1)
    assert list(row) == ["work", "ours_ms", "peer", "peer_ms", "ratio", "ours_error", "peer_error", "unit", "threads"]
    assert (row["ratio"], row["ours_error"], row["peer_error"]) == (2.5, 0.01235, None)


def test_icp_errors_are_taken_at_the_isocentre():
    d = icp.displacement()
    assert np.linalg.norm(d[:3, :3] @ icp.ISOCENTRE_MM + d[:3, 3] - icp.ISOCENTRE_MM) == pytest.approx(11)
    assert icp.errors(np.linalg.inv(d)) == pytest.approx((0, 0), abs=1e-10)
    mm, deg = icp.errors(np.eye(4))
    assert (mm, deg) == (pytest.approx(11), pytest.approx(2.7))
    # Turned about the isocentre by 0.1 deg more: no error of the shift.
    c, s = np.cos(np.radians(0.1)), np.sin(np.radians(0.1))
    turn = np.eye(4)
    turn[:2, :2] = [[c, -s], [s, c]]
    turn[:3, 3] = icp.ISOCENTRE_MM - turn[:3, :3] @ icp.ISOCENTRE_MM
    assert icp.errors(np.linalg.inv(d @ turn)) == (pytest.approx(0, abs=1e-10), pytest.approx(0.1))
    assert np.isnan(icp.errors(np.full((4, 4), np.nan))).all()


def test_stereo_scene_has_the_disparity_it_says():
    x, y = np.array([350.0, 800.0, 1200.0]), np.array([10.0, 500.0, 1000.0])
    d = stereo.disparity_at_left(x, y)
    assert stereo.disparity_at_right(x - d, y) == pytest.approx(d, abs=1e-12)
    # A dot drawn for the right image has its centre where the disparity says.
    dot = np.array([[800.0, 500.0, 100.0]])
    start = dot[:, 0] - stereo.disparity_at_left(dot[:, 0], dot[:, 1])
    image = stereo.render(dot, start, lambda x, y: x + stereo.disparity_at_right(x, y)) - 25
    line, column = np.mgrid[: stereo.HEIGHT, : stereo.WIDTH]
    assert (image * column).sum() / image.sum() == pytest.approx(start[0], abs=0.02)
    assert (image * line).sum() / image.sum() == pytest.approx(500, abs=0.02)


def test_stereo_comparison():
    line, column = (index.astype(float) for index in np.mgrid[100:200:4, 200:300:4])
    left_px = np.stack([column, line], axis=-1)
    right_px = np.stack([column - stereo.disparity_at_left(column, line) - 0.1, line], axis=-1)
    right_px[0] = np.nan  # one line of 25 of ours is absent
    every_line, every_column = (index.astype(float) for index in np.mgrid[: stereo.HEIGHT, : stereo.WIDTH])
    peer = stereo.disparity_at_left(every_column, every_line) + 0.3
    peer[:, 200:240] = np.nan  # 10 columns of 25 of the peer's
    rms, missing = stereo.compare(left_px, right_px, peer)
    assert rms == pytest.approx([0.1, 0.3])
    assert missing == pytest.approx([1 / 25, 10 / 25])


def test_project_scene():
    pose = project.camera_from_room()
    assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3))
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    assert project.pixels_of(np.array([[0.0, 0.0, 2000.0]])) == pytest.approx(np.array([project.INTRINSICS[2:]]))
    assert project.rms(np.array([[3.0, 4.0], [0.0, 0.0]])) == pytest.approx(np.sqrt(12.5))
