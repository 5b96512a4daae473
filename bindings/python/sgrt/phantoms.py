"""phantom.json (schema sgrt-phantom/1): a thing whose points are known in the room, and what cameras saw of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .boards import Board, parse_board, read_photo
from .errors import FormatError, InvalidArgument, NotFound
from .frames import shift_from_pose
from .io._files import PathLike, check_schema, naming, numbers, parse_json, read_text

SCHEMA = "sgrt-phantom/1"


@dataclass(frozen=True)
class Phantom:
    """points: N x 3, mm, room frame. ids: one a point. sigma_mm: one sigma of each coordinate.

    board: a plate whose corners are the points, found in images; None: the file gives their pixels.
    """

    ids: list[str]
    points: NDArray[np.float64]
    sigma_mm: float = 0.0
    board: Board | None = None
    pixels: dict[str, dict[str, list[float]]] = field(default_factory=dict)


def _plate(value: dict[str, Any]) -> Phantom:
    try:
        board = parse_board(str(value["board"]))
    except InvalidArgument as error:
        raise FormatError(f"board: {error}") from error
    pose = numbers(value.get("room_from_board"), (4, 4), "room_from_board")
    try:
        shift_from_pose(pose, (0, 0, 0))  # the library's own check of a rigid motion
    except InvalidArgument as error:
        raise FormatError(f"room_from_board: {error}") from error
    points = np.einsum("ij,nj->ni", pose[:3, :3], board.points) + pose[:3, 3]
    return Phantom([str(i) for i in range(len(points))], points, board=board)


def _points(value: dict[str, Any]) -> Phantom:
    ids, places = [], []
    if not isinstance(value["points"], list):
        raise FormatError("points: expected a list of {id, position_mm}")
    for i, item in enumerate(value["points"]):
        if not isinstance(item, dict) or not isinstance(item.get("id"), str):
            raise FormatError(f"points[{i}]: expected an object with an id, a text, and position_mm")
        if item["id"] in ids:
            raise FormatError(f"points[{i}].id: {item['id']!r} stands twice")
        ids.append(item["id"])
        places.append(numbers(item.get("position_mm"), (3,), f"points[{i}].position_mm"))
    pixels: dict[str, dict[str, list[float]]] = {}
    cameras = value.get("pixels") or {}
    if not isinstance(cameras, dict):
        raise FormatError("pixels: expected an object of camera ids")
    for camera, seen in cameras.items():
        if not isinstance(seen, dict):
            raise FormatError(f"pixels.{camera}: expected an object of point ids")
        for name, place in seen.items():
            if name not in ids:
                raise FormatError(f"pixels.{camera}: no point {name!r}")
            pixels.setdefault(camera, {})[name] = numbers(place, (2,), f"pixels.{camera}.{name}").tolist()
    return Phantom(ids, np.array(places).reshape(-1, 3), pixels=pixels)


def read_phantom(path: PathLike) -> Phantom:
    """The phantom of a file. Raises OSError, FormatError."""
    text = read_text(path)
    with naming(path):
        value = parse_json(text)
        check_schema(value, SCHEMA)
        if ("board" in value) == ("points" in value):
            raise FormatError("expected either board with room_from_board, or points")
        phantom = _plate(value) if "board" in value else _points(value)
        sigma = float(numbers(value.get("sigma_mm", 0.0), (), "sigma_mm"))
        if sigma < 0:
            raise FormatError(f"sigma_mm: {sigma}, expected at least 0")
        return Phantom(phantom.ids, phantom.points, sigma, phantom.board, phantom.pixels)


def sights(phantom: Phantom, sizes: dict[str, tuple[int, int]], images: Sequence[tuple[str, Path]]) -> dict[str, Any]:
    """cameras, points, index and pixels for calibration_room.

    sizes: of the rig's cameras. images: of a plate, (camera id, file).

    Raises NotFound: a plate that an image does not show. InvalidArgument: a camera that is not in the rig.
    """
    names: list[str] = []
    index: list[list[int]] = []
    pixels: list[list[float]] = []
    seen = dict(phantom.pixels)
    for camera, path in images:
        if camera in [c for c, _ in images[: images.index((camera, path))]]:
            raise InvalidArgument(f"--images {camera}: given twice")
        if phantom.board is None:
            raise InvalidArgument(
                f"--images {camera}={path}: the phantom is no board, its points are not looked for; give"
                " their pixels in its file"
            )
        try:
            found = phantom.board.find(read_photo(path))
        except NotFound as error:
            raise NotFound(f"{path}: {error}") from error
        seen[camera] = {str(i): list(map(float, p)) for i, p in enumerate(found.pixels) if np.isfinite(p[0])}
    if not seen:
        raise InvalidArgument("--images: none given, and the phantom's file has no pixels")
    for camera, points in seen.items():
        if camera not in sizes:
            raise InvalidArgument(f"camera {camera!r} is not in the rig, which has {', '.join(sizes)}")
        names.append(camera)
        for name, place in points.items():
            index.append([len(names) - 1, 0, phantom.ids.index(name)])
            pixels.append(place)
    return {
        "cameras": [(name, sizes[name]) for name in names],
        "points": phantom.points,
        "index": np.array(index, np.int32).reshape(-1, 3),
        "pixels": np.array(pixels).reshape(-1, 2),
    }
