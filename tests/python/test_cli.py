"""The command line: output whole or not at all, one line on standard error, exit codes, JSON and nothing else."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest
import sgrt
from conftest import ISOCENTRE, SHIFT, body_points, displaced, rig_document, take_ctrl_c
from sgrt import io
from sgrt.cli import group
from sgrt.frames import couch_turn

AT = ["--isocentre", *map(str, ISOCENTRE)]


@pytest.fixture(scope="module")
def room(tmp_path_factory, reference, live, images):
    folder = tmp_path_factory.mktemp("room")
    io.write_surface(folder / "reference.ply", reference)
    io.write_surface(folder / "live.ply", live)
    io.write_image(folder / "left.png", images[0])
    io.write_image(folder / "right.png", images[1])
    document = rig_document()
    document["pairs"].append({"id": "pod2", "left": "left", "right": "right"})
    (folder / "rig.json").write_text(json.dumps(document))
    flat = np.zeros((900, 3))
    flat[:, :2] = np.random.default_rng(0).uniform(-100, 100, (900, 2))
    io.write_surface(folder / "flat.ply", sgrt.Surface(flat, normals=np.tile([0.0, 0, 1], (900, 1))))
    io.write_surface(folder / "three.ply", sgrt.Surface(np.eye(3)))
    io.write_surface(
        folder / "away.ply", sgrt.Surface(reference.points + np.array([0.0, 0, 500]), normals=reference.normals)
    )
    io.write_image(folder / "grey.png", np.full_like(images[0], 90))
    io.write_image(folder / "small.png", images[0][:100])
    return folder


def one_line_about(error, *words):
    assert error.startswith("sgrt: ")
    assert error.count("\n") == 1
    for word in words:
        assert str(word) in error


def files(folder):
    return {p.name: p.read_bytes() for p in Path(folder).rglob("*") if p.is_file()}


# ------------------------------------------------------------------------------------------------------------- register


def register(room, *more, reference="reference.ply", live="live.ply"):
    return ["register", "--reference", room / reference, "--live", room / live, *more]


def test_register_json(run, room):
    code, out, err = run(*register(room, *AT, "--json"))
    assert (code, err) == (0, "")
    assert out.count("\n") == 1
    document = json.loads(out)
    assert document["status"] == "ok"
    assert document["timing_ms"] > 0
    for name, truth in SHIFT.items():
        assert document["patient_displacement"][name] == pytest.approx(truth, abs=0.03)


def test_register_for_people(run, room):
    code, out, err = run(*register(room, *AT))
    assert (code, err) == (0, "")
    for word in ("LAT", "LNG", "VRT", "PITCH", "ROLL", "RTN", "MAG", "couch correction", "verdict ok"):
        assert word in out


# REQ-DET-010
def test_same_bytes_at_any_number_of_threads(run, room):
    documents = []
    for threads in (1, 2, 4):
        document = json.loads(run(*register(room, *AT, "--json", "--threads", threads))[1])
        del document["timing_ms"]
        documents.append(json.dumps(document))
    assert len(set(documents)) == 1


def test_register_starts_from_a_result(run, room, tmp_path):
    (tmp_path / "first.json").write_text(run(*register(room, *AT, "--json"))[1])
    code, out, _ = run(*register(room, *AT, "--json", "--initial", tmp_path / "first.json"))
    assert code == 0
    assert json.loads(out)["iterations"] <= json.loads((tmp_path / "first.json").read_text())["iterations"]
    assert run(*register(room, *AT, "--initial", "identity"))[0] == 0


def test_register_without_a_start(run, room, tmp_path):
    """The patient lies the other way round, 300 mm away: found without a guess, and the same six numbers."""
    far = dict(SHIFT, rtn_deg=170.0, lat_mm=200.0, lng_mm=-300.0)
    rng = np.random.default_rng(22)
    points = displaced(body_points(8000, 21)[rng.permutation(8000)], far, ISOCENTRE)
    points = points[points[:, 0] > np.quantile(points[:, 0], 0.2)]  # a part of it is hidden
    io.write_surface(tmp_path / "far.ply", sgrt.Surface(points, sigma_mm=np.full(len(points), 0.1)))
    command = ["register", "--reference", room / "reference.ply", "--live", tmp_path / "far.ply", *AT, "--json"]
    code, out, err = run(*command, "--initial", "none")
    assert code == 0, err
    document = json.loads(out)
    for name, truth in far.items():
        assert document["patient_displacement"][name] == pytest.approx(truth, abs=0.1), name
    assert document["coarse"]["runner_up"] < 0.9 * document["coarse"]["score"]
    code, out, _ = run(*command)  # from identity it must not pretend
    assert code == 1 or json.loads(out)["verdict"] == "weak"


def test_register_roi(run, room, tmp_path):
    io.write_roi(tmp_path / "roi.json", sgrt.Roi.box((-100, -100, 0), (100, 100, 300)))
    assert run(*register(room, *AT, "--roi", tmp_path / "roi.json"))[0] == 0
    io.write_roi(tmp_path / "roi.json", sgrt.Roi.box((900, 900, 0), (910, 910, 300)))
    code, out, _ = run(*register(room, *AT, "--roi", tmp_path / "roi.json", "--json"))
    assert code == 1
    assert json.loads(out)["status"] == "insufficient_data"


@pytest.mark.parametrize("angle", [30.0, -90.0, 180.0])
def test_couch_angle(run, room, tmp_path, angle):
    """The patient turned with the couch and then displaced by SHIFT in room axes: the command says SHIFT."""
    turn = np.radians(angle)
    matrix = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    on_couch = (body_points(8000, 21) - ISOCENTRE) @ matrix.T + ISOCENTRE
    live = sgrt.Surface(displaced(on_couch, SHIFT, ISOCENTRE), sigma_mm=np.full(8000, 0.1))
    io.write_surface(tmp_path / "live.ply", live)
    square = [[-120, -150], [120, -150], [120, 150], [-120, 150]]  # drawn on the reference, that is at couch 0
    io.write_roi(tmp_path / "roi.json", sgrt.Roi.polygon(square))
    command = ["register", "--reference", room / "reference.ply", "--live", tmp_path / "live.ply", *AT, "--json"]
    for more in ([], ["--roi", tmp_path / "roi.json"]):
        code, out, err = run(*command, "--couch-angle", angle, *more)
        assert code == 0, err
        for name, truth in SHIFT.items():
            assert json.loads(out)["patient_displacement"][name] == pytest.approx(truth, abs=0.05), name
    io.write_roi(tmp_path / "box.json", sgrt.Roi.box((-100, -100, 0), (100, 100, 300)))
    code, out, err = run(*command, "--couch-angle", angle, "--roi", tmp_path / "box.json")
    assert code == 2
    one_line_about(err, "box.json", "polygon")


def test_a_couch_without_pitch_and_roll(run, room):
    document = json.loads(run(*register(room, *AT, "--json", "--couch-dof", "4"))[1])
    move, left = document["couch_correction_4dof"], document["remaining_displacement"]
    found = document["patient_displacement"]
    assert (move["pitch_deg"], move["roll_deg"]) == (0, 0)
    assert move["rtn_deg"] == pytest.approx(-found["rtn_deg"])
    assert move["mag_mm"] == pytest.approx(found["mag_mm"])
    assert {k: v for k, v in left.items() if v} == {k: found[k] for k in ("pitch_deg", "roll_deg")}
    assert "couch correction 4dof: LAT" in run(*register(room, *AT, "--couch-dof", "4"))[1]


def test_the_couch_turns_all_that_a_surface_holds():
    covariance = [[1.0, 0.1, 0.2, 2.0, 0.3, 3.0]]
    s = sgrt.Surface(
        [[1.0, 2, 3]],
        normals=[[1.0, 0, 0]],
        sigma_mm=[0.5],
        covariance=covariance,
        modes=[[[0.0, 1, 2]]],
        correlation_points=3,
    )
    turned = s.moved(couch_turn(90, (1, 0, 0)))
    assert np.allclose(turned.points, [[-1, 0, 3]], atol=1e-12)
    assert np.allclose(turned.normals, [[0, 1, 0]], atol=1e-12)
    assert np.allclose(turned.modes, [[[-1, 0, 2]]], atol=1e-12)
    assert np.allclose(turned.covariance, [[2.0, -0.1, -0.3, 1.0, 0.2, 3.0]], atol=1e-12)
    assert turned.correlation_points == 3


# REQ-CLI-003
@pytest.mark.parametrize(
    ("name", "status"), [("flat.ply", "degenerate"), ("away.ply", "not_found"), ("three.ply", "insufficient_data")]
)
def test_register_without_an_answer(run, room, name, status):
    reference = "flat.ply" if name == "flat.ply" else "reference.ply"
    code, out, err = run(*register(room, *AT, "--json", live=name, reference=reference))
    assert code == 1
    one_line_about(err, name, reference)
    document = json.loads(out)
    assert (document["status"], document["verdict"]) == (status, None)
    assert document["reference_from_live"] == [[None] * 4] * 4
    assert set(document["patient_displacement"].values()) == {None}
    assert document["isocentre_mm"] == ISOCENTRE.tolist()
    if status == "degenerate":
        words = [free["words"] for free in document["observability"]["free"]]
        assert len(words) == 3
        assert all(len(free["motion"]) == 6 for free in document["observability"]["free"])
    code, out, err = run(*register(room, *AT, live=name, reference=reference))
    assert (code, out) == (1, "")


def test_register_without_an_isocentre(run, room):
    code, out, err = run(*register(room))
    assert (code, out) == (2, "")
    one_line_about(err, "--isocentre")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--isocentre", "0", "0"], ["--isocentre"]),
        (["--isocentre", "0", "0", "x"], ["--isocentre", "x"]),
        (["--isocentre", "0", "0", "nan"], ["isocentre"]),
        ([*AT, "--threads", "-1"], ["--threads"]),
        ([*AT, "--threads", "1000"], ["--threads"]),
        ([*AT, "--whatever"], ["--whatever"]),
        ([*AT, "--initial", "missing.json"], ["missing.json"]),
        ([*AT, "--roi", "missing.json"], ["missing.json"]),
        ([*AT, "--couch-angle", "inf"], ["couch"]),
    ],
)
def test_register_bad_calls(run, room, more, words):
    code, out, err = run(*register(room, *more))
    assert (code, out) == (2, "")
    one_line_about(err, *words)


# REQ-CLI-002
def test_register_bad_files(run, room, tmp_path):
    (tmp_path / "bad.ply").write_bytes(b"ply\nformat ascii 1.0\nend_header\n")
    for name in (tmp_path / "missing.ply", tmp_path / "bad.ply", tmp_path, room / "left.png"):
        code, out, err = run(*register(room, *AT, "--json", live=name))
        assert (code, out) == (2, "")
        one_line_about(err, name)


# --------------------------------------------------------------------------------------------------------------- stereo


def stereo(room, out, *more, left="left.png", right="right.png", pair="pod1", rig="rig.json"):
    return ["stereo", "--rig", room / rig, "--pair", pair, room / left, room / right, "--out", out, *more]


def test_stereo_writes_the_grid(run, room, tmp_path):
    code, out, err = run(*stereo(room, tmp_path / "s.ply", "--json"))
    assert (code, err) == (0, "")
    document = json.loads(out)
    s = io.read_surface(tmp_path / "s.ply")
    assert s.point_count == document["points"] == document["pairs"][0]["points"] > 1000
    assert s.grid_shape == tuple(document["pairs"][0]["grid"][::-1])
    assert None not in (s.grid_shape, s.normals is None or 1, s.sigma_mm is None or 1, s.covariance is None or 1)
    assert document["fusion"] is None
    assert sum(document["pairs"][0]["reasons"].values()) == s.points.shape[0] * s.points.shape[1]
    assert list(files(tmp_path)) == ["s.ply"]


def test_stereo_fuses(run, room, tmp_path):
    command = stereo(room, tmp_path / "s.ply", "--pair", "pod2", room / "left.png", room / "right.png")
    code, out, err = run(*command, "--json")
    assert (code, err) == (0, "")
    fusion = json.loads(out)["fusion"]
    assert fusion["overlap_count"] > 1000
    assert fusion["disagreement_rms_mm"] < 1
    assert io.read_surface(tmp_path / "s.ply").grid_shape is None
    code, out, err = run(*command)
    assert (code, err) == (0, "")
    assert "disagreement" in out
    assert "pod2" in out


def test_stereo_options(run, room, tmp_path):
    counts = []
    for more in ([], ["--stride", "8"], ["--volume", "-50", "-50", "-100", "50", "50", "100"], ["--window", "31"]):
        code, out, err = run(*stereo(room, tmp_path / "s.ply", "--json", *more))
        assert (code, err) == (0, "")
        counts.append(json.loads(out)["points"])
    assert counts[1] < counts[0] / 3
    assert 0 < counts[2] < counts[0] / 3
    run(*stereo(room, tmp_path / "s.ply", "--volume", "-50", "-50", "-100", "50", "50", "100"))
    s = io.read_surface(tmp_path / "s.ply")
    assert np.nanmax(np.abs(s.points[..., :2])) <= 50


# REQ-DET-010
def test_stereo_same_bytes_at_any_number_of_threads(run, room, tmp_path):
    for threads in (1, 2, 4):
        assert run(*stereo(room, tmp_path / f"{threads}.ply", "--threads", threads))[0] == 0
    assert len(set(files(tmp_path).values())) == 1


# REQ-CLI-003
def test_stereo_without_an_answer(run, room, tmp_path):
    code, out, err = run(*stereo(room, tmp_path / "s.ply", "--json", right="grey.png"))
    assert code == 1
    one_line_about(err, "pod1", "grey.png")
    document = json.loads(out)
    assert document["status"] == "not_found"
    assert document["pairs"][0]["points"] == 0
    assert not files(tmp_path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"left": "missing.png"}, ["missing.png"]),
        ({"left": "rig.json"}, ["rig.json", "not a PNG"]),
        ({"left": "small.png"}, ["small.png", "pod1"]),
        ({"pair": "pod9"}, ["rig.json", "pod9", "pod1"]),
        ({"rig": "left.png"}, ["left.png"]),
        ({"rig": "missing.json"}, ["missing.json"]),
    ],
)
def test_stereo_bad_input(run, room, tmp_path, change, words):
    code, out, err = run(*stereo(room, tmp_path / "s.ply", "--json", **change))
    assert (code, out) == (2, "")
    one_line_about(err, *words)
    assert not files(tmp_path)


@pytest.mark.parametrize(
    ("more", "word"),
    [(["--window", "16"], "window"), (["--stride", "0"], "stride"), (["--volume", *"000000"], "volume")],
)
def test_stereo_bad_options(run, room, tmp_path, more, word):
    code, out, err = run(*stereo(room, tmp_path / "s.ply", *more))
    assert (code, out) == (2, "")
    one_line_about(err, word)
    assert not files(tmp_path)


def test_stereo_pair_twice(run, room, tmp_path):
    code, _, err = run(*stereo(room, tmp_path / "s.ply", "--pair", "pod1", room / "left.png", room / "right.png"))
    assert code == 2
    one_line_about(err, "pod1", "twice")


def test_stereo_out_of_place(run, room, tmp_path):
    for out in (tmp_path / "no" / "s.ply", tmp_path, Path("/proc/s.ply")):  # not even root may write there
        code, _, err = run(*stereo(room, out))
        assert code == 2
        one_line_about(err, out)
    assert not files(tmp_path)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_stereo_unwritable_folder(run, room, tmp_path):
    tmp_path.chmod(0o500)
    code, _, err = run(*stereo(room, tmp_path / "s.ply"))
    assert code == 2
    one_line_about(err, tmp_path)


# ------------------------------------------------------------------------------------------------------------ all of it


def leaves(command, words=()):
    """The words of every command that does something by itself."""
    inner = command.commands.items() if isinstance(command, click.Group) else ()
    for name, part in inner:
        yield from leaves(part, (*words, name))
    if not inner or command.invoke_without_command:
        yield words


def test_help_and_version(run):
    assert run("--version") == (0, f"sgrt {sgrt.__version__}\n", "")
    code, out, err = run("--help")
    assert (code, err) == (0, "")
    commands = list(leaves(group))
    assert {("register",), ("stereo",), ("reference", "ct")} <= set(commands)
    for command in commands:
        code, out, err = run(*command, "--help")
        assert (code, err) == (0, "")
        assert f"Example: sgrt {' '.join(command)}" in " ".join(out.split())
        assert "--threads" in out
        assert "--json" in out


def test_unknown_command(run):
    code, out, err = run("levitate")
    assert (code, out) == (2, "")
    one_line_about(err, "levitate")


# REQ-CLI-002
def test_a_defect_is_one_line_and_3(run, room, monkeypatch):
    monkeypatch.setattr("sgrt.cli.register.icp_align", lambda *_, **__: 1 / 0)
    code, out, err = run(*register(room, *AT))
    assert (code, out) == (3, "")
    one_line_about(err, "ZeroDivisionError")


# REQ-CLI-001
@pytest.mark.parametrize(
    ("error", "code"),
    [
        (sgrt.InvalidArgument("x"), 2),
        (sgrt.FormatError("x"), 2),
        (sgrt.NotConverged("x"), 1),
        (sgrt.Cancelled("x"), 130),
        (sgrt.OutOfMemory("x"), 3),
        (sgrt.LimitError("x"), 3),
        (sgrt.InternalError("x"), 3),
        (KeyboardInterrupt(), 130),
        (MemoryError(), 3),
        (OSError(28, "No space left on device", "x"), 2),
    ],
)
def test_exit_codes(run, room, monkeypatch, error, code):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr("sgrt.cli.register.icp_align", fail)
    found, out, err = run(*register(room, *AT))
    assert (found, out) == (code, "")
    one_line_about(err)


SGRT = shutil.which("sgrt", path=str(Path(sys.executable).parent))


def threads_of(child):
    """0 once it has ended."""
    try:
        return int(Path(f"/proc/{child.pid}/status").read_text().split("Threads:")[1].split()[0])
    except (OSError, IndexError):
        return 0


@pytest.mark.skipif(SGRT is None, reason="the script is not installed")
def test_the_installed_script_has_no_thread_too_many(room):
    child = subprocess.Popen([SGRT, *map(str, register(room, *AT, "--threads", "1"))], stdout=subprocess.DEVNULL)
    most = 0
    while child.poll() is None:
        most = max(most, threads_of(child))
    assert child.returncode == 0
    assert most == 1


# REQ-CLI-004
@pytest.mark.skipif(SGRT is None, reason="the script is not installed")
def test_ctrl_c_is_130_and_leaves_nothing(tmp_path):
    io.write_surface(tmp_path / "big.ply", sgrt.Surface(body_points(1_500_000, 1)))
    big = str(tmp_path / "big.ply")
    child = subprocess.Popen(
        # Half a minute of work; the second thread is there from when it begins.
        [SGRT, "register", "--reference", big, "--live", big, *AT, "--deform", "field", "--threads", "2", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=take_ctrl_c,
    )
    while child.poll() is None and threads_of(child) < 2:
        pass
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    assert (child.returncode, out) == (130, "")
    one_line_about(err, "cancelled")


def test_check_of_an_ordinary_capture(run, room, tmp_path):
    trend = tmp_path / "trend.jsonl"
    call = [
        "check",
        "--rig",
        room / "rig.json",
        "--pair",
        "pod1",
        room / "left.png",
        room / "right.png",
        "--trend",
        trend,
    ]
    code, out, err = run(*call, "--json")
    assert (code, err) == (0, "")
    document = json.loads(out)
    assert document["pass"] is True
    assert document["figures"][0]["unit"] == "px"
    assert abs(document["figures"][0]["value"]) < 0.1
    assert [json.loads(line)["pass"] for line in trend.read_text().splitlines()] == [True]
    # A camera that was knocked by 0.5 px fails, with the figure, and the trend grows.
    rig = json.loads((room / "rig.json").read_text())
    rig["cameras"][1]["intrinsics"][3] += 0.5
    (tmp_path / "knocked.json").write_text(json.dumps(rig))
    call[2] = tmp_path / "knocked.json"
    code, out, err = run(*call, "--json")
    assert code == 1
    assert abs(json.loads(out)["figures"][0]["value"]) == pytest.approx(0.5, abs=0.1)
    assert len(trend.read_text().splitlines()) == 2


def test_advise(run, room, tmp_path):
    regions = {
        "all": [[-120, -140], [120, -140], [120, 140], [-120, 140]],
        "small": [[0, 0], [30, 0], [30, 30], [0, 30]],
    }
    for name, polygon in regions.items():
        io.write_roi(tmp_path / f"{name}.json", sgrt.Roi.polygon(polygon))
    candidates = ["--candidate", tmp_path / "small.json", "--candidate", tmp_path / "all.json"]
    out = tmp_path / "better.json"
    arguments = ["advise", "--reference", room / "reference.ply", "--isocentre", 0, 0, 0, *candidates, "--out", out]
    code, text, _ = run(*arguments, "--json")
    document = json.loads(text)
    assert code == 0
    assert [Path(c["candidate"]).stem for c in document["candidates"]] == ["all", "small"]
    assert document["candidates"][0]["score"] < document["candidates"][1]["score"]
    assert io.read_roi(out).polygon_xy_mm.tolist() == document["proposal"]["polygon_xy_mm"]
    code, text, _ = run(*arguments)
    assert code == 0
    assert "all.json" in text.splitlines()[0]
    code, _, error = run("advise", "--reference", room / "reference.ply", "--isocentre", 0, 0, 0, "--sigma", -1)
    assert code == 2
    one_line_about(error, "live_sigma_mm")


def test_register_residuals(run, room):
    for residual, kernel in (("symmetric", "welsch"), ("point_svd", "tukey")):
        more = ["--residual", residual, "--kernel", kernel, "--max-iterations", 500, "--json"]
        code, text, _ = run(*register(room, *AT, *more))
        assert code == 0
        shift = json.loads(text)["patient_displacement"]
        assert all(shift[name] == pytest.approx(truth, abs=0.1) for name, truth in SHIFT.items())
    code, _, error = run(*register(room, *AT, "--residual", "symmetric", "--deform", "rigid"))
    assert code == 2
    one_line_about(error, "--residual")


def test_an_error_with_a_click_that_does_not_know_no_arguments(monkeypatch, run):
    """Before click 8.2 there was no NoArgsIsHelpError, and every error was an AttributeError."""
    monkeypatch.setattr("sgrt.cli.NO_ARGUMENTS", ())
    code, out, err = run("filter", "none.ply", "--out", "out.ply")
    assert (code, out) == (2, "") and err.count("\n") == 1


# ---------------------------------------------------------------------------------------------------------------- eval


def test_eval(run, tmp_path):
    ball = tmp_path / "ball.json"
    ball.write_text(sgrt.NurbsSurface.sphere((10, 20, 30), 50).to_json())
    out = tmp_path / "grid.ply"
    code, said, err = run("eval", ball, "--grid", "40x30", "--out", out, "--json")
    assert (code, err) == (0, "") and json.loads(said)["points"] == 1200
    grid = io.read_surface(out)
    off = grid.points.reshape(-1, 3) - (10, 20, 30)
    np.testing.assert_allclose(np.linalg.norm(off, axis=1), 50, atol=1e-4)
    known = np.isfinite(grid.normals.reshape(-1, 3)).all(1)  # a pole has none
    np.testing.assert_allclose(np.abs((off * grid.normals.reshape(-1, 3)).sum(1))[known], 50, atol=1e-3)
    code, said, _ = run("eval", ball, "--chord-error", "0.5", "--out", tmp_path / "mesh.ply")
    mesh = io.read_surface(tmp_path / "mesh.ply")
    assert code == 0 and f"{mesh.point_count} points" in said
    middles = mesh.points[mesh.faces].mean(1) - (10, 20, 30)
    assert np.linalg.norm(middles, axis=1).min() > 49.4
    for wrong in ([], ["--grid", "4x4", "--chord-error", "1"], ["--grid", "4"], ["--grid", "0x4"], ["--grid", "axb"]):
        code, said, err = run("eval", ball, *wrong, "--out", tmp_path / "no.ply")
        assert code == 2 and not said and not (tmp_path / "no.ply").exists()
        one_line_about(err, "grid")


def test_references_for_people(run, room, tmp_path):
    out, store = tmp_path / "kept.ply", tmp_path / "store.sqlite"
    code, said, _ = run("reference", "captured", room / "reference.ply", "--out", out)
    assert code == 0 and "points" in said and "as captured" in said
    code, said, err = run("reference", "captured", out, "--out", out)
    assert code == 2 and not said
    one_line_about(err, "is the source itself")
    code, said, err = run("reference", "captured", room / "reference.ply", "--out", tmp_path / "kept.json")
    assert code == 2
    one_line_about(err, "ends in .ply")
    roi = tmp_path / "roi.json"
    io.write_roi(roi, sgrt.Roi.box((-100, -100, 0), (100, 100, 300)))
    place = ["--store", store, "--plan-id", "P1", "--field", "F1"]
    assert run("reference", "add", out, *place)[0] == 0
    code, said, _ = run("reference", "add", out, *place, "--roi", roi)
    assert code == 0 and "P1  F1  v2  captured" in said and said.rstrip().endswith("roi")
    code, said, _ = run("reference", "list", "--store", store)
    assert code == 0 and len(said.splitlines()) == 2 and said.splitlines()[0].split()[:4] == ["1", "P1", "F1", "v1"]
    code, said, _ = run("reference", "show", 2, "--store", store)
    assert code == 0 and "kind: captured" in said
    code, said, _ = run("reference", "show", 2, "--store", store, "--json")
    assert json.loads(said)["roi"]["schema"] == "sgrt-roi/1"
    code, said, _ = run("reference", "export", 2, "--store", store, "--out", tmp_path / "back.ply")
    assert code == 0 and str(tmp_path / "back.ply") in said
    code, said, err = run("reference", "export", 2, "--store", store, "--out", tmp_path / "back.json")
    assert code == 2
    one_line_about(err, "ends in .ply")


@pytest.mark.parametrize(
    ("pair", "words"),
    [
        ("pod", "expected ID=LEFT,RIGHT"),
        ("pod=a", "expected ID=LEFT,RIGHT"),
        ("pod=a,x", "no camera 'x'; there are a, b"),
        ("pod=a,a", "one camera twice"),
    ],
)
def test_calibrate_names_a_pair_that_is_none(run, tmp_path, pair, words):
    """Before it looks for an image."""
    for camera in "ab":
        (tmp_path / camera).mkdir()
    cameras = [f"--camera={camera}={tmp_path / camera}" for camera in "ab"]
    code, said, err = run(
        "calibrate", "--board", "chessboard:5x4:30", *cameras, "--pair", pair, "--out", tmp_path / "rig.json"
    )
    assert code == 2 and not said
    one_line_about(err, words)
