"""The twin: a seeded simulated treatment room with exact ground truth, for tests, examples and the demo.

It uses nothing of the library that it tests: its projection, poses and surfaces are its own, or common
errors would cancel. The same seeds give the same bytes. Units are mm and pixels; frames and equations:
docs/theory/twin.md. Needs the extra `twin`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .bodies import head, torso
from .camera import Camera
from .checks import Array
from .laser import Mirror, Scanner, Stripe, board_corners, board_stripe, default_mirror
from .pattern import Projector, speckles
from .phantom import Blob, Phantom
from .pose import displacement, random_displacement
from .room import Room
from .sensor import Sensor
from .truth import Match

__all__ = [
    "Blob",
    "Camera",
    "Match",
    "Mirror",
    "Phantom",
    "Projector",
    "Room",
    "Scanner",
    "Sensor",
    "Stripe",
    "board_corners",
    "board_stripe",
    "default_mirror",
    "displacement",
    "distance",
    "head",
    "random_displacement",
    "sample_surface",
    "speckles",
    "torso",
    "true_match",
    "truth_depth",
]


def truth_depth(room: Room, camera: str, phantom: Phantom, room_from_body: ArrayLike | None = None) -> Array:
    """`Room.truth_depth` as a function."""
    return room.truth_depth(camera, phantom, room_from_body)


def true_match(room: Room, pair: str, phantom: Phantom, room_from_body: ArrayLike | None = None) -> Match:
    """`Room.true_match` as a function."""
    return room.true_match(pair, phantom, room_from_body)


def sample_surface(phantom: Phantom, count: int, seed: int) -> tuple[Array, np.ndarray]:
    """`Phantom.sample_surface` as a function."""
    return phantom.sample_surface(count, seed)


def distance(phantom: Phantom, points_in_body: ArrayLike) -> Array:
    """`Phantom.distance` as a function: signed distance, mm, of body-frame points (N, 3)."""
    return phantom.distance(points_in_body)
