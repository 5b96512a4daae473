"""Surfaces as PLY: binary little-endian or ascii, float32 or float64 (docs/formats.md)."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, Literal
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray

from .._core import Surface
from ..errors import FormatError, LimitError
from ._files import PathLike, naming, writing
from ._ply_rows import TYPES, Ascii, Binary, Element, Rows, write

MAX_HEADER_BYTES = 2**16
MAX_POINTS = 50_000_000
POINT = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
COVARIANCE = ("cxx", "cxy", "cxz", "cyy", "cyz", "czz")
FLOATS = ("float", "double", "float32", "float64")


@dataclass
class _Header:
    format: str = ""
    comments: list[str] = field(default_factory=list)
    elements: list[Element] = field(default_factory=list)
    size: int = 0

    def element(self, name: str) -> Element | None:
        return next((e for e in self.elements if e.name == name), None)


def _count(word: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 19):
        raise FormatError(f"header: {word!r} is not a count")
    return int(word)


def _property(element: Element, words: list[str]) -> None:
    is_list = len(words) == 5 and words[1] == "list"
    types = words[2:4] if is_list else words[1:2]
    if (len(words) != 3 and not is_list) or any(t not in TYPES for t in types) or (is_list and words[2] in FLOATS):
        raise FormatError(f"header: {' '.join(words)!r} is not a property")
    if words[-1] in element.properties:
        raise FormatError(f"header: the property {words[-1]!r} stands twice")
    element.properties[words[-1]] = types[-1]
    if is_list:
        element.lists[words[-1]] = words[2]


def _header(stream: BinaryIO) -> _Header:
    data = stream.read(MAX_HEADER_BYTES)
    if not data.startswith((b"ply\n", b"ply\r\n")):
        raise FormatError("not a PLY file")
    header = _Header()
    for raw in data.splitlines(keepends=True):
        header.size += len(raw)
        words = raw.decode("ascii", "replace").split()
        match words:
            case ["end_header"] if raw.endswith((b"\n", b"\r")):
                return header
            case ["ply"] | [] | ["obj_info", *_]:
                pass
            case ["format", name, "1.0"]:
                header.format = name
            case ["comment", *rest]:
                header.comments.append(" ".join(rest))
            case ["element", name, count]:
                if header.element(name):
                    raise FormatError(f"header: the element {name!r} stands twice")
                header.elements.append(Element(name, _count(count)))
            case ["property", *_] if header.elements:
                _property(header.elements[-1], words)
            case _:
                raise FormatError(f"header: {' '.join(words)[:60]!r} is not understood")
    raise FormatError("header: no end_header")


def _check(header: _Header, file_bytes: int) -> None:
    """Nothing is allocated before the bytes for it are seen."""
    if header.format not in ("ascii", "binary_little_endian"):
        raise FormatError(f"format {header.format!r}; expected ascii or binary_little_endian")
    for element in header.elements:
        if element.count and not element.properties:
            raise FormatError(f"header: the element {element.name!r} has no property")
    ascii_text = header.format == "ascii"
    least = sum(e.count * e.least(ascii_text) for e in header.elements)
    if least > file_bytes - header.size + ascii_text:  # the last number of ascii may lack its newline
        counts = ", ".join(f"{e.count} {e.name}" for e in header.elements)
        raise FormatError(
            f"cut short: the header promises {counts}, at least {least} bytes; {file_bytes - header.size} follow it"
        )
    vertex = header.element("vertex")
    if vertex is None:
        raise FormatError("no element 'vertex'")
    if vertex.count > MAX_POINTS:
        raise LimitError(f"{vertex.count} points; at most {MAX_POINTS}")
    for names in (POINT, NORMAL, COVARIANCE, ("sigma_mm",)):
        present = [name for name in names if name in vertex.properties]
        if (present and len(present) != len(names)) or (not present and names is POINT):
            missing = next(name for name in names if name not in vertex.properties)
            raise FormatError(f"vertex lacks the property {missing!r}")
        for name in present:
            if name in vertex.lists or vertex.properties[name] not in FLOATS:
                kind = "list" if name in vertex.lists else vertex.properties[name]
                raise FormatError(f"vertex {name}: type {kind}; expected float or double")


def _tagged(comments: list[str], tag: str, count: int) -> list[str] | None:
    found = [c.split()[2:] for c in comments if c.split()[:2] == ["sgrt", tag]]
    if len(found) > 1 or any(len(words) != count for words in found):
        raise FormatError(f"comment 'sgrt {tag}': expected once, with {count} value{'s' * (count > 1)}")
    return found[0] if found else None


def _grid(comments: list[str], points: int) -> tuple[int, int] | None:
    words = _tagged(comments, "grid", 2)
    if words is None:
        return None
    width, height = _count(words[0]), _count(words[1])
    if width * height != points:
        raise FormatError(f"comment 'sgrt grid {width} {height}' but {points} points")
    return height, width


def _correlation(comments: list[str]) -> float:
    words = _tagged(comments, "correlation_points", 1)
    if words is None:
        return 1.0  # independent points
    try:
        value = float(words[0])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FormatError(f"comment 'sgrt correlation_points {words[0]}': not a finite number")
    return value


def _causes(comments: list[str], count: int) -> list[str] | None:
    """The names of the modes, percent-encoded; a lone % is the empty name."""
    words = _tagged(comments, "mode_names", count) if count else None
    return None if words is None else ["" if word == "%" else unquote(word) for word in words]


def _columns(vertex: Rows, names: tuple[str, ...]) -> NDArray[Any]:
    wide = any(vertex[name].dtype.itemsize == 8 for name in names)
    return np.stack([vertex[name] for name in names], axis=-1).astype("f8" if wide else "f4", copy=False)


def _mode_names(k: int) -> tuple[str, ...]:
    return tuple(f"mode{k}_{axis}" for axis in "xyz")


def _mode_count(vertex: Element) -> int:
    count = 0
    while all(vertex.properties.get(name) in FLOATS and name not in vertex.lists for name in _mode_names(count)):
        count += 1
    if any(name.startswith("mode") and name[4:5].isdigit() and int(name[4:5]) >= count for name in vertex.properties):
        raise FormatError("vertex: the properties mode0_x, mode0_y, mode0_z, mode1_x ... have a gap")
    return count


def _face_name(element: Element) -> str:
    for name in ("vertex_indices", "vertex_index"):
        if name in element.lists and element.properties[name] not in FLOATS:
            return name
    raise FormatError("face lacks the list 'vertex_indices'")


def _faces(rows: Rows, name: str, points: int) -> NDArray[np.int32]:
    corners = rows[name]
    lengths = {corners.shape[1]} if isinstance(corners, np.ndarray) else {len(row) for row in corners}
    if lengths - {3}:
        raise FormatError(f"a face with {max(lengths - {3})} corners; expected triangles")
    with _parse_errors():
        indices = np.asarray(corners, dtype=np.int64).reshape(-1, 3)
    wrong = indices[(indices < 0) | (indices >= points)]
    if wrong.size:
        raise FormatError(f"a face names the point {wrong[0]}; there are {points}")
    return indices.astype(np.int32)


@contextlib.contextmanager
def _parse_errors() -> Iterator[None]:
    try:
        yield
    except FormatError:
        raise
    except (ValueError, OverflowError) as error:
        raise FormatError(f"malformed numbers: {str(error).splitlines()[0]}") from error


def _elements(path: PathLike) -> tuple[_Header, dict[str, Rows]]:
    """The header and the rows of the points and faces; what stands behind them is not read."""
    with Path(path).open("rb") as stream:
        header = _header(stream)
        _check(header, os.fstat(stream.fileno()).st_size)
        stream.seek(header.size)
        body = Ascii(stream) if header.format == "ascii" else Binary(stream.read())
        with _parse_errors():
            wanted = max(i for i, e in enumerate(header.elements) if e.name in ("vertex", "face"))
            return header, {e.name: body.rows(e) for e in header.elements[: wanted + 1]}


def _surface(path: PathLike) -> Surface:
    header, found = _elements(path)
    vertex, face = header.element("vertex"), header.element("face")
    assert vertex is not None
    grid = _grid(header.comments, vertex.count)
    correlation = _correlation(header.comments)
    rows = found["vertex"]
    shape = grid or (vertex.count,)

    def array(names: tuple[str, ...]) -> NDArray[Any] | None:
        return _columns(rows, names).reshape(*shape, len(names)) if names[0] in vertex.properties else None

    points = array(POINT)
    assert points is not None
    sigma = array(("sigma_mm",))
    modes = [_columns(rows, _mode_names(k)).reshape(*shape, 3) for k in range(_mode_count(vertex))]
    causes = _causes(header.comments, len(modes))
    return Surface(
        points,
        normals=array(NORMAL),
        sigma_mm=None if sigma is None else sigma[..., 0],
        covariance=array(COVARIANCE),
        faces=_faces(found["face"], _face_name(face), vertex.count) if face and face.count else None,
        modes=np.stack(modes).astype("f8") if modes else None,
        mode_names=causes,
        correlation_points=correlation,
    )


def read_surface(path: PathLike) -> Surface:
    """The surface of a PLY file.

    Raises OSError (missing), FormatError (malformed; the message names the file and cause), InsufficientData (no
    point).
    """
    with naming(path):
        return _surface(path)


def write_surface(
    path: PathLike,
    surface: Surface,
    *,
    format: Literal["binary", "ascii"] = "binary",
    extra: Mapping[str, NDArray[Any]] | None = None,
) -> None:
    """Writes all that a surface holds, float64: points, normals, sigma_mm, covariance, faces, modes and the grid.

    The modes are the properties mode0_x, mode0_y, mode0_z, mode1_x ..., their names a comment. extra: further
    properties of the points, a name and a number a point each.
    """
    columns: list[tuple[str, NDArray[np.float64]]] = []

    def add(names: tuple[str, ...], values: NDArray[np.float64] | None) -> None:
        if values is not None:
            flat = values.reshape(-1, len(names))
            columns.extend((name, flat[:, i]) for i, name in enumerate(names))

    add(POINT, surface.points)
    add(NORMAL, surface.normals)
    add(("sigma_mm",), surface.sigma_mm)
    add(COVARIANCE, surface.covariance)
    for k, mode in enumerate(surface.modes if surface.modes is not None else ()):
        add(_mode_names(k), mode)
    for name, numbers in (extra or {}).items():
        add((name,), numbers)
    rows = np.empty(len(columns[0][1]), dtype=[(name, "<f8") for name, _ in columns])
    for name, values in columns:
        rows[name] = values
    elements: list[tuple[str, NDArray[Any], list[str]]] = [("vertex", rows, [f"double {name}" for name, _ in columns])]
    if surface.faces is not None:
        dtype = [("length", "u1"), ("a", "<i4"), ("b", "<i4"), ("c", "<i4")]
        triangles = np.empty(len(surface.faces), dtype=dtype)
        triangles["length"] = 3
        for i, corner in enumerate("abc"):
            triangles[corner] = surface.faces[:, i]
        elements.append(("face", triangles, ["list uchar int vertex_indices"]))
    comments = [f"sgrt correlation_points {surface.correlation_points!r}"]
    if surface.mode_names:
        comments.append("sgrt mode_names " + " ".join(quote(name, safe="") or "%" for name in surface.mode_names))
    if surface.grid_shape:
        height, width = surface.grid_shape
        comments.insert(0, f"sgrt grid {width} {height}")
    with writing(path) as stream:
        write(stream, format == "ascii", comments, elements)
