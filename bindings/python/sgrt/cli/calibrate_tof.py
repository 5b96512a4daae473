"""`sgrt calibrate tof`: the range error of a time-of-flight camera from frames of a board."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from .._core import Calibration, Context, Rig, Tof, TofUnit, calibration_tof, tof_measure
from ..boards import Board, index_rows, parse_board
from ..errors import NotFound
from ..io import TofFrames, read_rig, read_tof, write_pixel_offset, write_rig
from ..io._files import write_json
from ._common import FILE, Failure, about, calibrating, check_out, common, print_json, progress_bar, report_of, working
from .tof import unit_of

BARE = 0.8  # of a square beyond the outer corners: printed on every chessboard


def _amplitude(rig: Rig, unit: TofUnit, frames: TofFrames, path: Path, window: dict[str, Any]) -> NDArray[np.float32]:
    """The amplitude image, in which the board is found as in any other."""
    options = window | ({} if frames.saturation is None else {"saturation": frames.saturation})
    try:
        with about(path):
            result = tof_measure(rig, unit.id, frames.taps, **options)
    except NotFound as error:
        if not isinstance(error.result, Tof):
            raise
        result = error.result
    assert result.amplitude is not None
    return np.ascontiguousarray(result.amplitude[0])


def _find(
    rig: Rig, unit: TofUnit, board: Board, captures: list[tuple[Path, TofFrames]], window: dict[str, Any]
) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """Arguments of calibration_tof for the placements in which the board was found, and those without it."""
    camera = next(c for c in rig.cameras if c.id == unit.camera)
    index, pixels, missing = [], [], []
    with progress_bar() as progress:
        for number, (path, frames) in enumerate(captures):
            progress((number + 1) / len(captures), "find the board")
            try:
                found = board.find(_amplitude(rig, unit, frames, path, window))
            except NotFound as error:
                missing.append({"frames": path.name, "why": str(error)})
                continue
            rows, seen = index_rows(found.pixels, 0, number)
            index.append(rows)
            pixels.append(found.pixels[seen])
    if not index:
        raise NotFound(f"the board is in none of the frames: {missing[0]['why']}")
    arguments = {
        "cameras": [(camera.id, (camera.width, camera.height))],
        "points": board.points,
        "index": np.concatenate(index),
        "pixels": np.concatenate(pixels),
        "placements": [path.name for path, _ in captures],
        "half_turn_ambiguous": board.half_turn_ambiguous,
    }
    return arguments, missing


def _bare(board: Board) -> tuple[float, float, float, float]:
    """left, top, right, bottom of the board's own area, mm."""
    points = board.points
    rim = BARE * board.spacing_mm if board.kind == "chessboard" else 0.0
    low, high = points.min(axis=0) - rim, points.max(axis=0) + rim
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _write(out: Path, tof_id: str, result: Calibration) -> None:
    """The rig, and beside it the offsets of its pixels under a name of their own."""
    assert result.rig is not None
    rig = result.rig
    if result.pixel_offset_mm is not None:
        name = "".join(c if c.isalnum() or c in "-_" else "-" for c in f"{out.stem}-{tof_id}-offset") + ".npy"
        check_out(out.parent / name)
        write_pixel_offset(out.parent / name, result.pixel_offset_mm)
        document = json.loads(rig.to_json())
        next(t for t in document["tofs"] if t["id"] == tof_id)["pixel_offset_mm"] = name
        rig = Rig(json.dumps(document, indent=1))
    write_rig(out, rig)


def _print(report: dict[str, Any], out: Path) -> None:
    for item in report["frames_without_board"]:
        print(f"{item['frames']}: not used: {item['why']}")
    for item in report["placements"]:
        if item["pixels"]:
            print(
                f"{item['name']}: {item['pixels']} pixels at {item['range_mm']:.0f} mm,"
                f" error {item['mean_before_mm']:+.2f} mm, {item['mean_after_mm']:+.2f} mm after"
            )
    print(
        f"{report['unit']}: {report['pixels']} samples, error {report['rms_before_mm']:.2f} mm RMS,"
        f" {report['rms_after_mm']:.2f} mm after (noise {report['expected_rms_mm']:.2f}),"
        f" placements {report['placement_rms_mm']:.3f} mm RMS"
    )
    for warning in report["warnings"]:
        print(f"warning: {warning}")
    print(f"{out}: written")


def _solve(
    rig: Rig,
    tof_id: str,
    captures: list[tuple[Path, TofFrames]],
    board: Board,
    seen: dict[str, Any],
    options: dict[str, Any],
    context: Context,
) -> Calibration:
    levels = {frames.saturation for _, frames in captures}
    if len(levels) > 1:
        raise Failure(f"the frames state different saturations: {sorted(str(level) for level in levels)}")
    level = levels.pop()
    if level is not None:
        options = options | {"saturation": level}
    taps = [frames.taps for _, frames in captures]
    return calibration_tof(rig, tof_id, taps, board_mm=_bare(board), context=context, **seen, **options)


@click.command(
    "tof",
    epilog="\b\nExample: sgrt calibrate tof --rig rig.json --board chessboard:11x8:30 --tof tof0 near.npz middle.npz"
    " far.npz --out calibrated.json",
)
@click.option("--rig", "rig_file", type=FILE, required=True, metavar="FILE", help="A rig whose lenses are calibrated.")
@click.option("--board", required=True, metavar="KIND:COLSxROWS:MM", help="As of sgrt calibrate.")
@click.option("--tof", "tof_id", required=True, metavar="ID", help="The unit; the frames follow, one file a placement.")
@click.argument("frames", type=FILE, nargs=-1, required=True, metavar="FRAMES.npz ...")
@click.option("--range", "window", type=float, nargs=2, metavar="MIN MAX", help="Window of ranges, mm.")
@click.option("--knot-spacing", type=float, metavar="MM", help="Of the range correction; default: 50.")
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The rig.json to write.")
@click.option("--report", "report_file", type=FILE, metavar="FILE", help="Also write the report, JSON.")
@common
def command(
    rig_file: Path,
    board: str,
    tof_id: str,
    frames: tuple[Path, ...],
    window: tuple[float, float] | None,
    knot_spacing: float | None,
    out: Path,
    report_file: Path | None,
    threads: int,
    as_json: bool,
) -> int:
    """Calibrates the range of a time-of-flight camera: its error over the range (wiggling), over the amplitude, and of
    each pixel.

    Each file holds frames of the board in one placement, from the nearest to the furthest range of use, some tilted,
    over all of the image. The board is found in the amplitude; the lens is the rig's. The pixels' offsets are written
    beside the rig.
    """
    check_out(out, report_file)
    rig, target = read_rig(rig_file), parse_board(board)
    unit = unit_of(rig, rig_file, tof_id)
    options: dict[str, Any] = {"range_min_mm": window[0], "range_max_mm": window[1]} if window else {}
    captures = [(path, read_tof(path)) for path in frames]
    seen, missing = _find(rig, unit, target, captures, options)
    if knot_spacing is not None:
        options = options | {"knot_spacing_mm": knot_spacing}
    with calibrating(as_json), working(threads) as context:
        result = _solve(rig, tof_id, captures, target, seen, options, context)
    report = report_of(result) | {"frames_without_board": missing}
    if report_file is not None:
        write_json(report_file, report)
    _write(out, tof_id, result)
    if as_json:
        print_json(report)
    else:
        _print(report, out)
    return 0
