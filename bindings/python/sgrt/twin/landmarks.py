"""Landmarks of a phantom: the points where the mean curvature of the skin has a local extremum near a seed.

A convex cap (apex and alae of the nose, chin) is a maximum, a concave valley (nasion, the sulci, the inner
corners of the eyes) a minimum. The curvature is exact (analytic Hessian), so the extremum is found by
Newton on the skin to far below a micrometre.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np

from .checks import Array
from .closest import onto_skin

if TYPE_CHECKING:
    from .phantom import Phantom

SEARCH_FACETS = 4.0  # how far from its seed a landmark may lie, in facets of the phantom
STEP_FACETS = 0.055  # of the finite differences


@functools.lru_cache(maxsize=8)
def landmarks(phantom: Phantom) -> tuple[tuple[str, tuple[float, float, float]], ...]:
    """Name and position (body frame, mm) of every mark of the phantom."""
    found = []
    for name, seed, sign in phantom.marks:
        start = onto_skin(phantom, np.array([seed]), steps=30)[0]
        found.append((name, tuple(_extremum(phantom, start, float(sign)).tolist())))
    return tuple(found)


def _extremum(phantom: Phantom, start: Array, sign: float) -> Array:
    """Climb sign * mean curvature from `start`: hill climbing on shrinking rings, then Newton."""
    facet, x, radius = phantom.facet_mm, start, 0.5 * phantom.facet_mm
    turn = np.arange(12) * (2 * np.pi / 12)
    while radius > 0.03 * facet:
        ring = _around(phantom, x, radius * np.cos(turn), radius * np.sin(turn))
        candidates = np.vstack([x[None], ring])
        best = int(np.argmax(sign * phantom.curvature(candidates)[0]))
        x, radius = candidates[best], radius if best else 0.5 * radius
        if np.sum((x - start) ** 2) > (SEARCH_FACETS * facet) ** 2:
            raise ValueError(f"phantom {phantom.name} has no curvature extremum near {start}")
    for _ in range(20):
        step = _newton_step(phantom, x)
        x = _around(phantom, x, step[:1], step[1:])[0]
        if np.sum(step * step) < 1e-18:
            break
    return x


def _around(phantom: Phantom, x: Array, u: Array, v: Array) -> Array:
    """Points of the skin at tangential offsets (u, v), mm, from x."""
    n = phantom.normal(x[None])[0]
    helper = np.eye(3)[int(np.argmin(np.abs(n)))]
    e1 = np.cross(n, helper)
    e1 /= np.sqrt(e1 @ e1)
    return onto_skin(phantom, x + u[:, None] * e1 + v[:, None] * np.cross(n, e1), steps=6)


def _newton_step(phantom: Phantom, x: Array) -> Array:
    """The Newton step to a stationary point of the mean curvature, from fourth-order central differences."""
    h = STEP_FACETS * phantom.facet_mm
    k = np.array([-2.0, -1.0, 1.0, 2.0]) * h
    u = np.concatenate([k, 0 * k, [0.0], k, -k])
    v = np.concatenate([0 * k, k, [0.0], k, k])
    mean = phantom.curvature(_around(phantom, x, u, v))[0]
    first = np.array([1.0, -8.0, 8.0, -1.0]) / (12 * h)
    second = np.array([-1.0, 16.0, 16.0, -1.0]) / (12 * h * h)
    centre = 30.0 / (12 * h * h) * mean[8]
    gradient = np.array([first @ mean[0:4], first @ mean[4:8]])
    uu, vv = second @ mean[0:4] - centre, second @ mean[4:8] - centre
    uv = (second @ mean[9:13] - second @ mean[13:17]) / 4
    return np.clip(-np.linalg.solve(np.array([[uu, uv], [uv, vv]]), gradient), -5 * h, 5 * h)
