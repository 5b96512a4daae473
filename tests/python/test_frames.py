"""Frames: against the matrices of formats.md and domain.md, written out here."""

import numpy as np
import pytest
import sgrt
from conftest import SHIFT, body_points, displaced, rotation
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


# REQ-FRAME-007
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


# A body in DICOM coordinates (x left, y back, z head): where its parts lie in each position, in words.
POSITIONS = {
    "HFS": ("left +x, front up, head to the gantry", np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])),
    "HFP": ("left -x, front down", np.array([[-1, 0, 0], [0, 0, 1], [0, 1, 0]])),
    "FFS": ("left -x, front up, head away", np.array([[-1, 0, 0], [0, 0, -1], [0, -1, 0]])),
    "FFP": ("left +x, front down, head away", np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])),
    "HFDL": ("left down, front +x", np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]])),
    "HFDR": ("left up, front -x", np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])),
    "FFDL": ("left down, front -x, head away", np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]])),
    "FFDR": ("left up, front +x, head away", np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])),
}


# REQ-FRAME-004
@pytest.mark.parametrize("position", POSITIONS)
def test_a_phantom_in_every_position(position):
    """The plan's surface in DICOM coordinates, the patient in the room by matrices written out here, the couch turned:
    the library's frames and registration find the displacement that was made."""
    rng = np.random.default_rng(len(position) + ord(position[0]))
    isocentre_dicom = np.array([12.0, -34.0, 560.0])
    body = [p[:, [0, 2, 1]] * [1, -1, 1] for p in (body_points(3000, 1), body_points(3000, 2))]  # front is -y
    body = [p + isocentre_dicom for p in body]
    couch_deg, shift = 30.0, dict(SHIFT)
    turn = rotation(0, 0, couch_deg)
    room = [(p - isocentre_dicom) @ POSITIONS[position][1].T for p in body]
    live = displaced(room[1] @ turn.T, shift, np.zeros(3)) + rng.normal(0, 0.05, (3000, 3))

    in_dicom = sgrt.Surface(body[0]).estimate_normals(viewpoint_mm=isocentre_dicom - [0, 1e4, 0])
    plan = in_dicom.moved(frames.fixed_from_dicom(position, isocentre_dicom))
    assert np.abs(plan.points - room[0]).max() < 1e-9
    reference = plan.moved(frames.couch_turn(couch_deg, (0, 0, 0)))
    view = 1e4 * (turn @ POSITIONS[position][1] @ [0, -1, 0])
    result = sgrt.icp_align(reference, sgrt.Surface(live).estimate_normals(viewpoint_mm=view), isocentre_mm=(0, 0, 0))
    for name, truth in shift.items():
        assert getattr(result.displacement, name) == pytest.approx(truth, abs=0.06), name
    # What the couch does about it, applied to the patient, brings him to the plan.
    home = (live - 0) @ rotation(*(getattr(result.correction, n) for n in ("pitch_deg", "roll_deg", "rtn_deg"))).T
    home += [result.correction.lat_mm, result.correction.lng_mm, result.correction.vrt_mm]
    assert np.abs(home - room[1] @ turn.T).max() < 0.5


@pytest.mark.parametrize("seed", range(5))
def test_a_couch_without_pitch_and_roll(seed):
    rng = np.random.default_rng(seed)
    isocentre = rng.uniform(-200, 200, 3)
    names = ("lat_mm", "lng_mm", "vrt_mm", "pitch_deg", "roll_deg", "rtn_deg")
    shift = sgrt.PatientDisplacement(**dict(zip(names, rng.uniform(-3, 3, 6), strict=True)))
    pose = frames.pose_from_displacement(shift, isocentre)
    correction, remaining = frames.four_dof(pose, isocentre)
    assert (correction.pitch_deg, correction.roll_deg) == (0, 0)
    # The couch moves the displaced patient: what remains is his pitch and roll, the isocentre in place.
    after = displacement_matrix(correction, isocentre) @ displacement_matrix(shift, isocentre)
    assert np.abs(after - displacement_matrix(remaining, isocentre)).max() < 1e-12
    assert (remaining.lat_mm, remaining.lng_mm, remaining.vrt_mm, remaining.rtn_deg) == (0, 0, 0, 0)
    assert (remaining.pitch_deg, remaining.roll_deg) == pytest.approx((shift.pitch_deg, shift.roll_deg), abs=1e-12)

    # No other turn of the couch leaves a turn that is smaller by more than a second-order crumb.
    def left_deg(rtn_deg):
        turn = rotation(0, 0, rtn_deg) @ rotation(shift.pitch_deg, shift.roll_deg, shift.rtn_deg)
        return np.degrees(np.arccos((np.trace(turn) - 1) / 2))

    least = min(left_deg(correction.rtn_deg + d) for d in np.linspace(-1, 1, 2001))
    assert left_deg(correction.rtn_deg) - least < 2e-3


def test_gantry_and_couch():
    for deg in (-200.0, -90.0, 17.0, 180.0):
        assert np.abs(frames.fixed_from_gantry(deg)[:3, :3] - rotation(0, deg, 0)).max() < 1e-14
        pose = frames.couch_turn(deg, (1, 2, 3))
        assert np.allclose(pose @ [1, 2, 77, 1], [1, 2, 77, 1], atol=1e-12)  # the axis stays
        assert np.abs(pose[:3, :3] - rotation(0, 0, deg)).max() < 1e-14
    # Gantry at 90: the beam's source, above the isocentre at 0, comes to +X.
    assert np.allclose(frames.fixed_from_gantry(90) @ [0, 0, 1000, 1], [1000, 0, 0, 1])


def test_what_lies_on_the_couch_moves():
    polygon = sgrt.Roi.polygon([[0, 0], [100, 0], [100, 50]])
    turned = polygon.moved(frames.couch_turn(90, (0, 0, 0)))
    assert np.allclose(turned.polygon_xy_mm, [[0, 0], [0, 100], [-50, 100]], atol=1e-12)
    assert turned.box_mm is None
    shift = np.eye(4)
    shift[:3, 3] = 1, 2, 3
    assert sgrt.Roi.box((0, 0, 0), (1, 1, 1)).moved(shift).box_mm.tolist() == [[1, 2, 3], [2, 3, 4]]
    with pytest.raises(sgrt.InvalidArgument, match="box cannot turn"):
        sgrt.Roi.box((0, 0, 0), (1, 1, 1)).moved(frames.couch_turn(1, (0, 0, 0)))
    with pytest.raises(sgrt.InvalidArgument, match="vertical"):
        polygon.moved(frames.fixed_from_gantry(1))
    with pytest.raises(sgrt.InvalidArgument, match="pose"):
        sgrt.Surface([[0.0, 0, 0]]).moved(np.diag([1, 1, 2, 1.0]))
