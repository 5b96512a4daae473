"""A triangle mesh of a phantom: rays from its spine (a segment along y, closed by two half spheres of
directions), each cut with the skin by safeguarded Newton. Vertices lie on the skin to rounding error;
triangles do not, so the mesh is a first guess and an occluder, never the truth."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np

from .checks import Array

if TYPE_CHECKING:
    from .phantom import Phantom

REACH_MM = 500.0
GUESS_MM = 100.0
ROUNDS = 60
DONE_MM = 1e-9


@functools.lru_cache(maxsize=8)
def mesh(phantom: Phantom, resolution_mm: float) -> tuple[Array, np.ndarray]:
    """Vertices (V, 3) and outward triangles (T, 3) int32, read-only."""
    origins, directions, rows, columns = _rays(phantom, resolution_mm)
    vertices = origins + _reach(phantom, origins, directions)[:, None] * directions
    i = np.arange(rows * columns).reshape(rows, columns)
    right = np.roll(i, -1, axis=1)
    a, b, c, d = i[:-1], right[:-1], right[1:], i[1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    faces = faces.astype(np.int32)
    vertices.flags.writeable = faces.flags.writeable = False
    return vertices, faces


def _rays(phantom: Phantom, resolution_mm: float) -> tuple[Array, Array, int, int]:
    """Origins and directions, row by row from the foot end to the head end."""
    low, high, z = phantom.spine
    radius = float(np.max(_reach(phantom, *_belt(phantom))))
    cap = np.linspace(0.0, np.pi / 2, max(8, round(0.5 * np.pi * radius / resolution_mm)) + 1)
    along = np.linspace(low, high, max(2, round((high - low) / resolution_mm)) + 1)[1:-1]
    y = np.concatenate([np.full(cap.size, low), along, np.full(cap.size, high)])
    tilt = np.concatenate([cap - np.pi / 2, np.zeros(along.size), cap])
    columns = max(16, round(2 * np.pi * radius / resolution_mm))
    turn = np.arange(columns) * (2 * np.pi / columns)
    shape = (y.size, columns)
    direction = np.stack(
        [
            np.cos(tilt)[:, None] * np.sin(turn),
            np.broadcast_to(np.sin(tilt)[:, None], shape),
            np.cos(tilt)[:, None] * np.cos(turn),
        ],
        axis=-1,
    )
    origin = np.zeros((*shape, 3))
    origin[..., 1], origin[..., 2] = y[:, None], z
    return origin.reshape(-1, 3), direction.reshape(-1, 3), *shape


def _belt(phantom: Phantom) -> tuple[Array, Array]:
    low, high, z = phantom.spine
    y, turn = np.meshgrid(np.linspace(low, high, 9), np.linspace(0, 2 * np.pi, 16, endpoint=False))
    origins = np.stack([np.zeros(y.size), y.ravel(), np.full(y.size, z)], axis=-1)
    return origins, np.stack([np.sin(turn.ravel()), np.zeros(y.size), np.cos(turn.ravel())], axis=-1)


def _reach(phantom: Phantom, origins: Array, directions: Array) -> Array:
    """Distance from each origin along its direction to the skin, mm: Newton inside a shrinking bracket."""
    o, d = np.ascontiguousarray(origins.T), np.ascontiguousarray(directions.T)
    low, high = np.zeros(o.shape[1]), np.full(o.shape[1], REACH_MM)
    t = np.full(o.shape[1], GUESS_MM)
    active = np.arange(t.size)
    for _ in range(ROUNDS):
        now, ray = t[active], d[:, active]
        f, *g = phantom.field(*(o[:, active] + now * ray))
        inside = f < 0.0
        low[active] = np.where(inside, now, low[active])
        high[active] = np.where(inside, high[active], now)
        slope = g[0] * ray[0] + g[1] * ray[1] + g[2] * ray[2]
        tried = now - f / np.where(slope > 1e-3, slope, 1e-3)
        ok = (tried > low[active]) & (tried < high[active])
        t[active] = np.where(ok, tried, 0.5 * (low[active] + high[active]))
        active = active[np.abs(t[active] - now) > DONE_MM]
        if active.size == 0:
            break
    return t
