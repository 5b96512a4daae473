"""Arrays outlive their handle, contexts are collected, lent memory cannot be written."""

import gc
import json
import weakref

import numpy as np
import pytest
import sgrt
from conftest import ISOCENTRE, body_points, rig_document


def churn():
    """Overwrites freed memory, so that a dangling array would show."""
    gc.collect()
    for _ in range(20):
        np.full(60_000, np.nan)


# REQ-PY-003
def test_arrays_keep_their_surface():
    points = body_points(20_000, 1)
    surface = sgrt.Surface(points, sigma_mm=np.ones(20_000))
    died = weakref.ref(surface)
    lent, part = surface.points, surface.points[::7]
    del surface
    churn()
    assert died() is not None
    assert np.array_equal(lent, points)
    del lent
    churn()
    assert np.array_equal(part, points[::7])
    del part
    gc.collect()
    assert died() is None


# REQ-PY-003
def test_lent_memory_is_read_only_and_not_copied(reference):
    a, b = reference.points, reference.points
    assert a.ctypes.data == b.ctypes.data
    assert not a.flags.owndata
    with pytest.raises(ValueError, match="read-only"):
        a[0] = 0
    with pytest.raises(ValueError, match="WRITEABLE"):
        a.setflags(write=True)
    assert memoryview(a).readonly


def test_results_keep_their_arrays(reference, live, stereo):
    result = sgrt.icp_align(reference, live, isocentre_mm=ISOCENTRE)
    distance, copy = result.distance_mm, result.distance_mm.copy()
    del result
    churn()
    assert np.array_equal(distance, copy, equal_nan=True)


def test_stereo_arrays(rig, images):
    result = sgrt.stereo_match(rig, "pod1", *images)
    surface, correlation, copies = (
        result.surface,
        result.correlation,
        (result.surface.points.copy(), result.correlation.copy()),
    )
    del result
    churn()
    assert np.array_equal(surface.points, copies[0], equal_nan=True)
    assert np.array_equal(correlation, copies[1], equal_nan=True)


def test_a_result_of_an_error(rig):
    grey = np.zeros((240, 320), dtype=np.uint8)
    try:
        sgrt.stereo_match(rig, "pod1", grey, grey)
    except sgrt.NotFound as error:
        reason = error.result.reason
    churn()
    assert (reason != 0).all()


def test_surfaces_copy_their_input():
    points = body_points(100, 1)
    surface = sgrt.Surface(points)
    expected = points.copy()
    points[:] = 0
    assert np.array_equal(surface.points, expected)


def test_a_context_in_its_own_callback_is_collected():
    def make():
        def progress(fraction, stage):
            return context is None

        context = sgrt.Context(progress=progress)
        return weakref.ref(context)

    died = make()
    gc.collect()
    assert died() is None


def test_a_session_outlives_its_rig(images):
    rig = sgrt.Rig(json.dumps(rig_document()))
    session = sgrt.StereoSession(rig, "pod1")
    del rig
    churn()
    assert session.push(*images, time_s=0.0).point_count > 1000


def test_many_calls_do_not_grow(reference):
    def resident() -> int:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096

    def work():
        surface = sgrt.Surface(reference.points, normals=reference.normals)
        sgrt.surface_distance(surface, surface)
        with pytest.raises(sgrt.InvalidArgument):
            sgrt.Surface(np.zeros((3, 2)))
        with pytest.raises(sgrt.InsufficientData) as error:
            sgrt.icp_align(surface, sgrt.Surface(np.zeros((3, 3))), isocentre_mm=(0, 0, 0))
        del error

    for _ in range(20):
        work()
    before = resident()
    for _ in range(100):
        work()
    assert resident() - before < 8e6
