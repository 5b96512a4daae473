"""What all formats share: whole files or none, errors that name the file, strict JSON."""

from __future__ import annotations

import contextlib
import json
import math
import os
import secrets
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import Error, FormatError, InvalidArgument, LimitError

PathLike = str | os.PathLike[str]

MAX_JSON_BYTES = 16 * 2**20
MAX_JSON_DEPTH = 16


@contextlib.contextmanager
def writing(path: PathLike) -> Iterator[BinaryIO]:
    """A file that appears under its name when the block ends well, and leaves nothing behind when it does not."""
    target = Path(path)
    if target.exists() and not target.is_file():
        raise OSError(f"{target}: exists and is not a file")
    temporary = target.parent / f".sgrt-{secrets.token_hex(8)}.tmp"
    try:
        stream = temporary.open("xb")
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(target)) from error
    try:
        with stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextlib.contextmanager
def naming(path: PathLike) -> Iterator[None]:
    """Puts the file's name before what the library says of its content; wrong content is a format error."""
    try:
        yield
    except Error as error:
        kind = FormatError if isinstance(error, InvalidArgument) else type(error)
        raise kind(f"{path}: {error}") from error


def _no_constant(word: str) -> Any:
    raise FormatError(f"{word} is not JSON")


def _no_duplicates(items: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(items)
    if len(found) != len(items):
        keys = [key for key, _ in items]
        raise FormatError(f"the key {next(k for k in keys if keys.count(k) > 1)!r} stands twice")
    return found


def _depth(value: Any) -> int:
    depth, level = 0, [value]
    while level:
        depth += 1
        children = [v.values() if isinstance(v, dict) else v for v in level if isinstance(v, dict | list)]
        level = [child for group in children for child in group]
    return depth


def read_text(path: PathLike) -> str:
    """A UTF-8 text of at most 16 MiB."""
    with Path(path).open("rb") as stream:
        data = stream.read(MAX_JSON_BYTES + 1)
    if len(data) > MAX_JSON_BYTES:
        raise LimitError(f"{path}: more than {MAX_JSON_BYTES} bytes of JSON")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: not UTF-8: byte {error.start}") from error


def parse_json(text: str) -> dict[str, Any]:
    """Strict: no NaN, no key twice, an object at the top, not deeper than 16."""
    try:
        value = json.loads(text, parse_constant=_no_constant, object_pairs_hook=_no_duplicates)
    except json.JSONDecodeError as error:
        raise FormatError(f"not JSON: line {error.lineno}: {error.msg}") from error
    except RecursionError:
        raise LimitError(f"nested more than {MAX_JSON_DEPTH} deep") from None
    except FormatError:
        raise
    except ValueError as error:  # an integer of thousands of digits
        raise FormatError(f"not JSON: {error}") from error
    if not isinstance(value, dict):
        raise FormatError("expected a JSON object")
    if _depth(value) - 1 > MAX_JSON_DEPTH:
        raise LimitError(f"nested more than {MAX_JSON_DEPTH} deep")
    return value


def check_schema(value: dict[str, Any], schema: str) -> None:
    found = value.get("schema")
    if found != schema:
        raise FormatError(f"schema is {found!r}; expected {schema!r}")


def numbers(value: Any, shape: Sequence[int | None], name: str) -> NDArray[np.float64]:
    """Nested lists of finite numbers of this shape; None: any length."""

    def check(part: Any, rest: Sequence[int | None], where: str) -> Any:
        if not rest:
            if isinstance(part, bool) or not isinstance(part, int | float):
                raise FormatError(f"{where} is {part!r}; expected a number")
            try:
                number = float(part)
            except OverflowError:
                number = math.inf
            if not math.isfinite(number):
                raise FormatError(f"{where} is not a finite number")
            return number
        if not isinstance(part, list):
            raise FormatError(f"{where} is {part!r}; expected a list")
        if rest[0] is not None and len(part) != rest[0]:
            raise FormatError(f"{where} has {len(part)} entries; expected {rest[0]}")
        return [check(item, rest[1:], f"{where}[{i}]") for i, item in enumerate(part)]

    flat = np.array(check(value, shape, name), dtype=np.float64)
    return flat.reshape([-1 if n is None else n for n in shape])


def plain(value: Any) -> Any:
    """Arrays and tuples as lists, and what is not finite as null."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def json_text(document: dict[str, Any]) -> str:
    return json.dumps(plain(document), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def write_json(path: PathLike, document: dict[str, Any]) -> None:
    data = json_text(document).encode()
    with writing(path) as stream:
        stream.write(data)
