"""Arrays and files of any kind, drawn by Hypothesis: read, or refused in one line that names the file.

Derandomised: the same cases in every run. A case that failed once stays as an @example or as a test of its own.
"""

import contextlib
import json
import struct
import zlib

import numpy as np
import pytest
import sgrt
from conftest import body_points, rig_document
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from sgrt import io
from sgrt.cli import main
from sgrt.frames import shift_from_pose
from sgrt.phantoms import read_phantom
from sgrt.store import ReferenceStore

few = settings(
    derandomize=True, max_examples=60, deadline=None, database=None, suppress_health_check=list(HealthCheck)
)  # the fixtures are files that every example overwrites


def refused_or_read(read, path):
    """What it raises is the library's or the system's, in one line with the file's name."""
    try:
        read(path)
    except (sgrt.Error, OSError) as error:
        assert "\n" not in str(error), str(error)
        assert path.name in str(error)


# ------------------------------------------------------------------------------------------------------------- arrays

shapes = st.one_of(
    arrays.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=7),
    st.tuples(st.integers(0, 9), st.just(3)),
    st.tuples(st.integers(1, 4), st.integers(1, 4), st.just(3)),
)
dtypes = st.one_of(
    arrays.scalar_dtypes(), st.sampled_from([np.dtype(">f8"), np.dtype(">u2"), np.dtype(object), np.dtype("f4")])
)


@st.composite
def any_array(draw):
    """Any dtype, shape, order and stride: reversed, skipping, transposed, broadcast, read-only, unaligned."""
    shape = draw(shapes)
    dtype = draw(dtypes)
    if dtype.kind == "O":
        return np.full(shape, draw(st.sampled_from([None, "x", 1.5, 10**400])), dtype=object)
    made = draw(arrays.arrays(dtype, shape))
    for step in draw(st.lists(st.sampled_from(["reverse", "skip", "turn", "spread", "lock", "shift"]), max_size=3)):
        if step == "reverse" and made.ndim:
            made = made[::-1]
        elif step == "skip" and made.ndim:
            made = made[..., ::2]
        elif step == "turn":
            made = made.T
        elif step == "spread":
            made = np.broadcast_to(made, (2, *made.shape))
        elif step == "shift":
            bare = np.zeros(made.size * made.itemsize + 1, np.uint8)
            bare[1:] = np.frombuffer(made.tobytes(), np.uint8)
            made = bare[1:].view(made.dtype).reshape(made.shape) if made.size else made
    return made


def answered_or_refused(call):
    with contextlib.suppress(sgrt.Error, TypeError, ValueError):  # what numpy itself raises of an object is fine
        return call()
    return None


@pytest.fixture(scope="module")
def small():
    return sgrt.Surface(body_points(60, 1), sigma_mm=np.full(60, 0.1)).estimate_normals()


# REQ-PY-002
@few
@given(any_array(), st.data())
def test_any_array_as_points(points, data):
    surface = answered_or_refused(lambda: sgrt.Surface(points))
    if surface is not None:
        assert np.array_equal(surface.points, np.asarray(points, dtype=np.float64).reshape(surface.points.shape), True)
    for name in ("normals", "sigma_mm", "covariance", "faces", "modes"):
        answered_or_refused(lambda name=name: sgrt.Surface(body_points(4, 1), **{name: data.draw(any_array())}))


@few
@given(any_array(), any_array())
def test_any_array_as_image_or_pixels(rig, left, right):
    answered_or_refused(lambda: sgrt.stereo_match(rig, "pod1", left, right))
    answered_or_refused(lambda: rig.project("left", left, out=right))
    answered_or_refused(lambda: rig.unproject("left", left))
    answered_or_refused(lambda: sgrt.stripe_extract(left, dark=right))
    answered_or_refused(lambda: sgrt.Roi.polygon(left))


@few
@given(any_array(), any_array(), any_array())
def test_any_array_as_pose_or_parameters(small, pose, point, knots):
    answered_or_refused(lambda: small.moved(pose))
    answered_or_refused(lambda: shift_from_pose(pose, point))
    answered_or_refused(lambda: sgrt.icp_align(small, small, isocentre_mm=point, initial_reference_from_live=pose))
    answered_or_refused(lambda: sgrt.NurbsCurve(point, 1, knots=knots))
    answered_or_refused(lambda: sgrt.points_curvature(point))
    answered_or_refused(lambda: sgrt.volume_skin(knots, pose))
    answered_or_refused(lambda: sgrt.coarse_align(point, knots, point, knots, isocentre_mm=[0, 0, 0]))


# -------------------------------------------------------------------------------------------------------------- files


@st.composite
def damaged(draw, data):
    """The bytes cut, overwritten, doubled or with some left out, up to three times."""
    made = bytearray(data)
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(made)))
        match draw(st.sampled_from(["cut", "set", "insert", "remove", "double", "digit"])):
            case "cut":
                del made[at:]
            case "set":
                made[at : at + 4] = draw(st.binary(min_size=1, max_size=4))
            case "insert":
                made[at:at] = draw(st.binary(max_size=8))
            case "remove":
                del made[at : at + draw(st.integers(1, 40))]
            case "double":
                made[at:at] = made[at : at + draw(st.integers(1, 40))]
            case "digit":
                places = [i for i, byte in enumerate(made[:2000]) if chr(byte).isdigit()]
                if places:
                    made[draw(st.sampled_from(places))] = draw(st.sampled_from(b"0129-e."))
    return bytes(made)


anything = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(-(2**70), 2**70),
        st.floats(),
        st.sampled_from(["", "x", "a\nb", "\x00", "../up.png", "/etc/passwd", "a\x00.png", "\ud800", "é" * 300]),
    ),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.sampled_from("abx"), inner, max_size=2)),
    max_leaves=5,
)


@st.composite
def altered(draw, document):
    """The document with a node anywhere replaced by anything, left out, or doubled."""
    made = json.loads(json.dumps(document))
    places = []

    def walk(node):
        for key in list(node) if isinstance(node, dict) else range(len(node)):
            places.append((node, key))
            if isinstance(node[key], dict | list):
                walk(node[key])

    walk(made)
    node, key = draw(st.sampled_from(places))
    match draw(st.sampled_from(["set", "set", "set", "remove", "double"])):
        case "set":
            node[key] = draw(anything)
        case "remove":
            del node[key]
        case "double" if isinstance(node, list):
            node.append(node[key])
    return json.dumps(made)


POINTS = [{"id": f"m{i}", "position_mm": [10.0 * i, 5.0 * i * i, 0.0]} for i in range(4)]
IDENTITY = np.eye(4).tolist()
DOCUMENTS = {
    "rig": (io.read_rig, rig_document()),
    "roi": (io.read_roi, {"schema": "sgrt-roi/1", "polygon_xy_mm": [[0, 0], [9, 0], [0, 9]]}),
    "poses": (
        io.read_poses,
        {"schema": "sgrt-poses/1", "poses": [{"time_s": float(t), "room_from_body": IDENTITY} for t in range(2)]},
    ),
    "pose": (
        io.read_pose,
        {"schema": "sgrt-registration/1", "status": "ok", "reference_from_live": IDENTITY},
    ),
    "scan": (
        io.read_scan,
        {"schema": "sgrt-scan/1", "laser": "l", "frames": [{"image": "0.png", "angle_rad": 0.1}], "dark": "d.png"},
    ),
    "captures": (
        io.read_captures,
        {
            "schema": "sgrt-frames/1",
            "frames": [{"time_s": 0.0, "pairs": {"pod1": ["a.png", "b.png"]}}, {"time_s": 1, "surface": "c.ply"}],
        },
    ),
    "landmarks": (
        io.read_landmarks,
        {
            "schema": "sgrt-landmarks/1",
            "landmarks": [{"name": "a", "position_mm": [0, 0, 0], "covariance_mm2": np.eye(3).tolist(), "score": 1}]
            * 2,
        },
    ),
    "phantom": (
        read_phantom,
        {"schema": "sgrt-phantom/1", "points": POINTS, "pixels": {"left": {"m0": [1.0, 2.0]}}, "sigma_mm": 0.1},
    ),
    "nurbs": (
        io.read_nurbs_curve,
        {
            "schema": "sgrt-nurbs/1",
            "degree": [1],
            "knots": [[0, 0, 1, 1]],
            "size": [2],
            "control_points": [[0, 0, 0], [1, 0, 0]],
        },
    ),
}


# REQ-FILE-001
@pytest.mark.parametrize("name", DOCUMENTS)
@few
@given(st.data())
def test_altered_json(tmp_path_factory, name, data):
    read, document = DOCUMENTS[name]
    path = tmp_path_factory.getbasetemp() / f"{name}.json"
    path.write_text(data.draw(altered(document)))
    refused_or_read(read, path)


def test_pixels_of_a_phantom_that_are_no_object(tmp_path):
    (tmp_path / "p.json").write_text(json.dumps(DOCUMENTS["phantom"][1] | {"pixels": True}))
    with pytest.raises(sgrt.FormatError, match=r"p\.json: pixels: expected an object"):
        read_phantom(tmp_path / "p.json")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A small file of each kind, by its name."""
    folder = tmp_path_factory.mktemp("good")
    surface = sgrt.Surface(body_points(60, 1), sigma_mm=np.full(60, 0.1)).estimate_normals()
    mesh = sgrt.Surface(body_points(5, 1), faces=np.array([[0, 1, 2], [2, 3, 4]], np.int32))
    io.write_surface(folder / "binary.ply", surface)
    io.write_surface(folder / "ascii.ply", surface, format="ascii")
    io.write_surface(folder / "mesh.ply", mesh)
    io.write_image(folder / "i.png", np.random.default_rng(0).integers(0, 256, (24, 16)).astype(np.uint8))
    io.write_image(folder / "deep.png", np.random.default_rng(0).integers(0, 2**16, (24, 16)).astype(np.uint16))
    np.savez_compressed(folder / "taps.npz", taps=np.full((1, 1, 4, 6, 8), 300, np.uint16), saturation=np.float64(4e3))
    np.save(folder / "offset.npy", np.zeros((6, 8), np.float32))
    with ReferenceStore(folder / "store.sqlite", create=True) as store:
        document = {"schema": "sgrt-reference/1", "kind": "captured", "source": {}}
        store.add((folder / "binary.ply").read_bytes(), document, plan="P", field="F")
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_files_are_good_before_they_are_damaged(tmp_path, files):
    readers = {".ply": io.read_surface, ".png": io.read_image, ".npz": io.read_tof, ".npy": io.read_pixel_offset}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        readers.get((tmp_path / name).suffix, read_store)(tmp_path / name)
    for name, (read, document) in DOCUMENTS.items():
        (tmp_path / name).write_text(json.dumps(document))
        read(tmp_path / name)


def damage(tmp_path_factory, files, data, name, read):
    path = tmp_path_factory.getbasetemp() / f"bad-{name}"
    path.write_bytes(data.draw(damaged(files[name])))
    refused_or_read(read, path)


# REQ-FILE-001
@pytest.mark.parametrize("name", ["binary.ply", "ascii.ply", "mesh.ply"])
@few
@given(st.data())
def test_damaged_ply(tmp_path_factory, files, name, data):
    damage(tmp_path_factory, files, data, name, io.read_surface)


# REQ-FILE-002
@few
@given(st.integers(0, 10**30), st.sampled_from(["vertex", "face"]), st.sampled_from(["binary_little_endian", "ascii"]))
def test_lying_counts_of_a_ply(tmp_path_factory, count, element, format):
    path = tmp_path_factory.getbasetemp() / "lying.ply"
    head = f"ply\nformat {format} 1.0\nelement vertex {count if element == 'vertex' else 1}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {count if element == 'face' else 0}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + bytes(24))
    refused_or_read(io.read_surface, path)


# REQ-FILE-001
@pytest.mark.parametrize("name", ["i.png", "deep.png"])
@few
@given(st.data())
def test_damaged_png(tmp_path_factory, files, name, data):
    damage(tmp_path_factory, files, data, name, io.read_image)


@pytest.mark.parametrize(("name", "read"), [("taps.npz", io.read_tof), ("offset.npy", io.read_pixel_offset)])
@few
@given(st.data())
def test_damaged_arrays(tmp_path_factory, files, name, read, data):
    damage(tmp_path_factory, files, data, name, read)


def npz(flag=0, version=20, content=None):
    """An .npz of one array, with a flag or version of zip that numpy's reader stumbles over."""
    content = content or npy("(1, 1, 4, 2, 2)") + bytes(32)
    name, crc = b"taps.npy", zlib.crc32(content)
    local = struct.pack("<IHHHHHIIIHH", 0x04034B50, version, flag, 0, 0, 0, crc, *[len(content)] * 2, len(name), 0)
    central = struct.pack(
        "<IHHHHHHIIIHHHHHII", 0x02014B50, 20, version, flag, 0, 0, 0, crc, *[len(content)] * 2, len(name), *[0] * 6
    )
    body = local + name + content
    end = struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, 1, 1, len(central) + len(name), len(body), 0)
    return body + central + name + end


def npy(shape, end="}"):
    head = f"{{'descr': '<u2', 'fortran_order': False, 'shape': {shape}, {end}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head


# REQ-FILE-001
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (npz(flag=1), "encrypted"),
        (npz(version=197), "version"),
        (npz(content=npy("(1, 1, 4, 2, 2)", end="(") + bytes(32)), "npz"),
        (npz(content=npy("(1, 1, 4, 90000, 90000)") + bytes(32)), "cut short"),
        (npz(content=npy("(1, 1, 4, -2, 2)") + bytes(32)), "npz"),
    ],
)
def test_arrays_that_came_out_as_defects(tmp_path, content, words):
    (tmp_path / "good.npz").write_bytes(npz())
    assert io.read_tof(tmp_path / "good.npz").taps.shape == (1, 1, 4, 2, 2)
    (tmp_path / "bad.npz").write_bytes(content)
    with pytest.raises(sgrt.FormatError, match=rf"bad\.npz: .*{words}") as error:
        io.read_tof(tmp_path / "bad.npz")
    assert "\n" not in str(error.value)


def read_store(path):
    with ReferenceStore(path) as store:
        for entry in store.entries():
            store.surface(entry.id)


@few
@given(st.data())
def test_damaged_store(tmp_path_factory, files, data):
    damage(tmp_path_factory, files, data, "store.sqlite", read_store)


# -------------------------------------------------------------------------------------------------------- command line


def commands(folder, bad):
    """Calls in which the file `bad` stands where one of its kind is read."""
    good, out = folder / "good.ply", folder / "out.ply"
    match bad.suffix:
        case ".ply":
            yield ["register", "--reference", good, "--live", bad, "--isocentre", 0, 0, 0, "--json"]
            yield ["fuse", bad, good, "--out", out]
            yield ["filter", bad, "--out", out]
        case ".png":
            yield ["stereo", "--rig", folder / "rig.json", "--pair", "pod1", bad, bad, "--out", out]
        case ".npz":
            yield ["tof", "--rig", folder / "rig.json", "--tof", "t", bad, "--out", out]
    if "rig" in bad.name:
        yield ["stereo", "--rig", bad, "--pair", "pod1", folder / "i.png", folder / "i.png", "--out", out]
    if "scan" in bad.name:
        yield ["laser", "--rig", folder / "rig.json", "--scan", bad, "--out", out]
    if "roi" in bad.name:
        yield ["register", "--reference", good, "--live", good, "--roi", bad, "--isocentre", 0, 0, 0]
    if "phantom" in bad.name:
        yield ["calibrate", "room", "--rig", folder / "rig.json", "--points", bad, "--out", folder / "o.json"]
    if "captures" in bad.name:
        yield ["track", "--rig", folder / "rig.json", "--reference", good, "--isocentre", 0, 0, 0, "--frames", bad]


# REQ-CLI-002
@pytest.mark.parametrize("name", ["binary.ply", "i.png", "taps.npz", "rig", "scan", "roi", "phantom", "captures"])
@settings(few, max_examples=20)
@given(st.data())
def test_command_on_damaged_files(tmp_path_factory, files, capfd, name, data):
    folder = tmp_path_factory.getbasetemp() / "cli"
    folder.mkdir(exist_ok=True)
    (folder / "good.ply").write_bytes(files["binary.ply"])
    (folder / "i.png").write_bytes(files["i.png"])
    (folder / "rig.json").write_text(json.dumps(rig_document()))
    if name in files:
        bad = folder / f"bad-{name}"
        bad.write_bytes(data.draw(damaged(files[name])))
    else:
        bad = folder / f"bad-{name}.json"
        bad.write_text(data.draw(altered(DOCUMENTS[name][1])))
    for command in commands(folder, bad):
        code = main([str(word) for word in command])
        error = capfd.readouterr().err
        assert code in (0, 1, 2), (command, error)
        assert "Traceback" not in error
        assert code != 2 or error.count("\n") == 1, error
