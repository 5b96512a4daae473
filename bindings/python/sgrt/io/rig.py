"""rig.json, schema sgrt-rig/1; the library reads and writes the text."""

from __future__ import annotations

from .._core import Rig
from ._files import PathLike, naming, read_text, writing


def read_rig(path: PathLike) -> Rig:
    """The rig of a file. Raises OSError, FormatError (the field is named), LimitError."""
    text = read_text(path)
    with naming(path):
        return Rig(text)


def write_rig(path: PathLike, rig: Rig) -> None:
    """Writes a rig, all numbers to the last bit, unknown keys kept."""
    with writing(path) as stream:
        stream.write(rig.to_json().encode())
