"""A laser scan, schema sgrt-scan/1: the frames of a sweep with their mirror readings and times."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import FormatError
from ._files import PathLike, check_schema, naming, numbers, parse_json, read_text, write_json
from .captures import _inside

SCHEMA = "sgrt-scan/1"


@dataclass(frozen=True)
class ScanFrame:
    image: Path
    angle_rad: float
    time_s: float


@dataclass(frozen=True)
class Scan:
    """laser: its id in the rig. dark: an image without laser, or None."""

    laser: str
    frames: list[ScanFrame]
    dark: Path | None = None


def _frame(folder: Path, value: Any, name: str) -> ScanFrame:
    if not isinstance(value, dict) or not {"image", "angle_rad"} <= value.keys():
        raise FormatError(f"{name}: expected an object with image and angle_rad")
    return ScanFrame(
        _inside(folder, value["image"], f"{name}.image"),
        float(numbers(value["angle_rad"], (), f"{name}.angle_rad")),
        float(numbers(value.get("time_s", 0.0), (), f"{name}.time_s")),
    )


def read_scan(path: PathLike) -> Scan:
    """The scan of a file, in its own order; whether its angles and times are sound the sweep says.

    Raises OSError, FormatError (also for an absolute path and one with `..`).
    """
    file = Path(path)
    text = read_text(file)
    with naming(file):
        value = parse_json(text)
        check_schema(value, SCHEMA)
        laser, frames, dark = value.get("laser"), value.get("frames"), value.get("dark")
        if not isinstance(laser, str) or not laser:
            raise FormatError(f"laser is {laser!r}; expected the id of a laser of the rig")
        if not isinstance(frames, list) or not frames:
            raise FormatError("frames: expected a list that is not empty")
        return Scan(
            laser,
            [_frame(file.parent, frame, f"frames[{i}]") for i, frame in enumerate(frames)],
            None if dark is None else _inside(file.parent, dark, "dark"),
        )


def write_scan(path: PathLike, scan: Scan) -> None:
    """Writes scan.json; the images must lie in its folder or below."""
    folder = Path(path).parent

    def name(file: Path) -> str:
        return file.relative_to(folder).as_posix() if file.is_absolute() or folder in file.parents else file.as_posix()

    frames = [{"image": name(f.image), "angle_rad": f.angle_rad, "time_s": f.time_s} for f in scan.frames]
    document: dict[str, Any] = {"schema": SCHEMA, "laser": scan.laser, "frames": frames}
    write_json(path, document | ({} if scan.dark is None else {"dark": name(scan.dark)}))
