"""Registration through the ABI: the truth comes back, with its uncertainty, and no pose is never a pose."""

import base64
import pickle
import struct
import zlib
from xml.etree import ElementTree

import numpy as np
import pytest
import sgrt
from conftest import DATA, ISOCENTRE, SHIFT, body_points, displaced


@pytest.fixture(scope="module")
def result(reference, live):
    return sgrt.icp_align(reference, live, isocentre_mm=ISOCENTRE)


def test_finds_the_shift(result):
    for i, (name, truth) in enumerate(SHIFT.items()):
        sigma = [*result.sigma_mm, *result.sigma_deg][i]
        assert abs(getattr(result.displacement, name) - truth) < max(5 * sigma, 0.02), name
    assert result.status == "ok"
    assert result.verdict == "ok"
    assert result.inlier_share > 0.9
    assert np.array_equal(result.isocentre_mm, ISOCENTRE)
    assert result.free_motions.shape == (0, 6)
    assert result.free_words == []


def test_its_parts_agree(result):
    displacement, correction = sgrt.frames.shift_from_pose(result.reference_from_live, ISOCENTRE)
    assert displacement.as_dict() == pytest.approx(result.displacement.as_dict(), abs=1e-10)
    assert correction.as_dict() == pytest.approx(result.correction.as_dict(), abs=1e-10)
    assert np.array_equal(result.covariance, result.covariance.T)
    assert np.allclose(result.sigma_mm, np.sqrt(np.diag(result.covariance)[3:]))
    assert np.allclose(result.sigma_deg, np.degrees(np.sqrt(np.diag(result.covariance)[:3])))
    assert result.distance_mm.shape == (8000,)
    assert result.inlier.dtype == np.uint8
    assert abs(np.median(result.distance_mm[result.inlier == 1])) < 0.02


def test_result_is_frozen(result):
    with pytest.raises(AttributeError):
        result.rms_mm = 0
    with pytest.raises(ValueError, match="read-only"):
        result.reference_from_live[0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        result.distance_mm[0] = 1


def test_start_and_roi(reference, live, result):
    start = sgrt.frames.pose_from_displacement(sgrt.PatientDisplacement(lat_mm=2), ISOCENTRE)
    other = sgrt.icp_align(
        reference,
        live,
        isocentre_mm=ISOCENTRE,
        initial_reference_from_live=start,
        roi=sgrt.Roi.polygon([[-120, -140], [120, -140], [120, 140], [-120, 140]]),
    )
    assert other.pair_count < result.pair_count
    assert abs(other.displacement.vrt_mm - SHIFT["vrt_mm"]) < 0.05


def test_a_plane_has_no_answer():
    rng = np.random.default_rng(4)
    points = np.zeros((2000, 3))
    points[:, :2] = rng.uniform(-100, 100, (2000, 2))
    flat = sgrt.Surface(points, normals=np.tile([0.0, 0, 1], (2000, 1)), sigma_mm=np.full(2000, 0.1))
    with pytest.raises(sgrt.Degenerate) as error:
        sgrt.icp_align(flat, flat, isocentre_mm=(0, 0, 0))
    found = error.value.result
    assert (error.value.status, error.value.word, found.status) == (11, "degenerate", "degenerate")
    assert np.isnan(found.reference_from_live).all()
    assert np.isnan(list(found.displacement.as_dict().values())).all()
    assert found.verdict == "none"
    assert len(found.free_words) == len(found.free_motions) == 3
    assert any("LAT" in words for words in found.free_words)
    assert any("LNG" in words for words in found.free_words)


def test_a_prepared_reference(reference, live, result):
    prepared = sgrt.Reference(reference)
    for handle in (prepared, pickle.loads(pickle.dumps(prepared))):
        again = handle.align(live, isocentre_mm=ISOCENTRE)
        assert again.reference_from_live.tobytes() == result.reference_from_live.tobytes()
    promise = prepared.predict(isocentre_mm=ISOCENTRE, live_sigma_mm=0.1)
    assert np.isnan(promise.reference_from_live).all()
    assert promise.sigma_mm == pytest.approx(result.sigma_mm, rel=0.3)
    assert "Surface" in repr(prepared)


def test_the_certificate(result):
    assert np.allclose(result.covariance_random + result.covariance_shared, result.covariance, rtol=1e-12)
    scaled = np.diag([100.0] * 3 + [1.0] * 3)
    unit = result.directions @ scaled
    assert np.allclose(np.linalg.norm(unit, axis=1), 1)
    assert np.allclose((unit.T * result.direction_sigma_mm**2) @ unit, scaled @ result.covariance @ scaled, rtol=1e-6)
    assert np.allclose(result.detectable_mm, 3.6048 * result.direction_sigma_mm, rtol=1e-3)
    assert len(result.direction_words) == 6
    assert 0.8 < result.chi2 < 1.2
    assert np.isnan(result.coarse_score)


def test_regions_are_ranked(reference):
    """A flat top tells less than the whole body."""
    sigma = []
    for half in (60, 100, 170):
        region = sgrt.Reference(
            reference, roi=sgrt.Roi.polygon([[-half, -half], [half, -half], [half, half], [-half, half]])
        )
        sigma.append(region.predict(isocentre_mm=ISOCENTRE, live_sigma_mm=0.1).direction_sigma_mm[0])
    assert sigma[0] > sigma[1] > sigma[2]


def test_modes_of_one_name_cancel(reference, live):
    def with_mode(surface, name):
        mode = np.tile([0.0, 0, 0.5], (len(surface.points), 1))[None]
        known = {"normals": surface.normals, "sigma_mm": surface.sigma_mm}
        return sgrt.Surface(surface.points, modes=mode, mode_names=[name], **known)

    base = with_mode(reference, "room/0")
    assert base.mode_names == ["room/0"]
    same = sgrt.icp_align(base, with_mode(live, "room/0"), isocentre_mm=ISOCENTRE)
    other = sgrt.icp_align(base, with_mode(live, "other/0"), isocentre_mm=ISOCENTRE)
    assert same.sigma_mm[2] < 0.05
    assert other.sigma_mm[2] == pytest.approx(0.5 * np.sqrt(2), abs=0.05)
    with pytest.raises(ValueError, match="mode_names"):
        sgrt.Surface(reference.points, mode_names=["x"])


def test_bad_input_is_said(reference, live):
    with pytest.raises(sgrt.NotFound, match="in metres"):
        sgrt.icp_align(reference, sgrt.Surface(live.points / 1000), isocentre_mm=ISOCENTRE)
    with pytest.raises(sgrt.NotFound, match="inside out"):
        sgrt.icp_align(reference, sgrt.Surface(live.points, normals=-live.normals), isocentre_mm=ISOCENTRE)
    with pytest.raises(sgrt.InsufficientData):
        sgrt.icp_align(reference, sgrt.Surface(np.ones((500, 3))), isocentre_mm=ISOCENTRE)
    far = sgrt.icp_align(reference, live, isocentre_mm=(0, 2500, 0))
    assert far.verdict == "weak"
    assert "mm from the surface" in far.verdict_text
    hole = reference.points[np.linalg.norm(reference.points[:, :2], axis=1) > 100]
    with pytest.raises(sgrt.InsufficientData, match="within the roi"):
        sgrt.icp_align(
            sgrt.Surface(hole), live, isocentre_mm=ISOCENTRE, roi=sgrt.Roi.box((-50, -50, -500), (50, 50, 500))
        )
    with pytest.raises(sgrt.InvalidArgument, match="sigma"):
        sgrt.Surface(live.points, sigma_mm=np.full(len(live.points), np.nan))
    zero = sgrt.Surface(live.points, covariance=np.zeros((len(live.points), 6)))
    assert sgrt.icp_align(reference, zero, isocentre_mm=ISOCENTRE).status == "ok"


def test_no_overlap(reference):
    away = sgrt.Surface(reference.points + np.array([0.0, 0.0, 500.0]), normals=reference.normals)
    with pytest.raises(sgrt.NotFound) as error:
        sgrt.icp_align(reference, away, isocentre_mm=(0, 0, 0))
    assert np.isnan(error.value.result.reference_from_live).all()


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_too_few_points(reference, count):
    few = sgrt.Surface(body_points(count, 9))
    with pytest.raises(sgrt.InsufficientData):
        sgrt.icp_align(reference, few, isocentre_mm=(0, 0, 0))


def test_not_converged(reference, live):
    with pytest.raises(sgrt.NotConverged) as error:
        sgrt.icp_align(reference, live, isocentre_mm=(0, 0, 0), max_iterations=2)
    assert np.isnan(error.value.result.reference_from_live).all()


def test_isocentre_is_required(reference, live):
    with pytest.raises(TypeError, match="isocentre_mm"):
        sgrt.icp_align(reference, live)
    with pytest.raises(sgrt.InvalidArgument, match="isocentre_mm"):
        sgrt.icp_align(reference, live, isocentre_mm=None)


def test_same_bits_at_any_number_of_threads(reference, live, result):
    for threads in (1, 2, 4):
        other = sgrt.icp_align(reference, live, isocentre_mm=ISOCENTRE, context=sgrt.Context(threads=threads))
        assert other.reference_from_live.tobytes() == result.reference_from_live.tobytes()
        assert other.covariance.tobytes() == result.covariance.tobytes()
        assert other.distance_mm.tobytes() == result.distance_mm.tobytes()


def torso() -> tuple[np.ndarray, np.ndarray]:
    """Vertices (mm) and triangles of the torso: VTK XML, zlib blocks in base64."""
    piece = ElementTree.parse(DATA / "surface/vtk/Torso.vtp").find(".//Piece")

    def array(path: str, dtype: str) -> np.ndarray:
        text = "".join(piece.find(path).text.split())
        count = struct.unpack("<I", base64.b64decode(text[:8])[:4])[0]
        head = 4 * (3 + count)
        width = (head + 2) // 3 * 4
        sizes = np.frombuffer(base64.b64decode(text[:width]), "<u4")[3 : 3 + count]
        data, blocks, at = base64.b64decode(text[width:]), [], 0
        for size in sizes:
            blocks.append(zlib.decompress(data[at : at + size]))
            at += size
        return np.frombuffer(b"".join(blocks), dtype)

    points = array("Points/DataArray", "<f4").reshape(-1, 3).astype(float)
    wide = {"Int32": "<i4", "Int64": "<i8"}
    arrays = {a.get("Name"): i for i, a in enumerate(piece.findall("Polys/DataArray"), 1)}
    kinds = {a.get("Name"): wide[a.get("type")] for a in piece.findall("Polys/DataArray")}
    corners = array(f"Polys/DataArray[{arrays['connectivity']}]", kinds["connectivity"])
    ends = array(f"Polys/DataArray[{arrays['offsets']}]", kinds["offsets"])
    triangles = []
    for begin, end in zip([0, *ends[:-1]], ends, strict=True):
        triangles += [(corners[begin], corners[k], corners[k + 1]) for k in range(begin + 1, end - 1)]
    return points, np.array(triangles)


@pytest.mark.skipif(not (DATA / "surface/vtk/Torso.vtp").exists(), reason="the torso is not in ../shared/data")
def test_torso():
    """Two samples of 20,000 points, displaced, 0.3 mm of noise: within 0.05 mm and 0.03 deg."""
    points, triangles = torso()
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1))
    rng = np.random.default_rng(11)

    def sample() -> np.ndarray:
        rows = rng.choice(len(area), 20000, p=area / area.sum())
        u, v = rng.uniform(size=(2, 20000, 1))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        return a[rows] + u * (b - a)[rows] + v * (c - a)[rows]

    isocentre = points.mean(axis=0)
    noise = rng.normal(0, 0.3, (2, 20000, 3))
    sigma = np.full(20000, 0.3)
    reference = sgrt.Surface(sample() + noise[0], sigma_mm=sigma)
    live = sgrt.Surface(displaced(sample(), SHIFT, isocentre) + noise[1], sigma_mm=sigma)
    found = sgrt.icp_align(reference, live, isocentre_mm=isocentre).displacement.as_dict()
    for name, truth in SHIFT.items():
        assert abs(found[name] - truth) < (0.05 if name.endswith("mm") else 0.03), name
