"""The couch turned: a reference as it stands in the room when the couch is not at 0."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import Roi, Surface
from .errors import InvalidArgument
from .frames import fixed_from_couch

_ROWS = [[0, 1, 2], [1, 3, 4], [2, 4, 5]]  # xx xy xz yy yz zz as a matrix
_SIX = ([0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2])


def _turn(rotation: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    turned: NDArray[np.float64] = np.einsum(
        "ij,...j->...i", rotation, vectors
    )  # no BLAS: the same bits at any thread count
    return turned


def turn_surface(surface: Surface, *, couch_deg: float, isocentre_mm: ArrayLike) -> Surface:
    """A surface captured with the couch at 0, turned with the couch about the vertical axis through the isocentre.

    couch_deg: counter-clockwise seen from above (IEC 61217 patient support). Normals, covariance and modes turn with
    it.
    """
    rotation = fixed_from_couch(couch_deg)[:3, :3]
    isocentre = np.asarray(isocentre_mm, dtype=np.float64)
    covariance = surface.covariance
    if covariance is not None:
        turned = np.einsum("ij,...jk,lk->...il", rotation, covariance[..., _ROWS], rotation)
        covariance = turned[..., _SIX[0], _SIX[1]]
    return Surface(
        _turn(rotation, surface.points - isocentre) + isocentre,
        normals=None if surface.normals is None else _turn(rotation, surface.normals),
        sigma_mm=surface.sigma_mm,
        covariance=covariance,
        faces=surface.faces,
        modes=None if surface.modes is None else _turn(rotation, surface.modes),
        correlation_points=surface.correlation_points,
    )


def turn_roi(roi: Roi, *, couch_deg: float, isocentre_mm: ArrayLike) -> Roi:
    """A polygon, turned as turn_surface turns the reference that it was drawn on; a box cannot: InvalidArgument."""
    if roi.polygon_xy_mm is None:
        raise InvalidArgument("a box cannot turn with the couch; give a polygon")
    isocentre = np.asarray(isocentre_mm, dtype=np.float64)[:2]
    rotation = fixed_from_couch(couch_deg)[:2, :2]
    return Roi.polygon(_turn(rotation, roi.polygon_xy_mm - isocentre) + isocentre)
