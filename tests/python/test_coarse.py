"""Landmarks through the ABI, their file, and the start that they give on the command line."""

import json

import numpy as np
import pytest
import sgrt
from conftest import ISOCENTRE, SHIFT
from sgrt.cli import main
from sgrt.io import LandmarkSet, landmarks_align, read_landmarks, write_landmarks

FACE = np.array(
    [[0, 0, 25], [-17, -8, 8], [17, -8, 8], [-16, 38, 2], [16, 38, 2], [0, -60, 5], [-65, 30, -50], [65, 32, -48]],
    float,
)
NAMES = ("nose_apex", "ala_left", "ala_right", "eye_inner_left", "eye_inner_right", "chin", "left", "right")


def pose():
    return sgrt.frames.pose_from_displacement(sgrt.PatientDisplacement(**SHIFT), ISOCENTRE)


def displaced_set(reference):
    return reference.moved(np.linalg.inv(pose()))


@pytest.fixture
def face():
    return LandmarkSet(NAMES, FACE, np.tile(0.25 * np.eye(3), (8, 1, 1)))


@pytest.fixture
def run_cli(capfd):
    def call(*arguments, exit_code=0):
        assert main([*map(str, arguments), "--json"]) == exit_code
        return json.loads(capfd.readouterr().out)

    return call


def test_exact(face):
    found = landmarks_align(face, displaced_set(face), isocentre_mm=ISOCENTRE)
    assert np.allclose(found.reference_from_live, pose(), atol=1e-9)
    assert (found.status, found.verdict, found.used_count, found.common_count) == ("ok", "ok", 8, 8)
    assert np.allclose(found.sigma_mm, np.sqrt(np.diag(found.covariance)[3:]))
    assert found.distance_mm.max() < 1e-9 and found.inlier.all()
    assert "lat" in repr(found)


def test_by_name_whatever_the_order(face):
    live = displaced_set(face)
    order = [7, 2, 0, 5, 1]
    shuffled = LandmarkSet(tuple(NAMES[i] for i in order), live.position_mm[order])
    found = landmarks_align(face, shuffled, isocentre_mm=ISOCENTRE)
    assert np.allclose(found.reference_from_live, pose(), atol=1e-9)
    assert found.common_count == 5


def test_refuses(face):
    few = LandmarkSet(NAMES[:2], FACE[:2])
    with pytest.raises(sgrt.InsufficientData, match="2 landmarks") as error:
        landmarks_align(face, few, isocentre_mm=ISOCENTRE)
    assert np.isnan(error.value.result.reference_from_live).all()
    other = np.random.default_rng(1).uniform(-300, 300, (8, 3))
    with pytest.raises(sgrt.NotFound):
        landmarks_align(face, LandmarkSet(NAMES, other), isocentre_mm=ISOCENTRE)
    ids = np.arange(8, dtype=np.int32)
    with pytest.raises(sgrt.InvalidArgument, match="live_mm"):
        sgrt.coarse_align(FACE, ids, FACE * np.nan, ids, isocentre_mm=ISOCENTRE)
    with pytest.raises(sgrt.InvalidArgument, match=r"reference_covariance_mm2\[0\]"):
        noise = np.full((8, 3, 3), np.nan)
        sgrt.coarse_align(FACE, ids, FACE, ids, isocentre_mm=ISOCENTRE, reference_covariance_mm2=noise)


def test_file_round_trip(face, tmp_path):
    path = tmp_path / "landmarks.json"
    scored = LandmarkSet(face.names, face.position_mm, face.covariance_mm2, np.linspace(0, 1, 8))
    write_landmarks(path, scored)
    again = read_landmarks(path)
    assert again.names == NAMES
    assert np.array_equal(again.position_mm, FACE)
    assert np.array_equal(again.covariance_mm2, face.covariance_mm2)
    assert np.array_equal(again.score, scored.score)
    bare = {"schema": "sgrt-landmarks/1", "landmarks": [{"name": "chin", "position_mm": [1, 2, 3]}]}
    path.write_text(json.dumps(bare))
    assert read_landmarks(path).covariance_mm2 is None
    for change, words in (({"name": 3}, "name"), ({"position_mm": [1, 2]}, "3"), ({"covariance_mm2": 1}, "covariance")):
        path.write_text(json.dumps(bare | {"landmarks": [bare["landmarks"][0] | change]}))
        with pytest.raises(sgrt.FormatError, match=words):
            read_landmarks(path)


def test_register_starts_from_landmarks(face, reference, live, tmp_path, run_cli):
    sgrt.io.write_surface(tmp_path / "reference.ply", reference)
    # Turned by 120 deg: far out of reach of the identity.
    turn = sgrt.frames.pose_from_displacement(sgrt.PatientDisplacement(rtn_deg=120, lng_mm=80), ISOCENTRE)
    sgrt.io.write_surface(tmp_path / "live.ply", live.moved(np.linalg.inv(turn)))
    write_landmarks(tmp_path / "a.json", face)
    write_landmarks(tmp_path / "b.json", displaced_set(face).moved(np.linalg.inv(turn)))
    surfaces = ["--reference", tmp_path / "reference.ply", "--live", tmp_path / "live.ply", "--isocentre", *ISOCENTRE]
    sets = ["--landmarks", tmp_path / "a.json", tmp_path / "b.json"]
    document = run_cli("register", *surfaces, *sets)
    assert document["verdict"] == "ok"
    assert document["coarse"]["landmarks"]["used"] == 8
    assert np.allclose(document["reference_from_live"], pose() @ turn, atol=0.1)
    write_landmarks(tmp_path / "b.json", LandmarkSet(NAMES[:2], FACE[:2]))
    document = run_cli("register", *surfaces, *sets, exit_code=1)
    assert document["status"] == "insufficient_data"
    assert document["coarse"]["landmarks"]["common"] == 2
    assert np.array(document["reference_from_live"]).tolist()[0][0] is None
