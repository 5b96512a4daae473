"""The main job end to end, on displacements that the demo does not use: images of the simulated room to six numbers."""

import json

import numpy as np
import pytest
import sgrt

twin = pytest.importorskip("sgrt.twin")
pytest.importorskip("matplotlib")


def test_demo_writes_what_it_says(tmp_path, monkeypatch, capfd):
    from sgrt import demo

    monkeypatch.setattr(demo, "TRIALS", 1)
    monkeypatch.setattr(demo, "SEED", 4)
    assert demo.run(out=tmp_path / "out", threads=1) == 0
    out, error = capfd.readouterr()
    assert error == ""
    assert "exact rig" in out
    document = json.loads((tmp_path / "out/demo.json").read_text())
    assert document["worst"]["exact"]["error_mm"] < 0.1
    assert document["worst"]["exact"]["error_deg"] < 0.05
    assert document["worst"]["perturbed"]["error_mm"] < 0.5
    for name in ("demo.png", "rig.json", "reference.ply", "live.ply", "registration.json", "live-pod2-right.png"):
        assert (tmp_path / "out" / name).stat().st_size > 500
    # What was written reads back to the same answer through the same library.
    result = sgrt.icp_align(
        sgrt.io.read_surface(tmp_path / "out/reference.ply"),
        sgrt.io.read_surface(tmp_path / "out/live.ply"),
        isocentre_mm=(0, 0, 0),
    )
    true = document["trials"][0]["true"]
    assert result.displacement.lat_mm == pytest.approx(true["lat_mm"], abs=0.1)


def test_a_head_from_images():
    room, phantom = twin.Room(9), twin.head()
    rig = sgrt.Rig(room.rig_json())
    moved, true = twin.random_displacement(77, 8.0, 2.0)
    surfaces = []
    for seed, pose in ((1, np.eye(4)), (2, moved)):
        images = room.capture(phantom, pose, seed=seed)
        pods = [sgrt.stereo_match(rig, pod, images[a], images[b]) for pod, (a, b) in room.pairs.items()]
        for pod in pods:
            points = pod.surface.points.reshape(-1, 3)
            known = np.isfinite(points[:, 0])
            off = phantom.distance((points[known] - pose[:3, 3]) @ pose[:3, :3])
            sigma = pod.surface.sigma_mm.ravel()[known]
            assert abs(np.mean(off)) < 0.03
            assert 0.3 < np.mean((off / sigma) ** 2) < 1.6  # an honest sigma, ears and all
        surfaces.append(sgrt.surface_fuse([pod.surface for pod in pods])[0])
    result = sgrt.icp_align(*surfaces, isocentre_mm=(0, 0, 0))
    found = result.displacement.as_dict()
    assert result.verdict == "ok"
    for key in ("lat_mm", "lng_mm", "vrt_mm"):
        assert found[key] == pytest.approx(true[key], abs=0.1)
    for key in ("pitch_deg", "roll_deg", "rtn_deg"):
        assert found[key] == pytest.approx(true[key], abs=0.1)
