"""`sgrt eval`: a NURBS surface to a dense surface of points."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from .._core import Surface
from ..io import read_nurbs_surface, write_surface
from ._common import FILE, Failure, Stopwatch, about, check_out, common, print_json, working


def _size(text: str) -> tuple[int, int]:
    """Rows and columns of a word like 500x500."""
    sides = text.lower().split("x")
    if len(sides) != 2 or not all(side.isascii() and side.isdigit() and 2 <= int(side) <= 32768 for side in sides):
        raise Failure(f"--grid {text}: expected NUxNV, two numbers from 2 to 32768, like 500x500")
    return int(sides[0]), int(sides[1])


@click.command("eval", epilog="Example: sgrt eval nurbs.json --grid 500x500 --out dense.ply")
@click.argument("nurbs", type=FILE, metavar="NURBS.json")
@click.option("--grid", "grid", metavar="NUxNV", help="Points equally spaced in u and in v.")
@click.option(
    "--chord-error",
    "chord_error_mm",
    type=float,
    metavar="MM",
    help="Instead of a grid: a mesh of triangles that lies within MM of the surface.",
)
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The surface with normals, PLY.")
@common
def command(nurbs: Path, grid: str | None, chord_error_mm: float | None, out: Path, threads: int, as_json: bool) -> int:
    """Evaluates a NURBS surface: an organised grid of points with exact normals, or a mesh."""
    if (grid is None) == (chord_error_mm is None):
        raise Failure("expected one of --grid and --chord-error")
    check_out(out)
    shape = read_nurbs_surface(nurbs)
    watch = Stopwatch()
    with working(threads) as context, about(nurbs):
        if chord_error_mm is not None:
            surface = shape.mesh(chord_error_mm, context=context)
        else:
            size = _size(grid or "")
            u, v = (np.linspace(*ends, count) for ends, count in zip(shape.domain, size, strict=True))
            normals = shape.normals(u[:, None], v[None, :], context=context)
            surface = Surface(shape.grid(*size, context=context), normals=normals, context=context)
        ms = watch.ms()
        write_surface(out, surface)
    if as_json:
        print_json({"out": str(out), "points": surface.point_count, "timing_ms": ms})
    else:
        print(f"{out}: {surface.point_count} points, {ms:.0f} ms")
    return 0
