"""`sgrt curvature`: the curvature of a surface at every point, with its uncertainty."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

from .._core import Curvature, curvature_features, surface_curvature
from ..errors import Error
from ..io import read_surface, write_surface
from ._common import FILE, Stopwatch, about, check_out, common, outward, outward_option, print_json, working

WRITTEN = (
    "k1",
    "k2",
    "mean",
    "gauss",
    "shape_index",
    "curvedness",
    "sigma_k1",
    "sigma_k2",
    "sigma_mean",
    "sigma_gauss",
    "sigma_shape_index",
    "radius_mm",
    "hk",
    "reason",
)


def _describe(found: Curvature) -> dict[str, Any]:
    radius = found.radius_mm[np.isfinite(found.radius_mm)]
    return {
        "points": found.counts,
        "duplicates": found.duplicate_count,
        "spacing_mm": found.spacing_mm,
        "noise_mm": found.noise_mm,
        "radius_mm": [float(np.min(radius)), float(np.median(radius)), float(np.max(radius))],
    }


@click.command("curvature", epilog="Example: sgrt curvature surface.ply --out curvature.ply")
@click.argument("surface_file", type=FILE, metavar="SURFACE.ply")
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The surface with its curvature, PLY.")
@click.option("--degree", type=click.IntRange(2, 4), default=2, show_default=True, help="Of the local fit.")
@click.option(
    "--radius", "radius_mm", type=float, default=0.0, metavar="MM", help="Of a neighbourhood; default: chosen."
)
@click.option("--noise", "noise_mm", type=float, default=0.0, metavar="MM", help="Default: the surface's, or measured.")
@outward_option
@common
def command(
    surface_file: Path,
    out: Path,
    degree: int,
    radius_mm: float,
    noise_mm: float,
    viewpoint_mm: tuple[float, float, float],
    threads: int,
    as_json: bool,
) -> int:
    """Writes the surface with k1 k2 mean gauss shape_index curvedness, their sigma_..., radius_mm, hk, reason, crest.

    1/mm (gauss 1/mm2), normal outward, convex positive; NaN where not known, `reason` then says why: 1 absent,
    2 no normal, 3 too few neighbours, 4 border or hole, 5 normals disagree, 6 not a sheet, 7 too noisy. crest: 1 ridge,
    2 valley.
    """
    watch = Stopwatch()
    check_out(out)
    surface = read_surface(surface_file)
    try:
        with working(threads) as context, about(surface_file):
            surface, normals = outward(surface, surface_file, viewpoint_mm, context)
            found = surface_curvature(surface, degree=degree, radius_mm=radius_mm, noise_mm=noise_mm, context=context)
            crest = curvature_features(surface, found, context=context)["crest"]
    except Error as error:
        if as_json and 10 <= error.status < 20:
            print_json({"status": error.word, "curvature": None, "timing_ms": watch.ms()})
        raise
    extra = {name: getattr(found, name).astype("f8") for name in WRITTEN} | {"crest": crest.astype("f8")}
    write_surface(out, surface, extra=extra)
    described = _describe(found)
    if as_json:
        print_json({"status": "ok", "curvature": str(out), "normals": normals} | described | {"timing_ms": watch.ms()})
    else:
        low, middle, high = described["radius_mm"]
        without = {word: n for word, n in found.counts.items() if n and word != "known"}
        rest = ", ".join(f"{n} {word.replace('_', ' ')}" for word, n in without.items())
        print(
            f"{out}: {found.known_count} points with curvature{'; ' + rest if rest else ''};"
            f" noise {found.noise_mm:.3g} mm, radius {low:.1f} to {high:.1f} mm, median {middle:.1f}"
        )
    return 0
