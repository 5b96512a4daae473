"""`sgrt filter`: a surface without outliers and with less noise, or a stream of them averaged over time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from .._core import FilterSession, surface_filter
from ..io import read_captures, read_surface, write_captures, write_surface
from ._common import FILE, Failure, Stopwatch, about, check_out, common, outward, outward_option, print_json, working


def _given(**options: float | None) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


Place = tuple[float, float, float]


def _in_space(
    source: Path, out: Path, viewpoint_mm: Place, options: dict[str, Any], threads: int
) -> tuple[dict[str, Any], str]:
    surface = read_surface(source)
    with working(threads) as context, about(source):
        surface, normals = outward(surface, source, viewpoint_mm, context)
        found = surface_filter(surface, **options, context=context)
    write_surface(out, found.surface)
    told = {
        "surface": str(out),
        "normals": normals,
        "counts": found.counts,
        "radius_mm": found.radius_mm,
        "sigma_before_mm": found.sigma_before_mm,
        "sigma_after_mm": found.sigma_after_mm,
        "correlation_points": found.correlation_points,
    }
    counts = found.counts
    return told, (
        f"{out}: {counts['filtered']} points filtered over {found.radius_mm:.2f} mm, {counts['kept']} as they were,"
        f" {counts['outlier']} outliers taken out; sigma {found.sigma_before_mm:.3f} to {found.sigma_after_mm:.3f} mm"
    )


def _over_time(
    source: Path, out: Path, viewpoint_mm: Place, options: dict[str, Any], threads: int
) -> tuple[dict[str, Any], str]:
    captures = read_captures(source)
    files = [capture.surface for capture in captures]
    surfaces = [file for file in files if file is not None]
    if any(capture.pairs for capture in captures) or not surfaces:
        raise Failure(f"{source}: expected frames with surfaces; make them of image pairs with sgrt stereo")
    if len({file.name for file in surfaces}) < len(surfaces):
        raise Failure(f"{source}: two frames have surfaces of one file name; expected a name each")
    if out.exists() and any(file.parent.resolve() == out.resolve() for file in surfaces):
        raise Failure(f"{out}: holds the frames themselves; expected another folder")
    session = FilterSession(**options)
    totals: dict[str, int] = {}
    written = []
    with working(threads) as context:
        for capture in captures:
            if capture.surface is None:
                written.append(capture)
                continue
            surface = read_surface(capture.surface)
            with about(capture.surface):
                surface, _ = outward(surface, capture.surface, viewpoint_mm, context)
                frame = session.push(surface, time_s=capture.time_s, context=context)
            out.mkdir(exist_ok=True)  # not before there is something to put in
            target = out / capture.surface.name
            write_surface(target, frame.surface)
            written.append(replace(capture, surface=target))
            for word, count in frame.counts.items():
                totals[word] = totals.get(word, 0) + count
    write_captures(out / "frames.json", written)
    told = {"frames": str(out / "frames.json"), "frame_count": len(written), "counts": totals}
    return told, f"{out / 'frames.json'}: {len(written)} frames; pixels " + ", ".join(
        f"{word} {count}" for word, count in totals.items()
    )


@click.command("filter", epilog="Example: sgrt filter surface.ply --radius 5 --out filtered.ply")
@click.argument("source", type=FILE, metavar="SURFACE.ply|FRAMES.json")
@click.option("--out", type=FILE, required=True, metavar="FILE|FOLDER", help="Of a surface a file, of frames a folder.")
@click.option("--radius", type=float, metavar="MM", help="Neighbours within it count. Default: three spacings.")
@click.option("--max-sigmas", type=float, help="Points further apart, in sigmas of both, are not one skin. Default 4.")
@click.option("--min-support", type=float, help="Share of the neighbours that a point must agree with. Default 0.15.")
@click.option("--motion-sigmas", type=float, help="Of frames: a patch has moved beyond so many sigmas. Default 4.")
@click.option("--drift", type=float, metavar="MM", help="Of frames: unseen motion in a second. Default 0.05.")
@outward_option
@common
def command(
    source: Path,
    out: Path,
    radius: float | None,
    max_sigmas: float | None,
    min_support: float | None,
    motion_sigmas: float | None,
    drift: float | None,
    viewpoint_mm: Place,
    threads: int,
    as_json: bool,
) -> int:
    """Takes outliers out of a surface and noise down, in space; of frames, averages each pixel until it moves.

    Nothing is filled. sigma_mm and covariance become those of the filtered points.
    """
    watch = Stopwatch()
    in_space = _given(radius_mm=radius, max_sigmas=max_sigmas, min_support=min_support)
    over_time = _given(motion_sigmas=motion_sigmas, drift_mm=drift)
    frames = source.is_dir() or source.suffix == ".json"
    wrong = in_space if frames else over_time
    if wrong:
        raise Failure(f"{source}: {', '.join(wrong)} belong to {'a surface' if frames else 'frames'}")
    if frames:
        if not out.is_dir():
            check_out(out)
        told, words = _over_time(source, out, viewpoint_mm, over_time, threads)
    else:
        check_out(out)
        told, words = _in_space(source, out, viewpoint_mm, in_space, threads)
    if as_json:
        print_json({"status": "ok"} | told | {"timing_ms": watch.ms()})
    else:
        print(words)
    return 0
