"""Bodies that change their shape: faces and torsos of the simulated room with drawn deformations, the command line."""

import json

import numpy as np
import pytest
import sgrt
from conftest import ISOCENTRE, SHIFT, body_points, displaced
from sgrt import io
from sgrt.cli import main

twin = pytest.importorskip("sgrt.twin")


def bump(points, centre, radius, amount):
    q = np.sum(((points - centre) / radius) ** 2, axis=1)
    return np.where(q < 1, (1 - q) ** 2, 0)[:, None] * np.asarray(amount)


@pytest.fixture(scope="module")
def bodies():
    def part(phantom, seed, box):
        points, normals = phantom.sample_surface(14000, seed)
        low, high = np.array(box)
        return points[(normals[:, 2] > 0.1) & np.all((points > low) & (points < high), axis=1)]

    boxes = {"head": ((-85, -105, 10), (85, 95, 300)), "torso": ((-150, -220, -100), (150, 190, 300))}
    phantoms = {"head": twin.head(), "torso": twin.torso()}
    return {name: [part(phantoms[name], seed, boxes[name]) for seed in (1, 2)] for name in boxes}


SHAPES = {
    "smile": ("head", [((40, -45, 80), 38, (0.6, 0.5, 0.7)), ((-40, -45, 80), 38, (-0.6, 0.5, 0.7))]),
    "mouth": ("head", [((0, -60, 95), 42, (0, -0.3, 0.95))]),
    "cheek": ("head", [((-45, -30, 70), 50, (0.5, 0, -0.87))]),
    "belly": ("torso", [((10, -160, 80), 130, (0, 0, 1))]),
    "breast": ("torso", [((76, 76, 84), 75, (0.7, -0.3, 0.6))]),
    "none": ("head", []),
}


def scene(bodies, shape, amount_mm, noise_mm, seed):
    name, bumps = SHAPES[shape]
    rng = np.random.default_rng(seed)
    plan, now = bodies[name]
    change = sum((bump(now, np.array(c), r, amount_mm * np.array(d)) for c, r, d in bumps), np.zeros_like(now))
    live = displaced(now + change, SHIFT, ISOCENTRE)
    surfaces = [
        sgrt.Surface(p + rng.normal(0, noise_mm, p.shape), sigma_mm=np.full(len(p), noise_mm)).estimate_normals()
        for p in (plan, live)
    ]
    return (*surfaces, change)


def error_mm(displacement):
    return np.sqrt(sum((getattr(displacement, n) - SHIFT[n]) ** 2 for n in ("lat_mm", "lng_mm", "vrt_mm")))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("amount_mm", "noise_mm"), [(1.5, 0.3), (-3.0, 0.5)])
def test_the_isocentre_stays(bodies, shape, amount_mm, noise_mm):
    reference, live, _ = scene(bodies, shape, amount_mm, noise_mm, seed=3)
    result = sgrt.deform_align(reference, live, isocentre_mm=ISOCENTRE)
    assert result.status == "ok"
    assert error_mm(result.displacement) < 0.3
    assert result.rigid_share > 0.6
    assert result.part.shape == (live.point_count,)
    assert set(np.unique(result.part)) <= {0, 1, 255}


def test_it_is_better_than_a_rigid_registration(bodies):
    reference, live, _ = scene(bodies, "smile", 3.0, 0.3, seed=4)
    rigid = sgrt.icp_align(reference, live, isocentre_mm=ISOCENTRE)
    aware = sgrt.deform_align(reference, live, isocentre_mm=ISOCENTRE)
    assert error_mm(aware.displacement) < 0.5 * error_mm(rigid.displacement)


def test_it_says_that_it_cannot_tell(bodies):
    plan, now = bodies["head"]
    rng = np.random.default_rng(5)
    change = np.zeros_like(now)
    change[:, 2] = 3 * np.sin(now[:, 0] / 30) * np.cos(now[:, 1] / 35)  # hardly anything stays
    reference, live = (
        sgrt.Surface(p + rng.normal(0, 0.3, p.shape), sigma_mm=np.full(len(p), 0.3)).estimate_normals()
        for p in (plan, now + change)
    )
    with pytest.raises((sgrt.NotFound, sgrt.Degenerate), match="cannot tell the rigid motion") as caught:
        sgrt.deform_align(reference, live, isocentre_mm=ISOCENTRE)
    result = caught.value.result
    assert result.rigid_share < 0.6
    assert np.isnan(result.reference_from_live).all() and np.isnan(result.displacement.lat_mm)
    assert result.verdict == "none"


def test_field(bodies):
    reference, live, change = scene(bodies, "belly", 3.0, 0.2, seed=6)
    result = sgrt.deform_align(reference, live, isocentre_mm=ISOCENTRE, mode="field")
    known = np.isfinite(result.deformation_mm).all(axis=1)
    assert known.mean() > 0.9
    pose = result.reference_from_live[:3, :3]
    normals = live.normals @ pose.T
    seen = np.einsum("ij,ij->i", normals, result.deformation_mm - change)[known]
    assert np.sqrt(np.mean(seen**2)) < 0.3
    assert result.deformation_max_mm == pytest.approx(3, abs=0.8)
    assert sgrt.deform_align(reference, live, isocentre_mm=ISOCENTRE).deformation_mm is None


def test_similarity(reference):
    points = displaced((body_points(8000, 31) - ISOCENTRE) / 1.05 + ISOCENTRE, SHIFT, ISOCENTRE)
    live = sgrt.Surface(points, sigma_mm=np.full(8000, 0.1)).estimate_normals()
    result = sgrt.deform_align(reference, live, isocentre_mm=ISOCENTRE, mode="similarity")
    assert result.scale == pytest.approx(1.05, abs=max(6 * result.scale_sigma, 5e-4))
    for name in ("pitch_deg", "roll_deg", "rtn_deg"):
        assert getattr(result.displacement, name) == pytest.approx(SHIFT[name], abs=0.1)


def test_same_bits_at_any_number_of_threads(bodies):
    reference, live, _ = scene(bodies, "cheek", 2.0, 0.3, seed=7)

    def run(threads):
        context = sgrt.Context(threads=threads)
        r = sgrt.deform_align(reference, live, isocentre_mm=ISOCENTRE, mode="field", context=context)
        return r.reference_from_live.tobytes(), r.covariance.tobytes(), r.deformation_mm.tobytes(), r.part.tobytes()

    assert len({run(threads) for threads in (1, 2, 3)}) == 1


@pytest.mark.parametrize(
    "bad",
    [
        {"mode": "elastic"},
        {"min_rigid_share": 1.1},
        {"max_structure_mm": -1},
        {"max_rivalry": float("nan")},
        {"stiffness": 0},
    ],
)
def test_nonsense(reference, bad):
    with pytest.raises(sgrt.InvalidArgument, match=next(iter(bad))):
        sgrt.deform_align(reference, reference, isocentre_mm=ISOCENTRE, **bad)


def test_command_line(bodies, tmp_path, capfd):
    reference, live, _ = scene(bodies, "smile", 2.0, 0.3, seed=8)
    io.write_surface(tmp_path / "reference.ply", reference)
    io.write_surface(tmp_path / "live.ply", live)
    command = ["register", "--reference", tmp_path / "reference.ply", "--live", tmp_path / "live.ply"]
    command = [str(c) for c in (*command, "--isocentre", *ISOCENTRE)]
    assert main([*command, "--deform", "field", "--json", "--map", str(tmp_path / "map.npz")]) == 0
    document = json.loads(capfd.readouterr().out)
    assert document["patient_displacement"]["lat_mm"] == pytest.approx(SHIFT["lat_mm"], abs=0.3)
    assert document["deform"]["rigid_share"] > 0.6
    with np.load(tmp_path / "map.npz") as arrays:
        assert arrays["deformation_mm"].shape == arrays["points_mm"].shape == (live.point_count, 3)
    assert main([*command, "--deform", "rigid"]) == 0
    assert "moved as one" in capfd.readouterr().out
    assert main([*command, "--map", str(tmp_path / "map.npz")]) == 2
    assert "--deform" in capfd.readouterr().err
