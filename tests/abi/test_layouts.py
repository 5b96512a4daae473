"""The layouts of the public structs and the values of the constants are those of the committed table."""

import difflib
from pathlib import Path

from layouts import constants, structs, table


# REQ-ABI-009
def test_layouts_are_the_committed_ones():
    committed = Path(__file__).with_name("layouts.txt").read_text().splitlines()[1:]
    now = table().splitlines()
    difference = "\n".join(difflib.unified_diff(committed, now, "layouts.txt", "sgrt.h", lineterm=""))
    assert not difference, f"the ABI changed (see tests/abi/layouts.py):\n{difference}"


def test_the_header_was_read():
    names = dict(structs())
    assert names["sgrt_view"] == ["data", "dtype", "ndim", "shape", "strides"]
    assert names["sgrt_couch_correction"][:2] == ["lat_mm", "lng_mm"]
    assert "SGRT_E_INTERNAL" in constants() and len(constants()) == len(set(constants()))


def test_sized_structs_begin_with_their_size():
    frozen = {"sgrt_view", "sgrt_mut_view", "sgrt_patient_displacement", "sgrt_couch_correction"}
    for name, members in structs():
        assert (members[0] == "struct_size") == (name not in frozen), name


def test_no_hidden_padding():
    """Members follow each other without a gap, to the end of the struct."""
    name, end, size = "", 0, 0
    for line in [*table().splitlines(), "end 0"]:
        if "=" in line:
            continue
        if not line.startswith(" "):
            assert end == size, f"{name}: padding at its end"
            name, size, end = line.split()[0], int(line.split()[1]), 0
        else:
            member, offset, length = line.split()
            assert int(offset) == end, f"{name}.{member}: padding before it"
            end += int(length)
