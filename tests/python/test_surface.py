"""Surface: what goes in comes out, and what cannot be a surface is refused."""

import numpy as np
import pytest
import sgrt
from conftest import body_height, body_points


# REQ-SURF-001
def test_every_array_comes_back():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(50, 3))
    normals = rng.normal(size=(50, 3))
    normals /= np.sqrt((normals**2).sum(axis=1, keepdims=True))
    covariance = np.tile([2.0, 0.1, 0.2, 3.0, 0.3, 4.0], (50, 1))
    modes = rng.normal(size=(2, 50, 3))
    faces = np.array([[0, 1, 2], [3, 4, 5]], dtype=np.int32)
    s = sgrt.Surface(
        points,
        normals=normals,
        sigma_mm=np.full(50, 0.5),
        covariance=covariance,
        faces=faces,
        modes=modes,
        correlation_points=4,
    )
    assert np.array_equal(s.points, points)
    assert np.abs(s.normals - normals).max() < 1e-15
    assert np.array_equal(s.sigma_mm, np.full(50, 0.5))
    assert np.array_equal(s.covariance, covariance)
    assert np.array_equal(s.faces, faces)
    assert np.array_equal(s.modes, modes)
    assert s.correlation_points == 4
    assert s.point_count == 50
    assert s.grid_shape is None
    low, high = s.bounds_mm
    assert np.array_equal(low, points.min(axis=0))
    assert np.array_equal(high, points.max(axis=0))


def test_absent_arrays_are_none():
    s = sgrt.Surface([[0.0, 0.0, 0.0]])
    assert all(a is None for a in (s.normals, s.sigma_mm, s.covariance, s.faces, s.modes))


def test_grid_with_holes():
    points = np.zeros((4, 5, 3))
    points[..., 0], points[..., 1] = np.meshgrid(np.arange(5), np.arange(4))
    points[1, 2] = np.nan
    s = sgrt.Surface(points, sigma_mm=np.ones((4, 5)))
    assert s.grid_shape == (4, 5)
    assert s.point_count == 19
    assert np.array_equal(s.points, points, equal_nan=True)


def test_height_field():
    z = np.array([[1.0, 2.0, 3.0], [4.0, np.nan, 6.0]])
    s = sgrt.Surface.from_height_field(z, origin_mm=(10, 20), spacing_mm=(2, 3))
    assert s.points[1, 2].tolist() == [14, 23, 6]
    assert np.isnan(s.points[1, 1]).all()
    with pytest.raises(sgrt.InvalidArgument, match="spacing"):
        sgrt.Surface.from_height_field(z, origin_mm=(0, 0), spacing_mm=(0, 3))


def test_mesh_normals():
    s = sgrt.Surface(
        [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]],
        faces=np.array([[0, 1, 2]], dtype=np.int32),
    )
    assert np.allclose(s.normals, [[0, 0, 1]] * 3, atol=1e-15)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"points": np.zeros((3, 2))}, "points"),
        ({"points": [[0.0, 0, np.nan]]}, "points"),
        ({"points": [[0.0, 0, np.inf]]}, "points"),
        ({"points": [[0.0, 0, 2e5]]}, "points"),
        ({"points": np.zeros((2, 3)), "sigma_mm": [1.0, 0.0]}, "sigma_mm"),
        ({"points": np.zeros((2, 3)), "sigma_mm": [1.0]}, "sigma_mm"),
        ({"points": np.zeros((2, 3)), "normals": np.ones((2, 3))}, "normals"),
        ({"points": np.zeros((2, 3)), "faces": np.array([[0, 1, 2]], dtype=np.int32)}, "faces"),
        ({"points": np.zeros((1, 3)), "covariance": [[1.0, 2, 0, 1, 0, 1]]}, "covariance"),
        ({"points": np.zeros((1, 3)), "modes": np.zeros((9, 1, 3))}, "modes"),
        ({"points": np.zeros((1, 3)), "correlation_points": 0}, "correlation_points"),
    ],
)
def test_refused(arguments, message):
    with pytest.raises(sgrt.InvalidArgument, match=message):
        sgrt.Surface(**arguments)


def test_no_point():
    with pytest.raises(sgrt.InsufficientData, match="point"):
        sgrt.Surface(np.zeros((0, 3)))


def test_estimated_normals_point_up_and_agree_with_the_gradient(reference):
    points, h = body_points(8000, 1), 1e-4
    x, y = points[:, 0], points[:, 1]
    gradient = [
        (body_height(x + h, y) - body_height(x - h, y)) / (2 * h),
        (body_height(x, y + h) - body_height(x, y - h)) / (2 * h),
    ]
    truth = np.stack([-gradient[0], -gradient[1], np.ones_like(x)], axis=1)
    truth /= np.sqrt((truth**2).sum(axis=1, keepdims=True))
    inside = (np.abs(x) < 120) & (np.abs(y) < 160)
    cosine = (truth * reference.normals).sum(axis=1)[inside]
    assert np.degrees(np.arccos(np.clip(np.median(cosine), -1, 1))) < 2
    assert cosine.min() > 0.9


def test_too_few_points_for_normals():
    with pytest.raises(sgrt.InsufficientData):
        sgrt.Surface(np.eye(3)).estimate_normals()


def test_fuse_reports_the_disagreement():
    y, x = np.mgrid[0:60:2.0, 0:60:2.0]

    def board(offset, z):
        points = np.stack([x + offset, y, np.full_like(x, z)], axis=-1).reshape(-1, 3)
        normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        return sgrt.Surface(points, normals=normals, sigma_mm=np.full(len(points), 0.2))

    fused, info = sgrt.surface_fuse([board(0, 0.0), board(30, 0.5)])
    assert info.surface_count == 2
    assert 0 < info.overlap_count < info.point_count == fused.point_count < 1800
    assert info.disagreement_mean_mm == pytest.approx(0.5, abs=1e-9)
    assert info.disagreement_rms_mm == pytest.approx(0.5, abs=1e-9)
    # A point's own sigma, and the smaller one of the plane through several points of the other board.
    assert 0.2 < info.disagreement_expected_mm < 0.2 * np.sqrt(2)


def test_fuse_refuses(reference):
    with pytest.raises(sgrt.InvalidArgument):
        sgrt.surface_fuse([])
    with pytest.raises(sgrt.InvalidArgument, match="normals"):
        sgrt.surface_fuse([reference, sgrt.Surface(np.zeros((1, 3)))])
    with pytest.raises(TypeError):
        sgrt.surface_fuse([reference, None, 3])


def test_distance_of_a_lifted_board():
    y, x = np.mgrid[0:50:2.0, 0:50:2.0]
    points = np.stack([x, y, np.zeros_like(x)], axis=-1)
    normals = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    board = sgrt.Surface(points, normals=normals)
    lifted = sgrt.Surface(points + np.array([0.3, 0.3, 1.5]))
    distance = sgrt.surface_distance(board, lifted)
    assert distance.shape == (25, 25)
    inside = distance[2:-2, 2:-2]
    assert np.allclose(inside, 1.5, atol=1e-9)
    down = np.eye(4)
    down[2, 3] = -2.0
    assert np.allclose(sgrt.surface_distance(board, lifted, down)[2:-2, 2:-2], -0.5, atol=1e-9)
    far = np.eye(4)
    far[2, 3] = 100.0
    assert np.isnan(sgrt.surface_distance(board, lifted, far)).all()


def test_roi_masks():
    points = np.array([[0.0, 0, 0], [5, 5, 0], [20, 0, 0], [1, 1, 0]])
    normals = np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, -1]])
    s = sgrt.Surface(points, normals=normals)
    square = sgrt.Roi.polygon([[-10, -10], [10, -10], [10, 10], [-10, 10]])
    assert square.mask(s).tolist() == [1, 1, 0, 0]  # the last looks down
    assert sgrt.Roi.box((-1, -1, -1), (2, 2, 1)).mask(s).tolist() == [1, 0, 0, 1]
    with pytest.raises(sgrt.InvalidArgument):
        sgrt.Roi.polygon([[0, 0], [1, 1]])
    with pytest.raises(sgrt.InvalidArgument):
        sgrt.Roi.box((0, 0, 0), (1, 0, 1))
