"""Files: what is written is read back to the last bit; a bad file is one line that names it; whole files or none."""

import json
import os
import struct
import zlib

import numpy as np
import pytest
import sgrt
from conftest import ISOCENTRE, body_points, rig_document
from PIL import Image
from sgrt import io

ARRAYS = ("points", "normals", "sigma_mm", "covariance", "faces", "modes")


def same(a, b):
    assert a.grid_shape == b.grid_shape
    assert a.correlation_points == b.correlation_points
    for name in ARRAYS:
        x, y = getattr(a, name), getattr(b, name)
        if x is None or y is None:
            assert x is y, name
        else:
            assert np.array_equal(x, y, equal_nan=True), name


# ----------------------------------------------------------------------------------------------------------------- PLY


@pytest.mark.parametrize("format", ["binary", "ascii"])
def test_surface_round_trip(tmp_path, format, reference, stereo):
    mesh = sgrt.Surface(
        body_points(5, 1),
        normals=np.tile([0.0, 0, 1], (5, 1)),
        covariance=np.tile([1.0, 0.1, 0.2, 1, 0.3, 1], (5, 1)),
        faces=np.array([[0, 1, 2], [2, 3, 4]], dtype=np.int32),
        modes=np.random.default_rng(0).normal(size=(2, 5, 3)),
        correlation_points=12.5,
    )
    for surface in (sgrt.Surface(body_points(3, 1)), mesh, reference, stereo.surface):
        io.write_surface(tmp_path / "s.ply", surface, format=format)
        same(io.read_surface(tmp_path / "s.ply"), surface)
    assert [p.name for p in tmp_path.iterdir()] == ["s.ply"]


def test_the_header_is_the_contract(tmp_path, stereo):
    io.write_surface(tmp_path / "s.ply", stereo.surface)
    header = (tmp_path / "s.ply").read_bytes().split(b"end_header")[0].decode()
    height, width = stereo.surface.grid_shape
    assert header.startswith("ply\nformat binary_little_endian 1.0\n")
    assert f"comment sgrt grid {width} {height}\n" in header
    names = [line.split()[2] for line in header.splitlines() if line.startswith("property")]
    assert names == ["x", "y", "z", "nx", "ny", "nz", "sigma_mm", "cxx", "cxy", "cxz", "cyy", "cyz", "czz"]


def test_reads_what_others_write(tmp_path):
    (tmp_path / "a.ply").write_text(
        "ply\r\nformat ascii 1.0\r\ncomment of somebody\r\nobj_info x\r\nelement vertex 3\r\nproperty float x\r\n"
        "property float y\r\nproperty double z\r\nproperty uchar red\r\nelement face 1\r\n"
        "property list uchar int vertex_index\r\nelement edge 0\r\nproperty int v\r\nend_header\r\n"
        "0 0 0 255\r\n1 0 0 255\r\n0 1 0 255\r\n3 0 1 2\r\n"
    )
    s = io.read_surface(tmp_path / "a.ply")
    assert s.faces.tolist() == [[0, 1, 2]]
    assert s.normals.tolist() == [[0, 0, 1]] * 3


def test_reads_elements_and_lists_in_any_order(tmp_path):
    """Faces first, with a flag and texture coordinates; a list of every length in an element that is skipped."""
    head = (
        "ply\nformat {} 1.0\nelement face 2\nproperty uchar flag\nproperty list uchar uint vertex_indices\n"
        "property list uchar float texcoord\nelement strip 2\nproperty list int short way\nelement vertex 3\n"
        "property double x\nproperty float y\nproperty list char char tag\nproperty float z\n"
        "element after 1\nproperty float w\nend_header\n"
    )
    text = "7 3 0 1 2 2 0.5 0.25\n7 3 2 1 0 0\n0\n3 5 -6 7\n1 2 0 3\n4 5 2 -1 1 6\n\n7 8.5 1 9 9\nwhatever\n"
    binary = struct.pack("<BBIIIBff", 7, 3, 0, 1, 2, 2, 0.5, 0.25) + struct.pack("<BBIIIB", 7, 3, 2, 1, 0, 0)
    binary += struct.pack("<ii", 0, 3) + struct.pack("<hhh", 5, -6, 7)
    binary += struct.pack("<dfbf", 1, 2, 0, 3) + struct.pack("<dfbbbf", 4, 5, 2, -1, 1, 6)
    binary += struct.pack("<dfbbf", 7, 8.5, 1, 9, 9)
    for format, body in (("ascii", text.encode()), ("binary_little_endian", binary + b"1234")):
        (tmp_path / "a.ply").write_bytes(head.format(format).encode() + body)
        s = io.read_surface(tmp_path / "a.ply")
        assert s.points.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8.5, 9]]
        assert s.faces.tolist() == [[0, 1, 2], [2, 1, 0]]
    head = head.format("binary_little_endian").encode()
    for size in range(len(binary)):
        (tmp_path / "a.ply").write_bytes(head + binary[:size])
        with pytest.raises(sgrt.FormatError, match="cut short"):
            io.read_surface(tmp_path / "a.ply")


VERTEX = "property float x\nproperty float y\nproperty float z\n"


def ply(body="0 0 0\n", vertices=1, properties=VERTEX, format="ascii", before="", after=""):
    return f"ply\nformat {format} 1.0\n{before}element vertex {vertices}\n{properties}{after}end_header\n{body}"


FACE = "element face 1\nproperty list uchar int vertex_indices\n"
BAD_PLY = {
    "empty file": ("", "not a PLY"),
    "another format": ("solid stl\n", "not a PLY"),
    "no end": ("ply\nformat ascii 1.0\nelement vertex 3\n", "end_header"),
    "no format": ("ply\nelement vertex 1\n" + VERTEX + "end_header\n0 0 0\n", "format"),
    "big endian": (ply(format="binary_big_endian"), "binary_big_endian"),
    "nonsense": (ply(before="whatever 3\n"), "whatever"),
    "no vertex": ("ply\nformat ascii 1.0\nend_header\n", "vertex"),
    "no z": (ply(properties="property float x\nproperty float y\n"), "'z'"),
    "half a normal": (ply(properties=VERTEX + "property float nx\n", body="0 0 0 1\n"), "'ny'"),
    "integer points": (ply(properties=VERTEX.replace("float x", "int x")), "int"),
    "x twice": (ply(properties=VERTEX + "property float x\n"), "twice"),
    "unknown type": (ply(properties=VERTEX.replace("float x", "half x")), "half x"),
    "a count that is none": (ply(vertices="-1"), "-1"),
    "a count beyond the file": (ply(vertices=10**15), "cut short"),
    "a count beyond 64 bits": (ply(vertices=10**30), "count"),
    "faces beyond the file": (ply(after=FACE.replace("face 1", "face 999999999")), "cut short"),
    "cut short": (ply(vertices=2, body="0 0 0 0\n"), "cut short"),
    "too few words": (ply(body="0 0\n\n\n\n\n"), "PLY|malformed"),
    "words": (ply(body="a b c d e f\n"), "malformed|PLY"),
    "a decimal comma": (ply(body="0,5 0,5 0,5\n"), "malformed|PLY"),
    "NaN in a cloud": (ply(body="0 0 nan\n"), "points"),
    "infinite": (ply(body="0 0 inf\n"), "points"),
    "beyond float32": (ply(body="0 0 1e300\n"), "points"),
    "too many words": (ply(body="0 0 0 0\n"), "too many"),
    "rows of two lengths": (ply(vertices=2, body="0 0 0\n0 0 0 0\n"), "malformed"),
    "a hash": (ply(body="0 0 0 # one\n"), "too many"),
    "a list of points": (ply(properties=VERTEX.replace("float x", "list uchar float x"), body="1 0 0 0\n"), "list"),
    "a list of -1": (ply(after=FACE.replace("uchar", "char"), body="0 0 0\n-1\n"), "-1 items"),
    "an index of 1e30": (ply(after=FACE, body=f"0 0 0\n3 0 0 {10**30}\n"), "malformed"),
    "half an index": (ply(after=FACE, body="0 0 0\n3 0 0 0.5\n"), "malformed"),
    "an empty element": (ply(before="element void 100000000000000000\n"), "void"),
    "far away": (ply(body="0 0 1e9\n"), "points"),
    "sigma of 0": (ply(properties=VERTEX + "property float sigma_mm\n", body="0 0 0 0\n"), "sigma_mm"),
    "normal of 0": (
        ply(properties=VERTEX + "property float nx\nproperty float ny\nproperty float nz\n", body="0 0 0 0 0 0\n"),
        "normals",
    ),
    "face out of range": (ply(after=FACE, body="0 0 0\n3 0 0 7\n"), "point 7"),
    "a quad": (ply(after=FACE, body="0 0 0\n4 0 0 0 0\n"), "4 corners"),
    "face without indices": (ply(after="element face 1\nproperty int v\n", body="0 0 0\n3\n"), "vertex_indices"),
    "a grid of another size": (ply(before="comment sgrt grid 2 2\n"), "grid"),
    "a grid of words": (ply(before="comment sgrt grid a b\n"), "'a'"),
    "a grid of one number": (ply(before="comment sgrt grid 1\n"), "grid"),
    "a grid twice": (ply(before="comment sgrt grid 1 1\n" * 2), "grid"),
    "correlation of words": (ply(before="comment sgrt correlation_points x\n"), "correlation_points"),
    "correlation of 0": (ply(before="comment sgrt correlation_points 0\n"), "correlation_points"),
    "modes with a gap": (
        ply(properties=VERTEX + "".join(f"property float mode1_{a}\n" for a in "xyz"), body="0 0 0 1 1 1\n"),
        "gap",
    ),
}


@pytest.mark.parametrize("name", BAD_PLY)
def test_bad_ply(tmp_path, name):
    text, message = BAD_PLY[name]
    path = tmp_path / "bad.ply"
    path.write_text(text)
    with pytest.raises(sgrt.FormatError, match=message) as error:
        io.read_surface(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_binary_cut_short(tmp_path):
    io.write_surface(tmp_path / "s.ply", sgrt.Surface(body_points(100, 1)))
    data = (tmp_path / "s.ply").read_bytes()
    for size in (len(data) - 1, len(data) - 1000, 60, 3):
        (tmp_path / "cut.ply").write_bytes(data[:size])
        with pytest.raises(sgrt.FormatError, match=r"cut\.ply"):
            io.read_surface(tmp_path / "cut.ply")


def test_no_point(tmp_path):
    (tmp_path / "none.ply").write_text(ply(vertices=0, body=""))
    with pytest.raises(sgrt.InsufficientData, match=r"none.ply: .*point"):
        io.read_surface(tmp_path / "none.ply")


def test_flipped_bytes_never_crash(tmp_path):
    io.write_surface(tmp_path / "s.ply", sgrt.Surface(body_points(20, 1)).estimate_normals())
    data = bytearray((tmp_path / "s.ply").read_bytes())
    rng = np.random.default_rng(1)
    for _ in range(300):
        broken = data.copy()
        for at in rng.integers(0, len(data), 3):
            broken[at] = rng.integers(0, 256)
        (tmp_path / "b.ply").write_bytes(broken)
        try:
            io.read_surface(tmp_path / "b.ply")
        except sgrt.Error as error:
            assert "b.ply: " in str(error)


# ----------------------------------------------------------------------------------------------------------------- PNG


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_image_round_trip(tmp_path, dtype):
    image = np.random.default_rng(0).integers(0, np.iinfo(dtype).max + 1, (13, 17)).astype(dtype)
    io.write_image(tmp_path / "i.png", image)
    back = io.read_image(tmp_path / "i.png")
    assert back.dtype == dtype
    assert np.array_equal(back, image)
    assert back.flags.c_contiguous


@pytest.mark.parametrize(
    ("mode", "message"),
    [("RGB", "RGB colour"), ("RGBA", "alpha"), ("LA", "alpha"), ("P", "palette"), ("1", "1 bit")],
)
def test_no_colour(tmp_path, mode, message):
    Image.new(mode, (8, 8)).save(tmp_path / "c.png")
    with pytest.raises(sgrt.FormatError, match=rf"c\.png: .*{message}"):
        io.read_image(tmp_path / "c.png")


def png(width, height, depth=8, colour=0, data=b""):
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (b"", sgrt.FormatError),
        (b"GIF89a", sgrt.FormatError),
        (b"\x89PNG\r\n\x1a\n", sgrt.FormatError),
        (png(30000, 30000, data=zlib.compress(b"")), sgrt.FormatError),
        (png(0, 5), sgrt.FormatError),
        (png(40000, 1), sgrt.LimitError),
        (png(8, 8, data=zlib.compress(b"\0" * 20)), sgrt.FormatError),
        (png(8, 8, data=b"nonsense" * 9), sgrt.FormatError),
        (png(8, 8, depth=4, data=zlib.compress(b"\0" * 100)), sgrt.FormatError),
    ],
)
def test_bad_png(tmp_path, data, error):
    (tmp_path / "bad.png").write_bytes(data)
    with pytest.raises(error, match=r"bad\.png: "):
        io.read_image(tmp_path / "bad.png")


def test_cut_png(tmp_path):
    io.write_image(tmp_path / "i.png", np.random.default_rng(0).integers(0, 256, (90, 90)).astype(np.uint8))
    data = (tmp_path / "i.png").read_bytes()
    for size in range(0, len(data) - 12, 601):
        (tmp_path / "cut.png").write_bytes(data[:size])
        with pytest.raises(sgrt.FormatError, match=r"cut\.png: "):
            io.read_image(tmp_path / "cut.png")


def test_write_image_refuses(tmp_path):
    for image in (np.zeros((3, 3)), np.zeros((3, 3, 3), np.uint8), np.zeros((0, 3), np.uint8)):
        with pytest.raises(sgrt.InvalidArgument):
            io.write_image(tmp_path / "i.png", image)
    assert not list(tmp_path.iterdir())


# ---------------------------------------------------------------------------------------------------------------- JSON


def test_roi_round_trip(tmp_path, reference):
    for roi in (sgrt.Roi.polygon([[-50.5, -50], [50, -60], [0, 70]]), sgrt.Roi.box((-50, -50, 0), (50, 40, 200))):
        io.write_roi(tmp_path / "roi.json", roi)
        assert np.array_equal(io.read_roi(tmp_path / "roi.json").mask(reference), roi.mask(reference))
        assert json.loads((tmp_path / "roi.json").read_text())["schema"] == "sgrt-roi/1"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not JSON"),
        ("[]", "object"),
        ('{"schema": "sgrt-roi/2", "box_mm": [[0,0,0],[1,1,1]]}', "schema"),
        ('{"box_mm": [[0,0,0],[1,1,1]]}', "schema"),
        ('{"schema": "sgrt-roi/1"}', "either"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,1,1]], "polygon_xy_mm": []}', "either"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,1]]}', r"box_mm\[1\] has 2"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,1,"1"]]}', r"box_mm\[1\]\[2\]"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,1,true]]}', r"box_mm\[1\]\[2\]"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,1,NaN]]}', "NaN"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,1,1e999]]}', "finite"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,1,' + "9" * 400 + "]]}", "finite"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,1,' + "9" * 9999 + "]]}", "JSON"),
        ('{"schema": "sgrt-roi/1", "box_mm": [[0,0,0],[1,-1,1]]}', "min|max"),
        ('{"schema": "sgrt-roi/1", "polygon_xy_mm": []}', "vertices|3"),
        ('{"schema": "sgrt-roi/1", "polygon_xy_mm": [[0,0],[1,1]]}', "vertices|3"),
        ('{"schema": "sgrt-roi/1", "schema": "sgrt-roi/1"}', "twice"),
    ],
)
def test_bad_roi(tmp_path, text, message):
    (tmp_path / "roi.json").write_text(text)
    with pytest.raises(sgrt.FormatError, match=rf"roi\.json: .*({message})"):
        io.read_roi(tmp_path / "roi.json")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a":' * 20 + "1" + "}" * 20, " " * (16 * 2**20 + 1)])
def test_json_bombs(tmp_path, text):
    (tmp_path / "roi.json").write_text(text)
    with pytest.raises((sgrt.LimitError, sgrt.FormatError), match=r"roi\.json: "):
        io.read_roi(tmp_path / "roi.json")


def test_not_utf8(tmp_path):
    (tmp_path / "roi.json").write_bytes(b'{"schema": "\xff"}')
    for read in (io.read_roi, io.read_rig, io.read_poses, io.read_pose):
        with pytest.raises(sgrt.FormatError, match=r"roi\.json: not UTF-8"):
            read(tmp_path / "roi.json")


def test_rig_round_trip(tmp_path, rig):
    io.write_rig(tmp_path / "rig.json", rig)
    assert io.read_rig(tmp_path / "rig.json").to_json() == rig.to_json()
    (tmp_path / "bad.json").write_text(json.dumps(rig_document() | {"schema": "sgrt-rig/9"}))
    with pytest.raises(sgrt.FormatError, match=r"bad\.json: .*schema"):
        io.read_rig(tmp_path / "bad.json")


def test_poses_round_trip(tmp_path):
    poses = np.array([np.eye(4), sgrt.frames.fixed_from_couch(12.5)])
    io.write_poses(tmp_path / "p.json", io.PoseTrack(np.array([0.0, 0.1]), poses))
    back = io.read_poses(tmp_path / "p.json")
    assert np.array_equal(back.time_s, [0.0, 0.1])
    assert np.array_equal(back.room_from_body, poses)


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        ([], "empty"),
        ([{"time_s": 0}], "room_from_body"),
        ([{"time_s": 0, "room_from_body": np.zeros((4, 4)).tolist()}], r"poses\[0\]"),
        ([{"time_s": 0, "room_from_body": np.eye(3).tolist()}], r"poses\[0\]\.room_from_body"),
        ([{"time_s": t, "room_from_body": np.eye(4).tolist()} for t in (1, 0)], "time_s"),
    ],
)
def test_bad_poses(tmp_path, poses, message):
    (tmp_path / "p.json").write_text(json.dumps({"schema": "sgrt-poses/1", "poses": poses}))
    with pytest.raises(sgrt.FormatError, match=rf"p\.json: .*{message}"):
        io.read_poses(tmp_path / "p.json")


KEYS = [
    "schema",
    "status",
    "verdict",
    "reference_from_live",
    "isocentre_mm",
    "patient_displacement",
    "couch_correction",
    "covariance",
    "observability",
    "covariance_random",
    "covariance_shared",
    "verdict_text",
    "coarse",
    "rms_mm",
    "inlier_share",
    "iterations",
]


def test_registration_is_the_contract(tmp_path, reference, live):
    result = sgrt.icp_align(reference, live, isocentre_mm=ISOCENTRE)
    io.write_registration(tmp_path / "r.json", result)
    document = json.loads((tmp_path / "r.json").read_text())
    assert list(document) == KEYS
    assert (document["schema"], document["status"], document["verdict"]) == ("sgrt-registration/1", "ok", "ok")
    assert np.array_equal(document["reference_from_live"], result.reference_from_live)
    assert np.array_equal(document["covariance"], result.covariance)
    shifts = ["lat_mm", "lng_mm", "vrt_mm", "pitch_deg", "roll_deg", "rtn_deg", "mag_mm"]
    assert list(document["patient_displacement"]) == list(document["couch_correction"]) == shifts
    assert document["observability"]["free"] == []
    directions = document["observability"]["detectable"]
    assert len(directions) == 6
    for direction in directions:
        assert len(direction["motion"]) == 6
        assert direction["detectable_mm"] == pytest.approx(3.605 * direction["sigma_mm"], rel=1e-3)
        assert direction["words"]
    assert document["coarse"] is None
    assert np.array_equal(io.read_pose(tmp_path / "r.json"), result.reference_from_live)


def test_no_pose_is_null_never_identity(tmp_path, reference):
    away = sgrt.Surface(reference.points + np.array([0.0, 0.0, 500.0]), normals=reference.normals)
    with pytest.raises(sgrt.NotFound) as error:
        sgrt.icp_align(reference, away, isocentre_mm=ISOCENTRE)
    for result in (error.value.result, None):
        io.write_registration(tmp_path / "r.json", result, status="not_found", isocentre_mm=ISOCENTRE)
        document = json.loads((tmp_path / "r.json").read_text())
        assert list(document) == KEYS
        assert (document["status"], document["verdict"]) == ("not_found", None)
        assert document["isocentre_mm"] == ISOCENTRE.tolist()
        assert document["reference_from_live"] == [[None] * 4] * 4
        assert document["covariance"] == [[None] * 6] * 6
        assert set(document["patient_displacement"].values()) == {None}
        assert set(document["couch_correction"].values()) == {None}
        with pytest.raises(sgrt.FormatError, match=r"r\.json: .*not_found"):
            io.read_pose(tmp_path / "r.json")


def test_pose_of_another_program(tmp_path):
    pose = sgrt.frames.fixed_from_couch(5)
    (tmp_path / "p.json").write_text(json.dumps({"reference_from_live": pose.tolist()}))
    assert np.array_equal(io.read_pose(tmp_path / "p.json"), pose)
    for bad in ({}, {"reference_from_live": np.diag([1, 1, 2, 1]).tolist()}, {"reference_from_live": None}):
        (tmp_path / "p.json").write_text(json.dumps(bad))
        with pytest.raises(sgrt.FormatError, match=r"p\.json: .*reference_from_live"):
            io.read_pose(tmp_path / "p.json")


# -------------------------------------------------------------------------------------------------------------- writers


def write_all(folder, reference, rig):
    return [
        (lambda: io.write_surface(folder / "x", reference)),
        (lambda: io.write_image(folder / "x", np.zeros((3, 3), np.uint8))),
        (lambda: io.write_roi(folder / "x", sgrt.Roi.box((0, 0, 0), (1, 1, 1)))),
        (lambda: io.write_rig(folder / "x", rig)),
        (lambda: io.write_registration(folder / "x", None)),
    ]


def test_missing_files_and_folders(tmp_path, reference, rig):
    for read in (io.read_surface, io.read_image, io.read_roi, io.read_rig, io.read_poses, io.read_pose):
        with pytest.raises(FileNotFoundError, match="missing"):
            read(tmp_path / "missing")
        with pytest.raises(OSError, match=str(tmp_path)):
            read(tmp_path)
    for write in write_all(tmp_path / "no such folder", reference, rig):
        with pytest.raises(OSError, match="no such folder/x"):
            write()


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch, reference, rig):
    (tmp_path / "x").write_text("old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    for write in write_all(tmp_path, reference, rig):
        with pytest.raises(OSError, match="No space"):
            write()
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("x", "old")]


def test_files_have_ordinary_rights(tmp_path):
    (tmp_path / "ordinary").touch()
    io.write_roi(tmp_path / "x", sgrt.Roi.box((0, 0, 0), (1, 1, 1)))
    assert (tmp_path / "x").stat().st_mode == (tmp_path / "ordinary").stat().st_mode


def test_never_replaces_a_folder_or_a_device(tmp_path, rig):
    with pytest.raises(OSError, match=str(tmp_path)):
        io.write_rig(tmp_path, rig)
    with pytest.raises(OSError, match="/dev/null"):
        io.write_rig("/dev/null", rig)
