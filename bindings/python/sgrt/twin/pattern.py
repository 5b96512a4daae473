"""The speckle projector: a pinhole fixed in the room that throws one random, band-limited pattern.

White noise, low-passed, pushed towards black and white by tanh, low-passed again (the projector's own
defocus). Its cubic spline is the definition of the pattern between its samples, so every camera sees one
and the same continuous function.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from .camera import into_frame
from .checks import Array

NOISE_SIGMA_PX = 0.8
CONTRAST = 3.0
DEFOCUS_SIGMA_PX = 0.6
DARK, BRIGHT = 0.04, 0.96


@dataclass(frozen=True)
class Projector:
    """A pinhole projector without distortion, its principal point in the middle of its `image_size` px."""

    id: str
    image_size: tuple[int, int]
    focal_px: float
    projector_from_room: tuple[float, ...]
    seed: int

    @property
    def centre(self) -> Array:
        """The projection centre in the room frame, mm, shape (3,)."""
        m = np.array(self.projector_from_room).reshape(4, 4)
        return -m[:3, :3].T @ m[:3, 3]

    def project(self, x: Array, y: Array, z: Array) -> tuple[Array, Array]:
        """Pattern coordinates (column, row) of room coordinates, mm; NaN behind the projector."""
        px, py, pz = into_frame(self.projector_from_room, x, y, z)
        pz = np.where(pz > 1.0, pz, np.nan)
        (width, height), f = self.image_size, self.focal_px
        return f * px / pz + 0.5 * (width - 1), f * py / pz + 0.5 * (height - 1)

    def intensity(self, column: Array, row: Array) -> Array:
        """Relative light, 0 to 1, at pattern coordinates of shape (N,); 0 outside the pattern. float32."""
        where = np.stack([row, column])
        where[~np.isfinite(where)] = -1e9
        return ndimage.map_coordinates(
            _spline(self),
            where,
            output=np.float32,
            order=3,
            mode="constant",
            cval=0.0,
            prefilter=False,
        )


@functools.lru_cache(maxsize=8)
def speckles(projector: Projector) -> np.ndarray:
    """The pattern's samples, 0 to 1, shape (height, width) float32, read-only."""
    width, height = projector.image_size
    rng = np.random.Generator(
        np.random.PCG64(np.random.SeedSequence([projector.seed, *projector.id.encode(), *b"pattern"]))
    )
    noise = rng.standard_normal((height, width), dtype=np.float32)
    smooth = ndimage.gaussian_filter(noise, NOISE_SIGMA_PX, mode="wrap")
    # The standard deviation of low-passed white noise: known, so no sum over the image is needed.
    expected = 1.0 / (2.0 * np.sqrt(np.pi) * NOISE_SIGMA_PX)
    hard = np.tanh(np.float32(CONTRAST / expected) * smooth)
    soft = ndimage.gaussian_filter(hard, DEFOCUS_SIGMA_PX, mode="wrap")
    samples = np.float32(0.5 * (BRIGHT + DARK)) + np.float32(0.5 * (BRIGHT - DARK)) * soft
    samples.flags.writeable = False
    return samples


@functools.lru_cache(maxsize=8)
def _spline(projector: Projector) -> np.ndarray:
    """Cubic spline coefficients of the pattern, shape (height, width) float32."""
    return ndimage.spline_filter(speckles(projector), order=3, output=np.float32, mode="mirror")
