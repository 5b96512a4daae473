"""`sgrt register`: how far the live surface lies from the reference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from .._core import Coarse, Context, Deform, Icp, LandmarkModel, Roi, Surface, deform_align, icp_align, landmarks_find
from ..errors import Error
from ..frames import couch_turn, four_dof
from ..io import LandmarkSet, landmarks_align, read_landmarks, read_pose, read_surface, registration_document
from ..io._files import writing
from ._common import (
    FILE,
    Failure,
    Stopwatch,
    about,
    check_out,
    common,
    placed,
    print_json,
    read_placed,
    working,
)

ROWS = (
    ("LAT", "lat_mm"),
    ("LNG", "lng_mm"),
    ("VRT", "vrt_mm"),
    ("PITCH", "pitch_deg"),
    ("ROLL", "roll_deg"),
    ("RTN", "rtn_deg"),
    ("MAG", "mag_mm"),
)


_DEFAULTS = {"residual": "plane", "kernel": "auto", "keep_share": 1.0}


def _initial(word: str) -> NDArray[np.float64] | None:
    return None if word in ("identity", "none", "landmarks") else read_pose(word)


def _from_landmarks(files: tuple[Path, Path], couch_deg: float, context: Context, isocentre_mm: Any) -> Coarse:
    """The start from landmarks on both bodies; those of the reference turn with the couch."""
    reference, live = map(read_landmarks, files)
    if couch_deg != 0:
        reference = reference.moved(couch_turn(couch_deg, isocentre_mm))
    with about(f"{files[1]} on {files[0]}"):
        return landmarks_align(reference, live, isocentre_mm=isocentre_mm, context=context)


def _by_distinctive(
    surfaces: tuple[Surface, Surface, Roi | None], live: Path, context: Context, isocentre_mm: Any
) -> Coarse:
    """The start from the reference's most distinctive points, located on the live surface."""
    known, seen = (s if s.normals is not None else s.estimate_normals(context=context) for s in surfaces[:2])
    model = LandmarkModel.learn(known, context=context)
    with about(live):
        found = landmarks_find(seen, model, context=context)
    there = np.isfinite(found.positions_mm[:, 0])
    names = tuple(name for name, here in zip(found.names, there, strict=True) if here)
    return landmarks_align(
        LandmarkSet(tuple(model.names), model.positions_mm),
        LandmarkSet(names, found.positions_mm[there], found.repeat_covariance_mm2[there]),
        isocentre_mm=isocentre_mm,
        context=context,
    )


def _print(result: Icp | Deform, ms: float) -> None:
    displacement, correction = result.displacement.as_dict(), result.correction.as_dict()
    sigma = [*result.sigma_mm, *result.sigma_deg]
    print(f"{'':13}{'patient displacement':>22}{'couch correction':>20}{'one sigma':>12}")
    for i, (name, key) in enumerate(ROWS):
        unit = "deg" if key.endswith("deg") else "mm"
        spread = f"{sigma[i]:12.3f}" if i < 6 else ""
        print(f"{name:6} {unit:6}{displacement[key]:+22.3f}{correction[key]:+20.3f}{spread}")
    if isinstance(result, Icp):
        how = f"{result.iterations} iterations"
    else:
        how = f"scale {result.scale:.4f}" if result.scale != 1 else f"{100 * result.rigid_share:.0f} % moved as one"
    print(
        f"verdict {result.verdict_text}; rms {result.rms_mm:.3f} mm, inliers {100 * result.inlier_share:.1f} %,"
        f" {how}, {ms:.0f} ms"
    )


def _four_dof(result: Icp | Deform) -> dict[str, Any]:
    correction, remaining = four_dof(result.reference_from_live, result.isocentre_mm)
    return {"couch_correction_4dof": correction.as_dict(), "remaining_displacement": remaining.as_dict()}


def _write_map(path: Path, live: Surface, result: Deform) -> None:
    arrays = {"points_mm": live.points, "distance_mm": result.distance_mm, "part": result.part}
    if result.deformation_mm is not None:
        arrays["deformation_mm"] = result.deformation_mm
    with writing(path) as stream:
        np.savez_compressed(stream, **{name: a for name, a in arrays.items() if a is not None})  # type: ignore[arg-type]


def _align(
    reference: Path,
    live: Path,
    context: Context,
    surfaces: tuple[Surface, Surface, Roi | None],
    deform: str,
    **known: Any,
) -> Icp | Deform:
    with about(f"{live} on {reference}"):
        if deform == "none":
            return icp_align(surfaces[0], surfaces[1], roi=surfaces[2], context=context, **known)
        return deform_align(surfaces[0], surfaces[1], roi=surfaces[2], mode=deform, context=context, **known)


@click.command(
    "register", epilog="\b\nExample: sgrt register --reference reference.ply --live live.ply --isocentre 0 0 0 --json"
)
@placed(
    "The live surface was captured with the couch turned by DEG (IEC 61217: counter-clockwise from above) from"
    " where the reference was. The reference, and a polygon ROI with it, is first turned about the vertical axis at"
    " the isocentre; the result is relative to it, in room axes."
)
@click.option("--live", type=FILE, required=True, metavar="FILE", help="Where the patient is, PLY, room frame.")
@click.option(
    "--initial",
    default="identity",
    metavar="identity|none|landmarks|FILE",
    help="The start: identity; none: assume nothing about it; landmarks: the same, by the reference's most"
    ' distinctive points, found on the live surface; or a registration result or {"reference_from_live": 4x4}.'
    " Default: identity.",
)
@click.option(
    "--landmarks",
    type=FILE,
    nargs=2,
    metavar="REFERENCE LIVE",
    help="The start from landmarks on both bodies, landmarks.json; instead of --initial.",
)
@click.option(
    "--residual",
    type=click.Choice(["plane", "point_svd", "point_quaternion", "symmetric"]),
    default="plane",
    help="What a step makes smaller; default: plane. Anything but the defaults of these three is textbook ICP.",
)
@click.option(
    "--kernel",
    type=click.Choice(["auto", "none", "tukey", "welsch"]),
    default="auto",
    help="Weights of the residuals; default: auto.",
)
@click.option(
    "--keep", "keep_share", type=float, default=1.0, metavar="SHARE", help="Of the pairs, the nearest; default: 1."
)
@click.option(
    "--max-iterations",
    type=int,
    metavar="N",
    help="Of closest points and step; to points it takes hundreds; default: 60.",
)
@click.option(
    "--deform",
    type=click.Choice(["none", "rigid", "similarity", "field"]),
    default="none",
    help="The body changed its shape (an expression, a breath): rigid: the motion of the region that moved as"
    " one; similarity: one scale for all; field: as rigid, with a displacement field of the rest; default: none.",
)
@click.option(
    "--map",
    "map_file",
    type=FILE,
    metavar="FILE",
    help="With --deform: .npz with points_mm, distance_mm, part and deformation_mm of the live points.",
)
@click.option(
    "--couch-dof",
    type=click.Choice(["6", "4"]),
    default="6",
    help="4: also what a couch without pitch and roll can do, and what then remains; default: 6.",
)
@common
def command(
    reference: Path,
    live: Path,
    isocentre_mm: tuple[float, ...],
    roi: Path | None,
    initial: str,
    couch_deg: float,
    couch_dof: str,
    deform: str,
    map_file: Path | None,
    landmarks: tuple[Path, Path] | None,
    residual: str,
    kernel: str,
    keep_share: float,
    max_iterations: int | None,
    threads: int,
    as_json: bool,
) -> int:
    """Finds how far the live surface lies from the reference: six numbers at the isocentre, with their uncertainty."""
    if map_file is not None:
        if deform == "none":
            raise Failure("--map: needs --deform")
        check_out(map_file)
    if deform != "none" and initial == "none":
        raise Failure("--initial none: not with --deform; register without it first and give its result as the start")
    if landmarks and initial != "identity":
        raise Failure("--landmarks and --initial: give one of them")
    known: dict[str, Any] = {"residual": residual, "kernel": kernel, "keep_share": keep_share}
    if deform != "none" and (known != _DEFAULTS or max_iterations is not None):
        raise Failure("--residual, --kernel, --keep, --max-iterations: not with --deform")
    known |= {"anywhere": initial == "none"}
    if max_iterations is not None:
        known["max_iterations"] = max_iterations
    ms = 0.0
    coarse = None
    try:
        start = _initial(initial)
        surface, regions = read_placed(reference, (roi,), couch_deg, isocentre_mm)
        surfaces = surface, read_surface(live), regions[0]
        watch = Stopwatch()
        with working(threads) as context:
            try:
                if landmarks:
                    coarse = _from_landmarks(landmarks, couch_deg, context, isocentre_mm)
                elif initial == "landmarks":
                    coarse = _by_distinctive(surfaces, live, context, isocentre_mm)
                if coarse is not None:
                    start = coarse.reference_from_live
                result = _align(
                    reference,
                    live,
                    context,
                    surfaces,
                    deform,
                    isocentre_mm=isocentre_mm,
                    initial_reference_from_live=start,
                    **({} if deform != "none" else known),
                )
            finally:
                ms = watch.ms()
    except Error as error:
        if as_json and 10 <= error.status < 20:
            found = error.result if isinstance(error.result, Icp | Deform) else None
            if isinstance(error.result, Coarse):
                coarse = error.result
            rest = {"status": error.word, "isocentre_mm": isocentre_mm, "timing_ms": ms}
            print_json(registration_document(found, coarse=coarse, **rest))
        raise
    if map_file is not None and isinstance(result, Deform):
        _write_map(map_file, surfaces[1], result)
    four = _four_dof(result) if couch_dof == "4" else {}
    if as_json:
        print_json(registration_document(result, coarse=coarse, timing_ms=ms) | four)
    else:
        if coarse is not None:
            agree = f"{coarse.used_count} of {coarse.common_count} landmarks agree, rms {coarse.rms_mm:.2f} mm"
            print(f"start: {agree}; {coarse.verdict_text}")
        _print(result, ms)
        for title, shift in four.items():
            numbers = ", ".join(f"{name} {shift[key]:+.3f}" for name, key in ROWS if shift[key])
            print(f"{title.replace('_', ' ')}: {numbers or 'none'}")
    return 0
