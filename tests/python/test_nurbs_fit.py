"""The fit through the ABI: the twin's bodies with noise, outliers and holes, its posterior, files and the command."""

import contextlib
import copy
import json
import pickle

import numpy as np
import pytest
import sgrt
from sgrt import cli


def wave(x, y):
    return 6 * np.sin(x / 25) * np.cos(y / 30)


@pytest.fixture(scope="module")
def surface():
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-60, 60, (2, 3000))
    return sgrt.Surface(np.stack([x, y, wave(x, y) + rng.normal(0, 0.2, 3000)], axis=1))


@pytest.fixture(scope="module")
def fit(surface):
    return sgrt.nurbs_fit(surface, chart="plane", axis=(0, 0, 1))


def places(count=15):
    u, v = np.meshgrid(np.linspace(0.1, 0.9, count), np.linspace(0.1, 0.9, count))
    return np.stack([u.ravel(), v.ravel()], axis=1)


def test_errors_are_as_predicted(fit):
    at = fit.evaluate(places())
    off = (at.points[:, 2] - wave(at.points[:, 0], at.points[:, 1])) * at.normals[:, 2]
    assert np.sqrt(np.mean(off**2)) < 0.05
    assert 0.3 < np.mean((off / at.sigma_mm) ** 2) < 1.8
    assert at.support.min() > 0.7
    assert at.covariance.shape == at.normal_covariance.shape == (225, 6)
    assert at.derivatives.shape == (225, 5, 3)
    assert at.derivative_covariance.shape == (225, 5, 6)
    assert (fit.chart, fit.closed, fit.point_count) == ("plane", False, 3000)
    assert fit.noise == pytest.approx(0.2, rel=0.1)


def test_derivatives_are_those_of_the_points(fit):
    step = 1e-5
    across, along = np.array([step, 0]), np.array([0, step])
    middle = places(5)
    d = fit.evaluate(middle).derivatives
    u = (fit.evaluate(middle + across).points - fit.evaluate(middle - across).points) / (2 * step)
    v = (fit.evaluate(middle + along).points - fit.evaluate(middle - along).points) / (2 * step)
    assert d[:, 0] == pytest.approx(u, abs=1e-5)
    assert d[:, 1] == pytest.approx(v, abs=1e-5)


def test_nearest_and_arrays(fit):
    at = fit.evaluate(places())
    assert fit.nearest(at.points + 2 * at.normals) == pytest.approx(places(), abs=1e-7)
    assert fit.residual_mm.shape == fit.weight.shape == (3000,)
    assert fit.parameters.shape == (3000, 2)
    nu, nv, _ = fit.surface.control_points.shape
    with pytest.raises(ValueError, match="read-only"):
        fit.weight[0] = 0
    document = json.loads(fit.surface.to_json())
    assert document["schema"] == "sgrt-nurbs/1"
    assert document["size"] == [nu, nv]
    assert np.array_equal(np.reshape(document["control_points"], (nu, nv, 3)), fit.surface.control_points)


def test_planes_come_back():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-60, 60, (2, 500))
    plane = sgrt.Surface(np.stack([x, y, 3 + 0.4 * x - 0.7 * y], axis=1))
    for lambda_ in (1e-3, 1e9):
        at = sgrt.nurbs_fit(plane, smoothing="given", lambda_=lambda_).evaluate(places())
        assert np.abs(at.points @ [-0.4, 0.7, 1] - 3).max() < 1e-10


def body_scan(phantom, samples, seed):
    """About one point a mm2 of what lies to the front, 0.3 mm noise, 5 % outliers of 5 to 50 mm, 15 % holes."""
    rng = np.random.default_rng(seed)
    points, normals = phantom.sample_surface(samples, seed)
    seen = (normals[:, 2] > 0.2) & (np.abs(points[:, 1]) < 120)
    points, normals = points[seen], normals[seen]
    kept = np.ones(len(points), bool)
    while kept.mean() > 0.85:
        kept &= np.linalg.norm(points - points[rng.integers(len(points))], axis=1) > 15
    points, normals = points[kept], normals[kept]
    bad = rng.random(len(points)) < 0.05
    off = rng.normal(0, 0.3, len(points))
    off[bad] = rng.choice([-1, 1], bad.sum()) * rng.uniform(5, 50, bad.sum())
    return points + off[:, None] * normals


@pytest.mark.parametrize(("name", "samples"), [("head", 330_000), ("torso", 900_000)])
def test_bodies_of_the_twin(name, samples):
    twin = pytest.importorskip("sgrt.twin")
    phantom = getattr(twin, name)()
    points = body_scan(phantom, samples, 1)
    fit = sgrt.nurbs_fit(sgrt.Surface(points))
    at = fit.evaluate((np.stack(np.meshgrid(*[np.arange(0.5, 60) / 60] * 2), axis=-1)).reshape(-1, 2))
    supported = at.support >= 0.5
    d = phantom.distance(at.points[supported])
    covered = np.mean(np.abs(d) < 1.96 * at.sigma_mm[supported])
    print(f"{name}: {len(points)} points, {fit!r}, rms {np.sqrt(np.mean(d**2)):.4f} mm, covered {covered:.3f}")
    assert supported.sum() > 1000
    assert np.sqrt(np.mean(d**2)) < 0.08
    assert 0.93 < covered < 0.97


@pytest.mark.parametrize("travel", [lambda x: pickle.loads(pickle.dumps(x)), copy.copy, copy.deepcopy])
@pytest.mark.parametrize("chart", ["plane", "grid"])
def test_travels(surface, travel, chart):
    if chart == "grid":
        side = np.arange(30.0)
        x, y = np.meshgrid(side, side)
        surface = sgrt.Surface(np.stack([x, y, 0.01 * x * y], -1))
    fit = sgrt.nurbs_fit(surface, chart=chart, max_control_points=200)
    twin = travel(fit)
    uv = np.random.default_rng(1).uniform(0, 1, (50, 2))
    for name in ("points", "normal_covariance", "sigma_mm", "support"):
        assert np.array_equal(getattr(twin.evaluate(uv), name), getattr(fit.evaluate(uv), name)), name
    for name in ("residual_mm", "weight", "parameters"):
        assert np.array_equal(getattr(twin, name), getattr(fit, name), equal_nan=True), name
    assert (repr(twin), twin.noise, twin.conversion_error_mm) == (repr(fit), fit.noise, fit.conversion_error_mm)


def test_no_state_of_a_fit(surface):
    fit = sgrt.nurbs_fit(surface, max_control_points=200)
    state = fit.__getstate__()
    for bad in (state[:-1], state[:20], state[:0], np.append(state, 0), np.full(4, np.nan)):
        with pytest.raises(sgrt.InvalidArgument, match="expected the state of a fit"):
            sgrt.NurbsFit.__new__(sgrt.NurbsFit).__setstate__(bad)
    for place in range(40):
        broken = state.copy()
        broken[place] = -1e300
        with contextlib.suppress(sgrt.Error):
            twin = sgrt.NurbsFit.__new__(sgrt.NurbsFit)
            twin.__setstate__(broken)
            twin.evaluate([[0.5, 0.5]])


def test_errors(surface):
    with pytest.raises(sgrt.InvalidArgument, match="chart: 'cube', expected one of 'auto'"):
        sgrt.nurbs_fit(surface, chart="cube")
    with pytest.raises(sgrt.InvalidArgument, match=r"control_points\[0\]: 2"):
        sgrt.nurbs_fit(surface, control_points=(2, 8))
    with pytest.raises(sgrt.InvalidArgument, match="axis: 0 0 0, expected a direction"):
        sgrt.nurbs_fit(surface, axis=(0, 0, 0))
    with pytest.raises(sgrt.InsufficientData, match="expected at least 16"):
        sgrt.nurbs_fit(sgrt.Surface(np.eye(3)))
    line = np.arange(100.0)[:, None] * [1, 2, 3]
    with pytest.raises(sgrt.Degenerate, match="line"):
        sgrt.nurbs_fit(sgrt.Surface(line))
    fit = sgrt.nurbs_fit(surface)
    for uv in ([[0.5, 1.5]], [[np.nan, 0]], [0.5, 0.5], [[1, 2, 3]]):
        with pytest.raises(sgrt.InvalidArgument, match="uv"):
            fit.evaluate(uv)
    with pytest.raises(sgrt.InvalidArgument, match="points"):
        fit.nearest([[0, 0, np.nan]])


def test_command(surface, tmp_path, capsys):
    source, out = tmp_path / "surface.ply", tmp_path / "nurbs.json"
    sgrt.io.write_surface(source, surface)
    assert cli.main(["fit", str(source), "--out", str(out), "--chart", "plane", "--threads", "1", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["status"], document["chart"], document["point_count"]) == ("ok", "plane", 3000)
    assert json.loads(out.read_text())["size"] == document["size"]
    assert cli.main(["fit", str(source), "--out", str(out), "--threads", "1"]) == 0
    assert "control points over a plane" in capsys.readouterr().out
    sgrt.io.write_surface(source, sgrt.Surface(np.arange(100.0)[:, None] * [1, 2, 3]))
    assert cli.main(["fit", str(source), "--out", str(out), "--json"]) == 1
    captured = capsys.readouterr()
    assert json.loads(captured.out)["status"] == "degenerate"
    assert "surface.ply" in captured.err
