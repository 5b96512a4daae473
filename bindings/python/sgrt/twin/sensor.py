"""The image sensor: full well, shot noise, read noise, gain, offset, quantisation.

    counts = round(k (min(e, full well) + n) + offset),  n ~ N(0, e + read^2),  k = (2^bits - 1) / full well

Shot noise is drawn as a Gaussian of the Poisson's variance e. From about 100 electrons on (the ambient
light alone gives that) the two cannot be told apart beside 12 electrons of read noise, and it costs a
quarter of the time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import checks


@dataclass(frozen=True)
class Sensor:
    """What all cameras of a room share.

    full_well_e, read_noise_e : electrons. bits : 8 to 16. blur_px : sigma of the lens' defocus. exposure :
    share of the full well that the brightest speckle reaches on skin of albedo 0.6 that faces the
    projector, on top of a patient at the isocentre.
    """

    full_well_e: float = 12000.0
    read_noise_e: float = 12.0
    bits: int = 8
    blur_px: float = 0.55
    exposure: float = 0.75

    def __post_init__(self) -> None:
        checks.number("full_well_e", self.full_well_e, 100.0, 1e7)
        checks.number("read_noise_e", self.read_noise_e, 0.0, 1e5)
        checks.integer("bits", self.bits, 8, 16)
        checks.number("blur_px", self.blur_px, 0.0, 10.0)
        checks.number("exposure", self.exposure, 0.01, 2.0)

    @property
    def counts_per_electron(self) -> float:
        """k above."""
        return (2**self.bits - 1) / self.full_well_e

    def expose(self, electrons: np.ndarray, offset_counts: float, rng: np.random.Generator) -> np.ndarray:
        """Noise and quantise expected electrons (H, W) float32 into uint8, or uint16 above 8 bits."""
        e = np.minimum(electrons, np.float32(self.full_well_e))
        noise = rng.standard_normal(e.shape, dtype=np.float32)
        noise *= np.sqrt(e + np.float32(self.read_noise_e**2))
        noise += e
        noise *= np.float32(self.counts_per_electron)
        noise += np.float32(offset_counts)
        np.rint(noise, out=noise)
        np.clip(noise, 0.0, 2**self.bits - 1, out=noise)
        return noise.astype(np.uint8 if self.bits == 8 else np.uint16)


def stream(seed: int, name: str, purpose: str) -> np.random.Generator:
    """A PCG64 generator of its own for each seed, camera and purpose: no camera changes another's."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *name.encode(), 0, *purpose.encode()])))
