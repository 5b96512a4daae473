"""Registers a live surface on its reference and prints the patient's displacement."""

import numpy as np
import sgrt


def skin(dx: float, dy: float, dz: float) -> sgrt.Surface:
    """Two bumps on a grid of 41 x 41 points, 4 mm apart, moved by (dx, dy, dz) mm."""
    y, x = np.mgrid[-80:81:4, -80:81:4]
    x, y = x - dx, y - dy
    z = dz + 50 * np.exp(-(x**2 + 2 * y**2) / 4000) + 15 * np.exp(-((x - 40) ** 2 + (y - 30) ** 2) / 500)
    return sgrt.Surface.from_height_field(z, origin_mm=(-80, -80), spacing_mm=(4, 4))


result = sgrt.icp_align(skin(0, 0, 0), skin(3, -2, 1.5), isocentre_mm=(0, 0, 0))
d = result.displacement
print(f"LAT {d.lat_mm:+.2f} mm  LNG {d.lng_mm:+.2f} mm  VRT {d.vrt_mm:+.2f} mm")
print(f"pitch {d.pitch_deg:+.2f} deg  roll {d.roll_deg:+.2f} deg  rtn {d.rtn_deg:+.2f} deg")
print(f"verdict: {result.verdict}")
