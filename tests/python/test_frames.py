"""Frames: against the matrices of formats.md and domain.md, written out here."""

import numpy as np
import pytest
import sgrt
from conftest import rotation
from sgrt import frames


def displacement_matrix(shift, isocentre):
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(shift.pitch_deg, shift.roll_deg, shift.rtn_deg)
    matrix[:3, 3] = isocentre + np.array([shift.lat_mm, shift.lng_mm, shift.vrt_mm]) - matrix[:3, :3] @ isocentre
    return matrix


@pytest.mark.parametrize("seed", range(5))
def test_displacement_is_the_inverse_of_the_pose(seed):
    rng = np.random.default_rng(seed)
    isocentre = rng.uniform(-200, 200, 3)
    names = ("lat_mm", "lng_mm", "vrt_mm", "pitch_deg", "roll_deg", "rtn_deg")
    shift = sgrt.PatientDisplacement(**dict(zip(names, rng.uniform(-20, 20, 6), strict=True)))
    pose = frames.pose_from_displacement(shift, isocentre)
    assert np.abs(pose @ displacement_matrix(shift, isocentre) - np.eye(4)).max() < 1e-12

    back, correction = frames.shift_from_pose(pose, isocentre)
    for name in names:
        assert getattr(back, name) == pytest.approx(getattr(shift, name), abs=1e-11)
    assert back.mag_mm == pytest.approx(np.sqrt(shift.lat_mm**2 + shift.lng_mm**2 + shift.vrt_mm**2))
    # The couch undoes D: its own six numbers, composed in the same way, are D's inverse.
    undone = displacement_matrix(correction, isocentre) @ displacement_matrix(shift, isocentre)
    assert np.abs(undone - np.eye(4)).max() < 1e-12
    assert np.abs(frames.pose_from_correction(correction, isocentre) - pose).max() < 1e-12


def test_identity_is_only_identity():
    displacement, correction = frames.shift_from_pose(np.eye(4), (1, 2, 3))
    assert set(displacement.as_dict().values()) == {0.0}
    assert set(correction.as_dict().values()) == {0.0}


@pytest.mark.parametrize(
    "bad", [np.diag([1, 1, 1, 2.0]), np.diag([-1, 1, 1, 1.0]), np.full((4, 4), np.nan), np.zeros((4, 4))]
)
def test_not_rigid(bad):
    with pytest.raises(sgrt.InvalidArgument):
        frames.shift_from_pose(bad, (0, 0, 0))


def test_the_two_shifts_do_not_convert():
    with pytest.raises(TypeError):
        frames.pose_from_displacement(sgrt.CouchCorrection(), (0, 0, 0))
    assert sgrt.PatientDisplacement() != sgrt.CouchCorrection()


def test_shifts_are_frozen():
    shift = sgrt.PatientDisplacement(lat_mm=1)
    with pytest.raises(AttributeError):
        shift.lat_mm = 2
    assert np.isnan(shift.mag_mm)  # not computed
    assert shift == sgrt.PatientDisplacement(lat_mm=1) != sgrt.PatientDisplacement(lat_mm=1.5)


def test_dicom():
    # Head first supine: (x, y, z)_IEC = (x, z, -y)_DICOM, the isocentre at the origin.
    pose = frames.fixed_from_dicom("HFS", (10, 20, 30))
    assert np.allclose(pose @ [11, 22, 33, 1], [1, 3, -2, 1], atol=1e-12)
    # Feet first supine: that, turned by 180 degrees about the vertical.
    pose = frames.fixed_from_dicom("FFS", (10, 20, 30))
    assert np.allclose(pose @ [11, 22, 33, 1], [-1, -3, -2, 1], atol=1e-12)
    for name in ("HFS", "HFP", "FFS", "FFP", "HFDL", "HFDR", "FFDL", "FFDR"):
        turn = frames.fixed_from_dicom(name, (0, 0, 0))[:3, :3]
        assert np.allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    with pytest.raises(sgrt.InvalidArgument, match="HFX"):
        frames.fixed_from_dicom("HFX", (0, 0, 0))


def test_couch_turns_counter_clockwise_from_above():
    assert np.allclose(frames.fixed_from_couch(90) @ [1, 0, 5, 1], [0, 1, 5, 1], atol=1e-12)
    with pytest.raises(sgrt.InvalidArgument):
        frames.fixed_from_couch(float("nan"))


@pytest.mark.parametrize("isocentre", [None, (1, 2), (1, 2, 3, 4), "abc", [[1, 2, 3]], (1, 2, float("nan"))])
def test_bad_isocentre(isocentre):
    with pytest.raises(sgrt.InvalidArgument, match="isocentre_mm"):
        frames.shift_from_pose(np.eye(4), isocentre)
