"""numpy's edges: each gives the right answer or a clear error, never a crash and never a silently copied output."""

import numpy as np
import pytest
import sgrt

POINTS = np.random.default_rng(0).normal(size=(40, 3))


def swapped(array):
    return array.astype(array.dtype.newbyteorder())


def misaligned(array):
    memory = np.zeros(array.nbytes + 1, dtype=np.uint8)
    view = memory[1:].view(array.dtype).reshape(array.shape)
    view[...] = array
    assert not view.flags.aligned
    return view


def columns_of_a_table(array):
    table = np.zeros((len(array), 7))
    table[:, 1:7:2] = array
    return table[:, 1:7:2]


def read_only(array):
    array = array.copy()
    array.setflags(write=False)
    return array


# REQ-VIEW-001
@pytest.mark.parametrize(
    "shape_of",
    [
        lambda p: p,
        np.asfortranarray,
        read_only,
        columns_of_a_table,
        misaligned,
        lambda p: p[::-1][::-1],
        lambda p: p[:, ::-1].copy()[:, ::-1],
        lambda p: p.tolist(),
        lambda p: [tuple(row) for row in p],
        lambda p: np.asmatrix(p) if hasattr(np, "asmatrix") else p,
    ],
)
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_any_layout_of_an_input(shape_of):
    assert np.array_equal(sgrt.Surface(shape_of(POINTS)).points, POINTS)


def test_float32_negative_and_zero_strides():
    single = POINTS.astype(np.float32)
    assert np.array_equal(sgrt.Surface(single[::-2]).points, single[::-2].astype(float))
    one = np.broadcast_to(POINTS[0], (5, 3))
    assert one.strides[0] == 0
    assert np.array_equal(sgrt.Surface(one).points, one)
    assert np.array_equal(sgrt.Surface(POINTS, sigma_mm=np.broadcast_to(0.5, 40)).sigma_mm, np.full(40, 0.5))


def test_integers_of_a_list_are_numbers():
    assert sgrt.Surface([[1, 2, 3]]).points.tolist() == [[1.0, 2.0, 3.0]]


# REQ-PY-002
@pytest.mark.parametrize(
    "points",
    [
        POINTS.astype(np.int64),
        POINTS.astype(np.int32),
        POINTS.astype(np.float16),
        POINTS.astype(np.longdouble),
        POINTS.astype(complex),
        POINTS > 0,
        POINTS.astype(str),
        POINTS.astype(object),
        swapped(POINTS),
        swapped(POINTS.astype(np.float32)),
        np.zeros((4, 3), dtype="M8[s]"),
        np.zeros(4, dtype=[("x", float), ("y", float)]),
    ],
    ids=lambda p: str(p.dtype),
)
def test_wrong_dtype_names_what_is_accepted(points):
    with pytest.raises(sgrt.InvalidArgument, match=r"^points: dtype .*float32 or float64"):
        sgrt.Surface(points)


def test_masked_arrays_do_not_lose_their_mask():
    with pytest.raises(sgrt.InvalidArgument, match=r"points: a masked array"):
        sgrt.Surface(np.ma.masked_array(POINTS, POINTS > 0))


@pytest.mark.parametrize("points", [5.0, None, "text", {}, [[1, 2], [3]], np.zeros((1,) * 7), np.float64(3)])
def test_not_an_array(points):
    with pytest.raises((sgrt.InvalidArgument, TypeError), match="points"):
        sgrt.Surface(points)


@pytest.mark.parametrize("shape", [(0, 3), (0, 0, 3), (3, 0), (0,), (0, 5, 3)])
def test_empty(shape):
    with pytest.raises((sgrt.InsufficientData, sgrt.InvalidArgument), match="points"):
        sgrt.Surface(np.zeros(shape))


def test_faces_are_int32():
    with pytest.raises(sgrt.InvalidArgument, match=r"^faces: dtype int64 .*int32"):
        sgrt.Surface(POINTS, faces=np.array([[0, 1, 2]], dtype=np.int64))


# REQ-VIEW-004
def test_inputs_are_never_written(rig):
    before = POINTS.copy()
    rig.project("left", POINTS)
    sgrt.Surface(POINTS)
    assert np.array_equal(POINTS, before)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_images_of_any_dtype_and_layout(rig, images, stereo, dtype):
    left, right = (np.asfortranarray(image.astype(dtype)) for image in images)
    found = sgrt.stereo_match(rig, "pod1", left, right)
    both = (found.reason == 0) & (stereo.reason == 0)
    assert both.mean() > 0.5
    assert np.abs(found.surface.points - stereo.surface.points)[both].max() < 1e-3


# ------------------------------------------------------------------------------------------------------------- outputs


def test_out_is_written_in_place(rig):
    expected = rig.project("left", POINTS)
    for out in (
        np.full((40, 2), -1.0),
        np.full((2, 40), -1.0).T,
        np.full((40, 7), -1.0)[:, 1:5:3],
        np.full((40, 2), -1.0)[::-1],
    ):
        assert rig.project("left", POINTS, out=out) is out
        assert np.array_equal(out, expected)


# REQ-VIEW-003
@pytest.mark.parametrize(
    ("out", "message"),
    [
        (np.zeros((40, 2), dtype=np.float32), "float32"),
        (swapped(np.zeros((40, 2))), "byte"),
        (read_only(np.zeros((40, 2))), "read-only"),
        (misaligned(np.zeros((40, 2))), "aligned"),
        (np.zeros((39, 2)), "39|shape"),
        (np.zeros((40, 3)), "3|shape"),
        (np.zeros(80), "dimension|shape|ndim"),
        (np.broadcast_to(np.zeros(1), (40, 2)), "read-only"),
    ],
)
def test_an_unfit_output_is_refused_not_copied(rig, out, message):
    before = out.tobytes()
    with pytest.raises(sgrt.InvalidArgument, match=message):
        rig.project("left", POINTS, out=out)
    assert out.tobytes() == before


def test_an_output_that_is_no_array(rig):
    with pytest.raises(TypeError):
        rig.project("left", POINTS, out=[[0.0, 0.0]] * 40)


def test_zero_stride_output(rig):
    out = np.lib.stride_tricks.as_strided(np.zeros(2), shape=(40, 2), strides=(0, 8))
    with pytest.raises(sgrt.InvalidArgument, match="stride"):
        rig.project("left", POINTS, out=out)


# REQ-VIEW-003
def test_an_output_over_its_input(rig):
    memory = POINTS.copy()
    with pytest.raises(sgrt.InvalidArgument, match="overlap"):
        rig.project("left", memory, out=memory[:, :2])
    assert np.array_equal(memory, POINTS)


def test_distance_and_mask_write_in_place(reference):
    out = np.zeros(8000)
    assert sgrt.surface_distance(reference, reference, out=out) is out
    assert np.isfinite(out).mean() > 0.5
    assert np.nanmax(np.abs(out)) < 0.1
    mask = np.zeros(8000, dtype=np.uint8)
    assert sgrt.Roi.box((-50, -50, 0), (50, 50, 200)).mask(reference, out=mask) is mask
    assert 0 < mask.sum() < 8000
    with pytest.raises(sgrt.InvalidArgument, match="uint8"):
        sgrt.Roi.box((-50, -50, 0), (50, 50, 200)).mask(reference, out=np.zeros(8000, dtype=bool))


def test_poses_of_any_real_dtype(reference):
    for pose in (np.eye(4, dtype=int), np.eye(4, dtype=np.float32), swapped(np.eye(4)), np.eye(4).tolist()):
        assert sgrt.surface_distance(reference, reference, pose).shape == (8000,)
    for pose in (np.eye(3), np.eye(4, dtype=complex), np.zeros((2, 4, 4)), np.full((4, 4), "1")):
        with pytest.raises(sgrt.InvalidArgument, match="reference_from_live"):
            sgrt.surface_distance(reference, reference, pose)
