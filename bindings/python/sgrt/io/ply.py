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
from plyfile import PlyData, PlyElement, PlyParseError

from .._core import Surface
from ..errors import FormatError, LimitError
from ._files import PathLike, naming, writing

MAX_HEADER_BYTES = 2**16
MAX_POINTS = 50_000_000
POINT = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
COVARIANCE = ("cxx", "cxy", "cxz", "cyy", "cyz", "czz")
SIZES = {
    **{"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4, "double": 8},
    **{"int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "float32": 4, "float64": 8},
}
FLOATS = ("float", "double", "float32", "float64")


@dataclass
class _Element:
    name: str
    count: int
    properties: dict[str, str] = field(default_factory=dict)  # the type; of a list "list"
    least_bytes: int = 0  # of one row
    least_words: int = 0


@dataclass
class _Header:
    format: str = ""
    comments: list[str] = field(default_factory=list)
    elements: list[_Element] = field(default_factory=list)
    size: int = 0

    def element(self, name: str) -> _Element | None:
        return next((e for e in self.elements if e.name == name), None)


def _count(word: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 19):
        raise FormatError(f"header: {word!r} is not a count")
    return int(word)


def _property(element: _Element, words: list[str]) -> None:
    is_list = len(words) == 5 and words[1] == "list"
    types = words[2:4] if is_list else words[1:2]
    if (len(words) != 3 and not is_list) or any(t not in SIZES for t in types):
        raise FormatError(f"header: {' '.join(words)!r} is not a property")
    if words[-1] in element.properties:
        raise FormatError(f"header: the property {words[-1]!r} stands twice")
    element.properties[words[-1]] = "list" if is_list else words[1]
    element.least_bytes += SIZES[types[0]]
    element.least_words += 1


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
                header.elements.append(_Element(name, _count(count)))
            case ["property", *_] if header.elements:
                _property(header.elements[-1], words)
            case _:
                raise FormatError(f"header: {' '.join(words)[:60]!r} is not understood")
    raise FormatError("header: no end_header")


def _check(header: _Header, file_bytes: int) -> None:
    """Nothing is allocated before the bytes for it are seen."""
    if header.format not in ("ascii", "binary_little_endian"):
        raise FormatError(f"format {header.format!r}; expected ascii or binary_little_endian")
    ascii_text = header.format == "ascii"
    # Of ascii every value takes a digit and a space or newline, but for the last.
    least = sum(e.count * (2 * e.least_words if ascii_text else e.least_bytes) for e in header.elements)
    if least > file_bytes - header.size + ascii_text:
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
            if vertex.properties[name] not in FLOATS:
                raise FormatError(f"vertex {name}: type {vertex.properties[name]}; expected float or double")


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


def _columns(vertex: Any, names: tuple[str, ...]) -> NDArray[Any]:
    wide = any(vertex[name].dtype.itemsize == 8 for name in names)
    return np.stack([vertex[name] for name in names], axis=-1).astype("f8" if wide else "f4", copy=False)


def _mode_names(k: int) -> tuple[str, ...]:
    return tuple(f"mode{k}_{axis}" for axis in "xyz")


def _mode_count(vertex: _Element) -> int:
    count = 0
    while all(vertex.properties.get(name) in FLOATS for name in _mode_names(count)):
        count += 1
    if any(name.startswith("mode") and name[4:5].isdigit() and int(name[4:5]) >= count for name in vertex.properties):
        raise FormatError("vertex: the properties mode0_x, mode0_y, mode0_z, mode1_x ... have a gap")
    return count


def _face_name(element: _Element) -> str:
    for name in ("vertex_indices", "vertex_index"):
        if element.properties.get(name) == "list":
            return name
    raise FormatError("face lacks the list 'vertex_indices'")


def _faces(ply: PlyData, element: _Element, name: str) -> NDArray[np.int32]:
    rows = ply["face"][name]
    if rows.dtype == object:
        lengths = {len(row) for row in rows}
        if lengths - {3}:
            raise FormatError(f"a face with {max(lengths - {3})} corners; expected triangles")
        rows = np.stack(list(rows)) if len(rows) else np.empty((0, 3), np.int32)
    indices: NDArray[np.int64] = np.asarray(rows, dtype=np.int64).reshape(element.count, -1)
    wrong = indices[(indices < 0) | (indices >= ply["vertex"].count)]
    if wrong.size:
        raise FormatError(f"a face names the point {wrong[0]}; there are {ply['vertex'].count}")
    return indices.astype(np.int32)


@contextlib.contextmanager
def _parse_errors() -> Iterator[None]:
    try:
        yield
    except PlyParseError as error:
        raise FormatError(f"not a PLY file that can be read: {error}") from error
    except (ValueError, EOFError, UnicodeDecodeError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"malformed numbers: {str(error).splitlines()[0]}") from error


def _surface(path: PathLike) -> Surface:
    with Path(path).open("rb") as stream:
        header = _header(stream)
        _check(header, os.fstat(stream.fileno()).st_size)
    vertex, face = header.element("vertex"), header.element("face")
    assert vertex is not None
    face_name = _face_name(face) if face and face.count else None
    grid = _grid(header.comments, vertex.count)
    correlation = _correlation(header.comments)
    with _parse_errors():
        try:  # triangles are read at once; anything else row by row, to say what it is
            ply = PlyData.read(
                os.fspath(path), mmap=False, known_list_len={"face": {face_name: 3}} if face_name else {}
            )
        except PlyParseError:
            if not face_name:
                raise
            ply = PlyData.read(os.fspath(path), mmap=False)
    rows = ply["vertex"]
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
        faces=_faces(ply, face, face_name) if face and face_name else None,
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
    elements = [PlyElement.describe(rows, "vertex")]
    if surface.faces is not None:
        triangles = np.empty(len(surface.faces), dtype=[("vertex_indices", "<i4", (3,))])
        triangles["vertex_indices"] = surface.faces
        elements.append(PlyElement.describe(triangles, "face"))
    comments = [f"sgrt correlation_points {surface.correlation_points!r}"]
    if surface.mode_names:
        comments.append("sgrt mode_names " + " ".join(quote(name, safe="") or "%" for name in surface.mode_names))
    if surface.grid_shape:
        height, width = surface.grid_shape
        comments.insert(0, f"sgrt grid {width} {height}")
    with writing(path) as stream:
        PlyData(elements, text=format == "ascii", byte_order="<", comments=comments).write(stream)
