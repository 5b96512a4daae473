"""`sgrt track`: a stream of captures to shifts and the beam-hold signal, a line a frame."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np

from .._core import Context, PatientDisplacement, Rig, StereoSession, Surface, Tracker, TrackFrame, surface_fuse
from ..errors import Error
from ..io import Capture, read_captures, read_image, read_rig, read_surface
from ..io._files import plain
from ._common import FILE, Failure, Stopwatch, about, common, placed, print_json, read_placed, working

SCHEMA = "sgrt-track/1"


class Source:
    """The surface of a capture. A file that cannot be read is a frame without a surface, and its words are kept."""

    def __init__(self, rig: Rig | None, captures: list[Capture], rig_file: Path | None) -> None:
        self._rig = rig
        self._sessions: dict[str, StereoSession] = {}
        known = [pair.id for pair in rig.pairs] if rig else []
        for i, capture in enumerate(captures):
            for pair in capture.pairs:
                if rig is None:
                    raise Failure(f"frames[{i}]: image pairs need --rig")
                if pair not in known:
                    raise Failure(f"{rig_file}: has no pair {pair!r}, which frames[{i}] names")

    def _match(self, pair: str, images: tuple[Path, Path], time_s: float, context: Context) -> Surface | None:
        assert self._rig is not None
        if pair not in self._sessions:
            self._sessions[pair] = StereoSession(self._rig, pair, context=context)
        left, right = (read_image(image) for image in images)
        with about(f"pair {pair}"):
            return self._sessions[pair].push(left, right, time_s=time_s, context=context).surface

    def surface(self, capture: Capture, context: Context) -> Surface | None:
        if capture.surface is not None:
            return read_surface(capture.surface)
        seen, errors = [], []
        for pair, images in capture.pairs.items():
            try:
                surface = self._match(pair, images, capture.time_s, context)
            except (Error, OSError) as error:  # one pod blocked: the others still see
                if isinstance(error, Error) and error.status >= 20:
                    raise
                errors.append(error)
            else:
                seen += [surface] if surface is not None else []
        if not seen and errors:
            raise errors[0]
        if len(seen) > 1:
            return surface_fuse(seen, context=context)[0]
        return seen[0] if seen else None


def _shift(shift: PatientDisplacement) -> dict[str, float]:
    return dict(shift.as_dict())


def line_of(frame: TrackFrame, status: str | None, message: str, latency_ms: float) -> dict[str, Any]:
    """One line; status: of a capture that could not be read, else None."""
    return {
        "time_s": frame.time_s,
        "status": status or frame.status,
        "verdict": frame.verdict if frame.verdict != "none" else None,
        "patient_displacement": _shift(frame.displacement),
        "beam": frame.beam,
        "sigma_mm": frame.sigma_mm,
        "sigma_deg": frame.sigma_deg,
        "hold": frame.hold,
        "state": frame.state,
        "searched": frame.searched,
        "drift": _shift(frame.drift),
        "breathing_mm": frame.breathing_mm,
        "message": message or frame.verdict_text,
        "timing_ms": latency_ms,
    }


def _frames(
    tracker: Tracker, source: Source, captures: list[Capture], context: Context
) -> Iterator[tuple[TrackFrame, dict[str, Any]]]:
    for capture in captures:
        live, status, message = None, None, ""
        try:
            live = source.surface(capture, context)
        except OSError as error:
            status, message = "format", f"{error.filename or capture.surface}: {error.strerror or error}"
        except Error as error:
            if error.status >= 20:
                raise
            status, message = error.word, str(error)
        watch = Stopwatch()
        frame = tracker.push(live, time_s=capture.time_s, context=context)
        yield frame, line_of(frame, status, message, watch.ms())


def summary_of(lines: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts, and how long a frame took, over the lines."""
    ms = np.array([line["timing_ms"] for line in lines])
    return {
        "frames": len(lines),
        "poses": sum(line["status"] == "ok" for line in lines),
        "beam_on": sum(line["beam"] == "on" for line in lines),
        "timing_ms": {f"p{p:g}": float(np.percentile(ms, p)) for p in (50, 99, 99.9)},
    }


def _print(line: dict[str, Any]) -> None:
    shift = line["patient_displacement"]
    numbers = " ".join(
        f"{name} {shift[key]:+7.2f}" for name, key in (("LAT", "lat_mm"), ("LNG", "lng_mm"), ("VRT", "vrt_mm"))
    )
    turns = " ".join(
        f"{name} {shift[key]:+6.2f}" for name, key in (("PITCH", "pitch_deg"), ("ROLL", "roll_deg"), ("RTN", "rtn_deg"))
    )
    breath = "" if np.isnan(line["breathing_mm"]) else f" breath {line['breathing_mm']:+6.2f}"
    why = "" if line["message"] == "ok" else f" {line['message']}"
    print(f"{line['time_s']:9.3f} s {numbers} {turns}{breath} beam {line['beam']:4} {','.join(line['hold'])}{why}")


def _tracker(
    reference: Path, roi: Path | None, gate_roi: Path | None, couch_deg: float, context: Context, **known: Any
) -> Tracker:
    surface, regions = read_placed(reference, (roi, gate_roi), couch_deg, known["isocentre_mm"])
    with about(reference):
        return Tracker(surface, roi=regions[0], gate_roi=regions[1], context=context, **known)


@click.command(
    "track",
    epilog="\b\nExample: sgrt track --reference reference.ply --isocentre 0 0 0 --profile sbrt frames.json"
    " --json-lines",
)
@click.argument("frames", type=FILE, metavar="FRAMES.json")
@placed("The frames were captured with the couch turned by DEG from where the reference was; as in sgrt register.")
@click.option("--rig", "rig_file", type=FILE, metavar="FILE", help="The calibrated room, for frames of image pairs.")
@click.option(
    "--profile",
    type=click.Choice(["conventional", "sbrt", "srs"]),
    default="conventional",
    help="The tolerance: 2 mm and 1 deg, or 1 mm and 0.5 deg; default: conventional.",
)
@click.option("--gate-roi", type=FILE, metavar="FILE", help="The patch of the breathing trace, roi.json.")
@click.option(
    "--gate",
    type=float,
    nargs=2,
    metavar="LOW HIGH",
    help="The beam is on only with the breathing amplitude in this window, mm (DIBH); needs --gate-roi.",
)
@click.option("--tolerance-mm", type=float, default=0.0, metavar="MM", help="Instead of the profile's.")
@click.option("--tolerance-deg", type=float, default=0.0, metavar="DEG", help="Instead of the profile's.")
@click.option(
    "--no-search", is_flag=True, help="Look for a lost patient only near where he was and where he was set up."
)
@click.option("--json-lines", is_flag=True, help="Print one JSON object a frame on standard output.")
@common
def command(
    frames: Path,
    reference: Path,
    isocentre_mm: tuple[float, ...],
    rig_file: Path | None,
    profile: str,
    roi: Path | None,
    gate_roi: Path | None,
    gate: tuple[float, float] | None,
    tolerance_mm: float,
    tolerance_deg: float,
    couch_deg: float,
    no_search: bool,
    json_lines: bool,
    threads: int,
    as_json: bool,
) -> int:
    """Follows a patient through a list of captures: six numbers, a verdict and the beam-hold signal a frame.

    FRAMES.json lists PLY files or image pairs with times; a folder stands for the frames.json in it. A frame without a
    trusted pose holds the beam. Exit code 1 if no frame had a pose.
    """
    if json_lines and as_json:
        raise Failure("--json and --json-lines: give one of them")
    if gate and gate_roi is None:
        raise Failure("--gate: needs --gate-roi")
    captures = read_captures(frames)
    source = Source(read_rig(rig_file) if rig_file else None, captures, rig_file)
    known: dict[str, Any] = {
        "isocentre_mm": isocentre_mm,
        "profile": profile,
        "gated": bool(gate),
        "search": not no_search,
    }
    known |= {"tolerance_mm": tolerance_mm, "tolerance_deg": tolerance_deg}
    if gate:
        known |= {"gate_low_mm": gate[0], "gate_high_mm": gate[1]}
    lines: list[dict[str, Any]] = []
    with working(threads) as context:
        tracker = _tracker(reference, roi, gate_roi, couch_deg, context, **known)
        for _, line in _frames(tracker, source, captures, context):
            lines.append(line)
            if json_lines:
                print(json.dumps(plain(line), allow_nan=False), flush=True)
            elif not as_json:
                _print(line)
    summary = summary_of(lines)
    if as_json:
        status = "ok" if summary["poses"] else "not_found"
        print_json({"schema": SCHEMA, "status": status, "frames": lines, "summary": summary})
    elif not json_lines:
        took = summary["timing_ms"]
        print(
            f"{summary['frames']} frames, {summary['poses']} with a pose, beam on in {summary['beam_on']};"
            f" a frame took p50 {took['p50']:.2f}, p99 {took['p99']:.2f}, p99.9 {took['p99.9']:.2f} ms"
        )
    return 0 if summary["poses"] else 1
