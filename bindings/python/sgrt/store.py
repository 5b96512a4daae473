"""References of plans and fields in one SQLite file: versioned, never overwritten, without personal data.

An entry is the PLY, its document and its ROI; a new one for the same plan and field gets the next version. SQLite
writes each entry whole or not at all; triggers refuse changes, also those of other programs.
"""

from __future__ import annotations

import contextlib
import datetime
import hashlib
import json
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from .errors import FormatError
from .io._files import PathLike, check_schema, json_text, parse_json
from .reference import SCHEMA

APPLICATION_ID = 0x73677274  # "sgrt"
VERSION = 2  # 1: its digest was that of the surface alone
WAIT_S = 5.0
_TABLE = """
CREATE TABLE reference (
  id INTEGER PRIMARY KEY,
  plan TEXT NOT NULL,
  field TEXT NOT NULL,
  version INTEGER NOT NULL,
  created TEXT NOT NULL,
  kind TEXT NOT NULL,
  document TEXT NOT NULL,
  roi TEXT,
  surface BLOB NOT NULL,
  sha256 TEXT NOT NULL,
  UNIQUE (plan, field, version)
);
CREATE TRIGGER reference_stays BEFORE UPDATE ON reference
  BEGIN SELECT RAISE(ABORT, 'references are never overwritten'); END;
CREATE TRIGGER reference_remains BEFORE DELETE ON reference
  BEGIN SELECT RAISE(ABORT, 'references are never deleted'); END;
"""


@dataclass(frozen=True)
class Entry:
    id: int
    plan: str
    field: str
    version: int
    created: str  # UTC, ISO 8601
    kind: str  # ct, rtstruct or captured
    document: dict[str, Any]
    roi: dict[str, Any] | None


_COLUMNS = "id, plan, field, version, created, kind, document, roi, surface, sha256"


def _digest(*parts: Any) -> str:
    """Of all that an entry says: a changed isocentre is as wrong as a changed surface."""
    digest = hashlib.sha256()
    for part in parts:
        data = part if isinstance(part, bytes) else b"-" if part is None else str(part).encode("utf-8", "surrogatepass")
        digest.update(len(data).to_bytes(8, "little") + data)
    return digest.hexdigest()


class ReferenceStore:
    """The store in a file; it is made where it does not exist and `create` is set. A context manager.

    Raises OSError: no such file, the disk is full, another process holds it for more than 5 s. FormatError: not a store
    of this library, or one of a later version; an entry whose bytes have changed.
    """

    def __init__(self, path: PathLike, *, create: bool = False) -> None:
        self._path = Path(path)
        exists = self._path.exists()
        if not exists and not create:
            raise FileNotFoundError(2, "no such store", str(self._path))
        with self._errors():
            self._connection = sqlite3.connect(self._path, timeout=WAIT_S, isolation_level=None)
        try:
            self._open(new=not exists or self._path.stat().st_size == 0)
        except BaseException:
            self._connection.close()
            if not exists:
                self._path.unlink(missing_ok=True)
            raise

    def _open(self, *, new: bool) -> None:
        with self._errors():
            if new:
                with self._writing():
                    if self._number("application_id") == 0:  # nobody else made it meanwhile
                        for statement in _TABLE.strip().split(";\n"):
                            end = ";" if statement.rstrip().endswith("END") else ""
                            self._connection.execute(statement + end)
                        self._connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                        self._connection.execute(f"PRAGMA user_version = {VERSION}")
            if self._number("application_id") != APPLICATION_ID:
                raise FormatError(f"{self._path}: not a store of references")
            if self._number("user_version") != VERSION:
                raise FormatError(f"{self._path}: a store of version {self._number('user_version')}; this is {VERSION}")

    def _number(self, pragma: str) -> int:
        return int(self._connection.execute(f"PRAGMA {pragma}").fetchone()[0])

    @contextlib.contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.OperationalError as error:
            what = str(error)
            if "locked" in what:
                what = f"another process has held the store for more than {WAIT_S:.0f} s"
            if "UTF-8" in what:
                raise FormatError(f"{self._path}: damaged: a text that is not UTF-8") from error
            raise OSError(5, " ".join(what.split()), str(self._path)) from error
        except sqlite3.DatabaseError as error:
            raise FormatError(f"{self._path}: {' '.join(str(error).split())}") from error

    def _entry(self, row: tuple[Any, ...]) -> Entry:
        """The entry of a row, if it is still what was added."""
        number, plan, field, version, created, kind, document, roi, surface, digest = row
        if _digest(plan, field, version, created, kind, document, roi, surface) != digest:
            raise FormatError(f"{self._path}: entry {number} has changed since it was added")
        return Entry(
            number, plan, field, version, created, kind, json.loads(document), json.loads(roi) if roi else None
        )

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._connection.execute("COMMIT")
        except BaseException:
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
            raise

    def close(self) -> None:
        self._connection.close()

    def __enter__(self) -> ReferenceStore:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def add(
        self, surface: bytes, document: dict[str, Any], *, plan: str, field: str, roi: dict[str, Any] | None = None
    ) -> Entry:
        """Adds a reference as the next version of its plan and field. surface: the bytes of its PLY."""
        check_schema(document, SCHEMA)
        for name, text in (("plan", plan), ("field", field)):
            if not text.strip() or len(text) > 200 or any(ord(c) < 32 for c in text):
                raise FormatError(f"{name}: {text[:80]!r}; expected a name of 1 to 200 characters in one line")
        created = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        texts = json_text(document), None if roi is None else json_text(roi)
        with self._errors(), self._writing():
            version = 1 + int(
                self._connection.execute(
                    "SELECT coalesce(max(version), 0) FROM reference WHERE plan = ? AND field = ?", (plan, field)
                ).fetchone()[0]
            )
            known = (plan, field, version, created, document["kind"], *texts)
            cursor = self._connection.execute(
                "INSERT INTO reference (plan, field, version, created, kind, document, roi, surface, sha256)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (*known, surface, _digest(*known, surface)),
            )
            found = cursor.lastrowid
        assert found is not None
        return Entry(found, plan, field, version, created, document["kind"], parse_json(texts[0]), roi)

    def entries(self, *, plan: str | None = None, field: str | None = None) -> list[Entry]:
        """All entries, or those of a plan or field, oldest first."""
        wanted = [(f"{name} = ?", text) for name, text in (("plan", plan), ("field", field)) if text is not None]
        where = " WHERE " + " AND ".join(clause for clause, _ in wanted) if wanted else ""
        with self._errors():
            rows = self._connection.execute(
                f"SELECT {_COLUMNS} FROM reference{where} ORDER BY id", [text for _, text in wanted]
            ).fetchall()
        return [self._entry(row) for row in rows]

    def entry(self, number: int) -> Entry:
        with self._errors():
            row = self._connection.execute(f"SELECT {_COLUMNS} FROM reference WHERE id = ?", (number,)).fetchone()
        if row is None:
            raise FormatError(f"{self._path}: has no entry {number}")
        return self._entry(row)

    def surface(self, number: int) -> bytes:
        """The PLY of an entry, byte for byte as it was added."""
        self.entry(number)
        with self._errors():
            row = self._connection.execute("SELECT surface FROM reference WHERE id = ?", (number,)).fetchone()
        return bytes(row[0])
