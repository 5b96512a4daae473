"""Rig: text in and out, projection against the equations written out here, stereo of a board."""

import json

import numpy as np
import pytest
import sgrt
from conftest import BASE, DEPTH, FOCAL, HEIGHT, WIDTH, camera_from_room, rig_document


def test_reads_and_writes_every_number(rig):
    written = json.loads(rig.to_json())
    for key, value in rig_document().items():
        assert written[key] == value
    assert (rig.id, rig.room) == ("test room", "IEC 61217 fixed, mm")
    assert [c.id for c in rig.cameras] == ["left", "right"]
    assert (rig.cameras[0].width, rig.cameras[0].height) == (WIDTH, HEIGHT)
    assert np.array_equal(rig.cameras[1].camera_from_room, camera_from_room(BASE / 2))
    assert rig.cameras[0].intrinsics.tolist() == [FOCAL, FOCAL, (WIDTH - 1) / 2, (HEIGHT - 1) / 2]
    assert [(p.id, p.left, p.right) for p in rig.pairs] == [("pod1", "left", "right")]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(schema="sgrt-rig/2"), "schema"),
        (lambda d: d["cameras"][1].pop("intrinsics"), r"cameras\[1\].*intrinsics"),
        (lambda d: d["cameras"][0].update(model="fisheye"), "model"),
        (lambda d: d["cameras"][1].update(id="left"), "left"),
        (lambda d: d["pairs"][0].update(right="nobody"), "nobody"),
        (lambda d: d["cameras"][0]["camera_from_room"][0].__setitem__(0, 0.5), "camera_from_room"),
    ],
)
def test_names_the_bad_field(change, message):
    document = rig_document()
    change(document)
    with pytest.raises(sgrt.FormatError, match=message):
        sgrt.Rig(json.dumps(document))


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"schema": "sgrt-rig/1"}'])
def test_not_a_rig(text):
    with pytest.raises(sgrt.FormatError):
        sgrt.Rig(text)


def brown(xn, yn, k1, k2, p1, p2, k3):
    r2 = xn**2 + yn**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    return (
        xn * radial + 2 * p1 * xn * yn + p2 * (r2 + 2 * xn**2),
        yn * radial + p1 * (r2 + 2 * yn**2) + 2 * p2 * xn * yn,
    )


@pytest.fixture(scope="module")
def bent():
    document = rig_document()
    document["cameras"][0]["distortion"] = [-0.1, 0.02, 1e-3, -5e-4, 3e-3]
    return sgrt.Rig(json.dumps(document))


def test_projects_as_the_equations_say(bent):
    rng = np.random.default_rng(3)
    x = rng.uniform([-150, -100, -100], [100, 100, 100], (200, 3))
    camera = bent.cameras[0]
    in_camera = x @ camera.camera_from_room[:3, :3].T + camera.camera_from_room[:3, 3]
    xd, yd = brown(in_camera[:, 0] / in_camera[:, 2], in_camera[:, 1] / in_camera[:, 2], *camera.distortion)
    fx, fy, cx, cy = camera.intrinsics
    pixels = bent.project("left", x)
    assert np.abs(pixels - np.stack([fx * xd + cx, fy * yd + cy], axis=1)).max() < 1e-10

    directions, centre = bent.unproject("left", pixels)
    assert np.allclose(centre, [-BASE / 2, 0, DEPTH], atol=1e-9)
    ray = x - centre
    ray /= np.sqrt((ray**2).sum(axis=1, keepdims=True))
    assert np.abs(directions - ray).max() < 1e-9


# REQ-RIG-008
def test_jacobians_against_differences(bent):
    x = np.array([[20.0, -30.0, 40.0], [-60.0, 10.0, 0.0]])
    pixels, jacobian = bent.project_jacobian("left", x)
    h = 1e-3
    for axis in range(3):
        step = np.eye(3)[axis] * h
        difference = (bent.project("left", x + step) - bent.project("left", x - step)) / (2 * h)
        assert np.abs(difference - jacobian[:, :, axis]).max() < 1e-7
    _, jacobian = bent.unproject_jacobian("left", pixels)
    for axis in range(2):
        step = np.eye(2)[axis] * h
        difference = (bent.unproject("left", pixels + step)[0] - bent.unproject("left", pixels - step)[0]) / (2 * h)
        assert np.abs(difference - jacobian[:, :, axis]).max() < 1e-7


def test_behind_the_camera_is_nan(rig):
    assert np.isnan(rig.project("left", [[0.0, 0.0, 2 * DEPTH]])).all()


@pytest.mark.parametrize("name", ["nobody", "", "left\0"])
def test_unknown_camera(rig, name):
    with pytest.raises(sgrt.InvalidArgument):
        rig.project(name, np.zeros((1, 3)))


def test_stereo_of_a_board(stereo):
    surface = stereo.surface
    assert surface.grid_shape == stereo.reason.shape
    assert stereo.point_count == surface.point_count > 1000
    z = surface.points[..., 2]
    assert np.nanmedian(np.abs(z)) < 0.3  # of 1000 mm
    assert np.nanmedian(surface.normals[..., 2]) > 0.99
    assert stereo.median_sigma_px < 0.1
    assert sum(stereo.counts.values()) == stereo.reason.size
    assert stereo.counts["none"] == stereo.point_count
    assert list(stereo.counts) == list(sgrt.STEREO_REASONS)
    there = stereo.reason == 0
    assert np.array_equal(there, ~np.isnan(stereo.correlation))
    disparity = (stereo.left_px - stereo.right_px)[there]
    assert abs(np.median(disparity[:, 0]) - FOCAL * BASE / DEPTH) < 0.05
    assert np.abs(disparity[:, 1]).max() < 0.05


def test_stereo_finds_nothing_in_grey_images(rig):
    grey = np.full((HEIGHT, WIDTH), 100, dtype=np.uint8)
    with pytest.raises(sgrt.NotFound) as error:
        sgrt.stereo_match(rig, "pod1", grey, grey)
    assert error.value.word == "not_found"
    assert error.value.result.point_count == 0
    assert error.value.result.surface is None
    assert error.value.result.counts["none"] == 0


def test_stereo_refuses(rig, images):
    left, right = images
    with pytest.raises(sgrt.InvalidArgument, match="left"):
        sgrt.stereo_match(rig, "pod1", left[:-1], right)
    with pytest.raises(sgrt.InvalidArgument, match="pod2"):
        sgrt.stereo_match(rig, "pod2", left, right)
    with pytest.raises(sgrt.InvalidArgument, match="window_px"):
        sgrt.stereo_match(rig, "pod1", left, right, window_px=16)
    with pytest.raises(sgrt.InvalidArgument, match="int64"):
        sgrt.stereo_match(rig, "pod1", left.astype(np.int64), right)


def test_session_gives_arrays_of_its_own(rig, images, stereo):
    left, right = images
    session = sgrt.StereoSession(rig, "pod1")
    first = session.push(left, right, time_s=0.0)
    kept = first.surface.points.copy()
    second = session.push(left[:, ::1], np.roll(right, 3, axis=1), time_s=0.1)
    assert np.array_equal(first.surface.points, kept, equal_nan=True)
    assert np.array_equal(first.surface.points, stereo.surface.points, equal_nan=True)
    assert abs(np.nanmedian(second.surface.points[..., 2])) > 10
    with pytest.raises(sgrt.InvalidArgument, match="time_s"):
        session.push(left, right, time_s=0.0)
    grey = np.full_like(left, 90)
    with pytest.raises(sgrt.NotFound) as error:
        session.push(grey, grey, time_s=0.15)
    assert error.value.result.counts["none"] == 0
    third = session.push(left, right, time_s=0.2)
    assert np.array_equal(third.surface.points, kept, equal_nan=True)
