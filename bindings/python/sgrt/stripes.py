"""The stripe of a laser on a board, in the scans that a calibration is made from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import stripe_extract
from .boards import Board, index_rows, read_photo
from .errors import FormatError, NotFound
from .io import Scan

TRIES = 12  # frames in which the board is looked for where there is no dark frame
ENOUGH = 5

Image = NDArray[Any]


def find_corners(board: Board, images: Sequence[Image], name: str) -> NDArray[np.float64]:
    """The board's corners, N x 2, NaN where hidden: the median over the images that show it. Raises NotFound."""
    found, why = [], ""
    for image in images:
        try:
            found.append(board.find(image).pixels)
        except NotFound as error:
            why = str(error)
        if len(found) == ENOUGH:
            break
    if not found:
        raise NotFound(f"{name}: the board is in none of the frames that were tried: {why}")
    stack = np.stack(found)
    seen = np.isfinite(stack[:, :, 0]).sum(axis=0) > 0
    corners = np.full(stack.shape[1:], np.nan)
    corners[seen] = np.nanmedian(stack[:, seen], axis=0)
    return corners


def find_stripe(image: Image, dark: Image | None, columns: bool) -> tuple[NDArray[Any], NDArray[Any]]:
    """Pixels (N x 2) of the stripe's centres and their sigma; none where there is no stripe."""
    try:
        stripe = stripe_extract(image, dark=dark, columns=columns)
    except NotFound:
        return np.zeros((0, 2)), np.zeros(0)
    lines = np.flatnonzero(np.isfinite(stripe.centre))
    at = stripe.centre[lines]
    pixels = np.stack([lines, at] if columns else [at, lines], axis=1).astype(np.float64)
    return pixels, np.asarray(stripe.sigma_px, np.float64)[lines]


def runs_across(image: Image, dark: Image | None) -> bool:
    """The stripe gives a centre in more columns than rows."""
    rows, columns = (len(find_stripe(image, dark, c)[0]) for c in (False, True))
    return columns / image.shape[1] > rows / image.shape[0]


def sights(
    board: Board,
    scans: Sequence[tuple[Path, Scan]],
    camera: str,
    *,
    progress: Callable[[float, str], None] | None = None,
) -> dict[str, Any]:
    """The arguments of calibration_laser from scans of a board, each in a place of its own.

    Raises FormatError: an image of another size; NotFound: a scan without board or without stripe.
    """
    index, corners = [], []
    placement, angles, pixels, sigmas = [], [], [], []
    size: tuple[int, int] | None = None
    total, done = sum(len(scan.frames) for _, scan in scans), 0
    for number, (file, scan) in enumerate(scans):
        dark = None if scan.dark is None else read_photo(scan.dark)
        frames = [read_photo(frame.image) for frame in scan.frames]
        for frame, image in zip(scan.frames, frames, strict=True):
            own = (image.shape[1], image.shape[0])
            size = size or own
            if own != size:
                raise FormatError(f"{frame.image}: {own[0]} x {own[1]} pixels, expected {size[0]} x {size[1]}")
        step = max(1, len(frames) // TRIES)
        found = find_corners(board, [dark] if dark is not None else frames[::step], str(file))
        rows, seen = index_rows(found, 0, number)
        index.append(rows)
        corners.append(found[seen])
        across = runs_across(frames[len(frames) // 2], dark)
        for frame, image in zip(scan.frames, frames, strict=True):
            at, sigma = find_stripe(image, dark, across)
            placement.append(np.full(len(at), number))
            angles.append(np.full(len(at), frame.angle_rad))
            pixels.append(at)
            sigmas.append(sigma)
            done += 1
            if progress:
                progress(done / total, "find board and stripe")
    assert size is not None
    readings = {frame.angle_rad for _, scan in scans for frame in scan.frames}
    return {
        "cameras": [(camera, size)],
        "points": board.points,
        "index": np.concatenate(index),
        "pixels": np.concatenate(corners),
        "placements": [f"{i} {file}" for i, (file, _) in enumerate(scans)],
        "stripe_placement": np.concatenate(placement).astype(np.int32),
        "stripe_angle_rad": np.concatenate(angles).astype(np.float64),
        "stripe_px": np.concatenate(pixels),
        "stripe_sigma_px": np.maximum(np.concatenate(sigmas), 0.02),
        "half_turn_ambiguous": board.half_turn_ambiguous,
        "fixed": len(readings) == 1,
    }
