"""`sgrt fuse`: the surfaces of several pods to one, and how far they disagree."""

from __future__ import annotations

from pathlib import Path

import click

from .._core import surface_fuse
from ..io import read_surface, write_surface
from ._common import FILE, Failure, Stopwatch, check_out, common, print_json, working


@click.command("fuse", epilog="Example: sgrt fuse pod1.ply pod2.ply --out surface.ply")
@click.argument("files", type=FILE, metavar="A.ply B.ply ...", nargs=-1, required=True)
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The fused surface, a cloud.")
@click.option("--max-distance", type=float, metavar="MM", help="Further apart, points are not one skin. Default 3.")
@click.option("--max-angle", type=float, metavar="DEG", help="Nor where the normals differ by more. Default 60.")
@common
def command(
    files: tuple[Path, ...],
    out: Path,
    max_distance: float | None,
    max_angle: float | None,
    threads: int,
    as_json: bool,
) -> int:
    """Fuses surfaces of one room frame, weighted by their covariance; they need normals.

    The disagreement in the overlap is the daily check of a room.
    """
    watch = Stopwatch()
    check_out(out)
    surfaces = [read_surface(file) for file in files]
    for file, surface in zip(files, surfaces, strict=True):
        if surface.normals is None:
            raise Failure(f"{file}: has no normals")
    given = {"max_distance_mm": max_distance, "max_angle_deg": max_angle}
    with working(threads) as context:
        options = {name: value for name, value in given.items() if value is not None}
        fused, info = surface_fuse(surfaces, **options, context=context)
    write_surface(out, fused)
    if as_json:
        print_json(
            {
                "status": "ok",
                "surface": str(out),
                "points": info.point_count,
                "overlap_points": info.overlap_count,
                "disagreement_mean_mm": info.disagreement_mean_mm,
                "disagreement_rms_mm": info.disagreement_rms_mm,
                "disagreement_expected_mm": info.disagreement_expected_mm,
                "timing_ms": watch.ms(),
            }
        )
        return 0
    print(f"{out}: {info.point_count} points, {info.overlap_count} in the overlap", end="")
    if info.overlap_count:
        print(
            f"; they disagree by {info.disagreement_rms_mm:.3f} mm RMS (mean {info.disagreement_mean_mm:+.3f},"
            f" their noise explains {info.disagreement_expected_mm:.3f})",
            end="",
        )
    print()
    return 0
