"""Time of flight through Python and the command line: figures on simulated scenes, files, real frames, nonsense."""

import json

import numpy as np
import pytest
import sgrt
from conftest import DATA
from sgrt.cli import main
from sgrt.twin import tof as twin
from sgrt.twin.camera import Camera

SNAPSHOT = DATA / "tof" / "snapshot-lidar" / "CVPRScene"
REJECTED = 63


def camera(width: int = 64, height: int = 48, focal: float = 80.0) -> Camera:
    """Looks down from 1.2 m above the isocentre."""
    pose = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1200], [0, 0, 0, 1]])
    centre = (width - 1) / 2, (height - 1) / 2
    return Camera("tof-cam", (width, height), (focal, focal, *centre), (-0.1, 0.05, 0, 0, 0), tuple(pose.ravel()))


def table(height_mm: float = 0.0) -> twin.Scene:
    return twin.plane([0, 0, height_mm], [0, 0, 1.0])


@pytest.fixture
def unit() -> twin.TofCamera:
    return twin.TofCamera(camera(), power_e=60_000, ambient_e=1000)


@pytest.fixture
def files(tmp_path, unit):
    """A rig and frames of a box on a table."""
    box = twin.nearest(table(), twin.plane([0, 0, 250], [0, 0, 1.0], radius_mm=150))
    (tmp_path / "rig.json").write_text(unit.rig_json())
    sgrt.io.write_tof(tmp_path / "frames.npz", sgrt.io.TofFrames(unit.capture(box, seed=1, frames=3), 60_000.0))
    return tmp_path


def tof(folder, *more, frames="frames.npz", unit_id="tof0"):
    inputs = ["--rig", folder / "rig.json", "--tof", unit_id, folder / frames]
    return main(["tof", *map(str, [*inputs, "--out", folder / "out.ply", *more])])


def test_the_twin_is_measured_as_it_is(unit):
    result = sgrt.tof_measure(sgrt.Rig(unit.rig_json()), "tof0", unit.capture(table(), seed=1, frames=8))
    truth = unit.truth(table())
    error = (result.range_mm - truth) / result.sigma_mm
    assert result.point_count == 64 * 48
    assert np.std(error) == pytest.approx(1, abs=0.06)
    assert abs(np.mean(error)) < 0.1
    assert np.all(result.frames >= 1) and np.mean(result.frames) > 7.8
    assert result.surface.points[..., 2] == pytest.approx(result.points[..., 2], abs=1e-2)
    assert np.nanmean(result.surface.normals[..., 2]) > 0.99


def test_a_patient_is_a_surface(unit):
    from sgrt.twin import torso

    scene = twin.nearest(twin.body(torso()), table(-150))
    result = sgrt.tof_measure(sgrt.Rig(unit.rig_json()), "tof0", unit.capture(scene, seed=2, frames=4))
    good = (result.flags & REJECTED) == 0
    truth = unit.truth(scene)
    assert good.mean() > 0.85
    assert np.std(((result.range_mm - truth) / result.sigma_mm)[good]) < 1.3


def test_flying_pixels_are_found():
    fine = twin.TofCamera(camera(160, 120, 200.0), power_e=4e5, full_well_counts=65_535, electrons_per_count=20, sub=4)
    tilted = twin.plane([20, 10, 300], [0.3, 0.2, 1.0], radius_mm=160)
    scene = twin.nearest(twin.plane([0, 0, 0], [0.1, 0, 1.0]), tilted)
    result = sgrt.tof_measure(sgrt.Rig(fine.rig_json()), "tof0", fine.capture(scene, seed=3, frames=4))
    centre, rays = fine.rays(fine.sub)
    shape = (120, 4, 160, 4)
    ranges = scene(centre, rays.reshape(-1, 3))[0].reshape(shape)
    near = np.isfinite(tilted(centre, rays.reshape(-1, 3))[0].reshape(shape)).mean(axis=(1, 3))
    mixed = (near > 0) & (near < 1)
    found = (result.flags & 8) != 0
    displaced = mixed & (np.abs(result.range_mm - np.nanmin(ranges, axis=(1, 3))) > 20)
    displaced &= np.abs(result.range_mm - np.nanmax(ranges, axis=(1, 3))) > 20
    assert displaced.sum() > 150
    assert found[displaced].mean() >= 0.95
    assert found[~mixed].mean() <= 0.02


def test_motion_between_the_taps_is_seen(unit):
    rig = sgrt.Rig(unit.rig_json())
    still = sgrt.tof_measure(rig, "tof0", unit.capture(table(), seed=4))
    assert still.counts["moved"] == 0
    moving = [twin.nearest(table(), twin.plane([100 + 40 * k, 0, 300], [0, 0, 1.0], radius_mm=200)) for k in range(4)]
    result = sgrt.tof_measure(rig, "tof0", unit.capture(moving, seed=4))
    truth = np.stack([unit.truth(scene) for scene in moving])
    crossed, found = np.ptp(truth, axis=0) > 100, (result.flags & 4) != 0
    assert found[crossed].mean() > 0.9
    assert found[~crossed].mean() < 0.01


def test_wiggling_is_calibrated_away(tmp_path):
    """Known poses: 30 mm of wiggling to less than 1 mm, through the files that the rig names."""
    unit = twin.TofCamera(camera(48, 36, 60.0), wiggle=30 / 1193, power_e=4e5, electrons_per_count=20)
    rig = sgrt.Rig(unit.rig_json())
    heights = np.linspace(500, -1500, 34)
    taps = [unit.capture(table(h), seed=i) for i, h in enumerate(heights)]
    poses = np.tile(np.eye(4), (len(heights), 1, 1))
    poses[:, 2, 3] = heights
    result = sgrt.calibration_tof(rig, "tof0", taps, board_mm=(-4000, -4000, 4000, 4000), room_from_board=poses)
    report = json.loads(result.report)
    assert report["rms_before_mm"] > 15
    assert result.rig.tofs[0].pixel_offset_file in ("", "pixel-offset.npy")
    left = []
    for height in (320, 60, -410, -930, -1210):
        taken = unit.capture(table(height), seed=99)
        measured = sgrt.tof_measure(result.rig, "tof0", taken, pixel_offset_mm=result.pixel_offset_mm)
        raw = sgrt.tof_measure(rig, "tof0", taken)
        truth = unit.truth(table(height))
        left.append(np.mean(measured.range_mm - truth))
        assert abs(np.mean(raw.range_mm - truth)) > 3 * abs(left[-1])
    assert np.sqrt(np.mean(np.square(left))) < 0.6 and np.max(np.abs(left)) < 1.0


def test_command_line_calibrates_from_boards(tmp_path, capsys):
    unit = twin.TofCamera(camera(128, 96, 150.0), wiggle=30 / 1193, power_e=4e5, electrons_per_count=20, sub=2)
    (tmp_path / "rig.json").write_text(unit.rig_json())
    files = []
    for i, height in enumerate(np.linspace(500, 200, 5)):
        pose = np.eye(4)
        pose[:3, :3] = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
        pose[:3, 3] = -180, 120, height
        frames = sgrt.io.TofFrames(unit.capture(twin.board(pose, 7, 5, 60.0), seed=i), 60_000.0)
        files.append(str(tmp_path / f"{i}.npz"))
        sgrt.io.write_tof(files[-1], frames)
    command = ["calibrate", "tof", "--rig", str(tmp_path / "rig.json"), "--board", "chessboard:7x5:60", "--tof", "tof0"]
    assert main([*command, *files, "--out", str(tmp_path / "out.json"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["kind"] == "tof" and report["rms_after_mm"] < report["rms_before_mm"]
    assert all(p["pixels"] > 300 for p in report["placements"])
    rig = sgrt.io.read_rig(tmp_path / "out.json")
    entry = json.loads(rig.to_json())["tofs"][0]
    assert len(entry["range_correction"]["range_mm"]) == len(entry["range_correction"]["error_mm"]) > 5
    if rig.tofs[0].pixel_offset_file:
        assert sgrt.io.read_pixel_offset(tmp_path / rig.tofs[0].pixel_offset_file).shape == (96, 128)
    # For people, with frames in which there is no board.
    files.append(str(tmp_path / "empty.npz"))
    sgrt.io.write_tof(files[-1], sgrt.io.TofFrames(unit.capture(table(300), seed=9), 60_000.0))
    more = ["--knot-spacing", "100", "--report", str(tmp_path / "report.json")]
    assert main([*command, *files, "--out", str(tmp_path / "two.json"), *more]) == 0
    said = capsys.readouterr().out
    assert "empty.npz: not used" in said and "samples, error" in said and "two.json: written" in said
    assert json.loads((tmp_path / "report.json").read_text())["frames_without_board"][0]["frames"] == "empty.npz"
    assert main([*command, files[-1], "--out", str(tmp_path / "three.json")]) == 1
    assert "the board is in none of the frames" in capsys.readouterr().err
    sgrt.io.write_tof(files[-1], sgrt.io.TofFrames(unit.capture(table(300), seed=9), 50_000.0))
    assert main([*command, files[0], files[-1], "--out", str(tmp_path / "three.json")]) in (1, 2)
    assert not (tmp_path / "three.json").exists()


def test_command_line_writes_a_surface(files, capsys):
    assert tof(files, "--json", "--picture", files / "range.png") == 0
    document = json.loads(capsys.readouterr().out)
    surface = sgrt.io.read_surface(files / "out.ply")
    assert (document["status"], document["verdict"]) == ("ok", "ok")
    assert document["points"] == surface.point_count == document["tof"]["points"]
    assert surface.points.shape == (48, 64, 3)
    assert surface.covariance is not None and surface.normals is not None
    assert document["tof"]["flags"]["saturated"] == 0
    assert (files / "range.png").read_bytes()[:4] == b"\x89PNG"
    heights = surface.points[..., 2]
    assert np.nanmedian(heights[20:28, 28:36]) == pytest.approx(250, abs=5)


def test_command_line_uses_what_the_rig_names(files, unit):
    offset = np.full((48, 64), 100.0)
    sgrt.io.write_pixel_offset(files / "offset.npy", offset)
    (files / "rig.json").write_text(unit.rig_json(pixel_offset_mm="offset.npy"))
    assert tof(files) == 0
    centre = sgrt.io.read_surface(files / "out.ply").points[24, 32]
    assert centre[2] == pytest.approx(350, abs=8)
    sgrt.io.write_pixel_offset(files / "offset.npy", offset[:7])
    assert tof(files) == 2


# REQ-FILE-003
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"taps": np.zeros((1, 1, 3, 48, 64), np.uint16)}, "taps: shape 1 x 1 x 3 x 48 x 64"),
        ({"taps": np.zeros((1, 2, 4, 48, 64), np.uint16)}, "taps: shape 1 x 2 x 4 x 48 x 64"),
        ({"taps": np.zeros((1, 1, 4, 48, 64))}, "dtype float64"),
        ({"taps": np.zeros((4, 48, 64), np.uint16)}, "3 dimensions"),
        ({"taps": np.zeros((0, 1, 4, 48, 64), np.uint16)}, "without a pixel"),
        ({"phases": np.zeros(3)}, "has no array 'taps'"),
        ({"taps": np.zeros((1, 1, 4, 48, 64), np.uint16), "saturation": np.array([1, 2])}, "saturation"),
        ({"taps": np.array([{}], dtype=object)}, "not an .npz file that can be read"),
    ],
)
def test_malformed_frames_are_named(files, capsys, change, words):
    np.savez(files / "bad.npz", **change)
    assert tof(files, frames="bad.npz") == 2
    error = capsys.readouterr().err
    assert words in error and "bad.npz" in error and error.count("\n") == 1
    assert not (files / "out.ply").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tap_phase_rad": [0, 0.1, 0.2]}, "tofs[0].tap_phase_rad"),
        ({"tap_phase_rad": [0, 3.14159265]}, "tofs[0].tap_phase_rad"),
        ({"modulation_hz": [0]}, "tofs[0].modulation_hz: 0"),
        ({"modulation_hz": [-20e6]}, "tofs[0].modulation_hz: -2e+07"),
        ({"modulation_hz": []}, "tofs[0].modulation_hz"),
        ({"modulation_hz": [20e6, 20e6]}, "twice"),
        ({"taps": "signed"}, "tofs[0].taps"),
        ({"camera": "other"}, "tofs[0].camera"),
        ({"range_correction": {"range_mm": [1, 1], "error_mm": [0, 0]}}, "range_correction.range_mm[1]"),
        ({"range_correction": {"range_mm": [1, 2], "error_mm": [0]}}, "range_correction.error_mm"),
        ({"amplitude_correction": {"error_mm": [0]}}, "amplitude_correction.amplitude: missing"),
        ({"pixel_offset_mm": "../x.npy"}, "pixel_offset_mm"),
        ({"pixel_offset_mm": "/x.npy"}, "pixel_offset_mm"),
        ({"refractive_index": 0.9}, "refractive_index"),
        ({"electrons_per_count": "2"}, "electrons_per_count"),
    ],
)
def test_malformed_units_are_named(unit, change, words):
    with pytest.raises(sgrt.FormatError, match="tofs") as error:
        sgrt.Rig(unit.rig_json(**change))
    assert words in str(error.value)


def test_units_round_trip(unit):
    rig = sgrt.Rig(unit.rig_json(maker="x", range_correction={"range_mm": [1, 2.5], "error_mm": [0.1, 0.2]}))
    assert sgrt.Rig(rig.to_json()).to_json() == rig.to_json()
    (only,) = rig.tofs
    assert (only.id, only.camera, only.modulation_hz, only.differential) == ("tof0", "tof-cam", [20e6], False)
    assert json.loads(rig.to_json())["tofs"][0]["maker"] == "x"


def test_bad_calls_are_named(files, unit, capsys):
    rig = sgrt.Rig(unit.rig_json())
    with pytest.raises(sgrt.InvalidArgument, match="tof 'tof7' is not in the rig, which has 'tof0'"):
        sgrt.tof_measure(rig, "tof7", np.zeros((1, 4, 48, 64), np.uint16))
    with pytest.raises(sgrt.InvalidArgument, match="dtype"):
        sgrt.tof_measure(rig, "tof0", np.zeros((1, 4, 48, 64)))
    with pytest.raises(sgrt.NotFound, match="3072 of 3072 are saturated") as error:
        sgrt.tof_measure(rig, "tof0", np.full((1, 4, 48, 64), 65535, np.uint16))
    assert np.all(error.value.result.flags & 1)
    with pytest.raises(sgrt.NotFound, match="low amplitude"):
        sgrt.tof_measure(rig, "tof0", np.zeros((1, 4, 48, 64), np.uint16))
    with pytest.raises(sgrt.NotFound, match="saturated"):
        sgrt.tof_measure(rig, "tof0", np.full((1, 4, 48, 64), np.nan, np.float32))
    assert tof(files, unit_id="tof7") == 2
    assert "has no time-of-flight unit 'tof7'; it has tof0" in capsys.readouterr().err
    assert tof(files, "--range", 2000, 1000) == 2
    assert tof(files, "--range", 4000, 5000) == 1
    assert "out of range" in capsys.readouterr().err


def test_session_gives_what_the_call_gives(unit):
    rig, taps = sgrt.Rig(unit.rig_json()), unit.capture(table(), seed=5)
    session = sgrt.TofSession(rig, "tof0")
    first = session.push(taps, time_s=0.0)
    whole = sgrt.tof_measure(rig, "tof0", taps, context=sgrt.Context(threads=2))
    session.push(unit.capture(table(100), seed=6), time_s=0.1, surface=False)
    assert np.array_equal(first.range_mm, whole.range_mm)
    assert np.array_equal(first.points, whole.points, equal_nan=True)
    assert np.array_equal(first.surface.normals, whole.surface.normals, equal_nan=True)
    with pytest.raises(sgrt.InvalidArgument, match="time_s"):
        session.push(taps, time_s=0.05)


def test_clipped_frames_are_not_averaged(unit):
    """Clipped in the last frame: flagged. Clipped before: that frame does not count."""
    taps = unit.capture(table(), seed=7, frames=4)
    taps[3, 0, 1, 10, 10] = taps[1, 0, 2, 20, 20] = 60_000
    result = sgrt.tof_measure(sgrt.Rig(unit.rig_json()), "tof0", taps, saturation=60_000)
    assert result.flags[10, 10] & 1 and not result.flags[20, 20] & REJECTED
    assert result.frames[20, 20] == 2


def test_the_filters_of_surfaces_serve(unit):
    result = sgrt.tof_measure(sgrt.Rig(unit.rig_json()), "tof0", unit.capture(table(), seed=8))
    filtered = sgrt.surface_filter(result.surface, radius_mm=60.0).surface
    before, after = (np.nanstd(s.points[..., 2]) for s in (result.surface, filtered))
    assert after < 0.5 * before
    session = sgrt.FilterSession()
    for i in range(6):
        frame = sgrt.tof_measure(sgrt.Rig(unit.rig_json()), "tof0", unit.capture(table(), seed=20 + i)).surface
        steady = session.push(frame, time_s=0.05 * i).surface
    assert np.nanstd(steady.points[..., 2]) < 0.7 * before


@pytest.mark.skipif(not SNAPSHOT.exists(), reason=f"no {SNAPSHOT}")
def test_a_real_camera_agrees():
    """Differential taps of a snapshot lidar: its amplitude is 2 A, its distance 429 mm/rad from 1150 mm."""
    planes = {name: np.load(SNAPSHOT / f"{name}_avg.npy") for name in ("dist", "amp")}
    order = (90, 270, 0, 180)  # any order, by the phases
    taps = np.stack([np.load(SNAPSHOT / f"phase{k}_avg.npy") for k in order]).astype(np.float32)[None]
    height, width = planes["amp"].shape
    rig = json.loads(twin.TofCamera(camera(width, height, 500.0), tap_phase_rad=tuple(np.radians(order))).rig_json())
    rig["tofs"][0] |= {"taps": "differential", "modulation_hz": [299792458e3 / (4 * np.pi * 429 * 1.00027)]}
    result = sgrt.tof_measure(sgrt.Rig(json.dumps(rig)), "tof0", taps)
    ratio = planes["amp"] / result.amplitude[0]
    assert np.percentile(np.abs(ratio / np.median(ratio) - 1), 95) < 0.01
    turn = 2 * np.pi * 429
    difference = (planes["dist"] - result.range_mm - 1150 + turn / 2) % turn - turn / 2
    bright = planes["amp"] > np.median(planes["amp"])  # in the darker half the camera has a term of its own
    assert np.median(np.abs(difference[bright])) < 3
    along = np.corrcoef((result.phase_rad[0][bright] + np.pi) % (2 * np.pi), planes["dist"][bright])[0, 1]
    assert along > 0.999  # linear and rising
    assert np.all(np.isnan(result.sigma_mm)) and result.surface.sigma_mm is None
    assert result.counts["moved"] < 0.001 * height * width
