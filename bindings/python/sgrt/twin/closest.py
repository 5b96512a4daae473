"""Nearest point of the skin, signed distance and uniform samples: the truth for a reconstruction.

The foot x of p solves x + m grad F(x) = p, F(x) = 0. From the nearest vertex of a mesh: move to the foot
of p on the tangent plane and back onto the skin, by half as much where that does not shorten the distance.
A point that is not there after 12 rounds takes Newton steps on the four equations, if they lead no further
away. Far off (beyond the radius of a hollow) the foot can be a local one.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from .checks import Array

if TYPE_CHECKING:
    from .phantom import Phantom

SAMPLING_FACET_MM = 4.0
ROUNDS = 12
POLISHING_STEPS = 6
DONE_MM = 1e-7  # of the foot's tangential error; the distance's own error is its square


@functools.lru_cache(maxsize=8)
def _guess(phantom: Phantom) -> cKDTree:
    return cKDTree(phantom.mesh(phantom.facet_mm)[0])


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
        tried = onto_skin(phantom, here + scale[active, None] * tangent, steps=2)
        better = np.sum((target - tried) ** 2, axis=1) < np.sum(gap * gap, axis=1)
        x[active[better]] = tried[better]
        scale[active] = np.where(better, np.minimum(1.0, 1.5 * scale[active]), 0.5 * scale[active])
        active = active[(np.sum(tangent**2, axis=1) > DONE_MM**2) & (scale[active] > 1e-9)]
        if active.size == 0:
            break
    if active.size:
        x[active] = _polished(phantom, p[active], x[active])
    feet[finite] = x
    return feet


def _polished(phantom: Phantom, p: Array, x: Array) -> Array:
    """Newton on x + m g(x) = p, F(x) = 0 from a foot x near the solution."""
    for _ in range(POLISHING_STEPS):
        f, g = phantom.value(x), phantom.gradient(x)
        m = np.sum((p - x) * g, axis=1) / np.sum(g * g, axis=1)
        system = np.zeros((len(p), 4, 4))
        system[:, :3, :3] = np.eye(3) + m[:, None, None] * phantom.hessian(x)
        system[:, :3, 3] = system[:, 3, :3] = g
        wanted = np.concatenate([p - x - m[:, None] * g, -f[:, None]], axis=1)
        regular = np.abs(np.linalg.det(system)) > 1e-9
        system[~regular] = np.eye(4)
        step = np.linalg.solve(system, wanted[..., None])[:, :3, 0]
        tried = onto_skin(phantom, x + np.clip(step, -1.0, 1.0))
        closer = np.sum((p - tried) ** 2, axis=1) <= np.sum((p - x) ** 2, axis=1)
        x = np.where((regular & closer)[:, None], tried, x)
    return x


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
    inside = phantom.value(np.where(np.isfinite(gap), points, 0.0)) < 0.0
    return np.where(inside, -1.0, 1.0) * np.sqrt(np.sum(gap * gap, axis=1))


def sample_surface(phantom: Phantom, count: int, seed: int) -> tuple[Array, Array]:
    """Points (count, 3) uniform over the skin's area and their outward normals (count, 3)."""
    vertices, faces = phantom.mesh(SAMPLING_FACET_MM)
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
