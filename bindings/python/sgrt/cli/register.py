"""`sgrt register`: how far the live surface lies from the reference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from .._core import Context, Icp, Roi, Surface, icp_align
from ..couch import turn_roi, turn_surface
from ..errors import Error
from ..io import read_pose, read_roi, read_surface, registration_document
from ._common import FILE, Stopwatch, about, common, print_json, working

ROWS = (
    ("LAT", "lat_mm"),
    ("LNG", "lng_mm"),
    ("VRT", "vrt_mm"),
    ("PITCH", "pitch_deg"),
    ("ROLL", "roll_deg"),
    ("RTN", "rtn_deg"),
    ("MAG", "mag_mm"),
)


def _initial(word: str) -> NDArray[np.float64] | None:
    return None if word in ("identity", "none") else read_pose(word)


def _read(
    reference: Path, live: Path, roi: Path | None, couch_deg: float, isocentre_mm: tuple[float, ...]
) -> tuple[Surface, Surface, Roi | None]:
    surfaces = read_surface(reference), read_surface(live)
    region = read_roi(roi) if roi else None
    if couch_deg == 0:
        return *surfaces, region
    turned = turn_surface(surfaces[0], couch_deg=couch_deg, isocentre_mm=isocentre_mm)
    if region is not None:
        with about(roi):
            region = turn_roi(region, couch_deg=couch_deg, isocentre_mm=isocentre_mm)
    return turned, surfaces[1], region


def _print(result: Icp, ms: float) -> None:
    displacement, correction = result.displacement.as_dict(), result.correction.as_dict()
    sigma = [*result.sigma_mm, *result.sigma_deg]
    print(f"{'':13}{'patient displacement':>22}{'couch correction':>20}{'one sigma':>12}")
    for i, (name, key) in enumerate(ROWS):
        unit = "deg" if key.endswith("deg") else "mm"
        spread = f"{sigma[i]:12.3f}" if i < 6 else ""
        print(f"{name:6} {unit:6}{displacement[key]:+22.3f}{correction[key]:+20.3f}{spread}")
    print(
        f"verdict {result.verdict_text}; rms {result.rms_mm:.3f} mm, inliers {100 * result.inlier_share:.1f} %,"
        f" {result.iterations} iterations, {ms:.0f} ms"
    )


def _align(
    reference: Path, live: Path, context: Context, surfaces: tuple[Surface, Surface, Roi | None], **known: Any
) -> Icp:
    with about(f"{live} on {reference}"):
        return icp_align(surfaces[0], surfaces[1], roi=surfaces[2], context=context, **known)


@click.command(
    "register", epilog="\b\nExample: sgrt register --reference reference.ply --live live.ply --isocentre 0 0 0 --json"
)
@click.option(
    "--reference", type=FILE, required=True, metavar="FILE", help="Where the patient should be, PLY, room frame."
)
@click.option("--live", type=FILE, required=True, metavar="FILE", help="Where the patient is, PLY, room frame.")
@click.option(
    "--isocentre",
    "isocentre_mm",
    type=float,
    nargs=3,
    required=True,
    metavar="X Y Z",
    help="Where the motion is reported, mm, room frame.",
)
@click.option("--roi", type=FILE, metavar="FILE", help="The part of the reference that counts, roi.json.")
@click.option(
    "--initial",
    default="identity",
    metavar="identity|none|FILE",
    help='The start: identity; none: assume nothing about it; or a registration result or {"reference_from_live": 4x4}.'
    " Default: identity.",
)
@click.option(
    "--couch-angle",
    "couch_deg",
    type=float,
    default=0.0,
    metavar="DEG",
    help="The live surface was captured with the couch turned by DEG (IEC 61217: counter-clockwise from above) from"
    " where the reference was. The reference, and a polygon ROI with it, is first turned about the vertical axis at"
    " the isocentre; the result is relative to it, in room axes.",
)
@common
def command(
    reference: Path,
    live: Path,
    isocentre_mm: tuple[float, ...],
    roi: Path | None,
    initial: str,
    couch_deg: float,
    threads: int,
    as_json: bool,
) -> int:
    """Finds how far the live surface lies from the reference: six numbers at the isocentre, with their uncertainty."""
    ms = 0.0
    try:
        start = _initial(initial)
        surfaces = _read(reference, live, roi, couch_deg, isocentre_mm)
        watch = Stopwatch()
        with working(threads) as context:
            try:
                result = _align(
                    reference,
                    live,
                    context,
                    surfaces,
                    isocentre_mm=isocentre_mm,
                    initial_reference_from_live=start,
                    anywhere=initial == "none",
                )
            finally:
                ms = watch.ms()
    except Error as error:
        if as_json and 10 <= error.status < 20:
            found = error.result if isinstance(error.result, Icp) else None
            print_json(registration_document(found, status=error.word, isocentre_mm=isocentre_mm, timing_ms=ms))
        raise
    if as_json:
        print_json(registration_document(result, timing_ms=ms))
    else:
        _print(result, ms)
    return 0
