"""`sgrt fit`: a scattered, noisy, holed surface to a NURBS surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .._core import NurbsFit, nurbs_fit
from ..errors import Error
from ..io import read_surface, write_nurbs
from ._common import FILE, Stopwatch, about, check_out, common, print_json, working


def _describe(fit: NurbsFit) -> dict[str, Any]:
    names = (
        "chart",
        "closed",
        "point_count",
        "inlier_count",
        "noise",
        "rms_mm",
        "lambda_",
        "effective_parameters",
        "conversion_error_mm",
    )
    found = {name.rstrip("_"): getattr(fit, name) for name in names}
    return found | {"size": list(fit.surface.control_points.shape[:2])}


@click.command("fit", epilog="Example: sgrt fit surface.ply --out nurbs.json")
@click.argument("surface_file", type=FILE, metavar="SURFACE.ply")
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The fitted surface, nurbs.json.")
@click.option(
    "--chart",
    type=click.Choice(["auto", "plane", "cylinder", "sphere", "grid"]),
    default="auto",
    show_default=True,
    help="What u and v run over: a height field, a torso, a head, the sensor's grid.",
)
@click.option("--axis", type=float, nargs=3, metavar="X Y Z", help="Of the height field or the cylinder.")
@click.option("--control-points", type=int, nargs=2, default=(0, 0), metavar="NU NV", help="Default: from the density.")
@click.option("--least-squares", is_flag=True, help="Without robust weights: there are no outliers.")
@common
def command(
    surface_file: Path,
    out: Path,
    chart: str,
    axis: tuple[float, float, float] | None,
    control_points: tuple[int, int],
    least_squares: bool,
    threads: int,
    as_json: bool,
) -> int:
    """Fits a smooth NURBS surface to points with noise, holes and outliers.

    Smoothing is chosen by restricted maximum likelihood; a point's sigma_mm or covariance weighs it. Parts without
    points are extrapolated.
    """
    watch = Stopwatch()
    check_out(out)
    surface = read_surface(surface_file)
    try:
        with working(threads) as context, about(surface_file):
            found = nurbs_fit(
                surface,
                chart=chart,
                axis=axis,
                robust=not least_squares,
                control_points=control_points,
                context=context,
            )
    except Error as error:
        if as_json and 10 <= error.status < 20:
            print_json({"status": error.word, "nurbs": None, "timing_ms": watch.ms()})
        raise
    write_nurbs(out, found.surface)
    described = _describe(found)
    if as_json:
        print_json({"status": "ok", "nurbs": str(out)} | described | {"timing_ms": watch.ms()})
    else:
        nu, nv = described["size"]
        print(
            f"{out}: {nu} x {nv} control points over a {found.chart}{', closed' if found.closed else ''};"
            f" {found.point_count} points, {found.point_count - found.inlier_count} outliers,"
            f" rms {found.rms_mm:.3f} mm"
        )
    return 0
