"""NURBS through Python: against other libraries' numbers, scipy's splines, exact shapes, files and nonsense."""

import json
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sgrt

DATA = Path(__file__).parents[3] / "shared/data/nurbs"


@pytest.fixture
def surface():
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.arange(9.0) * 10, np.arange(8.0) * 12, indexing="ij")
    points = np.stack([x, y, rng.normal(0, 5, x.shape)], -1)
    return sgrt.NurbsSurface(points, (3, 2), weights=rng.uniform(0.5, 2, x.shape))


def data(name):
    file = DATA / name
    if not file.exists():
        pytest.skip(f"no {file}")
    return json.loads(file.read_text())


def test_numbers_of_geomdl():
    d = data("geomdl_surface_reference.json")
    points = np.array(d["ctrlpts_u_major"]).reshape(d["size_u"], d["size_v"], 3)
    s = sgrt.NurbsSurface(points, tuple(d["degree"]), knots=(d["knots_u"], d["knots_v"]))
    for row in d["eval"]:
        np.testing.assert_allclose(s.evaluate(*row["uv"]), row["point"], atol=d["tolerance"])
    key = next(k for k in d if k.startswith("derivatives"))
    for row in d[key]:
        got = s.derivatives(*row["uv"], row["order"])
        for k in range(row["order"] + 1):
            for m in range(row["order"] + 1 - k):
                expected = np.array(row["SKL"][k][m])
                np.testing.assert_allclose(got[(k + m) * (k + m + 1) // 2 + m], expected, atol=2e-3)


def test_worked_example_of_the_book():
    d = data("nurbsbook_ex_surface.json")
    h = np.array(d["ctrlpts_homogeneous_wx_wy_wz_w"], float)
    s = sgrt.NurbsSurface(
        h[..., :3] / h[..., 3:],
        tuple(d["degree"]),
        knots=(np.array(d["knots_u"], float), np.array(d["knots_v"], float)),
        weights=np.ascontiguousarray(h[..., 3]),
    )
    for row in d["eval"]:
        np.testing.assert_allclose(s.evaluate(*row["uv"]), row["point"], rtol=1e-14)


def test_against_scipy():
    interpolate = pytest.importorskip("scipy.interpolate")
    rng = np.random.default_rng(2)
    points = rng.normal(0, 50, (12, 3))
    curve = sgrt.NurbsCurve(points, 4)
    spline = interpolate.BSpline(curve.knots, points, 4)
    u = rng.uniform(0, 1, 200)
    for k, got in enumerate(np.moveaxis(curve.derivatives(u, 3), 1, 0)):
        np.testing.assert_allclose(got, spline(u, k), atol=1e-9 * 10**k)


def test_shapes_and_broadcasting(surface):
    assert surface.evaluate(0.5, 0.5).shape == (3,)
    assert surface.evaluate(np.linspace(0, 1, 4)[:, None], np.linspace(0, 1, 5)).shape == (4, 5, 3)
    assert surface.derivatives([0, 1], [0, 1]).shape == (2, 6, 3)
    grid = surface.grid(7, 6)
    u, v = np.linspace(0, 1, 7), np.linspace(0, 1, 6)
    assert np.array_equal(grid, surface.evaluate(u[:, None], v))
    out = np.empty((7, 6, 6, 3))
    assert surface.grid(7, 6, 2, out=out) is out
    assert np.array_equal(out, surface.derivatives(u[:, None], v, 2))
    flat = np.empty((3, 6, 3))
    assert surface.derivatives([0, 0.5, 1], [0, 0.5, 1], out=flat) is flat
    assert np.array_equal(flat, surface.derivatives([0, 0.5, 1], [0, 0.5, 1]))
    wide = np.empty((7, 6, 4))
    surface.grid(7, 6, out=wide[:, :, :3])
    assert np.array_equal(wide[:, :, :3], grid)
    assert np.array_equal(surface.grid(7, 6, context=sgrt.Context(threads=3)), grid)
    normals = surface.normals(u[:, None], v)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, atol=1e-14)
    d = surface.derivatives(u[:, None], v, 1)
    assert abs(np.einsum("ijc,ijc->ij", normals, d[:, :, 1])).max() < 1e-10


def test_tools_keep_the_shape(surface):
    before = surface.grid(20, 20)
    for direction in (0, 1):
        fine = surface.insert_knot(direction, 0.3, 2)
        same = [fine, surface.bezier(direction), surface.elevate(direction), surface.refine(direction, [0.1, 0.77])]
        back, count, bound = fine.remove_knot(direction, 0.3, 2)
        assert count == 2 and bound < 1e-9
        lower, count, bound = surface.elevate(direction).reduce_degree(direction)
        assert count == 1 and lower.degree == surface.degree and bound < 1e-9
        for tool in (*same, back, lower):
            np.testing.assert_allclose(tool.grid(20, 20), before, atol=1e-10)
        left, right = surface.split(direction, 0.4)
        assert left.domain[direction] == (0, 0.4) and right.domain[direction] == (0.4, 1)
        np.testing.assert_allclose(left.evaluate(0.2, 0.3), surface.evaluate(0.2, 0.3), atol=1e-10)
        turned = surface.reparameterise(direction, 1, 0)
        np.testing.assert_allclose(turned.grid(20, 20), np.flip(before, direction), atol=1e-10)


def test_exact_quadrics_and_length():
    sphere = sgrt.NurbsSurface.sphere((1, 2, 3), 40)
    points = sphere.grid(50, 50) - [1, 2, 3]
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 40, rtol=1e-14)
    circle = sgrt.NurbsCurve.arc((0, 0, 0), (40, 0, 0), (0, 40, 0), 0, 2 * np.pi)
    assert circle.length() == pytest.approx(80 * np.pi, rel=1e-13)
    around = sgrt.NurbsSurface.revolve(circle, (100, 0, 0), (0, 1, 0), np.pi)
    assert around.domain == ((0, 1), (0, 1))


def test_closest_point_and_mesh():
    torus = sgrt.NurbsSurface.torus((0, 0, 0), (0, 0, 1), 60, 20)
    x = np.random.default_rng(3).uniform(-90, 90, (50, 3))
    uv, distance, gap = torus.closest_point(x)
    expected = abs(np.hypot(np.hypot(x[:, 0], x[:, 1]) - 60, x[:, 2]) - 20)
    np.testing.assert_allclose(distance, expected, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(torus.evaluate(*uv.T) - x, axis=1), distance, atol=1e-9)
    assert gap.max() < 1e-5
    mesh = torus.mesh(0.1)
    centres = mesh.points[mesh.faces].mean(1)
    assert torus.closest_point(centres[::97])[1].max() <= 0.1


def test_interpolation_and_chapter(surface):
    points = surface.grid(15, 12)
    through = sgrt.NurbsSurface.interpolate(points, (3, 3))
    assert through.closest_point(points.reshape(-1, 3))[1].max() < 1e-5
    fewer = sgrt.NurbsSurface.interpolate(points, (3, 3), count=(9, 8), parameters="uniform")
    assert fewer.control_points.shape == (9, 8, 3)
    field = sgrt.Surface.from_height_field(np.zeros((6, 7)), origin_mm=(0, 0), spacing_mm=(2, 3))
    chapter = sgrt.NurbsSurface.chapter(field, (3, 2))
    np.testing.assert_allclose(chapter.evaluate(0.5, 0.5), [6, 7.5, 0], atol=1e-12)


def test_pickle_and_files(surface, tmp_path):
    assert pickle.loads(pickle.dumps(surface)).to_json() == surface.to_json()
    curve = sgrt.NurbsCurve(np.arange(15.0).reshape(5, 3), 2)
    assert pickle.loads(pickle.dumps(curve)).to_json() == curve.to_json()
    sgrt.io.write_nurbs(tmp_path / "s.json", surface)
    assert np.array_equal(sgrt.io.read_nurbs_surface(tmp_path / "s.json").control_points, surface.control_points)
    with pytest.raises(sgrt.FormatError, match=r"s\.json: degree: 2 numbers, expected 1 for a curve"):
        sgrt.io.read_nurbs_curve(tmp_path / "s.json")


def test_command(surface, tmp_path):
    sgrt.io.write_nurbs(tmp_path / "s.json", surface)
    command = [sys.executable, "-m", "sgrt", "eval", str(tmp_path / "s.json")]
    out = tmp_path / "dense.ply"
    done = subprocess.run([*command, "--grid", "30x20", "--out", str(out)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    dense = sgrt.io.read_surface(out)
    assert np.array_equal(dense.points, surface.grid(30, 20)) and dense.normals.shape == (30, 20, 3)
    done = subprocess.run([*command, "--chord-error", "0.5", "--out", str(out)], capture_output=True, text=True)
    assert done.returncode == 0 and sgrt.io.read_surface(out).faces is not None
    done = subprocess.run([*command, "--grid", "30", "--out", str(out)], capture_output=True, text=True)
    assert done.returncode == 2 and "--grid 30: expected NUxNV" in done.stderr


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.evaluate(1.5, 0), "uv[0]: 1.5, expected within the domain, 0 to 1"),
        (lambda s: s.evaluate(np.nan, 0), "uv[0]: nan"),
        (lambda s: s.evaluate([0, 1], [0, 1, 1]), "u, v"),
        (lambda s: s.derivatives(0, 0, 25), "order: 25"),
        (lambda s: s.grid(1, 5), "nu: 1, expected at least 2"),
        (lambda s: s.closest_point([[np.nan, 0, 0]]), "points_mm[0]"),
        (lambda s: s.elevate(2), "direction"),
        (lambda s: s.insert_knot(0, 1.0), "inside the domain"),
        (lambda s: s.mesh(-1), "chord_error_mm: -1"),
        (lambda s: sgrt.NurbsSurface(np.zeros((3, 5, 3))), "3 control points, expected at least 4"),
        (lambda s: sgrt.NurbsCurve(np.zeros((5, 3)), knots=np.zeros(4)), "4 knots, expected 9"),
        (lambda s: sgrt.NurbsCurve(np.zeros((5, 3)), weights=-np.ones(5)), "weights[0]: -1"),
        (lambda s: sgrt.NurbsCurve.interpolate(np.zeros((5, 3)), parameters="x"), "parameters: 'x'"),
    ],
)
def test_nonsense(surface, call, words):
    with pytest.raises(sgrt.InvalidArgument) as caught:
        call(surface)
    assert words in str(caught.value)


def test_clamp(surface):
    assert np.array_equal(surface.evaluate(1.5, -3, clamp=True), surface.evaluate(1, 0))


def test_degenerate_data():
    with pytest.raises(sgrt.Degenerate):
        sgrt.NurbsCurve.interpolate(np.zeros((5, 3)))
    with pytest.raises(sgrt.InsufficientData):
        sgrt.NurbsCurve.interpolate(np.eye(3))
