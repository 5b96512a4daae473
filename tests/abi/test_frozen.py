"""The ABI is the frozen one: no symbol, signature, layout or constant is removed or changed, and what is new is in the
tables."""

import difflib
import shutil
import subprocess

import pytest
from abi import declared_functions
from freeze import ABIXML, ADVICE, LAYOUTS, SYMBOLS, breaks, entries, layouts, name_of, prototypes, stub, symbols


@pytest.mark.parametrize(("path", "now"), [(SYMBOLS, symbols), (LAYOUTS, layouts)], ids=["symbols", "layouts"])
def test_the_abi_is_the_frozen_one(path, now):
    frozen, fresh = path.read_text(), now()
    difference = "\n".join(difflib.unified_diff(frozen.splitlines(), fresh.splitlines(), path.name, "sgrt.h", "", ""))
    broken = "".join(f"\nBREAKS {line}" for line in breaks(frozen, fresh))
    assert not difference, f"{difference}{broken}\n{ADVICE}"


def test_every_function_is_frozen():
    assert set(entries(SYMBOLS.read_text())) == set(map(name_of, prototypes())) == declared_functions()


@pytest.mark.skipif(shutil.which("abidiff") is None, reason="abidiff (abigail-tools) is not installed")
def test_abidiff_agrees(tmp_path):
    """Types as the compiler sees them, down to what a pointer points to."""
    done = subprocess.run(["abidiff", ABIXML, stub(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stdout}{done.stderr}\n{ADVICE}"


SYMBOL_TABLE = "libsgrt.so.0.9\nvoid sgrt_a_free(sgrt_a *)\nsgrt_status sgrt_a_get(const sgrt_a *, double [3])\n"
LAYOUT_TABLE = """head
sgrt_a_options 16
  struct_size 0 4
  count 4 4
  size_mm 8 8
sgrt_view 8
  data 0 8
SGRT_OK = 0
"""


@pytest.mark.parametrize(
    ("table", "old", "new", "broken"),
    [
        (SYMBOL_TABLE, "void sgrt_a_free(sgrt_a *)\n", "", "sgrt_a_free: removed"),
        (SYMBOL_TABLE, "double [3]", "double [6]", "sgrt_a_get: was"),
        (SYMBOL_TABLE, "void sgrt_a_free", "sgrt_status sgrt_a_free", "sgrt_a_free: was"),
        (LAYOUT_TABLE, "  count 4 4\n", "", "sgrt_a_options.count: removed"),
        (LAYOUT_TABLE, "count 4 4", "count 4 8", "sgrt_a_options.count: was 4 4"),
        (LAYOUT_TABLE, "sgrt_view 8", "sgrt_view 16", "sgrt_view: was 8, is 16"),
        (LAYOUT_TABLE, "SGRT_OK = 0", "SGRT_OK = 1", "SGRT_OK: was 0, is 1"),
    ],
)
def test_a_break_is_seen(table, old, new, broken):
    assert old in table
    (line,) = breaks(table, table.replace(old, new))
    assert line.startswith(broken)


@pytest.mark.parametrize(
    ("table", "old", "new"),
    [
        (SYMBOL_TABLE, "void sgrt_a_free", "void sgrt_a_extra(void)\nvoid sgrt_a_free"),
        (LAYOUT_TABLE, "sgrt_a_options 16", "sgrt_a_options 24"),
        (LAYOUT_TABLE, "  size_mm 8 8\n", "  size_mm 8 8\n  more_mm 16 8\n"),
        (LAYOUT_TABLE, "SGRT_OK = 0", "SGRT_OK = 0\nSGRT_NEW = 1"),
    ],
)
def test_an_addition_breaks_nothing(table, old, new):
    assert old in table
    assert breaks(table, table.replace(old, new)) == []
