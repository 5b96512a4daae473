"""What the layouts of the public structs keep to; that they are the frozen ones is in test_frozen.py."""

from layouts import constants, structs, table


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
