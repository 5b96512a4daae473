"""The tracker and `sgrt track`: tolerances with hysteresis, lost and found, breathing, drift, nonsense, same bits."""

import json

import numpy as np
import pytest
import sgrt
from conftest import ISOCENTRE, SHIFT, body_height, body_points, displaced
from sgrt import io

PATCH = sgrt.Roi.polygon([[-40, -40], [40, -40], [40, 40], [-40, 40]])


def body(seed, count=4000, noise_mm=0.1, **shift):
    """The body of the reference displaced by `shift` about ISOCENTRE, newly sampled."""
    rng = np.random.default_rng(seed)
    points = displaced(body_points(count, seed), {k: shift.get(k, 0.0) for k in SHIFT}, ISOCENTRE)
    points += rng.normal(0, noise_mm, points.shape)
    return sgrt.Surface(points, sigma_mm=np.full(count, noise_mm)).estimate_normals()


def tracker(reference, **options):
    return sgrt.Tracker(reference, isocentre_mm=ISOCENTRE, **options)


def beams(tracker, frames, dt=0.1):
    return [tracker.push(body(50 + i, **shift), time_s=i * dt).beam for i, shift in enumerate(frames)]


@pytest.mark.parametrize(("profile", "mm", "deg"), [("conventional", 2.0, 1.0), ("sbrt", 1.0, 0.5), ("srs", 1.0, 0.5)])
def test_profiles(reference, profile, mm, deg):
    for axis in ("lat_mm", "lng_mm", "vrt_mm"):
        for sign in (-1, 1):
            inside, outside = {axis: sign * (mm - 0.1)}, {axis: sign * (mm + 0.1)}
            assert beams(tracker(reference, profile=profile), [inside, outside]) == ["on", "hold"], axis
    for axis in ("pitch_deg", "roll_deg", "rtn_deg"):
        frames = [{axis: deg - 0.05}, {axis: deg + 0.05}]
        assert beams(tracker(reference, profile=profile), frames) == ["on", "hold"], axis


def test_hysteresis(reference):
    frames = [{"lat_mm": x} for x in (0.0, 1.9, 2.1, 1.9, 1.7, 1.5, 1.9)]
    assert beams(tracker(reference), frames) == ["on", "on", "hold", "hold", "hold", "on", "on"]
    assert beams(tracker(reference, hysteresis=1.0), frames)[3] == "on"
    again = beams(tracker(reference, resume_s=0.25), [{"lat_mm": x} for x in (2.1, 0, 0, 0, 0, 0)])
    assert again == ["hold"] * 4 + ["on"] * 2


def test_a_frame_says_what_it_knows(reference):
    track = tracker(reference)
    first = track.push(body(1, **SHIFT), time_s=5.0)
    for name, truth in SHIFT.items():
        assert getattr(first.displacement, name) == pytest.approx(truth, abs=0.05)
    assert (first.status, first.verdict, first.state, first.frame, first.time_s) == ("ok", "ok", "tracking", 0, 5.0)
    assert first.hold == ["translation", "rotation"]
    assert first.hold_text == "the translation is beyond tolerance; the rotation is beyond tolerance"
    assert max(abs(v) for v in first.drift.as_dict().values()) < 1e-9
    assert np.all(first.sigma_mm < 0.05) and np.isnan(first.breathing_mm)
    moved = dict(SHIFT, lng_mm=SHIFT["lng_mm"] + 1.5)
    second = track.push(body(2, **moved), time_s=5.1)
    assert second.drift.lng_mm == pytest.approx(1.5, abs=0.05)
    assert second.drift.lat_mm == pytest.approx(0, abs=0.05)


def test_found_anywhere(reference):
    track = tracker(reference)
    assert track.push(body(1), time_s=0).beam == "on"
    away = track.push(body(2, vrt_mm=300), time_s=0.1)
    assert (away.status, away.state, away.beam, away.searched) == ("ok", "found", "hold", True)
    assert away.displacement.vrt_mm == pytest.approx(300, abs=0.1)
    assert away.verdict_text == "ok: found by a search anywhere"
    on = track.push(body(3, vrt_mm=300.5), time_s=0.2)
    assert (on.state, on.searched, on.attempts) == ("tracking", False, 1)
    with pytest.raises(sgrt.InvalidArgument, match="search_every_s"):
        tracker(reference, search_every_s=-1)


# REQ-TRACK-005
def test_lost_and_found(reference):
    track = tracker(reference, search=False)
    assert track.push(body(1), time_s=0).beam == "on"
    away = track.push(body(2, vrt_mm=300), time_s=0.1)
    assert (away.status, away.state, away.beam, away.hold) == ("not_found", "lost", "hold", ["no_pose"])
    assert np.isnan(away.displacement.lat_mm) and np.isnan(away.reference_from_live).all()
    nothing = track.push(None, time_s=0.2)
    assert (nothing.status, nothing.beam) == ("insufficient_data", "hold")
    back = track.push(body(3, lat_mm=15, rtn_deg=4), time_s=0.3)
    assert (back.state, back.beam) == ("found", "hold")
    assert back.displacement.lat_mm == pytest.approx(15, abs=0.05)
    home = track.push(body(4), time_s=0.4)
    assert (home.state, home.beam) == ("tracking", "on")


def test_motion_is_predicted(reference):
    """A patient who slides by 8 mm a frame is followed with fewer iterations than without prediction."""
    steps = [body(10 + i, lng_mm=8.0 * i) for i in range(6)]
    moving, still = tracker(reference), tracker(reference, max_gap_s=1e-3)
    fast = [moving.push(s, time_s=0.1 * i).iterations for i, s in enumerate(steps)]
    slow = [still.push(s, time_s=0.1 * i).iterations for i, s in enumerate(steps)]
    assert sum(fast[2:]) < sum(slow[2:])


# REQ-TRACK-006
def test_a_weak_pose_holds():
    """A shallow bump on a dome turns nearly freely: what is not certain does not let the beam on."""
    rng = np.random.default_rng(3)

    def dome(n):
        x, y = rng.uniform(-60, 60, (2, n))
        z = np.sqrt(150.0**2 - x**2 - y**2) - 150 + 2.0 * np.exp(-((x - 20) ** 2 + (y + 10) ** 2) / 800)
        points = np.stack([x, y, z], axis=1) + rng.normal(0, 0.3, (n, 3))
        return sgrt.Surface(points, sigma_mm=np.full(n, 0.3)).estimate_normals()

    frame = sgrt.Tracker(dome(4000), isocentre_mm=(0, 0, -150)).push(dome(3000), time_s=0)
    assert frame.beam == "hold"
    assert frame.hold in (["weak"], ["no_pose"])


def breath(seed, amplitude_mm, count=4000):
    rng = np.random.default_rng(seed)
    points = body_points(count, seed)
    points[:, 2] = body_height(points[:, 0], points[:, 1]) + amplitude_mm * np.exp(
        -(points[:, 0] ** 2 + points[:, 1] ** 2) / (2 * 90.0**2)
    )
    points += rng.normal(0, 0.1, points.shape)
    return sgrt.Surface(points, sigma_mm=np.full(count, 0.1)).estimate_normals()


# REQ-TRACK-007
def test_breathing_trace_and_window(reference):
    track = tracker(
        reference, gate_roi=PATCH, gated=True, tolerance_mm=50, tolerance_deg=30, gate_low_mm=-1, gate_high_mm=2
    )
    trace, on = [], []
    true = [0.0, 4.0, 8.0, 4.0, 1.0, 0.0, -3.0, 0.0]
    for i, amplitude in enumerate(true):
        frame = track.push(breath(30 + i, amplitude), time_s=0.2 * i)
        trace.append(frame.breathing_mm)
        on.append(frame.beam)
        if not -1 <= amplitude <= 2:
            assert "breathing" in frame.hold
        assert 0 < frame.breathing_sigma_mm < 0.2
    # Over a patch of 80 mm the lift is the Gaussian's mean, about 0.88 of its top.
    assert np.abs(np.array(trace) - 0.9 * np.array(true)).max() < 0.06 * 8
    assert [b for b, a in zip(on, true, strict=True) if a in (0.0, 1.0)] == ["on"] * 4
    with pytest.raises(sgrt.InvalidArgument, match="gate_roi"):
        tracker(reference, gated=True)
    with pytest.raises(sgrt.InsufficientData, match="gate_roi"):
        tracker(reference, gate_roi=sgrt.Roi.box((900, 900, 900), (901, 901, 901)))


def test_time_and_reference(reference):
    track = tracker(reference)
    assert track.push(body(1), time_s=1.0).beam == "on"
    for bad in (0.5, float("nan"), float("inf")):
        with pytest.raises(sgrt.InvalidArgument, match="time_s"):
            track.push(body(1), time_s=bad)
    # The beam has to come back: within the tolerance is not enough after the error, well inside is.
    assert track.push(body(2, lat_mm=1.8), time_s=1.1).hold == ["returning"]
    assert track.push(body(3), time_s=1.2).beam == "on"
    # A pause: the same.
    assert track.push(body(4, lat_mm=1.8), time_s=9.0).hold == ["returning"]
    # Another reference: where the patient is now becomes the plan.
    track.set_reference(body(5, lat_mm=5))
    frame = track.push(body(6, lat_mm=5), time_s=9.1)
    assert frame.beam == "on"
    assert frame.displacement.mag_mm < 0.1
    assert max(abs(v) for v in frame.drift.as_dict().values()) < 1e-9
    with pytest.raises(sgrt.InsufficientData):
        track.set_reference(body(5), gate_roi=sgrt.Roi.box((900, 900, 900), (901, 901, 901)))
    frame = track.push(body(7, lat_mm=5), time_s=9.2)
    assert (frame.beam, frame.displacement.mag_mm < 0.1) == ("on", True)  # the old one stayed


@pytest.mark.parametrize(
    "bad",
    [
        {"profile": "sdrt"},
        {"tolerance_mm": -1},
        {"tolerance_deg": float("nan")},
        {"hysteresis": 0},
        {"hysteresis": 1.1},
        {"resume_s": -1},
        {"max_gap_s": 0},
        {"gate_low_mm": 2, "gate_high_mm": 1},
    ],
)
def test_nonsense_options(reference, bad):
    with pytest.raises(sgrt.InvalidArgument, match=next(iter(bad))):
        tracker(reference, **bad)


def test_same_bits_at_any_number_of_threads(reference):
    frames = [body(70 + i, count=2000, lat_mm=0.3 * i, breath=0) for i in range(4)]

    def run(threads):
        context = sgrt.Context(threads=threads)
        track = tracker(reference, gate_roi=PATCH, context=context)
        found = [track.push(f, time_s=0.1 * i, context=context) for i, f in enumerate(frames)]
        return [(f.reference_from_live.tobytes(), f.covariance.tobytes(), f.breathing_mm) for f in found]

    assert len({repr(run(threads)) for threads in (1, 2, 3, 8)}) == 1


# --------------------------------------------------------------------------------------------------------- command line


@pytest.fixture(scope="module")
def captures(tmp_path_factory, reference):
    folder = tmp_path_factory.mktemp("track")
    io.write_surface(folder / "reference.ply", reference)
    io.write_roi(folder / "patch.json", PATCH)
    frames = []
    for i, lat in enumerate((0.0, 0.5, 1.4, 0.2)):
        io.write_surface(folder / f"{i:03}.ply", body(20 + i, lat_mm=lat))
        frames.append(io.Capture(0.1 * i, folder / f"{i:03}.ply"))
    (folder / "broken.ply").write_text("ply\nnonsense\n")
    (folder / "empty.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    )
    frames += [io.Capture(0.4, folder / "broken.ply"), io.Capture(0.5, folder / "empty.ply"), io.Capture(0.6)]
    frames += [io.Capture(0.7, folder / "gone.ply"), io.Capture(0.8, folder / "000.ply")]
    io.write_captures(folder / "frames.json", frames)
    return folder


def command(folder, *more, frames="frames.json"):
    return ["track", folder / frames, "--reference", folder / "reference.ply", "--isocentre", *ISOCENTRE, *more]


def test_track_json_lines(run, captures):
    code, out, err = run(*command(captures, "--profile", "sbrt", "--json-lines"))
    assert (code, err) == (0, "")
    lines = [json.loads(line) for line in out.splitlines()]
    assert [line["beam"] for line in lines] == ["on", "on", "hold", "on", "hold", "hold", "hold", "hold", "on"]
    assert [line["status"] for line in lines[:4]] == ["ok"] * 4
    assert [line["status"] for line in lines[4:8]] == ["format", "insufficient_data", "insufficient_data", "format"]
    assert [line["time_s"] for line in lines] == pytest.approx([0.1 * i for i in range(9)])
    assert lines[1]["patient_displacement"]["lat_mm"] == pytest.approx(0.5, abs=0.03)
    assert lines[4]["patient_displacement"] == dict.fromkeys(lines[0]["patient_displacement"])
    assert lines[4]["sigma_mm"] == [None] * 3 and lines[4]["verdict"] is None
    assert "broken.ply" in lines[4]["message"] and "gone.ply" in lines[7]["message"]
    assert all(line["timing_ms"] >= 0 for line in lines)
    assert run(*command(captures, "--profile", "sbrt", "--json-lines", frames="."))[0] == 0  # the folder


def test_track_for_people_and_as_one_document(run, captures):
    code, out, _ = run(*command(captures, "--gate-roi", captures / "patch.json", "--gate", -2, 2))
    assert code == 0
    assert "9 frames, 5 with a pose, beam on in 5; a frame took p50" in out
    assert "breath" in out
    document = json.loads(run(*command(captures, "--json"))[1])
    assert document["summary"]["frames"] == len(document["frames"]) == 9
    assert set(document["summary"]["timing_ms"]) == {"p50", "p99", "p99.9"}


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"frames": []}, "frames"),
        ({"schema": "sgrt-frames/9", "frames": [{"time_s": 0}]}, "sgrt-frames/9"),
        ({"frames": [{"time_s": 1, "surface": "000.ply"}, {"time_s": 0.5, "surface": "000.ply"}]}, "frames[1].time_s"),
        ({"frames": [{"surface": "000.ply"}]}, "time_s"),
        ({"frames": [{"time_s": 0, "surface": "/etc/passwd"}]}, "surface"),
        ({"frames": [{"time_s": 0, "surface": "../000.ply"}]}, "'..'"),
        ({"frames": [{"time_s": 0, "surface": "a", "pairs": {}}, {"time_s": 0, "surface": "a", "ply": "b"}]}, "one of"),
        ({"frames": [{"time_s": 0, "pairs": {"pod1": ["a"]}}]}, "left, right"),
        ({"frames": [{"time_s": 0, "pairs": {"pod1": ["a", "b"]}}]}, "--rig"),
    ],
)
def test_track_refuses(run, captures, tmp_path, document, words):
    (tmp_path / "frames.json").write_text(json.dumps(document))
    code, out, err = run(*command(captures, "--json-lines")[:1], tmp_path / "frames.json", *command(captures)[2:])
    assert (code, out) == (2, "")
    assert words in err and err.count("\n") == 1


def test_no_frame_with_a_pose(run, captures, tmp_path):
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"time_s": 0}, {"time_s": 1}]}))
    code, out, _ = run("track", tmp_path, *command(captures)[2:], "--json-lines")
    assert code == 1
    assert [json.loads(line)["beam"] for line in out.splitlines()] == ["hold", "hold"]
    code, out, _ = run("track", tmp_path, *command(captures)[2:], "--json")
    assert code == 1 and json.loads(out)["status"] == "not_found"  # never ok with another exit code than 0
