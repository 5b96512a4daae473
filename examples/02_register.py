"""Registers a live surface on its reference and prints the six numbers of the patient's displacement."""

import numpy as np
import sgrt


def skin(moved: bool) -> sgrt.Surface:
    """Two bumps over 160 x 160 mm, moved by (3, -2, 1.5) mm and turned by 1 degree about Z if `moved`."""
    y, x = np.mgrid[-80:81:4.0, -80:81:4.0]
    if moved:
        c, s = np.cos(np.radians(1)), np.sin(np.radians(1))
        x, y = c * (x - 3) + s * (y + 2), -s * (x - 3) + c * (y + 2)
    z = 50 * np.exp(-(x**2 + 2 * y**2) / 4000) + 15 * np.exp(-((x - 40) ** 2 + (y - 30) ** 2) / 500)
    return sgrt.Surface.from_height_field(z + 1.5 * moved, origin_mm=(-80, -80), spacing_mm=(4, 4))


result = sgrt.icp_align(skin(moved=False), skin(moved=True), isocentre_mm=(0, 0, 0))
d = result.displacement
print(f"LAT {d.lat_mm:+.2f} mm  LNG {d.lng_mm:+.2f} mm  VRT {d.vrt_mm:+.2f} mm")
print(f"pitch {d.pitch_deg:+.2f} deg  roll {d.roll_deg:+.2f} deg  rtn {d.rtn_deg:+.2f} deg")
print(f"verdict: {result.verdict}")
