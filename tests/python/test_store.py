"""The store of references: versions, nothing overwritten, whole or not at all."""

import os
import sqlite3
import threading

import pytest
import sgrt
from sgrt import store as store_module
from sgrt.store import ReferenceStore

DOCUMENT = {"schema": "sgrt-reference/1", "kind": "captured", "source": {}}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "references.sqlite"


def test_versions_count_a_plan_and_field(path):
    with ReferenceStore(path, create=True) as store:
        got = [store.add(b"a", DOCUMENT, plan=p, field=f) for p, f in (("P", "F"), ("P", "F"), ("P", "G"), ("Q", "F"))]
        assert [entry.version for entry in got] == [1, 2, 1, 1]
        assert [entry.id for entry in store.entries(plan="P", field="F")] == [1, 2]
    with ReferenceStore(path) as store:
        assert [entry.id for entry in store.entries()] == [1, 2, 3, 4]
        assert store.surface(2) == b"a"
        assert store.entry(3).document == DOCUMENT


# REQ-FILE-005
def test_entries_cannot_be_changed(path):
    with ReferenceStore(path, create=True) as store:
        store.add(b"a", DOCUMENT, plan="P", field="F")
    other = sqlite3.connect(path)
    for statement in ("UPDATE reference SET plan = 'X'", "DELETE FROM reference"):
        with pytest.raises(sqlite3.IntegrityError, match="never"):
            other.execute(statement)
    other.close()


# REQ-FILE-005
def test_a_changed_surface_is_noticed(path):
    with ReferenceStore(path, create=True) as store:
        store.add(b"honest bytes", DOCUMENT, plan="P", field="F")
    path.write_bytes(path.read_bytes().replace(b"honest", b"forged"))
    with ReferenceStore(path) as store, pytest.raises(sgrt.FormatError, match="entry 1 has changed"):
        store.surface(1)


# REQ-FILE-005
def test_a_changed_document_or_region_is_noticed(path):
    """An isocentre that changed in the file is as wrong as a surface that did."""
    document = DOCUMENT | {"isocentre_mm": [1.5, 2.5, 3.5]}
    for old, new in ((b"2.5", b"9.5"), (b"reg7", b"reg8"), (b"FieldX", b"FieldY")):
        path.unlink(missing_ok=True)
        with ReferenceStore(path, create=True) as store:
            store.add(b"s", document, plan="P", field="FieldX", roi={"schema": "reg7"})
            assert store.entry(1).document == document
        data = path.read_bytes()
        assert old in data
        path.write_bytes(data.replace(old, new))
        with ReferenceStore(path) as store:
            for read in (store.entries, lambda store=store: store.entry(1), lambda store=store: store.surface(1)):
                with pytest.raises(sgrt.FormatError, match=r"entry 1 has changed|malformed"):
                    read()


def test_bad_files(path, tmp_path):
    with pytest.raises(OSError, match="no such store"):
        ReferenceStore(path)
    assert not path.exists()
    path.write_text("this is a text, and long enough for a header of SQLite" * 10)
    with pytest.raises(sgrt.FormatError, match="not a database"):
        ReferenceStore(path)
    foreign = tmp_path / "foreign.sqlite"
    other = sqlite3.connect(foreign)
    other.execute("CREATE TABLE t (x)")
    other.close()
    with pytest.raises(sgrt.FormatError, match="not a store of references"):
        ReferenceStore(foreign, create=True)
    with ReferenceStore(tmp_path / "new.sqlite", create=True):
        pass
    other = sqlite3.connect(tmp_path / "new.sqlite")
    other.execute("PRAGMA user_version = 9")
    other.close()
    with pytest.raises(sgrt.FormatError, match="version 9"):
        ReferenceStore(tmp_path / "new.sqlite")


# REQ-FILE-001
def test_bad_entries(path):
    with ReferenceStore(path, create=True) as store:
        with pytest.raises(sgrt.FormatError, match="schema"):
            store.add(b"", {"schema": "other"}, plan="P", field="F")
        for name in ("", "  ", "x" * 300, "two\nlines"):
            with pytest.raises(sgrt.FormatError, match="field"):
                store.add(b"", DOCUMENT, plan="P", field=name)
        with pytest.raises(sgrt.FormatError, match="no entry 1"):
            store.surface(1)
        assert store.entries() == []


# REQ-FILE-004
def test_a_full_disk_leaves_the_store_as_it_was(path):
    with ReferenceStore(path, create=True) as store:
        store.add(b"a" * 100, DOCUMENT, plan="P", field="F")
        store._connection.execute("PRAGMA max_page_count = 12")
        with pytest.raises(OSError, match="full"):
            store.add(os.urandom(200_000), DOCUMENT, plan="P", field="F")
        assert [entry.version for entry in store.entries()] == [1]
        store._connection.execute("PRAGMA max_page_count = 10000")
        assert store.add(b"b", DOCUMENT, plan="P", field="F").version == 2
    with ReferenceStore(path) as store:
        assert store.surface(1) == b"a" * 100


def test_a_store_that_another_process_holds(path, monkeypatch):
    monkeypatch.setattr(store_module, "WAIT_S", 0.1)
    with ReferenceStore(path, create=True) as store:
        other = sqlite3.connect(path, isolation_level=None)
        other.execute("BEGIN EXCLUSIVE")
        with pytest.raises(OSError, match="another process"):
            store.add(b"a", DOCUMENT, plan="P", field="F")
        other.execute("ROLLBACK")
        other.close()
        assert store.add(b"a", DOCUMENT, plan="P", field="F").version == 1


def test_writers_at_once_get_versions_of_their_own(path):
    with ReferenceStore(path, create=True):
        pass

    def write():
        with ReferenceStore(path) as store:
            for _ in range(5):
                store.add(b"x", DOCUMENT, plan="P", field="F")

    threads = [threading.Thread(target=write) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with ReferenceStore(path) as store:
        assert sorted(entry.version for entry in store.entries()) == list(range(1, 21))
