"""A time-of-flight camera: expected taps of a scene, with shot noise, wiggling, flying pixels and motion.

    tap_k = (s + ambient) + contrast s g(phi - theta_k),  g(x) = cos x + h cos 3x,  phi = 4 pi f n d / c

summed over the sub-rays of a pixel, so that one on an edge mixes the light of both sides; s = power albedo
cos(incidence) (1 m / d)^2 electrons. Four taps alias the third harmonic into a range error that runs as
-sin 4 phi (the wiggling). Theory: docs/theory/twin.md.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .camera import Camera, ray_table, turned_back
from .checks import Array
from .phantom import Phantom
from .raycast import first_hit
from .rig import rig_json
from .sensor import stream

LIGHT_MM_S = 299_792_458e3
QUARTERS = (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi)
REFERENCE_MM = 1000.0

# (origin (3,), unit directions (N, 3)) of the room to range, cosine of the incidence and albedo, each (N,); a ray
# that meets nothing has range infinity.
Scene = Callable[[Array, Array], tuple[Array, Array, Array]]


@dataclass(frozen=True)
class TofCamera:
    """One time-of-flight unit.

    power_e: electrons of light a tap collects from a white surface that faces the camera at 1 m. ambient_e: electrons
    of other light. contrast: of the demodulation. wiggle: h above. sub: sub-rays a pixel and axis. full_well_counts:
    taps are clipped there.
    """

    camera: Camera
    id: str = "tof0"
    modulation_hz: tuple[float, ...] = (20e6,)
    tap_phase_rad: tuple[float, ...] = QUARTERS
    power_e: float = 40_000.0
    ambient_e: float = 2_000.0
    contrast: float = 0.8
    wiggle: float = 0.0
    read_noise_e: float = 20.0
    electrons_per_count: float = 4.0
    refractive_index: float = 1.00027
    full_well_counts: int = 60_000
    sub: int = 1

    @property
    def phase_per_mm(self) -> Array:
        """rad of each frequency."""
        return 4.0 * np.pi * np.array(self.modulation_hz) * self.refractive_index / LIGHT_MM_S

    def rig_json(self, rig_id: str = "twin-tof", **extra: object) -> str:
        """The true unit as rig.json text; `extra` goes into its entry."""
        rig = json.loads(rig_json(rig_id, [self.camera], {}, {"source": "simulated room", "truth": True}))
        entry: dict[str, object] = {
            "id": self.id,
            "camera": self.camera.id,
            "modulation_hz": list(self.modulation_hz),
            "tap_phase_rad": list(self.tap_phase_rad),
            "taps": "single",
            "electrons_per_count": self.electrons_per_count,
            "read_noise_e": self.read_noise_e,
            "refractive_index": self.refractive_index,
        }
        rig["tofs"] = [entry | extra]
        return json.dumps(rig, indent=1, allow_nan=False) + "\n"

    def rays(self, sub: int = 1) -> tuple[Array, Array]:
        """Centre (3,) and unit directions (H, sub, W, sub, 3), room frame; sub = 1: the pixels' centres."""
        fine = _finer(self.camera, sub)
        x, y = ray_table(fine)
        d = np.stack(turned_back(fine.camera_from_room, x, y, np.ones_like(x)), axis=-1)
        d /= np.linalg.norm(d, axis=-1, keepdims=True)
        width, height = self.camera.image_size
        return fine.centre, d.reshape(height, sub, width, sub, 3)

    def truth(self, scene: Scene) -> Array:
        """Range along the rays of the pixels' centres, (H, W), mm; NaN where there is nothing."""
        centre, rays = self.rays()
        width, height = self.camera.image_size
        d = scene(centre, rays.reshape(-1, 3))[0].reshape(height, width)
        return np.where(np.isfinite(d), d, np.nan)

    def expected(self, scene: Scene) -> Array:
        """Expected electrons of all taps of one still frame, (frequencies, taps, H, W)."""
        centre, rays = self.rays(self.sub)
        d, cosine, albedo = scene(centre, rays.reshape(-1, 3))
        seen = np.isfinite(d)
        d = np.where(seen, d, REFERENCE_MM)
        light = np.where(seen, self.power_e * albedo * np.maximum(cosine, 0.0) * (REFERENCE_MM / d) ** 2, 0.0)
        width, height = self.camera.image_size
        shape = height, self.sub, width, self.sub
        out = np.empty((len(self.modulation_hz), len(self.tap_phase_rad), height, width))
        for f, per_mm in enumerate(self.phase_per_mm):
            for k, theta in enumerate(self.tap_phase_rad):
                x = per_mm * d - theta
                g = np.cos(x) + self.wiggle * np.cos(3.0 * x)
                out[f, k] = (light * (1.0 + self.contrast * g)).reshape(shape).mean(axis=(1, 3)) + self.ambient_e
        return out

    def capture(self, scene: Scene | Sequence[Scene], *, seed: int, frames: int = 1) -> np.ndarray:
        """Noisy taps, (frames, frequencies, taps, H, W) uint16, counts.

        A sequence of scenes holds one a tap (the scene moves between the taps); they are the same at each frequency.
        """
        seed, frames = checks.integer("seed", seed), checks.integer("frames", frames)
        taps = len(self.tap_phase_rad)
        if callable(scene):
            electrons = self.expected(scene)
        else:
            if len(scene) != taps:
                raise ValueError(f"scene must hold one scene or one a tap, {taps}, got {len(scene)}")
            electrons = np.stack([self.expected(one)[:, k] for k, one in enumerate(scene)], axis=1)
        rng = stream(seed, self.id, "taps")
        noisy = rng.poisson(electrons, (frames, *electrons.shape)) + rng.normal(
            0.0, self.read_noise_e, (frames, *electrons.shape)
        )
        counts = np.rint(noisy / self.electrons_per_count)
        return np.clip(counts, 0, self.full_well_counts).astype(np.uint16)


def plane(point: ArrayLike, normal: ArrayLike, albedo: float = 0.6, radius_mm: float = np.inf) -> Scene:
    """A plane, or a disc about `point`."""
    p, n = np.asarray(point, float), np.asarray(normal, float)
    n = n / np.linalg.norm(n)

    def scene(origin: Array, rays: Array) -> tuple[Array, Array, Array]:
        along = rays @ n
        with np.errstate(divide="ignore", invalid="ignore"):
            d = ((p - origin) @ n) / along
            at = origin + d[:, None] * rays
            hit = (d > 0) & (np.sum((at - p) ** 2, axis=1) <= radius_mm**2)
        return np.where(hit, d, np.inf), np.abs(along), np.full(len(rays), albedo)

    return scene


def board(
    room_from_board: ArrayLike, columns: int, rows: int, spacing_mm: float, dark: float = 0.15, light: float = 0.7
) -> Scene:
    """A chessboard of columns x rows inner corners, squares one beyond them, and a light rim of half a square."""
    pose = np.asarray(room_from_board, float)
    flat = plane(pose[:3, 3], pose[:3, 2], light)

    def scene(origin: Array, rays: Array) -> tuple[Array, Array, Array]:
        d, cosine, albedo = flat(origin, rays)
        at = origin + np.where(np.isfinite(d), d, 0.0)[:, None] * rays
        u, v = ((at - pose[:3, 3]) @ pose[:3, i] / spacing_mm for i in range(2))
        rim = (u >= -1.5) & (u <= columns + 0.5) & (v >= -1.5) & (v <= rows + 0.5)
        squares = (u >= -1) & (u <= columns) & (v >= -1) & (v <= rows)
        black = squares & ((np.floor(u) + np.floor(v)) % 2 == 0)
        return np.where(rim, d, np.inf), cosine, np.where(black, dark, albedo)

    return scene


def body(phantom: Phantom, room_from_body: ArrayLike | None = None, albedo: float = 0.6) -> Scene:
    """A phantom at a pose."""
    pose = checks.pose("room_from_body", room_from_body)

    def scene(origin: Array, rays: Array) -> tuple[Array, Array, Array]:
        at = pose[:3, :3].T @ (origin - pose[:3, 3])
        turned = rays @ pose[:3, :3]
        t, hits, gradient = first_hit(phantom, at, (turned[:, 0], turned[:, 1], turned[:, 2]), 1e-6)
        d, cosine = np.full(len(rays), np.inf), np.zeros(len(rays))
        d[hits] = t[hits]
        n = np.stack(gradient, axis=-1)
        cosine[hits] = np.abs(np.sum(n * turned[hits], axis=1)) / np.linalg.norm(n, axis=1)
        return d, cosine, np.full(len(rays), albedo)

    return scene


def nearest(*scenes: Scene) -> Scene:
    """Several things at once: each ray sees the first of them."""

    def scene(origin: Array, rays: Array) -> tuple[Array, Array, Array]:
        seen = [one(origin, rays) for one in scenes]
        first = np.argmin([d for d, _, _ in seen], axis=0)
        d, cosine, albedo = (np.choose(first, [one[i] for one in seen]) for i in range(3))
        return d, cosine, albedo

    return scene


@functools.lru_cache(maxsize=8)
def _finer(camera: Camera, sub: int) -> Camera:
    """The camera with sub x sub pixels for each of its own."""
    if sub == 1:
        return camera
    (width, height), (fx, fy, cx, cy) = camera.image_size, camera.intrinsics
    centre = (cx + 0.5) * sub - 0.5, (cy + 0.5) * sub - 0.5
    return replace(camera, image_size=(sub * width, sub * height), intrinsics=(sub * fx, sub * fy, *centre))
