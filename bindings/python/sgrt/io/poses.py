"""Pose tracks, schema sgrt-poses/1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import FormatError, InvalidArgument
from ..frames import shift_from_pose
from ._files import PathLike, check_schema, naming, numbers, parse_json, read_text, write_json

SCHEMA = "sgrt-poses/1"


@dataclass(frozen=True)
class PoseTrack:
    """time_s: N, increasing. room_from_body: N x 4 x 4, rigid, mm."""

    time_s: NDArray[np.float64]
    room_from_body: NDArray[np.float64]


def _check(track: PoseTrack) -> None:
    if not np.all(np.diff(track.time_s) > 0):
        raise FormatError("poses: time_s must increase")
    for i, pose in enumerate(track.room_from_body):
        try:
            shift_from_pose(pose, (0, 0, 0))  # the library's own check of a rigid motion
        except InvalidArgument as error:
            raise FormatError(f"poses[{i}].room_from_body: {error}") from error


def read_poses(path: PathLike) -> PoseTrack:
    """The pose track of a file. Raises OSError, FormatError."""
    text = read_text(path)
    with naming(path):
        value = parse_json(text)
        check_schema(value, SCHEMA)
        poses = value.get("poses")
        if not isinstance(poses, list) or not poses:
            raise FormatError("poses: expected a list that is not empty")
        times, matrices = [], []
        for i, pose in enumerate(poses):
            if not isinstance(pose, dict) or not {"time_s", "room_from_body"} <= pose.keys():
                raise FormatError(f"poses[{i}]: expected time_s and room_from_body")
            times.append(numbers(pose["time_s"], (), f"poses[{i}].time_s"))
            matrices.append(numbers(pose["room_from_body"], (4, 4), f"poses[{i}].room_from_body"))
        track = PoseTrack(np.array(times, dtype=np.float64), np.array(matrices))
        _check(track)
        return track


def write_poses(path: PathLike, track: PoseTrack) -> None:
    """Writes a pose track."""
    _check(track)
    poses = [{"time_s": float(t), "room_from_body": m} for t, m in zip(track.time_s, track.room_from_body, strict=True)]
    write_json(path, {"schema": SCHEMA, "poses": poses})
