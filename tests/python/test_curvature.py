"""Curvature through the ABI: exact shapes, a noisy mesh, reasons, features, and the command."""

import json

import numpy as np
import pytest
import sgrt
from sgrt import cli, io


def ply_rows(path):
    """The points of a binary PLY of doubles, read independently."""
    head, _, body = path.read_bytes().partition(b"end_header\n")
    names = [line.split()[2].decode() for line in head.splitlines() if line.startswith(b"property double")]
    return np.frombuffer(body, [(name, "<f8") for name in names])


def wave(side=61, spacing=1.0, noise=0.0):
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(*[spacing * (np.arange(side) - side // 2)] * 2)
    z = 8 * np.cos(x / 15) * np.cos(y / 20) + noise * rng.normal(size=x.shape)
    fx, fy = -8 / 15 * np.sin(x / 15) * np.cos(y / 20), -8 / 20 * np.cos(x / 15) * np.sin(y / 20)
    n = np.stack([-fx, -fy, np.ones_like(fx)], -1)
    c = np.cos(x / 15) * np.cos(y / 20)
    fxx, fyy, fxy = -8 / 225 * c, -8 / 400 * c, 8 / 300 * np.sin(x / 15) * np.sin(y / 20)
    g = 1 + fx**2 + fy**2
    mean = -((1 + fy**2) * fxx - 2 * fx * fy * fxy + (1 + fx**2) * fyy) / (2 * g**1.5)
    return np.stack([x, y, z], -1), n / np.sqrt((n**2).sum(-1, keepdims=True)), mean


def test_nurbs_is_exact():
    torus = sgrt.NurbsSurface.torus((1, 2, 3), (0, 0, 1), 20, 8)
    uv = np.random.default_rng(2).uniform(0.01, 0.99, (500, 2))
    c = sgrt.nurbs_curvature(torus, uv)
    rho = np.hypot(*(torus.evaluate(uv[:, 0], uv[:, 1]) - (1, 2, 3))[:, :2].T)
    k2 = (rho - 20) / 8 / rho
    assert c["k1"] == pytest.approx(np.full(500, 1 / 8), rel=1e-10)
    assert c["k2"] == pytest.approx(k2, abs=1e-11)
    assert c["mean"] == pytest.approx((1 / 8 + k2) / 2, rel=1e-10)
    assert c["hk"][k2 > 1e-3].tolist() == [2] * int((k2 > 1e-3).sum())
    assert set(c["hk"][k2 < -1e-3]) <= {6, 7, 8}
    with pytest.raises(sgrt.InvalidArgument):
        sgrt.nurbs_curvature(torus, [[2.0, 0.5]])


def test_circle_of_radius_r_has_one_over_r():
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    points = np.stack([5 * np.cos(turn), 5 * np.sin(turn), 0 * turn], -1)
    c = sgrt.points_curvature(points, closed=True, plane_normal=(0, 0, 1), sigma_mm=0.01)
    assert c["curvature"] == pytest.approx(np.full(60, 0.2), rel=2e-4)
    assert sgrt.points_curvature(points[::-1], closed=True, plane_normal=(0, 0, 1))["curvature"].max() < 0
    curve = sgrt.NurbsCurve(points, 3)
    inner = sgrt.curve_curvature(curve, np.linspace(0.2, 0.8, 9))
    assert inner["curvature"] == pytest.approx(np.full(9, 0.2), rel=0.02)


@pytest.mark.parametrize("kind", ["grid", "cloud"])
def test_noise(kind):
    points, normals, mean = wave(noise=0.1)
    if kind == "cloud":
        points, normals, mean = points.reshape(-1, 3), normals.reshape(-1, 3), mean.ravel()
    c = sgrt.surface_curvature(sgrt.Surface(points, normals=normals))
    assert c.mean.shape == mean.shape
    known = c.reason == 0
    assert known.mean() > 0.8
    assert c.noise_mm == pytest.approx(0.1, rel=0.15)
    assert 0.6 < np.sqrt(np.mean(((c.mean - mean) / c.sigma_mean)[known] ** 2)) < 1.6
    inside = known & (np.abs(points[..., :2]).max(-1) < 20)  # at the border sigma is large, and said
    assert np.sqrt(np.mean((c.mean - mean)[inside] ** 2)) < 0.15 * np.sqrt(np.mean(mean[inside] ** 2))
    assert np.isnan(c.k1[~known]).all() and np.isnan(c.normals[~known]).all()
    assert c.counts["known"] == c.known_count == known.sum()
    assert np.einsum("...i,...i", c.d1[known], c.normals[known]) == pytest.approx(np.zeros(known.sum()), abs=1e-9)


def test_units_follow_the_size():
    points, normals, _ = wave(31)
    one = sgrt.surface_curvature(sgrt.Surface(points, normals=normals), radius_mm=4)
    ten = sgrt.surface_curvature(sgrt.Surface(10 * points, normals=normals), radius_mm=40)
    assert 10 * ten.k1[10:20, 10:20] == pytest.approx(one.k1[10:20, 10:20], rel=1e-9)
    flipped = sgrt.surface_curvature(sgrt.Surface(points, normals=-normals), radius_mm=4)
    assert flipped.k1[15, 15] == pytest.approx(-one.k2[15, 15], rel=1e-9)


def test_what_is_refused():
    points, normals, _ = wave(21)
    with pytest.raises(sgrt.InvalidArgument, match="without normals"):
        sgrt.surface_curvature(sgrt.Surface(points))
    with pytest.raises(sgrt.InvalidArgument, match="degree"):
        sgrt.surface_curvature(sgrt.Surface(points, normals=normals), degree=7)
    with pytest.raises(sgrt.InsufficientData, match="too_few"):
        sgrt.surface_curvature(sgrt.Surface(points, normals=normals), radius_mm=0.5)


def test_features():
    points, normals, _ = wave(61)
    surface = sgrt.Surface(points, normals=normals)
    c = sgrt.surface_curvature(surface, radius_mm=5, noise_mm=0.001)
    found = sgrt.curvature_features(surface, c)
    assert found["persistence"].shape == (61, 61) and found["crest"].dtype == np.uint8
    i, j = np.unravel_index(np.nanargmax(found["persistence"]), (61, 61))
    assert abs(i - 30) <= 1 and abs(j - 30) <= 1  # the top of the wave
    with pytest.raises(sgrt.InvalidArgument):
        sgrt.curvature_features(sgrt.Surface(points[:30], normals=normals[:30]), c)


def test_command(tmp_path, capsys):
    points, normals, mean = wave(41, noise=0.05)
    io.write_surface(tmp_path / "a.ply", sgrt.Surface(points, normals=normals))
    assert cli.main(["curvature", str(tmp_path / "a.ply"), "--out", str(tmp_path / "b.ply"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["status"] == "ok" and said["points"]["known"] > 1000
    rows = ply_rows(tmp_path / "b.ply")
    for name in ("k1", "k2", "mean", "gauss", "shape_index", "sigma_mean", "reason"):
        assert len(rows[name]) == 41 * 41
    middle = rows["mean"].reshape(41, 41)[15:25, 15:25]
    assert middle == pytest.approx(mean[15:25, 15:25], abs=0.01)
    assert io.read_surface(tmp_path / "b.ply").grid_shape == (41, 41)
    # Without normals outward is assumed, and said.
    io.write_surface(tmp_path / "c.ply", sgrt.Surface(points))
    assert cli.main(["curvature", str(tmp_path / "c.ply"), "--out", str(tmp_path / "d.ply")]) == 0
    assert "no normals" in capsys.readouterr().err
    assert cli.main(["curvature", str(tmp_path / "none.ply"), "--out", str(tmp_path / "d.ply")]) == 2
