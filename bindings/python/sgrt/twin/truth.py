"""Exact ground truth: every pixel's own ray, cut with the analytic skin by Newton to rounding error."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .camera import Camera, into_frame, ray_table
from .checks import Array
from .pattern import Projector
from .phantom import Phantom
from .raycast import DONE_MM, sees
from .render import Cast, bounding_region, cast


class Match(NamedTuple):
    """Where the right camera sees what each pixel of the left camera sees.

    pixels : (H, W, 2) float64, column and row in the right image; NaN where the left pixel sees no skin.
    visible : (H, W) bool, the point is inside the right image and the right camera sees it.
    lit : (H, W) bool, the pod's projector lights the point.
    """

    pixels: Array
    visible: np.ndarray
    lit: np.ndarray


def depth(camera: Camera, phantom: Phantom, room_from_body: Array) -> Array:
    """Room points (H, W, 3), mm, that the pixel centres see; NaN where there is no skin."""
    width, height = camera.image_size
    out = np.full((height * width, 3), np.nan)
    index, hit = _hits(camera, phantom, room_from_body)
    out[index] = np.stack(_room(room_from_body, hit), axis=-1)
    return out.reshape(height, width, 3)


def match(left: Camera, right: Camera, projector: Projector, phantom: Phantom, room_from_body: Array) -> Match:
    """True matches of all pixels of `left` in `right`."""
    width, height = left.image_size
    index, hit = _hits(left, phantom, room_from_body)
    pixels = np.full((height * width, 2), np.nan)
    visible, lit = np.zeros(height * width, bool), np.zeros(height * width, bool)
    if index.size:
        found = right.project(np.stack(_room(room_from_body, hit), axis=-1))
        pixels[index] = found
        wide, high = right.image_size
        inside = (found[:, 0] >= 0) & (found[:, 0] <= wide - 1) & (found[:, 1] >= 0) & (found[:, 1] <= high - 1)
        visible[index] = inside & _sees_from(right.centre, phantom, room_from_body, hit)
        lit[index] = _sees_from(projector.centre, phantom, room_from_body, hit)
    return Match(pixels.reshape(height, width, 2), visible.reshape(height, width), lit.reshape(height, width))


def _hits(camera: Camera, phantom: Phantom, room_from_body: Array) -> tuple[np.ndarray, Cast]:
    """Flat pixel indices of the hits and the hits."""
    width = camera.image_size[0]
    top, bottom, left, right = bounding_region(camera, phantom, room_from_body) or (0, 1, 0, 1)
    x, y = (np.ascontiguousarray(table[top:bottom, left:right]).ravel() for table in ray_table(camera))
    hit = cast(camera, phantom, room_from_body, x, y, DONE_MM)
    row, column = np.divmod(hit.hits, right - left)
    return (row + top) * width + column + left, hit


def _room(room_from_body: Array, hit: Cast) -> tuple[Array, Array, Array]:
    return into_frame(tuple(room_from_body.ravel().tolist()), *hit.points)


def _sees_from(centre: Array, phantom: Phantom, room_from_body: Array, hit: Cast) -> np.ndarray:
    in_body = room_from_body[:3, :3].T @ (centre - room_from_body[:3, 3])
    return sees(phantom, hit.points, hit.normals, in_body)
