"""The cameras as rig.json text, schema sgrt-rig/1."""

from __future__ import annotations

import json
from collections.abc import Iterable

from .camera import Camera


def rig_json(rig_id: str, cameras: Iterable[Camera], pairs: dict[str, tuple[str, str]], provenance: dict) -> str:
    """The JSON text of a rig; `pairs` maps a pair's id to its (left, right) camera ids."""
    rig = {
        "schema": "sgrt-rig/1",
        "id": rig_id,
        "room": "IEC 61217 fixed, mm",
        "cameras": [
            {
                "id": camera.id,
                "image_size": list(camera.image_size),
                "model": "brown5",
                "intrinsics": list(camera.intrinsics),
                "distortion": list(camera.distortion),
                "camera_from_room": camera.matrix.tolist(),
            }
            for camera in cameras
        ],
        "pairs": [{"id": pair, "left": left, "right": right} for pair, (left, right) in pairs.items()],
        "provenance": provenance,
    }
    return json.dumps(rig, indent=1, allow_nan=False) + "\n"
