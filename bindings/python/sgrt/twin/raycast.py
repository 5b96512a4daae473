"""First hits and shadows: embree on a mesh gives the guess, Newton on the analytic function the exact hit.

Everything here is in the body frame, with coordinates in separate arrays (x, y, z), mm.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

from .checks import Array

if TYPE_CHECKING:
    from .phantom import Phantom

XYZ = tuple[Array, Array, Array]

MISS = 1e30
LIFT_MM = 0.5  # shadow rays start this far off the skin: above the mesh's own facets (sagitta h^2 / 8R)
NEWTON_STEPS = 25
DONE_MM = 1e-10
STRAY_MM = 10.0  # a hit that Newton moves further than this was another fold of the skin


@functools.lru_cache(maxsize=4)
def scene(phantom: Phantom) -> rtcore_scene.EmbreeScene:
    """The embree scene of the phantom's mesh, built once a process."""
    vertices, faces = phantom.mesh(phantom.facet_mm)
    built = rtcore_scene.EmbreeScene()
    TriangleMesh(built, vertices.astype(np.float32), np.array(faces))
    built.run(np.full((1, 3), 1e4, np.float32), np.array([[0, 0, 1]], np.float32))  # commits the scene
    return built


def first_hit(phantom: Phantom, origin: Array, d: XYZ, done_mm: float = DONE_MM) -> tuple[Array, np.ndarray, XYZ]:
    """Cast rays origin + t d (unit d) and refine the hits.

    Returns t (N,) (NaN where nothing was hit), the indices (M,) of the hits, and the gradient of F at them
    (each (M,)). Newton runs until its step is below `done_mm` (it squares the error, so a step of 1e-4 mm
    leaves less than 1e-8 mm); a ray that does not get there within 25 steps (it grazes the skin) has no hit.
    """
    start = np.empty((d[0].size, 3), np.float32)
    start[:] = origin
    found = scene(phantom).run(start, np.stack(d, axis=-1).astype(np.float32), query="DISTANCE")
    t = np.full(d[0].size, np.nan)
    hits = np.flatnonzero(found < MISS)
    if hits.size == 0:
        return t, hits, tuple(np.empty(0) for _ in range(3))  # type: ignore[return-value]
    dx, dy, dz = (axis[hits] for axis in d)
    at = found[hits].astype(np.float64)
    guess = at.copy()
    step, *gradient = _newton(phantom, origin, at, dx, dy, dz)
    at -= step
    active = np.flatnonzero(np.abs(step) > done_mm)
    for _ in range(NEWTON_STEPS):
        if active.size == 0:
            break
        step, *piece = _newton(phantom, origin, at[active], dx[active], dy[active], dz[active])
        at[active] -= step
        for whole, part in zip(gradient, piece, strict=True):
            whole[active] = part
        active = active[np.abs(step) > done_mm]
    good = np.abs(at - guess) < STRAY_MM
    good[active] = False
    hits = hits[good]
    t[hits] = at[good]
    return t, hits, tuple(g[good] for g in gradient)  # type: ignore[return-value]


def _newton(
    phantom: Phantom, origin: Array, t: Array, dx: Array, dy: Array, dz: Array
) -> tuple[Array, Array, Array, Array]:
    """The Newton step at t along each ray, mm, and the gradient there; F must fall along the ray."""
    f, gx, gy, gz = phantom.field(origin[0] + t * dx, origin[1] + t * dy, origin[2] + t * dz)
    slope = np.minimum(gx * dx + gy * dy + gz * dz, -1e-12)
    return np.clip(f / slope, -2.0, 2.0), gx, gy, gz  # type: ignore[return-value]


def sees(phantom: Phantom, points: XYZ, normals: XYZ, target: Array) -> np.ndarray:
    """True where the skin point faces `target` (3,) and nothing of the body lies between; shape (N,)."""
    d = tuple(target[i] - points[i] for i in range(3))
    facing = d[0] * normals[0] + d[1] * normals[1] + d[2] * normals[2] > 0.0
    index = np.flatnonzero(facing)
    clear = np.zeros(points[0].size, dtype=bool)
    if index.size:
        length = np.sqrt(sum(axis[index] ** 2 for axis in d))
        origin = np.stack([points[i][index] + LIFT_MM * normals[i][index] for i in range(3)], axis=-1)
        direction = np.stack([axis[index] / length for axis in d], axis=-1)
        blocked = scene(phantom).run(origin.astype(np.float32), direction.astype(np.float32), query="OCCLUDED")
        clear[index] = blocked < 0
    return clear
