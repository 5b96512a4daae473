"""The phantom: a smooth closed body given by one analytic implicit function, exact anywhere.

    F(x) = -1/k log sum_i exp(-k F_i(x)) - sum_j A_j exp(-q_j(x)/2),     F_i = s_i/2 (q_i(x) - 1)

with q(x) = (x - c)^T W (x - c): a smooth union of ellipsoids (the trunk, the skull) plus Gaussian bumps and
dents (breasts, navel, nose, lips). F < 0 inside, the skin is F = 0, the outward normal is grad F / |grad F|.
F is infinitely differentiable; value, gradient and Hessian are written out below.
Theory: docs/theory/twin.md.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .checks import Array

CHUNK = 8192  # points a pass: the temporaries of a pass stay in the second-level cache
NEGLIGIBLE_Q = 80.0  # exp(-q/2) < 5e-18 beyond it


@dataclass(frozen=True)
class Blob:
    """One ellipsoid or one Gaussian: `size` is s_i of an ellipsoid or the amplitude A_j of a bump, mm.

    `axes` are semi-axes or sigmas, mm; `turn_deg` turns the axes about x, then y, then z of the body.
    """

    size: float
    centre: tuple[float, float, float]
    axes: tuple[float, float, float]
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @functools.cached_property
    def weight(self) -> Array:
        """W, shape (3, 3), 1/mm2."""
        rotation = np.eye(3)
        for axis, angle in enumerate(np.deg2rad(self.turn_deg)):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            turn = np.eye(3)
            turn[i, i] = turn[j, j] = np.cos(angle)
            turn[j, i] = np.sin(angle)
            turn[i, j] = -turn[j, i]
            rotation = turn @ rotation
        return rotation @ np.diag(1.0 / np.square(self.axes)) @ rotation.T

    def offset(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array, Array]:
        """Return q and the three components of W (x - c)."""
        w = self.weight
        dx, dy, dz = x - self.centre[0], y - self.centre[1], z - self.centre[2]
        if any(self.turn_deg):
            wx = w[0, 0] * dx + w[0, 1] * dy + w[0, 2] * dz
            wy = w[1, 0] * dx + w[1, 1] * dy + w[1, 2] * dz
            wz = w[2, 0] * dx + w[2, 1] * dy + w[2, 2] * dz
        else:
            wx, wy, wz = w[0, 0] * dx, w[1, 1] * dy, w[2, 2] * dz
        return dx * wx + dy * wy + dz * wz, wx, wy, wz


@dataclass(frozen=True)
class Phantom:
    """A body in its own frame (mm; x to the patient's left, y to the head, z to the front; origin at the
    isocentre).

    When the patient is set up perfectly the body frame is the room frame. `spine` is the segment along y (y
    from, y to, z) from which the body is star-shaped; the mesh is built on it, `facet_mm` is its pitch for
    the ray caster. `marks` are the seeds of the landmarks: name, point near it, and +1 for a convex cap or
    -1 for a concave valley.
    """

    name: str
    parts: tuple[Blob, ...]
    bumps: tuple[Blob, ...]
    sharpness: float
    spine: tuple[float, float, float]
    facet_mm: float = 3.0
    marks: tuple[tuple[str, tuple[float, float, float], int], ...] = ()
    albedo: float = 0.6
    texture: float = 0.0

    def __post_init__(self) -> None:
        checks.number("albedo", self.albedo, 0.0, 1.0)
        checks.number("texture", self.texture, 0.0, 0.5)

    @functools.cached_property
    def _key(self) -> int:
        return hash(tuple(self.__getstate__().values()))

    def __hash__(self) -> int:
        return self._key

    def __getstate__(self) -> dict:
        return {name: getattr(self, name) for name in self.__dataclass_fields__}

    def __setstate__(self, state: dict) -> None:
        self.__dict__.update(state)

    def field(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array, Array]:
        """F and its gradient for float64 coordinates of one shape (N,), body frame, mm."""
        out = tuple(np.empty(x.shape) for _ in range(4))
        for start in range(0, x.size, CHUNK):
            part = slice(start, start + CHUNK)
            for whole, piece in zip(out, self._field(x[part], y[part], z[part]), strict=True):
                whole[part] = piece
        return out  # type: ignore[return-value]

    def _field(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array, Array]:
        values, slopes = [], []
        for part in self.parts:
            q, wx, wy, wz = part.offset(x, y, z)
            values.append((0.5 * part.size) * (q - 1.0))
            slopes.append((wx, wy, wz))
        f, shares = self._union(values)
        gx, gy, gz = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
        for part, share, (wx, wy, wz) in zip(self.parts, shares, slopes, strict=True):
            share *= part.size
            gx += share * wx
            gy += share * wy
            gz += share * wz
        box = [(axis.min(), axis.max()) for axis in (x, y, z)]
        for bump in self.bumps:
            if _far(bump, box):
                continue
            q, wx, wy, wz = bump.offset(x, y, z)
            q *= -0.5
            e = np.exp(q, out=q)
            e *= bump.size
            f -= e
            gx += e * wx
            gy += e * wy
            gz += e * wz
        return f, gx, gy, gz

    def _union(self, values: list[Array]) -> tuple[Array, list[Array]]:
        """The smooth minimum of `values` and the share of each in it."""
        lowest = functools.reduce(np.minimum, values)
        shares = [np.exp(self.sharpness * (lowest - value)) for value in values]
        total = functools.reduce(np.add, shares)
        return lowest - np.log(total) / self.sharpness, [share / total for share in shares]

    def value(self, points: ArrayLike) -> Array:
        """F of points (N, 3), body frame, mm: negative inside, zero on the skin; shape (N,)."""
        p = checks.points("points", points)
        return self.field(*_columns(p))[0]

    def gradient(self, points: ArrayLike) -> Array:
        """Gradient of F at points (N, 3), body frame, mm; shape (N, 3)."""
        p = checks.points("points", points)
        return np.stack(self.field(*_columns(p))[1:], axis=-1)

    def normal(self, points: ArrayLike) -> Array:
        """Outward unit normal of the level surface through points (N, 3); shape (N, 3)."""
        g = self.gradient(points)
        return g / np.sqrt(np.sum(g * g, axis=1, keepdims=True))

    def hessian(self, points: ArrayLike) -> Array:
        """Second derivatives of F at points (N, 3), body frame, mm; shape (N, 3, 3)."""
        p = checks.points("points", points)
        x, y, z = _columns(p)
        values, slopes = [], []
        for part in self.parts:
            q, *w = part.offset(x, y, z)
            values.append(0.5 * part.size * (q - 1.0))
            slopes.append(part.size * np.stack(w, axis=-1))
        _, shares = self._union(values)
        mean = np.sum([share[:, None] * slope for share, slope in zip(shares, slopes, strict=True)], axis=0)
        total = self.sharpness * _outer(mean)
        for part, share, slope in zip(self.parts, shares, slopes, strict=True):
            total += share[:, None, None] * (part.size * part.weight - self.sharpness * _outer(slope))
        for bump in self.bumps:
            q, *w = bump.offset(x, y, z)
            e = bump.size * np.exp(-0.5 * q)
            total += e[:, None, None] * (bump.weight - _outer(np.stack(w, axis=-1)))
        return total

    def curvature(self, points: ArrayLike) -> tuple[Array, Array]:
        """Mean (1/mm) and Gaussian (1/mm2) curvature at points (N, 3) of the skin, convex positive; (N,)."""
        p = checks.points("points", points)
        g, h = self.gradient(p), self.hessian(p)
        length2 = np.sum(g * g, axis=1)
        along = np.einsum("ni,nij,nj->n", g, h, g)
        mean = (length2 * np.trace(h, axis1=1, axis2=2) - along) / (2.0 * length2**1.5)
        rows = h[:, 0], h[:, 1], h[:, 2]
        adjugate = np.stack(
            [np.cross(rows[1], rows[2]), np.cross(rows[2], rows[0]), np.cross(rows[0], rows[1])], axis=1
        )
        return mean, np.einsum("ni,nij,nj->n", g, adjugate, g) / length2**2

    def reflectance(self, x: Array, y: Array, z: Array) -> Array | float:
        """Albedo at body-frame coordinates (N,): constant, or in waves of 45 to 100 mm where textured."""
        if self.texture == 0.0:
            return self.albedo
        waves = ((0.07, 0.03, 0.02), (-0.03, 0.06, 0.05), (0.10, -0.09, 0.03), (0.02, 0.05, -0.08))
        total = sum(np.cos(a * x + b * y + c * z + n) for n, (a, b, c) in enumerate(waves))
        return self.albedo * (1.0 + 0.25 * self.texture * total)

    def mesh(self, resolution_mm: float = 3.0) -> tuple[Array, np.ndarray]:
        """Triangles with vertices on the skin: (V, 3) float64 mm, body frame, and (T, 3) int32, outward."""
        from .mesh import mesh

        return mesh(self, checks.number("resolution_mm", resolution_mm, 0.5, 50.0))

    def project(self, points: ArrayLike) -> Array:
        """The nearest points of the skin to points (N, 3), body frame, mm; shape (N, 3)."""
        from .closest import closest_points

        return closest_points(self, checks.points("points", points))

    def distance(self, points: ArrayLike) -> Array:
        """Signed distance, mm, of points (N, 3) to the skin, positive outside; (N,). NaN in, NaN out."""
        from .closest import signed_distance

        return signed_distance(self, checks.points("points", points))

    def sample_surface(self, count: int, seed: int) -> tuple[Array, Array]:
        """Uniform random points of the skin and outward unit normals, both (count, 3), mm, body frame."""
        from .closest import sample_surface

        return sample_surface(self, checks.integer("count", count, 1, 50_000_000), checks.integer("seed", seed))

    def landmarks(self) -> dict[str, Array]:
        """Landmark positions (3,), body frame, mm, by name: local extrema of the skin's mean curvature."""
        from .landmarks import landmarks

        return {name: np.array(point) for name, point in landmarks(self)}


def _columns(p: Array) -> tuple[Array, Array, Array]:
    return np.ascontiguousarray(p[:, 0]), np.ascontiguousarray(p[:, 1]), np.ascontiguousarray(p[:, 2])


def _outer(v: Array) -> Array:
    return v[:, :, None] * v[:, None, :]


def _far(bump: Blob, box: list[tuple[float, float]]) -> bool:
    """True where the bump is nil on the whole box."""
    axes = (max(bump.axes),) * 3 if any(bump.turn_deg) else bump.axes
    q = 0.0
    for c, sigma, (low, high) in zip(bump.centre, axes, box, strict=True):
        q += (max(low - c, 0.0, c - high) / sigma) ** 2
    return q > NEGLIGIBLE_Q
