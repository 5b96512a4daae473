"""roi.json, schema sgrt-roi/1: a polygon seen from above, or a box."""

from __future__ import annotations

from .._core import Roi
from ..errors import FormatError
from ._files import PathLike, check_schema, naming, numbers, parse_json, read_text, write_json

SCHEMA = "sgrt-roi/1"


def read_roi(path: PathLike) -> Roi:
    """The region of interest of a file. Raises OSError, FormatError."""
    text = read_text(path)
    with naming(path):
        value = parse_json(text)
        check_schema(value, SCHEMA)
        if ("polygon_xy_mm" in value) == ("box_mm" in value):
            raise FormatError("expected either polygon_xy_mm or box_mm")
        if "polygon_xy_mm" in value:
            return Roi.polygon(numbers(value["polygon_xy_mm"], (None, 2), "polygon_xy_mm"))
        return Roi.box(*numbers(value["box_mm"], (2, 3), "box_mm"))


def write_roi(path: PathLike, roi: Roi) -> None:
    """Writes a region of interest."""
    if roi.polygon_xy_mm is not None:
        write_json(path, {"schema": SCHEMA, "polygon_xy_mm": roi.polygon_xy_mm})
    else:
        write_json(path, {"schema": SCHEMA, "box_mm": roi.box_mm})
