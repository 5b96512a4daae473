"""Nearest point of the skin, signed distance and uniform samples: the truth for a reconstruction.

The foot of p is the fixed point of: cut p's perpendicular with the tangent plane at the present guess, pull
the result back onto the skin along the gradient. It converges linearly with the ratio distance x curvature;
a step that does not shorten the distance is halved.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from .checks import Array

if TYPE_CHECKING:
    from .phantom import Phantom

GUESS_RESOLUTION_MM = 4.0
ROUNDS = 60
DONE_MM = 1e-7  # of the foot's tangential error; the distance's own error is its square


@functools.lru_cache(maxsize=8)
def _guess(phantom: Phantom) -> cKDTree:
    return cKDTree(phantom.mesh(GUESS_RESOLUTION_MM)[0])


def closest_points(phantom: Phantom, points: Array) -> Array:
    """Nearest points of the skin (N, 3); rows that are not finite give NaN."""
    feet = np.full(points.shape, np.nan)
    finite = np.all(np.isfinite(points), axis=1)
    p = points[finite]
    if p.size == 0:
        return feet
    x = _guess(phantom).data[_guess(phantom).query(p)[1]]
    active, scale = np.arange(len(p)), np.ones(len(p))
    for _ in range(ROUNDS):
        here, target = x[active], p[active]
        n = phantom.normal(here)
        gap = target - here
        tangent = gap - np.sum(gap * n, axis=1, keepdims=True) * n
        tried = onto_skin(phantom, here + scale[active, None] * tangent)
        better = np.sum((target - tried) ** 2, axis=1) < np.sum(gap * gap, axis=1)
        x[active[better]] = tried[better]
        scale[active] = np.where(better, np.minimum(1.0, 1.5 * scale[active]), 0.5 * scale[active])
        active = active[(np.sum(tangent**2, axis=1) > DONE_MM**2) & (scale[active] > 1e-9)]
        if active.size == 0:
            break
    feet[finite] = x
    return feet


def onto_skin(phantom: Phantom, points: Array, steps: int = 4) -> Array:
    """Follow the gradient from points near the skin to F = 0."""
    x, y, z = (np.array(points[:, i]) for i in range(3))
    for _ in range(steps):
        f, gx, gy, gz = phantom.field(x, y, z)
        step = f / (gx * gx + gy * gy + gz * gz)
        x -= step * gx
        y -= step * gy
        z -= step * gz
    return np.stack([x, y, z], axis=-1)


def signed_distance(phantom: Phantom, points: Array) -> Array:
    """Distance to the skin, mm, positive outside; shape (N,)."""
    gap = points - closest_points(phantom, points)
    return np.copysign(np.sqrt(np.sum(gap * gap, axis=1)), phantom.value(points))


def sample_surface(phantom: Phantom, count: int, seed: int) -> tuple[Array, Array]:
    """Points (count, 3) uniform over the skin's area and their outward normals (count, 3)."""
    vertices, faces = phantom.mesh(GUESS_RESOLUTION_MM)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = 0.5 * np.sqrt(np.sum(np.cross(b - a, c - a) ** 2, axis=1))
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *b"surface"])))
    heap = np.cumsum(area)
    pick = np.minimum(np.searchsorted(heap, rng.random(count) * heap[-1], side="right"), area.size - 1)
    u, v = rng.random(count), rng.random(count)
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    flat = a[pick] + u[:, None] * (b - a)[pick] + v[:, None] * (c - a)[pick]
    on_skin = onto_skin(phantom, flat, steps=5)
    return on_skin, phantom.normal(on_skin)
