"""nurbs.json, schema sgrt-nurbs/1; the library reads and writes the text."""

from __future__ import annotations

from .._core import NurbsCurve, NurbsSurface
from ._files import PathLike, naming, read_text, writing


def read_nurbs_curve(path: PathLike) -> NurbsCurve:
    """The curve of a file. Raises OSError, FormatError (the field is named), LimitError."""
    text = read_text(path)
    with naming(path):
        return NurbsCurve.from_json(text)


def read_nurbs_surface(path: PathLike) -> NurbsSurface:
    """The surface of a file. Raises OSError, FormatError (the field is named), LimitError."""
    text = read_text(path)
    with naming(path):
        return NurbsSurface.from_json(text)


def write_nurbs(path: PathLike, shape: NurbsCurve | NurbsSurface) -> None:
    """Writes a curve or a surface, all numbers to the last bit."""
    with writing(path) as stream:
        stream.write(shape.to_json().encode())
