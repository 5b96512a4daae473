"""A laser scanner: a fan of light turned by a motor mirror, one camera, stripes with exact truth.

The fan meets the skin where N'(a) . X = d'(a), the fan's plane mirrored at the mirror's plane; a pixel that sees the
skin point X gets exp(-(N'.X - d')^2 / 2 w^2) of the laser's light, w the fan's half thickness, times the skin's
albedo and the angles' cosine, where the mirror lights it. The true centre of a row is the root of N'.X = d' along it.
Theory: docs/theory/twin.md.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .camera import Camera, into_frame
from .checks import Array
from .phantom import Phantom
from .raycast import DONE_MM, sees
from .render import cast
from .rig import rig_json
from .sensor import Sensor, stream

Vector = tuple[float, float, float]
COARSE_PX = 12  # between the rays that look for the stripe
REACH_SIGMAS = 5.0


@dataclass(frozen=True)
class Mirror:
    """The reflected-plane model of docs/formats.md: unit vectors, mm, rad, room axes."""

    fan_point: Vector
    fan_normal: Vector
    axis_point: Vector
    axis_direction: Vector
    normal_at_zero: Vector
    offset_mm: float = 0.0
    angle_scale: float = 1.0
    angle_zero_rad: float = 0.0

    def plane(self, reading: float) -> tuple[Array, float]:
        """N' (3,) and d' of the light plane N'.x = d' at a mirror reading."""
        u, n = np.array(self.axis_direction), np.array(self.normal_at_zero)
        a = self.angle_scale * (reading - self.angle_zero_rad)
        n = n * np.cos(a) + np.cross(u, n) * np.sin(a) + u * (u @ n) * (1 - np.cos(a))
        p, fan = np.array(self.fan_point), np.array(self.fan_normal)
        image = p - 2 * (n @ (p - np.array(self.axis_point)) - self.offset_mm) * n
        normal = fan - 2 * (fan @ n) * n
        return normal, float(normal @ image)


class Stripe(NamedTuple):
    """image: (H, W). centre: (H,), the stripe's column in each row, NaN: no lit skin there. points: (H, 3), mm."""

    image: np.ndarray
    centre: Array
    points: Array


def _unit(v: ArrayLike) -> Vector:
    a = np.asarray(v, np.float64)
    return tuple((a / np.sqrt(np.sum(a * a))).tolist())


def default_mirror(seed: int = 0, base_mm: float = 600.0, height_mm: float = 2000.0) -> Mirror:
    """A unit `base_mm` beside a camera at `height_mm` over the isocentre, with a fitter's small errors of `seed`."""
    rng = stream(seed, "laser", "mirror")
    place = np.array([base_mm, 0.0, height_mm])
    down = -np.array(_unit(place))
    normal = down - np.array([-1.0, 0.0, 0.0])  # of the mirror that turns light along -X towards the isocentre
    tilt = rng.normal(0.0, 0.004, (3, 3))
    return Mirror(
        fan_point=tuple((place + rng.normal(0.0, 1.0, 3)).tolist()),
        fan_normal=_unit([0.0, 0.0, 1.0] + tilt[0]),
        axis_point=tuple(place.tolist()),
        axis_direction=_unit([0.0, 1.0, 0.0] + tilt[1]),
        normal_at_zero=_unit(_unit(normal) + tilt[2]),
        offset_mm=float(rng.normal(1.5, 0.5)),
    )


@dataclass(frozen=True)
class Scanner:
    """A camera and a mirror. thickness_mm: w above. exposure: share of the full well of a bright stripe."""

    camera: Camera
    mirror: Mirror
    sensor: Sensor = field(default_factory=Sensor)
    thickness_mm: float = 1.2
    exposure: float = 0.6
    ambient: float = 0.02
    id: str = "scanner"

    def with_mirror(self, mirror: Mirror) -> Scanner:
        return replace(self, mirror=mirror)

    def rig_json(self, mirror: Mirror | None = None) -> str:
        """The true camera and unit (or another) as rig.json text."""
        m = mirror or self.mirror
        rig = json.loads(rig_json(f"twin-{self.id}", [self.camera], {}, {"source": "simulated laser scanner"}))
        rig["lasers"] = [
            {
                "id": self.id,
                "camera": self.camera.id,
                "fan": {"point": m.fan_point, "normal": m.fan_normal},
                "mirror": {
                    "axis_point": m.axis_point,
                    "axis_direction": m.axis_direction,
                    "normal_at_zero": m.normal_at_zero,
                    "offset_mm": m.offset_mm,
                    "angle_scale": m.angle_scale,
                    "angle_zero_rad": m.angle_zero_rad,
                },
            }
        ]
        return json.dumps(rig, indent=1) + "\n"

    def capture(
        self, phantom: Phantom, reading: float, room_from_body: ArrayLike | None = None, *, seed: int | None = 0
    ) -> Stripe:
        """Expose one frame. seed: of the noise, None for the expected image, float32 electrons."""
        pose = np.eye(4) if room_from_body is None else checks.pose("room_from_body", room_from_body)
        plane = self.mirror.plane(reading)
        width, height = self.camera.image_size
        electrons = np.full((height, width), self.ambient * self.sensor.full_well_e, np.float32)
        rough = self._crossings(phantom, pose, plane)
        centre, points = np.full(height, np.nan), np.full((height, 3), np.nan)
        rows = np.flatnonzero(np.isfinite(rough))
        if rows.size:
            centre[rows], points[rows] = self._refine(phantom, pose, plane, rows, rough[rows])
            self._light(phantom, pose, plane, rows, rough[rows], electrons)
        if seed is None:
            return Stripe(electrons, centre, points)
        rng = stream(seed, self.camera.id, f"laser {reading:.9f}")
        return Stripe(self.sensor.expose(electrons, self.camera.offset_counts, rng), centre, points)

    def _hits(self, phantom: Phantom, pose: Array, u: Array, v: Array) -> tuple[Array, Array, Array]:
        """Room points (N, 3), NaN where there is no skin, and the body's points and normals alike."""
        x, y = self.camera.ray(u, v)
        hit = cast(self.camera, phantom, pose, x, y, DONE_MM)
        out = [np.full((u.size, 3), np.nan) for _ in range(3)]
        out[0][hit.hits] = np.stack(into_frame(tuple(pose.ravel().tolist()), *hit.points), axis=-1)
        out[1][hit.hits] = np.stack(hit.points, axis=-1)
        out[2][hit.hits] = np.stack(hit.normals, axis=-1)
        return out[0], out[1], out[2]

    def _crossings(self, phantom: Phantom, pose: Array, plane: tuple[Array, float]) -> Array:
        """Column, a few px wide of the truth, where each row crosses the light plane; NaN where it does not."""
        width, height = self.camera.image_size
        u = np.arange(0.0, width, COARSE_PX)
        v = np.arange(0.0, height)
        grid = np.meshgrid(u, v)
        x = self._hits(phantom, pose, grid[0].ravel(), grid[1].ravel())[0]
        e = (x @ plane[0] - plane[1]).reshape(v.size, u.size)
        with np.errstate(invalid="ignore"):
            turns = e[:, :-1] * e[:, 1:] <= 0
        rough = np.full(height, np.nan)
        rows = np.flatnonzero(turns.any(axis=1))
        cell = np.argmax(turns[rows], axis=1)
        a, b = e[rows, cell], e[rows, cell + 1]
        rough[rows] = u[cell] + COARSE_PX * a / (a - b)
        return rough

    def _refine(
        self, phantom: Phantom, pose: Array, plane: tuple[Array, float], rows: np.ndarray, rough: Array
    ) -> tuple[Array, Array]:
        """Secant steps to the root; NaN where the mirror does not light it."""
        v = rows.astype(np.float64)
        low, high = rough - 0.5, rough + 0.5

        def error(u: Array) -> Array:
            return self._hits(phantom, pose, u, v)[0] @ plane[0] - plane[1]

        a, b = error(low), error(high)
        for _ in range(6):
            with np.errstate(invalid="ignore", divide="ignore"):
                step = np.where(b != a, b * (high - low) / (b - a), 0.0)
            low, a = high, b
            high = high - np.clip(step, -2.0, 2.0)
            b = error(high)
        room, body, normal = self._hits(phantom, pose, high, v)
        good = (np.abs(b) < 1e-6) & self._lit(phantom, pose, body, normal)
        return np.where(good, high, np.nan), np.where(good[:, None], room, np.nan)

    def _lit(self, phantom: Phantom, pose: Array, body: Array, normal: Array) -> np.ndarray:
        source = pose[:3, :3].T @ (np.array(self.mirror.axis_point) - pose[:3, 3])
        lit = np.zeros(len(body), bool)
        seen = np.flatnonzero(np.isfinite(body[:, 0]))
        if seen.size:
            lit[seen] = sees(phantom, tuple(body[seen].T), tuple(normal[seen].T), source)  # type: ignore[arg-type]
        return lit

    def _light(
        self,
        phantom: Phantom,
        pose: Array,
        plane: tuple[Array, float],
        rows: np.ndarray,
        rough: Array,
        electrons: np.ndarray,
    ) -> None:
        """Adds the stripe's expected light to the pixels about it."""
        width = self.camera.image_size[0]
        reach = 16
        u = np.rint(rough)[:, None] + np.arange(-reach, reach + 1)
        v = np.broadcast_to(rows[:, None].astype(np.float64), u.shape)
        inside = (u >= 0) & (u < width)
        u, v = u[inside], v[inside]
        room, body, normal = self._hits(phantom, pose, u, v)
        e = room @ plane[0] - plane[1]
        to_light = np.array(self.mirror.axis_point) - room
        turned = normal @ pose[:3, :3].T
        cosine = np.sum(turned * to_light, axis=1) / np.sqrt(np.sum(to_light * to_light, axis=1))
        albedo = np.asarray(phantom.reflectance(*body.T))
        light = np.exp(-0.5 * (e / self.thickness_mm) ** 2) * np.maximum(cosine, 0.0) * albedo / 0.6
        light *= self.exposure * self.sensor.full_well_e
        good = np.isfinite(light) & self._lit(phantom, pose, body, normal)
        electrons[v[good].astype(int), u[good].astype(int)] += light[good].astype(np.float32)


def board_corners(camera: Camera, room_from_board: Array, points: Array) -> Array:
    """Pixels (N, 2) of a board's points (N, 3)."""
    return camera.project(points @ room_from_board[:3, :3].T + room_from_board[:3, 3])


def board_stripe(camera: Camera, plane: tuple[Array, float], room_from_board: Array, rows: Array) -> Array:
    """Columns at which rows of the image see the light plane on a flat board's plane, exactly (NaN: nowhere)."""
    n, origin = room_from_board[:3, 2], room_from_board[:3, 3]
    # The line that board and light share, projected; then the root of each row by bisection along it.
    direction = np.cross(n, plane[0])
    direction /= np.sqrt(np.sum(direction * direction))
    point = np.linalg.solve(np.stack([n, plane[0], direction]), [n @ origin, plane[1], direction @ origin])
    low, high = np.full(len(rows), -2000.0), np.full(len(rows), 2000.0)

    def place(t: Array) -> Array:
        return camera.project(point + t[:, None] * direction)

    flip = np.sign(place(high)[:, 1] - place(low)[:, 1])
    for _ in range(60):
        middle = (low + high) / 2
        below = flip * (place(middle)[:, 1] - rows) < 0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    out = place((low + high) / 2)
    return np.where(np.abs(out[:, 1] - rows) < 1e-6, out[:, 0], np.nan)
