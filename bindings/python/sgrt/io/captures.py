"""What the cameras of a room took over time, schema sgrt-frames/1: surfaces or image pairs, with times."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from ..errors import FormatError
from ._files import PathLike, check_schema, naming, numbers, parse_json, read_text, write_json

SCHEMA = "sgrt-frames/1"


@dataclass(frozen=True)
class Capture:
    """One frame: a PLY file, or the two images of one or several pairs, or neither where the cameras had nothing."""

    time_s: float
    surface: Path | None = None
    pairs: dict[str, tuple[Path, Path]] = field(default_factory=dict)


def _inside(folder: Path, value: Any, name: str) -> Path:
    if not isinstance(value, str) or not value or "\0" in value:
        raise FormatError(f"{name} is {value!r}; expected the name of a file")
    pure = PurePosixPath(value), PureWindowsPath(value)
    if any(p.is_absolute() or p.drive or ".." in p.parts for p in pure):
        raise FormatError(f"{name} is {value!r}; expected a path inside the folder of the file, without '..'")
    return folder / value


def _capture(folder: Path, value: Any, name: str) -> Capture:
    if not isinstance(value, dict) or "time_s" not in value:
        raise FormatError(f"{name}: expected an object with time_s")
    time_s = float(numbers(value["time_s"], (), f"{name}.time_s"))
    given = [key for key in ("surface", "ply", "pairs") if value.get(key) is not None]
    if len(given) > 1:
        raise FormatError(f"{name}: has {' and '.join(given)}; expected one of them")
    if given and given[0] != "pairs":
        return Capture(time_s, _inside(folder, value[given[0]], f"{name}.{given[0]}"))
    pairs: dict[str, tuple[Path, Path]] = {}
    if not isinstance(value.get("pairs") or {}, dict):
        raise FormatError(f"{name}.pairs is {value['pairs']!r}; expected an object: pair id to [left, right]")
    for pair, images in (value.get("pairs") or {}).items():
        if not isinstance(images, list) or len(images) != 2:
            raise FormatError(f"{name}.pairs[{pair!r}] is {images!r}; expected [left, right]")
        left, right = (_inside(folder, image, f"{name}.pairs[{pair!r}]") for image in images)
        pairs[pair] = left, right
    return Capture(time_s, None, pairs)


def read_captures(path: PathLike) -> list[Capture]:
    """The frames of a file, or of `frames.json` in a folder, in the order of their times.

    Raises OSError, FormatError (also for a time that runs backwards, an absolute path and one with `..`).
    """
    file = Path(path)
    if file.is_dir():
        file = file / "frames.json"
    text = read_text(file)
    with naming(file):
        value = parse_json(text)
        if "schema" in value:
            check_schema(value, SCHEMA)
        frames = value.get("frames")
        if not isinstance(frames, list) or not frames:
            raise FormatError("frames: expected a list that is not empty")
        captures = [_capture(file.parent, frame, f"frames[{i}]") for i, frame in enumerate(frames)]
        for i in range(1, len(captures)):
            before, now = captures[i - 1].time_s, captures[i].time_s
            if now < before:
                raise FormatError(f"frames[{i}].time_s is {now:g}, before that of the frame before, {before:g}")
        return captures


def write_captures(path: PathLike, captures: list[Capture]) -> None:
    """Writes frames.json; the files must lie in its folder or below."""
    folder = Path(path).parent

    def name(file: Path) -> str:
        return file.relative_to(folder).as_posix() if file.is_absolute() or folder in file.parents else file.as_posix()

    frames: list[dict[str, Any]] = []
    for capture in captures:
        frame: dict[str, Any] = {"time_s": capture.time_s}
        if capture.surface is not None:
            frame["surface"] = name(capture.surface)
        elif capture.pairs:
            frame["pairs"] = {pair: [name(left), name(right)] for pair, (left, right) in capture.pairs.items()}
        frames.append(frame)
    write_json(path, {"schema": SCHEMA, "frames": frames})
