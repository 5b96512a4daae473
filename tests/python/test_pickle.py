"""Handles travel: Surface by its arrays, Rig by JSON, Roi by its numbers; sessions and contexts do not."""

import copy
import pickle

import numpy as np
import pytest
import sgrt


@pytest.mark.parametrize("travel", [lambda x: pickle.loads(pickle.dumps(x)), copy.copy, copy.deepcopy])
def test_surface(reference, stereo, travel):
    mesh = sgrt.Surface(
        np.eye(3),
        faces=np.array([[0, 1, 2]], dtype=np.int32),
        modes=np.ones((2, 3, 3)),
        correlation_points=9,
    )
    for surface in (reference, stereo.surface, mesh):
        twin = travel(surface)
        assert twin.grid_shape == surface.grid_shape
        assert twin.correlation_points == surface.correlation_points
        for name in ("points", "normals", "sigma_mm", "covariance", "faces", "modes"):
            a, b = getattr(surface, name), getattr(twin, name)
            if a is None:
                assert b is None
            else:
                assert a.dtype == b.dtype
                assert np.array_equal(a, b, equal_nan=True), name


def test_rig(rig):
    assert pickle.loads(pickle.dumps(rig)).to_json() == rig.to_json()


def test_roi(reference):
    for roi in (sgrt.Roi.polygon([[-50, -50], [50, -60], [0, 70.5]]), sgrt.Roi.box((-50, -50, 0), (50, 40, 200))):
        twin = pickle.loads(pickle.dumps(roi))
        assert np.array_equal(twin.mask(reference), roi.mask(reference))


def test_shifts():
    for shift in (sgrt.PatientDisplacement(lat_mm=1.5, rtn_deg=-2), sgrt.CouchCorrection(vrt_mm=3, mag_mm=3)):
        assert pickle.loads(pickle.dumps(shift)) == shift


def test_errors():
    error = pickle.loads(pickle.dumps(sgrt.NotFound("nothing there")))
    assert isinstance(error, sgrt.NotFound)
    assert (str(error), error.status, error.result) == ("nothing there", 13, None)


def test_what_has_state_does_not(rig):
    for thing in (sgrt.Context(), sgrt.StereoSession(rig, "pod1")):
        with pytest.raises(TypeError, match="pickle"):
            pickle.dumps(thing)
