"""Draws docs/images/tof.png: a simulated head before a time-of-flight camera, as the chapter's fig. 10.2.

.venv/bin/python scripts/tof_picture.py
"""

from pathlib import Path

import numpy as np
import sgrt
from sgrt.tof_picture import draw
from sgrt.twin import head
from sgrt.twin import tof as twin
from sgrt.twin.camera import Camera

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    """200 x 200 px and 20 MHz as the CamCube of the chapter, 0.75 m above the face, eight frames."""
    pose = np.diag([1.0, -1, -1, 1])
    pose[:3, 3] = 0, 0, 850
    camera = Camera("c", (200, 200), (400.0, 400.0, 99.5, 99.5), (-0.1, 0.05, 0, 0, 0), tuple(pose.ravel()))
    unit = twin.TofCamera(camera, power_e=150_000, electrons_per_count=10.0, sub=3)
    scene = twin.nearest(twin.body(head()), twin.plane([0, 0, -130], [0, 0, 1.0], albedo=0.4))
    result = sgrt.tof_measure(sgrt.Rig(unit.rig_json()), "tof0", unit.capture(scene, seed=1, frames=8))
    draw(ROOT / "docs" / "images" / "tof.png", result)
    print(result, result.counts)


if __name__ == "__main__":
    main()
