"""Displacements of the patient: six numbers a clinic reads, and the pose of the body that they make.

D(x) = R x + t about the isocentre (the room's origin), R = Rz(rtn) Rx(pitch) Ry(roll), right-handed about
room X, Y, Z, t = (lat, lng, vrt). A body in the reference position has room_from_body = 1, a displaced one
room_from_body = D.
"""

from __future__ import annotations

import numpy as np

from . import checks
from .checks import Array


def displacement(
    lat_mm: float = 0.0,
    lng_mm: float = 0.0,
    vrt_mm: float = 0.0,
    pitch_deg: float = 0.0,
    roll_deg: float = 0.0,
    rtn_deg: float = 0.0,
) -> Array:
    """The displacement D about the isocentre, (4, 4), mm: room_from_body of a patient displaced by it."""
    given = {"lat_mm": lat_mm, "lng_mm": lng_mm, "vrt_mm": vrt_mm}
    turns = {"pitch_deg": pitch_deg, "roll_deg": roll_deg, "rtn_deg": rtn_deg}
    pitch, roll, rtn = (np.deg2rad(checks.number(name, value)) for name, value in turns.items())
    (cp, sp), (cr, sr), (cz, sz) = ((np.cos(a), np.sin(a)) for a in (pitch, roll, rtn))
    out = np.eye(4)
    out[:3, :3] = (
        np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1.0]])
        @ np.array([[1.0, 0, 0], [0, cp, -sp], [0, sp, cp]])
        @ np.array([[cr, 0, sr], [0, 1.0, 0], [-sr, 0, cr]])
    )
    out[:3, 3] = [checks.number(name, value) for name, value in given.items()]
    return out


def random_displacement(seed: int, max_mm: float = 15.0, max_deg: float = 3.0) -> tuple[Array, dict[str, float]]:
    """Draw a displacement: the shift uniform in the ball of radius `max_mm`, each angle uniform in
    +-`max_deg`.

    Returns
    -------
    room_from_body : (4, 4) float64, mm, equal to D (reference to live).
    numbers : lat_mm, lng_mm, vrt_mm, pitch_deg, roll_deg, rtn_deg, mag_mm of D.
    """
    seed = checks.integer("seed", seed)
    max_mm, max_deg = checks.number("max_mm", max_mm, 0.0, 1e4), checks.number("max_deg", max_deg, 0.0, 180.0)
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *b"displacement"])))
    direction = rng.standard_normal(3)
    shift = max_mm * np.cbrt(rng.random()) * direction / np.sqrt(np.sum(direction**2))
    angles = max_deg * rng.uniform(-1.0, 1.0, 3)
    numbers = dict(zip(("lat_mm", "lng_mm", "vrt_mm"), shift.tolist(), strict=True))
    numbers.update(zip(("pitch_deg", "roll_deg", "rtn_deg"), angles.tolist(), strict=True))
    matrix = displacement(**numbers)
    return matrix, {**numbers, "mag_mm": float(np.sqrt(np.sum(shift**2)))}
