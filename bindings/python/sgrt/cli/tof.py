"""`sgrt tof`: taps of a time-of-flight camera to a surface."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from .._core import Context, Rig, Tof, TofUnit, tof_measure
from ..errors import Error
from ..io import TofFrames, read_pixel_offset, read_rig, read_tof, write_surface
from ._common import FILE, Failure, Stopwatch, about, check_out, common, one_line, print_json, working


def unit_of(rig: Rig, rig_file: Path, tof_id: str) -> TofUnit:
    for unit in rig.tofs:
        if unit.id == tof_id:
            return unit
    known = ", ".join(unit.id for unit in rig.tofs)
    raise Failure(f"{rig_file}: has no time-of-flight unit {tof_id!r}; it has {known or 'none'}")


def options_of(rig_file: Path, unit: TofUnit, frames: TofFrames) -> dict[str, Any]:
    """What the files beside the taps add: the pixels' offsets of the rig, the saturation of the frames."""
    options: dict[str, Any] = {}
    if unit.pixel_offset_file:
        options["pixel_offset_mm"] = read_pixel_offset(rig_file.parent / unit.pixel_offset_file)
    if frames.saturation is not None:
        options["saturation"] = frames.saturation
    return options


def _describe(tof_id: str, frames: TofFrames, result: Tof | None) -> dict[str, Any]:
    described: dict[str, Any] = {"id": tof_id, "frames": int(frames.taps.shape[0])}
    if result is None:
        return described
    low, high = result.range_window_mm
    return described | {
        "grid": [frames.taps.shape[4], frames.taps.shape[3]],
        "points": result.point_count,
        "flags": result.counts,
        "range_window_mm": [low, high],
        "ambiguity_mm": result.ambiguity_mm,
        "median_sigma_mm": result.median_sigma_mm,
    }


def _doubts(result: Tof) -> list[str]:
    """Why the answer is weak, one line each."""
    doubts = []
    low, high = result.range_window_mm
    if result.median_sigma_mm != result.median_sigma_mm:
        doubts.append("the taps are differential: their noise is not known, the surface has no sigma")
    if result.counts["uncalibrated"]:
        doubts.append(f"{result.counts['uncalibrated']} pixels lie outside the knots of the range correction")
    if result.counts["wrapped"] > result.point_count:
        doubts.append(
            f"{result.counts['wrapped']} pixels have several ranges in the window of {low:.0f} to {high:.0f} mm:"
            " state a smaller one with --range"
        )
    return doubts


def _draw(picture: Path | None, result: Tof) -> None:
    if picture is None:
        return
    try:
        from ..tof_picture import draw
    except ModuleNotFoundError as error:
        raise Failure(f"--picture needs {error.name}: pip install 'sgrt[plot]'") from error
    draw(picture, result)


def _measure(rig: Rig, tof_id: str, frames: TofFrames, options: dict[str, Any], context: Context, file: Path) -> Tof:
    with about(f"tof {tof_id} ({file})"):
        return tof_measure(rig, tof_id, frames.taps, context=context, **options)


@click.command("tof", epilog="\b\nExample: sgrt tof --rig rig.json --tof tof0 frames.npz --out surface.ply")
@click.option("--rig", "rig_file", type=FILE, required=True, metavar="FILE", help="The calibrated room, rig.json.")
@click.option(
    "--tof",
    "capture",
    type=(str, FILE),
    required=True,
    metavar="ID FRAMES",
    help="A time-of-flight unit of the rig and its frames, .npz; several frames are averaged as far as nothing moved.",
)
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The surface, PLY.")
@click.option(
    "--range",
    "window",
    type=float,
    nargs=2,
    metavar="MIN MAX",
    help="Window of ranges along the rays, mm; default: 0 to one unambiguous range.",
)
@click.option("--chapter-c", is_flag=True, help="c = 3e8 m/s and no air, as the chapter prints eq. 10.2.")
@click.option("--picture", type=FILE, metavar="FILE", help="Also draw the ranges in colour, PNG.")
@common
def command(
    rig_file: Path,
    capture: tuple[str, Path],
    out: Path,
    window: tuple[float, float] | None,
    chapter_c: bool,
    picture: Path | None,
    threads: int,
    as_json: bool,
) -> int:
    """Reconstructs a surface from the taps of a time-of-flight camera.

    The surface is the camera's own grid with normals, sigma_mm and covariance. Pixels that are saturated, dark, moving,
    flying, wrapped or out of range have no point and are counted.
    """
    watch = Stopwatch()
    check_out(out, picture)
    tof_id, file = capture
    rig = read_rig(rig_file)
    unit = unit_of(rig, rig_file, tof_id)
    frames = read_tof(file)
    options = options_of(rig_file, unit, frames) | {"chapter_c": chapter_c}
    if window:
        options |= {"range_min_mm": window[0], "range_max_mm": window[1]}
    with working(threads) as context:
        try:
            result = _measure(rig, tof_id, frames, options, context, file)
        except Error as error:
            if as_json and 10 <= error.status < 20:
                described = _describe(tof_id, frames, error.result if isinstance(error.result, Tof) else None)
                missing = {"status": error.word, "message": one_line(str(error)), "surface": None, "tof": described}
                print_json(missing | {"timing_ms": watch.ms()})
            raise
    surface = result.surface
    assert surface is not None
    write_surface(out, surface)
    _draw(picture, result)
    described, doubts = _describe(tof_id, frames, result), _doubts(result)
    for doubt in doubts:
        print(f"sgrt tof: warning: {doubt}", file=sys.stderr)
    if as_json:
        verdict = {"status": "ok", "verdict": "weak" if doubts else "ok", "doubts": doubts, "surface": str(out)}
        print_json(verdict | {"points": surface.point_count, "tof": described, "timing_ms": watch.ms()})
        return 0
    absent = {word: n for word, n in result.counts.items() if n and word != "uncalibrated"}
    print(
        f"{tof_id}: {result.point_count} of {result.flags.size if result.flags is not None else 0} pixels,"
        f" median sigma {result.median_sigma_mm:.2f} mm along the rays;"
        f" ranges of {result.range_window_mm[0]:.0f} to {result.range_window_mm[1]:.0f} mm; rejected: "
        + (", ".join(f"{n} {word}" for word, n in absent.items()) or "none")
    )
    print(f"{out}: {surface.point_count} points")
    return 0
