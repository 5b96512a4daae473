"""Filters of surfaces: noise down as predicted, outliers out, motion followed; the commands filter and fuse."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import sgrt
from sgrt.cli import main
from sgrt.io import Capture, read_captures, read_surface, write_captures, write_surface


def dome(rng: np.random.Generator, sigma: float = 0.2, shift: float = 0.0) -> sgrt.Surface:
    """A sphere of 80 mm, seen from above on a grid of 1 mm, with noise along the normal."""
    y, x = np.mgrid[-20:20.0, -20:20.0]
    centre = np.array([0, 0, shift])
    normals = np.stack([x, y, np.sqrt(80**2 - x**2 - y**2)], axis=-1) / 80
    noise = sigma * rng.standard_normal(x.shape)[..., None]
    return sgrt.Surface(centre + (80 + noise) * normals, normals=normals, sigma_mm=np.full(x.shape, sigma))


def heights(surface: sgrt.Surface) -> np.ndarray:
    return np.linalg.norm(surface.points, axis=-1) - 80


def test_noise_falls_as_predicted() -> None:
    found = sgrt.surface_filter(dome(np.random.default_rng(1)), radius_mm=5)
    assert found.counts == {"filtered": 1600, "absent": 0, "kept": 0, "outlier": 0}
    assert np.std(heights(found.surface) / found.surface.sigma_mm) == pytest.approx(1, abs=0.15)
    assert found.sigma_after_mm < 0.4 * found.sigma_before_mm
    assert "1600 filtered" in repr(found)


def test_outliers_go_and_the_map_says_so() -> None:
    surface = dome(np.random.default_rng(2))
    points = surface.points.copy()
    points[7, 9] += (0, 0, 5)
    points[20, 20] = np.nan
    found = sgrt.surface_filter(sgrt.Surface(points, normals=surface.normals, sigma_mm=surface.sigma_mm))
    words = np.array(sgrt.FILTER_REASONS)[found.reason]
    assert words[7, 9] == "outlier" and words[20, 20] == "absent"
    assert np.isnan(found.surface.points[7, 9]).all() and np.isnan(found.surface.points[20, 20]).all()
    assert found.surface.point_count == 1598


def test_a_stream_is_averaged_until_it_moves() -> None:
    rng = np.random.default_rng(3)
    session = sgrt.FilterSession(drift_mm=0)
    frames = [session.push(dome(rng), time_s=k / 10) for k in range(9)]
    assert frames[-1].counts["averaged"] > 1580
    assert np.std(heights(frames[-1].surface)) == pytest.approx(0.2 / 3, rel=0.1)
    moved = session.push(dome(rng, shift=0.5), time_s=1)
    assert moved.counts["moved"] == 1600
    assert np.array_equal(np.array(sgrt.FILTER_STATES)[moved.state], np.full((40, 40), "moved"))
    assert np.std(heights(frames[-1].surface)) < 0.1  # an older frame is its own
    with pytest.raises(sgrt.InvalidArgument, match=r"time_s is 0.5"):
        session.push(dome(rng), time_s=0.5)


def test_a_cloud_cannot_be_followed_over_time() -> None:
    cloud = sgrt.Surface(np.eye(3), normals=np.eye(3), sigma_mm=np.ones(3))
    with pytest.raises(sgrt.InvalidArgument, match="organised"):
        sgrt.FilterSession().push(cloud, time_s=0)


def test_command_filters_a_surface(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    noisy = dome(np.random.default_rng(4))
    write_surface(tmp_path / "a.ply", noisy)
    assert main(["filter", str(tmp_path / "a.ply"), "--radius", "5", "--out", str(tmp_path / "b.ply"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["counts"]["filtered"] == 1600 and told["radius_mm"] == 5
    filtered = read_surface(tmp_path / "b.ply")
    assert np.std(heights(filtered)) < 0.4 * np.std(heights(noisy))
    assert filtered.correlation_points == pytest.approx(told["correlation_points"])


def test_command_says_what_it_takes_for_outward(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_surface(tmp_path / "a.ply", sgrt.Surface(dome(np.random.default_rng(8)).points))
    assert main(["filter", str(tmp_path / "a.ply"), "--out", str(tmp_path / "b.ply"), "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["normals"] == "estimated, towards 0 0 10000"
    assert "outward is taken to be towards" in told.err


def test_command_filters_frames(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(5)
    captures = [Capture(k / 10, tmp_path / f"{k}.ply") for k in range(4)]
    for capture in captures:
        write_surface(capture.surface, dome(rng))
    captures.append(Capture(0.5))
    write_captures(tmp_path / "frames.json", captures)
    assert main(["filter", str(tmp_path / "frames.json"), "--out", str(tmp_path / "out"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["frame_count"] == 5 and told["counts"]["started"] == 1600
    written = read_captures(tmp_path / "out")
    assert [capture.time_s for capture in written] == [0, 0.1, 0.2, 0.3, 0.5]
    assert np.std(heights(read_surface(written[3].surface))) == pytest.approx(0.1, rel=0.15)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["absent.ply"], "absent.ply"),
        (["a.ply", "--radius", "-1"], "radius_mm is -1"),
        (["a.ply", "--drift", "1"], "drift_mm belong to frames"),
        (["frames.json", "--radius", "1"], "radius_mm belong to a surface"),
        (["pairs.json"], "expected frames with surfaces"),
    ],
)
def test_command_refuses(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    write_surface("a.ply", dome(np.random.default_rng(6)))
    write_captures("frames.json", [Capture(0, Path("a.ply"))])
    write_captures("pairs.json", [Capture(0, None, {"pod": (Path("l.png"), Path("r.png"))})])
    assert main(["filter", *arguments, "--out", "out"]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1
    assert not Path("out").exists()


def test_command_fuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(7)
    files = [str(tmp_path / name) for name in ("a.ply", "b.ply")]
    for file in files:
        write_surface(file, dome(rng))
    assert main(["fuse", *files, "--out", str(tmp_path / "c.ply"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["overlap_points"] > 1400
    assert told["disagreement_rms_mm"] == pytest.approx(told["disagreement_expected_mm"], rel=0.2)
    assert read_surface(tmp_path / "c.ply").point_count == told["points"]
    assert main(["fuse", *files, "--out", str(tmp_path / "c.ply")]) == 0
    assert "they disagree by 0.2" in capsys.readouterr().out


def test_fuse_names_the_file_without_normals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_surface(tmp_path / "a.ply", sgrt.Surface(np.eye(3)))
    assert main(["fuse", str(tmp_path / "a.ply"), "--out", str(tmp_path / "c.ply")]) == 2
    assert "a.ply: has no normals" in capsys.readouterr().err
    assert not (tmp_path / "c.ply").exists()
