"""The simulated room: geometry against independent formulas, images against their own truth, promises."""

from __future__ import annotations

import ast
import json
import multiprocessing
import pathlib
import pickle
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

pytest.importorskip("embreex")
pytest.importorskip("scipy")
twin = pytest.importorskip("sgrt.twin")

from scipy import ndimage  # noqa: E402
from scipy.spatial.transform import Rotation  # noqa: E402
from sgrt.twin import camera as camera_module  # noqa: E402
from sgrt.twin import render as render_module  # noqa: E402

HEAD_LANDMARKS = {
    *("nose_apex", "ala_left", "ala_right", "nasion", "nasolabial_left", "nasolabial_right"),
    *("nasofacial_left", "nasofacial_right", "chin", "eye_inner_left", "eye_inner_right"),
}
POSE = twin.displacement(lat_mm=6.0, lng_mm=-9.0, vrt_mm=4.0, pitch_deg=1.5, roll_deg=-2.0, rtn_deg=2.5)


@pytest.fixture(scope="module")
def room():
    return twin.Room(seed=7)


@pytest.fixture(scope="module")
def torso():
    return twin.torso()


@pytest.fixture(scope="module")
def head():
    return twin.head()


@pytest.fixture(scope="module")
def torso_truth(room, torso):
    return room.truth_depth("pod1-left", torso, POSE)


@pytest.fixture(scope="module")
def head_match(room, head):
    return room.true_match("pod2", head, POSE)


def sphere(radius: float):
    return twin.Phantom("ball", (twin.Blob(radius, (0, 0, 0), (radius,) * 3),), (), 0.1, (-1.0, 1.0, 0.0))


def into(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


# --- camera and room


def test_distortion_against_hand_computed_value():
    x, y = camera_module.distort((-0.1, 0.02, 0.001, -0.002, 0.05), np.array([0.2]), np.array([-0.1]))
    assert x[0] == pytest.approx(0.19871125, abs=1e-15)
    assert y[0] == pytest.approx(-0.099355625, abs=1e-15)


def test_projection_without_distortion_is_the_pinhole(room):
    given = room.cameras["pod2-right"]
    plain = twin.Camera("p", given.image_size, given.intrinsics, (0.0,) * 5, given.camera_from_room)
    points = np.random.default_rng(1).uniform(-200, 200, (50, 3))
    fx, fy, cx, cy = given.intrinsics
    homogeneous = into(given.matrix, points) @ np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]).T
    assert np.allclose(plain.project(points), homogeneous[:, :2] / homogeneous[:, 2:], atol=1e-9)


def test_pixels_survive_the_round_trip(room):
    pixels = np.random.default_rng(2).uniform([0, 0], [1279, 1023], (500, 2))
    for camera in room.cameras.values():
        centre, rays = camera.room_rays(pixels)
        assert np.allclose(np.sum(rays**2, axis=1), 1.0)
        assert np.max(np.abs(camera.project(centre + 1900.0 * rays) - pixels)) < 1e-9


def test_a_point_behind_the_camera_has_no_pixel(room):
    camera = room.cameras["pod1-left"]
    assert np.all(np.isnan(camera.project([2.0 * camera.centre])))


def test_ray_table_is_the_inverse_at_every_pixel(room):
    camera = room.cameras["pod1-right"]
    u, v = np.array([0, 1279, 3, 700]), np.array([0, 1023, 999, 511])
    x, y = camera_module.ray_table(camera)
    exact = camera.ray(u.astype(float), v.astype(float))
    assert np.max(np.abs(x[v, u] - exact[0])) < 1e-14 and np.max(np.abs(y[v, u] - exact[1])) < 1e-14


def test_the_room_is_as_described(room):
    assert list(room.cameras) == ["pod1-left", "pod1-right", "pod2-left", "pod2-right"]
    for left, right in room.pairs.values():
        a, b = room.cameras[left], room.cameras[right]
        assert np.linalg.norm(a.centre - b.centre) == pytest.approx(250.0, abs=4.0)
        assert into(a.matrix, b.centre)[0] > 240.0  # the partner lies towards the left camera's +x
        for camera in (a, b):
            assert 1800.0 < np.linalg.norm(camera.centre) < 2200.0 and camera.centre[2] > 1200.0
            assert np.max(np.abs(camera.project([[0, 0, 0]])[0] - [639.5, 511.5])) < 40.0
            assert camera.intrinsics[0] == pytest.approx(2400.0, rel=0.0101)
            upper, lower = camera.project([[0, 0, 50], [0, 0, -50]])
            assert upper[1] < lower[1]  # y down, the camera is upright
    assert room.cameras["pod1-left"].centre[0] < -1000.0 and room.cameras["pod2-left"].centre[0] > 1000.0
    assert len({c.distortion for c in room.cameras.values()}) == 4


def test_rig_json_has_the_fields_of_the_schema(room):
    rig = json.loads(room.rig_json())
    assert rig["schema"] == "sgrt-rig/1" and rig["room"] == "IEC 61217 fixed, mm" and rig["id"]
    assert rig["pairs"] == [{"id": p, "left": f"{p}-left", "right": f"{p}-right"} for p in ("pod1", "pod2")]
    for entry, camera in zip(rig["cameras"], room.cameras.values(), strict=True):
        assert set(entry) == {"id", "image_size", "model", "intrinsics", "distortion", "camera_from_room"}
        assert (entry["id"], entry["image_size"], entry["model"]) == (camera.id, [1280, 1024], "brown5")
        assert entry["intrinsics"] == list(camera.intrinsics) and entry["distortion"] == list(camera.distortion)
        assert np.array_equal(entry["camera_from_room"], camera.matrix)


def cameras_of(text: str) -> dict:
    return {
        c["id"]: twin.Camera(
            c["id"],
            tuple(c["image_size"]),
            tuple(c["intrinsics"]),
            tuple(c["distortion"]),
            tuple(np.ravel(c["camera_from_room"])),
        )
        for c in json.loads(text)["cameras"]
    }


def test_perturbed_rig_has_the_stated_pixel_error(room):
    points = np.random.default_rng(3).uniform([-200, -250, -50], [200, 250, 150], (300, 3))
    moved, between = [], []
    for seed in range(12):
        found = cameras_of(room.perturbed_rig_json(seed, sigma_px=0.1))
        change = {name: found[name].project(points) - room.cameras[name].project(points) for name in found}
        moved += list(change.values())
        between.append(change["pod1-left"] - change["pod1-right"])
        for camera in found.values():
            assert np.allclose(camera.matrix[:3, :3] @ camera.matrix[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.sqrt(np.mean(np.square(moved))) == pytest.approx(0.1, rel=0.25)
    # A calibration ties the cameras of a pod to each other better than the pod to the room.
    assert np.sqrt(np.mean(np.square(between))) < 0.07


def test_perturbed_rig_is_seeded_and_zero_is_the_truth(room):
    assert room.perturbed_rig_json(1) == room.perturbed_rig_json(1) != room.perturbed_rig_json(2)
    assert cameras_of(room.perturbed_rig_json(1, 0.0)) == cameras_of(room.rig_json())


# --- phantom


@pytest.mark.parametrize("name", ["torso", "head"])
def test_derivatives_against_differences(name):
    phantom = getattr(twin, name)()
    points, normals = phantom.sample_surface(200, 5)
    points = points + 2.0 * normals
    step = 1e-4
    for axis in range(3):
        e = step * np.eye(3)[axis]
        slope = (phantom.value(points + e) - phantom.value(points - e)) / (2 * step)
        bend = (phantom.gradient(points + e) - phantom.gradient(points - e)) / (2 * step)
        assert np.max(np.abs(slope - phantom.gradient(points)[:, axis])) < 1e-8
        assert np.max(np.abs(bend - phantom.hessian(points)[:, :, axis])) < 1e-8


def test_a_ball_has_the_geometry_of_a_ball():
    ball = sphere(80.0)
    points = np.random.default_rng(4).normal(size=(200, 3)) * [60.0, 90.0, 70.0]
    assert np.max(np.abs(ball.distance(points) - (np.linalg.norm(points, axis=1) - 80.0))) < 1e-9
    on_skin, normals = ball.sample_surface(40_000, 6)
    mean, gauss = ball.curvature(on_skin)
    assert np.allclose(mean, 1 / 80.0, rtol=1e-12) and np.allclose(gauss, 1 / 6400.0, rtol=1e-12)
    assert np.allclose(normals, on_skin / 80.0, atol=1e-12)
    # Uniform: z of a uniform sample of a sphere is uniform (Archimedes).
    share = np.histogram(on_skin[:, 2], bins=8, range=(-80, 80))[0] / 5000.0
    assert np.max(np.abs(share - 1.0)) < 0.06


@pytest.mark.parametrize("name", ["torso", "head"])
def test_distance_to_the_skin(name):
    phantom = getattr(twin, name)()
    points, normals = phantom.sample_surface(1000, 7)
    assert np.max(np.abs(phantom.value(points))) < 1e-9
    for offset in (-0.7, 1e-3, 0.7):
        assert np.max(np.abs(phantom.distance(points + offset * normals) - offset)) < 1e-6
    assert np.all(np.isnan(phantom.distance(np.array([[np.nan, 0, 0], [0, np.inf, 0]]))))
    assert phantom.distance(np.array([[0.0, 0.0, 0.0]]))[0] < -40.0  # the isocentre is well inside


@pytest.mark.parametrize("name", ["torso", "head"])
def test_mesh_is_closed_outward_and_on_the_skin(name):
    phantom = getattr(twin, name)()
    vertices, faces = phantom.mesh(6.0)
    assert np.max(np.abs(phantom.value(vertices))) < 1e-6
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.sum(np.cross(a, b) * c) / 6.0
    inside = np.random.default_rng(8).uniform(vertices.min(0), vertices.max(0), (40_000, 3))
    box = np.prod(vertices.max(0) - vertices.min(0))
    assert volume == pytest.approx(box * np.mean(phantom.value(inside) < 0.0), rel=0.03)


def test_landmarks_are_curvature_extrema_on_the_skin(head):
    found = head.landmarks()
    assert set(found) == HEAD_LANDMARKS
    rng = np.random.default_rng(9)
    for name, point in found.items():
        assert abs(head.value(point[None])[0]) < 1e-9
        around = head.project(point + rng.normal(0.0, 0.3, (30, 3)))
        sign = 1.0 if name in ("nose_apex", "ala_left", "ala_right", "chin") else -1.0
        here = sign * head.curvature(point[None])[0][0]
        assert here > 0.0 and np.all(sign * head.curvature(around)[0] <= here)
        if name.endswith(("_left", "_right")):
            assert point[0] > 5.0 if name.endswith("_left") else point[0] < -5.0
    assert found["nose_apex"][2] == max(p[2] for p in found.values())
    assert found["nasion"][1] > found["nose_apex"][1] > found["chin"][1]


def test_breathing_lifts_the_front_only(torso):
    points, normals = torso.sample_surface(2000, 10)
    lift = -twin.torso(breath_mm=10.0).distance(points)
    assert 8.0 < np.max(lift) < 11.0 and np.max(np.abs(lift[normals[:, 2] < -0.5])) < 0.3


# --- poses


def test_displacement_is_rz_rx_ry():
    numbers = {
        "lat_mm": 1.0,
        "lng_mm": 2.0,
        "vrt_mm": 3.0,
        "pitch_deg": 20.0,
        "roll_deg": -30.0,
        "rtn_deg": 50.0,
    }
    matrix = twin.displacement(**numbers)
    turn = Rotation.from_euler("ZXY", [50.0, 20.0, -30.0], degrees=True).as_matrix()
    assert np.allclose(matrix[:3, :3], turn, atol=1e-15) and np.array_equal(matrix[:3, 3], [1.0, 2.0, 3.0])


def test_random_displacement_is_seeded_and_bounded():
    draws = [twin.random_displacement(seed, max_mm=15.0, max_deg=3.0) for seed in range(300)]
    magnitudes = np.array([numbers["mag_mm"] for _, numbers in draws])
    angles = np.array([[n["pitch_deg"], n["roll_deg"], n["rtn_deg"]] for _, n in draws])
    assert magnitudes.max() <= 15.0 and np.median(magnitudes) == pytest.approx(15.0 * 0.5 ** (1 / 3), rel=0.05)
    assert np.max(np.abs(angles)) <= 3.0 and np.all(np.ptp(angles, axis=0) > 5.5)
    matrix, numbers = draws[5]
    again = twin.random_displacement(5)
    assert np.array_equal(again[0], matrix) and again[1] == numbers
    assert numbers["mag_mm"] == pytest.approx(np.linalg.norm(matrix[:3, 3]))


# --- images and truth


@pytest.mark.parametrize("name", ["torso", "head"])
def test_truth_is_exact(room, name):
    phantom, camera = getattr(twin, name)(), room.cameras["pod1-left"]
    points = room.truth_depth("pod1-left", phantom, POSE)
    rows, columns = np.nonzero(np.isfinite(points[..., 0]))
    pick = np.random.default_rng(11).choice(rows.size, 20_000, replace=False)
    rows, columns = rows[pick], columns[pick]
    seen = points[rows, columns]
    assert np.max(np.abs(camera.project(seen) - np.stack([columns, rows], -1))) < 1e-8
    in_body = into(np.linalg.inv(POSE), seen)
    slope = np.linalg.norm(phantom.gradient(in_body), axis=1)
    assert np.max(np.abs(phantom.value(in_body)) / slope) < 1e-9  # mm off the analytic skin
    back = camera.centre - seen
    along = back / np.linalg.norm(back, axis=1, keepdims=True)
    facing = np.sum(along * (phantom.normal(in_body) @ POSE[:3, :3].T), axis=1)
    # The depth error along the ray is the distance to the skin over the cosine of incidence.
    depth_error = np.abs(phantom.value(in_body)) / slope / np.maximum(facing, 1e-3)
    assert np.max(depth_error) < 1e-6 and np.min(facing) > -1e-6
    for step in (1.0, 10.0, 60.0, 200.0):  # nothing in front of it
        before = into(np.linalg.inv(POSE), seen[::20] + step * along[::20])
        assert np.mean(phantom.value(before) < -1e-3) == 0.0


def test_the_fast_render_equals_a_ray_for_every_pixel(room, head, monkeypatch):
    fast = room.render("pod1-right", head, POSE)
    monkeypatch.setattr(render_module, "DEPTH_TOLERANCE_MM", 0.0)
    assert np.max(np.abs(room.render("pod1-right", head, POSE) - fast)) < 12.0  # electrons: the read noise


def relative(electrons: np.ndarray, camera) -> np.ndarray:
    return electrons.astype(float) / camera.gain


def test_left_and_right_see_the_same_light_at_true_matches(room, head, head_match):
    left, right = (relative(room.render(n, head, POSE), room.cameras[n]) for n in room.pairs["pod2"])
    good = ndimage.binary_erosion(head_match.visible & head_match.lit, iterations=8)
    assert np.count_nonzero(good) > 20_000
    column, row = head_match.pixels[good].T
    there = ndimage.map_coordinates(right, [row, column], order=5)
    assert np.corrcoef(there, left[good])[0, 1] > 0.999
    for axis in (0, 1):  # the mean sub-pixel shift that would explain the difference
        slope = ndimage.map_coordinates(ndimage.convolve1d(right, [0.5, 0, -0.5], axis=axis), [row, column], order=3)
        assert abs(np.sum(slope * (left[good] - there)) / np.sum(slope**2)) < 0.004


def test_shadows_hold_ambient_light_only(room, torso):
    pose = twin.displacement(roll_deg=-60.0, rtn_deg=90.0)
    match = room.true_match("pod2", torso, pose)
    skin = np.isfinite(match.pixels[..., 0])
    dark = ndimage.binary_erosion(skin & ~match.lit, iterations=3)
    light = room.render("pod2-left", torso, pose)
    assert np.count_nonzero(dark) > 50
    assert np.min(light[dark]) / room.sensor.full_well_e > 0.01
    assert np.max(light[dark]) < 0.05 * room.sensor.full_well_e
    assert np.percentile(light[skin & match.lit], 90.0) > 0.3 * room.sensor.full_well_e


def test_the_pattern_stays_in_the_room_while_the_body_moves(room, torso, torso_truth):
    projector, name = room.projectors["pod1"], "pod1-left"

    def pattern_at(points):
        light = projector.intensity(*projector.project(*(points[..., i].ravel() for i in range(3))))
        light = ndimage.gaussian_filter(light.reshape(points.shape[:2]), 0.55)
        return light / ndimage.gaussian_filter(light, 12.0)

    for pose, points in ((POSE, torso_truth), (np.eye(4), room.truth_depth(name, torso))):
        image = relative(room.render(name, torso, pose), room.cameras[name])[300:700, 500:900]
        detail = image / ndimage.gaussian_filter(image, 12.0)
        points = points[300:700, 500:900]
        good = ndimage.binary_erosion(np.isfinite(points[..., 0]), iterations=30)
        points = np.nan_to_num(points)
        assert np.corrcoef(pattern_at(points)[good], detail[good])[0, 1] > 0.97
        if pose is POSE:
            fixed_to_body = pattern_at(into(np.linalg.inv(POSE), points))
            assert abs(np.corrcoef(fixed_to_body[good], detail[good])[0, 1]) < 0.1


def test_speckle_size_contrast_and_exposure(room, torso):
    image = relative(room.render("pod1-left", torso), room.cameras["pod1-left"])
    patch = image[440:568, 560:720]
    assert np.std(patch) / np.mean(patch) > 0.45
    spectrum = np.abs(np.fft.fft2(patch - ndimage.gaussian_filter(patch, 15.0))) ** 2
    correlation = np.fft.ifft2(spectrum).real
    for profile in (correlation[0, :8], correlation[:8, 0]):
        half = np.interp(-0.5, -profile / profile[0], np.arange(8.0))
        assert 3.0 < 2.0 * half < 4.2  # full width at half maximum, px
    bright = np.percentile(image[image > 0.1 * image.max()], 99.0) / room.sensor.full_well_e
    assert 0.6 < bright < 0.85


def test_noise_is_the_stated_sensor():
    for bits in (8, 12):
        sensor = twin.Sensor(bits=bits)
        k = (2**bits - 1) / 12000.0
        for electrons in (300.0, 3000.0, 9000.0):
            rng = np.random.Generator(np.random.PCG64(12))
            counts = sensor.expose(np.full((400, 500), electrons, np.float32), 3.0, rng).astype(float)
            assert np.mean(counts) == pytest.approx(k * electrons + 3.0, abs=0.03 * max(1.0, k * 12))
            expected = k**2 * (electrons + 12.0**2) + 1.0 / 12.0
            assert np.var(counts) == pytest.approx(expected, rel=0.04 if bits == 8 else 0.02)
    assert sensor.expose(np.full((2, 2), 1e6, np.float32), 0.0, rng).dtype == np.uint16


def test_noise_of_a_capture(torso):
    room = twin.Room(seed=7, sensor=twin.Sensor(bits=12))
    name = "pod2-left"
    frames = np.array([room.capture(torso, seed=s, cameras=[name])[name] for s in range(6)], dtype=float)
    electrons = np.minimum(room.render(name, torso), 12000.0)
    k = 4095.0 / 12000.0
    ratio = np.var(frames, axis=0, ddof=1) / (k**2 * (electrons + 144.0) + 1.0 / 12.0)
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.01)
    assert np.mean(ratio[electrons > 3000.0]) == pytest.approx(1.0, abs=0.02)


def test_texture_moves_with_the_body(room):
    plain, textured = (room.render("pod1-left", twin.head(texture=t), POSE) for t in (0.0, 0.4))
    body = plain > 1000.0
    ratio = textured[body] / plain[body]
    assert np.std(ratio) > 0.03 and np.mean(ratio) == pytest.approx(1.0, abs=0.15)


def _capture(job):
    room, phantom = pickle.loads(job)
    return {name: image.tobytes() for name, image in room.capture(phantom, POSE, seed=3, cameras=["pod1-left"]).items()}


def test_same_seed_same_bytes_in_any_process(room, head):
    images = room.capture(head, POSE, seed=3)
    again = twin.Room(seed=7).capture(head, POSE, seed=3)
    assert all(np.array_equal(images[name], again[name]) for name in images)
    assert all(image.shape == (1024, 1280) and image.dtype == np.uint8 for image in images.values())
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        elsewhere = pool.submit(_capture, pickle.dumps((room, head))).result()
    assert elsewhere == {"pod1-left": images["pod1-left"].tobytes()}
    assert not np.array_equal(room.capture(head, POSE, seed=4)["pod1-left"], images["pod1-left"])
    assert not np.array_equal(twin.Room(seed=8).capture(head, POSE, seed=3)["pod1-left"], images["pod1-left"])


# --- refusals


def test_body_out_of_view_is_background(room, torso):
    camera = room.cameras["pod1-left"]
    level = camera.offset_counts + 0.006 * 255 * camera.gain
    for place in ([5000.0, 0, 0], [0, -9000.0, 0], 2.0 * camera.centre):
        pose = np.eye(4)
        pose[:3, 3] = place
        image = room.capture(torso, pose, seed=1, cameras=["pod1-left"])["pod1-left"]
        assert np.mean(image) == pytest.approx(level, abs=0.1)
        assert np.all(np.isnan(room.truth_depth("pod1-left", torso, pose)))
    pose[:3, 3] = camera.centre + np.array([0, 0, 150.0])  # the body swallows the camera
    assert room.capture(torso, pose, seed=1, cameras=["pod1-left"])["pod1-left"].shape == (1024, 1280)


SHEARED = np.eye(4)
SHEARED[0, 1] = 0.1


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("seed", lambda room, body: twin.Room(seed=-1)),
        ("seed", lambda room, body: twin.Room(seed=1.5)),
        ("sensor", lambda room, body: twin.Room(sensor=8)),
        ("bits", lambda room, body: twin.Sensor(bits=7)),
        ("full_well_e", lambda room, body: twin.Sensor(full_well_e=float("nan"))),
        ("blur_px", lambda room, body: twin.Sensor(blur_px=-1.0)),
        ("phantom", lambda room, body: room.capture(None, seed=1)),
        ("seed", lambda room, body: room.capture(body, seed="x")),
        ("cameras", lambda room, body: room.capture(body, seed=1, cameras=["pod3-left"])),
        ("cameras", lambda room, body: room.capture(body, seed=1, cameras="pod1-left")),
        ("room_from_body", lambda room, body: room.render("pod1-left", body, np.eye(3))),
        ("room_from_body", lambda room, body: room.render("pod1-left", body, SHEARED)),
        ("room_from_body", lambda room, body: room.render("pod1-left", body, np.full((4, 4), np.nan))),
        ("room_from_body", lambda room, body: room.render("pod1-left", body, "no")),
        ("camera", lambda room, body: room.truth_depth("pod1", body)),
        ("pair", lambda room, body: room.true_match("pod1-left", body)),
        ("sigma_px", lambda room, body: room.perturbed_rig_json(1, -0.1)),
        ("seed", lambda room, body: room.perturbed_rig_json(-1)),
        ("scale", lambda room, body: twin.torso(scale=0.0)),
        ("breath_mm", lambda room, body: twin.torso(breath_mm=float("inf"))),
        ("albedo", lambda room, body: twin.head(albedo=1.5)),
        ("texture", lambda room, body: twin.head(texture=-0.1)),
        ("points", lambda room, body: body.distance([1.0, 2.0, 3.0])),
        ("count", lambda room, body: body.sample_surface(0, 1)),
        ("resolution_mm", lambda room, body: body.mesh(0.0)),
        ("max_mm", lambda room, body: twin.random_displacement(1, max_mm=-1.0)),
        ("lat_mm", lambda room, body: twin.displacement(lat_mm=float("nan"))),
        ("pixels", lambda room, body: room.cameras["pod1-left"].room_rays([[1, 2, 3]])),
        ("points_in_room", lambda room, body: room.cameras["pod1-left"].project("x")),
    ],
)
def test_nonsense_is_refused_by_name(room, head, name, call):
    with pytest.raises(ValueError, match=rf"^{name} must"):
        call(room, head)


def test_the_twin_imports_nothing_of_the_library():
    folder = pathlib.Path(twin.__file__).parent
    modules = {path.stem for path in folder.glob("*.py")}
    assert len(modules) > 10
    for path in folder.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                assert all(alias.name.split(".")[0] != "sgrt" for alias in node.names), path
            if isinstance(node, ast.ImportFrom):
                assert node.level < 2 and (node.module or "").split(".")[0] != "sgrt", path
                if node.level == 1:
                    names = [node.module] if node.module else [alias.name for alias in node.names]
                    assert {name.split(".")[0] for name in names} <= modules, path
