"""The rows of a PLY file's elements as numpy arrays, ascii or binary little-endian, and their writing.

An element whose lists all have the length that its first row's have, as of triangles, is one array and read at once;
any other is walked row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import FormatError

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"},
}
FLOATS = ("f4", "f8")
CUT_SHORT = "cut short: the file ends within its {} element"
Rows = dict[str, Any]


@dataclass
class Element:
    name: str
    count: int
    properties: dict[str, str] = field(default_factory=dict)  # the type; of a list that of its items
    lists: dict[str, str] = field(default_factory=dict)  # the type of the lists' lengths

    def least(self, ascii_text: bool) -> int:
        """The bytes that a row takes at least: of ascii a digit and a space or newline a number."""
        first = [self.lists.get(name, kind) for name, kind in self.properties.items()]
        return 2 * len(first) if ascii_text else sum(int(TYPES[kind][1]) for kind in first)


def _walk(element: Element, take: Callable[[str, int], Any]) -> Rows:
    """One row; take(type, n) is its next n numbers."""
    row: Rows = {}
    for name, kind in element.properties.items():
        length = int(take(element.lists[name], 1)[0]) if name in element.lists else 1
        if length < 0:
            raise FormatError(f"{element.name} {name}: a list of {length} items")
        row[name] = take(kind, length)
    return row


def _rows_of(element: Element, walked: Iterable[Rows]) -> Rows:
    """The walked rows column by column; a list's column is a list of arrays."""
    columns: Rows = {name: [] for name in element.properties}
    for row in walked:
        for name, value in row.items():
            columns[name].append(value)
    return {n: v if n in element.lists else np.array(v).reshape(element.count) for n, v in columns.items()}


class Binary:
    """Takes elements from the front of a binary body."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def _row(self, element: Element) -> Rows:
        def take(kind: str, n: int) -> Any:
            start, dtype = self.at, np.dtype("<" + TYPES[kind])
            self.at += n * dtype.itemsize
            if self.at > len(self.data):
                raise FormatError(CUT_SHORT.format(element.name))
            return np.frombuffer(self.data, dtype, n, start)

        return _walk(element, take)

    def rows(self, element: Element) -> Rows:
        start, lengths = self.at, {}
        if element.lists and element.count:
            first = self._row(element)
            lengths = {name: len(first[name]) for name in element.lists}
            self.at = start
        fields: list[Any] = []
        for name, kind in element.properties.items():
            if name in lengths:
                fields.append((f"length of {name}", "<" + TYPES[element.lists[name]]))
            fields.append((name, "<" + TYPES[kind], (lengths[name],)) if name in lengths else (name, "<" + TYPES[kind]))
        dtype = np.dtype(fields)
        size = element.count * dtype.itemsize
        if start + size <= len(self.data):
            rows = np.frombuffer(self.data, dtype, element.count, start)
            if all(bool(np.all(rows[f"length of {name}"] == n)) for name, n in lengths.items()):
                self.at = start + size
                return {name: rows[name] for name in element.properties}
        return _rows_of(element, (self._row(element) for _ in range(element.count)))


class Ascii:
    """Takes elements from the front of an ascii body: a row a line."""

    def __init__(self, stream: BinaryIO) -> None:
        self.lines = (line for line in stream if not line.isspace())

    def _row(self, element: Element, line: bytes) -> Rows:
        words = line.split()

        def take(kind: str, n: int) -> Any:
            if n > len(words):
                raise FormatError(f"malformed numbers: a row of the {element.name} element has too few")
            values = [float(word) if TYPES[kind] in FLOATS else int(word) for word in words[:n]]
            del words[:n]
            return values

        row = _walk(element, take)
        if words:
            raise FormatError(f"malformed numbers: a row of the {element.name} element has too many")
        return row

    def rows(self, element: Element) -> Rows:
        lines = list(islice(self.lines, element.count))
        if len(lines) < element.count:
            raise FormatError(CUT_SHORT.format(element.name))
        if element.lists or not lines:
            return _rows_of(element, (self._row(element, line) for line in lines))
        self._row(element, lines[0])  # as many words as there are properties
        table = np.loadtxt(lines, comments=None, ndmin=2)
        with np.errstate(over="ignore"):  # a float32 beyond its range is infinite, which the surface refuses
            names = element.properties.items()
            return {n: table[:, i].astype("f4" if TYPES[k] == "f4" else "f8") for i, (n, k) in enumerate(names)}


def write(
    stream: BinaryIO, text: bool, comments: list[str], elements: list[tuple[str, NDArray[Any], list[str]]]
) -> None:
    """A PLY file. An element: its name, its rows (a structured array), and a line of the header for each property."""
    header = ["ply", f"format {'ascii' if text else 'binary_little_endian'} 1.0", *(f"comment {c}" for c in comments)]
    for name, rows, properties in elements:
        header += [f"element {name} {len(rows)}", *(f"property {line}" for line in properties)]
    stream.write("\n".join([*header, "end_header", ""]).encode("ascii"))
    for _, rows, _ in elements:
        if text:
            stream.write("".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist()).encode("ascii"))
        else:
            stream.write(rows.tobytes())
