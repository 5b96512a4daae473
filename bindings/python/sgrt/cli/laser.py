"""`sgrt laser`: the sweep of a laser fan to a surface, or breathing from its stripe."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from .._core import Context, Laser, LaserSession, Rig, laser_signal
from ..errors import Error, NotFound
from ..io import Scan, read_image, read_poses, read_rig, read_scan, write_surface
from ._common import FILE, Failure, Stopwatch, about, check_out, common, print_json, working


def _sweep(
    rig: Rig, scan: Scan, scan_file: Path, poses: Path | None, options: dict[str, Any], context: Context
) -> Laser:
    dark = None if scan.dark is None else read_image(scan.dark)
    with about(scan_file):
        session = LaserSession(rig, scan.laser, context=context, **options)
    for i, frame in enumerate(scan.frames):
        with about(f"{scan_file}: frames[{i}] ({frame.image.name})"):
            session.push(
                read_image(frame.image), dark=dark, angle_rad=frame.angle_rad, time_s=frame.time_s, context=context
            )
    track: dict[str, Any] = {}
    if poses is not None:
        found = read_poses(poses)
        track = {"track_time_s": found.time_s, "room_from_body": found.room_from_body}
    with about(scan_file if poses is None else poses):
        return session.finish(**track, context=context)


def _signal(
    rig: Rig, scan: Scan, scan_file: Path, point: tuple[float, ...], axis: tuple[float, ...], radius: float, method: str
) -> list[dict[str, Any]]:
    """The signal of each frame; null where the stripe does not pass the point."""
    dark = None if scan.dark is None else read_image(scan.dark)
    unit = [a / (math.hypot(*axis) or 1.0) for a in axis]
    lines: list[dict[str, Any]] = []
    for i, frame in enumerate(scan.frames):
        image = read_image(frame.image)
        mm: float | None
        sigma: float | None
        try:
            with about(f"{scan_file}: frames[{i}] ({frame.image.name})"):
                mm, sigma = laser_signal(
                    rig,
                    scan.laser,
                    image,
                    frame.angle_rad,
                    point_mm=point,
                    axis=unit,
                    radius_mm=radius,
                    dark=dark,
                    method=method,
                )
        except NotFound:
            mm = sigma = None
        lines.append({"time_s": frame.time_s, "signal_mm": mm, "sigma_mm": sigma})
    if all(line["signal_mm"] is None for line in lines):
        raise NotFound(f"{scan_file}: the stripe passes the point in none of the frames")
    return lines


def _describe(result: Laser) -> dict[str, Any]:
    reason = result.reason
    return {
        "points": result.point_count,
        "grid": None if reason is None else [reason.shape[1], reason.shape[0]],
        "lines": "columns" if result.columns else "rows",
        "reasons": result.counts,
        "median_sigma_px": result.median_sigma_px,
        "median_sigma_mm": result.median_sigma_mm,
        "time_s": result.reference_time_s,
    }


@click.command("laser", epilog="\b\nExample: sgrt laser --rig rig.json --scan scan.json --out surface.ply")
@click.option("--rig", "rig_file", type=FILE, required=True, metavar="FILE", help="The rig.json with the laser.")
@click.option(
    "--scan", "scan_file", type=FILE, required=True, metavar="FILE", help="The frames of the sweep, scan.json."
)
@click.option("--poses", type=FILE, metavar="FILE", help="The body's poses over time: its motion is taken out.")
@click.option(
    "--at", "reference_time_s", type=float, metavar="S", help="Instant that the surface shows; default: first frame."
)
@click.option("--out", type=FILE, metavar="FILE", help="The surface, PLY.")
@click.option(
    "--method",
    type=click.Choice(["centroid", "gaussian", "ridge"]),
    default="gaussian",
    help="How a stripe's centre is found; default: gaussian.",
)
@click.option(
    "--angle-sigma", "angle_sigma_rad", type=float, default=0.0, metavar="RAD", help="One sigma of a mirror reading."
)
@click.option(
    "--volume", type=float, nargs=6, metavar="X0 Y0 Z0 X1 Y1 Z1", help="Working volume, mm, room axes; default: all."
)
@click.option(
    "--signal",
    "point",
    type=float,
    nargs=3,
    metavar="X Y Z",
    help="Instead of a surface: how far the skin lies from this point along --axis, each frame (breathing).",
)
@click.option("--axis", type=float, nargs=3, default=(0.0, 0.0, 1.0), metavar="X Y Z", help="Default: 0 0 1, up.")
@click.option("--radius", type=float, default=10.0, metavar="MM", help="Of the signal's point; default: 10.")
@common
def command(
    rig_file: Path,
    scan_file: Path,
    poses: Path | None,
    reference_time_s: float | None,
    out: Path | None,
    method: str,
    angle_sigma_rad: float,
    volume: tuple[float, ...] | None,
    point: tuple[float, ...] | None,
    axis: tuple[float, ...],
    radius: float,
    threads: int,
    as_json: bool,
) -> int:
    """Reconstructs a surface from the sweep of a laser fan.

    The surface is an organised grid, a column a mirror angle and a row a line of the image, with normals, sigma_mm and
    covariance. With --poses each column is moved to where the body was at the first frame (or --at).
    """
    watch = Stopwatch()
    if out is None and not point:
        raise Failure("--out is missing: the surface to write, PLY")
    if out is not None:
        check_out(out)
    rig, scan = read_rig(rig_file), read_scan(scan_file)
    if point:
        lines = _signal(rig, scan, scan_file, point, axis, radius, method)
        if as_json:
            print_json({"status": "ok", "signal": lines, "timing_ms": watch.ms()})
        else:
            for line in lines:
                missing = line["signal_mm"] is None
                print(f"{line['time_s']:.3f} s: " + ("none" if missing else f"{line['signal_mm']:+.3f} mm"))
        if out is None:
            return 0
    options: dict[str, Any] = {
        "method": method,
        "angle_sigma_rad": angle_sigma_rad,
        "reference_time_s": reference_time_s,
    }
    if volume:
        options |= {"volume_min_mm": volume[:3], "volume_max_mm": volume[3:]}
    assert out is not None
    try:
        with working(threads) as context:
            result = _sweep(rig, scan, scan_file, poses, options, context)
    except Error as error:
        if as_json and isinstance(error.result, Laser):
            print_json({"status": error.word, "surface": None, **_describe(error.result), "timing_ms": watch.ms()})
        raise
    assert result.surface is not None
    write_surface(out, result.surface)
    described = _describe(result)
    if as_json and not point:
        print_json({"status": "ok", "verdict": "ok", "surface": str(out), **described, "timing_ms": watch.ms()})
    elif not as_json:
        rejected = ", ".join(f"{n} {word}" for word, n in described["reasons"].items() if n and word != "none")
        print(
            f"{out}: {result.point_count} points, median sigma {result.median_sigma_mm:.3f} mm"
            f" ({result.median_sigma_px:.3f} px); without a point: {rejected or 'none'}"
        )
    return 0
