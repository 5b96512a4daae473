"""`sgrt stereo`: image pairs of pods to one surface."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from .._core import Context, FuseInfo, Rig, Stereo, StereoSession, Surface, stereo_match, surface_fuse
from ..errors import Error
from ..io import read_image, read_rig, read_roi, read_surface, write_surface
from ._common import FILE, Failure, Stopwatch, about, check_out, common, one_line, print_json, working


def _match(
    rig: Rig, pair: tuple[str, Path, Path], options: dict[str, Any], live: dict[str, Any], context: Context
) -> tuple[Stereo | None, Error | None]:
    """What a pair gave; with the error where its data have no answer, which leaves the other pairs theirs."""
    pair_id, left, right = pair
    images = read_image(left), read_image(right)
    try:
        with about(f"pair {pair_id} ({left}, {right})"):
            if live:
                session = StereoSession(rig, pair_id, context=context, **options, **live)
                return session.push(*images, time_s=0.0, context=context), None
            return stereo_match(rig, pair_id, *images, context=context, **options), None
    except Error as error:
        if not 10 <= error.status < 20:
            raise
        return (error.result if isinstance(error.result, Stereo) else None), error


def _check_pairs(rig: Rig, pairs: tuple[tuple[str, Path, Path], ...], rig_file: Path) -> None:
    known = [pair.id for pair in rig.pairs]
    for i, (pair_id, _, _) in enumerate(pairs):
        if pair_id not in known:
            raise Failure(f"{rig_file}: has no pair {pair_id!r}; it has {', '.join(known) or 'none'}")
        if pair_id in [p for p, _, _ in pairs[:i]]:
            raise Failure(f"--pair {pair_id}: given twice")


def _describe(pair_id: str, result: Stereo | None, error: Error | None) -> dict[str, Any]:
    described: dict[str, Any] = {"id": pair_id, "status": "ok" if error is None else error.word}
    if error is not None:
        described["message"] = one_line(str(error))
    if result is None:
        return described
    return described | {
        "points": result.point_count,
        "grid": [result.reason.shape[1], result.reason.shape[0]] if result.reason is not None else None,
        "reasons": result.counts,
        "noise_left": result.noise_left,
        "median_sigma_px": result.median_sigma_px,
        "median_sigma_mm": result.median_sigma_mm,
        "epipolar": {
            "median_px": result.epipolar_px,
            "sigma_px": result.epipolar_sigma_px,
            "rms_px": result.epipolar_rms_px,
            "windows": result.epipolar_count,
            "out_of_calibration": result.out_of_calibration,
        },
    }


def _doubts(pairs: list[dict[str, Any]]) -> list[str]:
    """Why the answer is weak, one line each."""
    doubts = [f"{pair['message']}; the surface lacks this pair" for pair in pairs if pair["status"] != "ok"]
    for pair in pairs:
        check = pair.get("epipolar")
        if check and check["out_of_calibration"]:
            doubts.append(
                f"pair {pair['id']}: out of calibration, matches lie {check['rms_px']:.3f} px off their epipolar lines"
                f" (median {check['median_px']:+.3f}, sigma {check['sigma_px']:.3f}): calibrate again"
            )
    return doubts


def _describe_fusion(info: FuseInfo | None) -> dict[str, Any] | None:
    names = ("point_count", "overlap_count", "disagreement_mean_mm", "disagreement_rms_mm", "disagreement_expected_mm")
    return None if info is None else {name: getattr(info, name) for name in names}


def _print(out: Path, surface: Surface, pairs: list[dict[str, Any]], fusion: dict[str, Any] | None) -> None:
    for pair in pairs:
        if "points" not in pair or pair["status"] != "ok":
            continue
        total = sum(pair["reasons"].values())
        rejected = {word: n for word, n in pair["reasons"].items() if n and word != "none"}
        print(
            f"{pair['id']}: {pair['points']} of {total} grid points, median sigma {pair['median_sigma_mm']:.3f} mm"
            f" ({pair['median_sigma_px']:.3f} px); rejected: "
            + (", ".join(f"{n} {word}" for word, n in rejected.items()) or "none")
        )
    if fusion:
        print(
            f"fused: {fusion['overlap_count']} points in the overlap,"
            f" disagreement {fusion['disagreement_rms_mm']:.3f} mm RMS"
            f" (mean {fusion['disagreement_mean_mm']:+.3f}, expected {fusion['disagreement_expected_mm']:.3f})"
        )
    print(f"{out}: {surface.point_count} points")


@click.command(
    "stereo", epilog="\b\nExample: sgrt stereo --rig rig.json --pair pod1 left.png right.png --out surface.ply"
)
@click.option("--rig", "rig_file", type=FILE, required=True, metavar="FILE", help="The calibrated room, rig.json.")
@click.option(
    "--pair",
    "pairs",
    type=(str, FILE, FILE),
    multiple=True,
    required=True,
    metavar="ID LEFT RIGHT",
    help="A pair of the rig and its two images, 8 or 16 bit grey PNG. Several pairs are fused.",
)
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The surface, PLY.")
@click.option(
    "--volume",
    type=float,
    nargs=6,
    metavar="X0 Y0 Z0 X1 Y1 Z1",
    help="Working volume, mm, room axes; default: wherever both cameras see.",
)
@click.option("--stride", "stride_px", type=int, metavar="PX", help="A point every so many pixels, 1 to 32.")
@click.option("--window", "window_px", type=int, metavar="PX", help="Side of the square window, odd, 9 to 41.")
@click.option(
    "--max-sigma",
    "max_sigma_px",
    type=float,
    metavar="PX",
    help="Points with a larger sigma are left out; default 0.1. 1 covers weakly textured skin too.",
)
@click.option(
    "--prior", "prior_file", type=FILE, metavar="FILE", help="A surface (PLY): only what it shows is sought, near it."
)
@click.option("--roi", "roi_file", type=FILE, metavar="FILE", help="The part of the prior that counts, roi.json.")
@click.option("--band", "band_mm", type=float, metavar="MM", help="How far from the prior is still taken; default 25.")
@common
def command(
    rig_file: Path,
    pairs: tuple[tuple[str, Path, Path], ...],
    out: Path,
    volume: tuple[float, ...] | None,
    stride_px: int | None,
    window_px: int | None,
    max_sigma_px: float | None,
    prior_file: Path | None,
    roi_file: Path | None,
    band_mm: float | None,
    threads: int,
    as_json: bool,
) -> int:
    """Reconstructs a surface from pairs of speckle images.

    The surface holds normals, sigma_mm and covariance; from one pair it is the organised grid, from several one fused
    cloud, and how far the pods disagree where they overlap is reported. A pair that gives nothing leaves the others
    theirs: the verdict is then weak, and so it is where matches show the rig to be out of calibration.

    With --prior only what that surface shows is sought, and only near it: what has moved further than --band is counted
    as "moved", never given. The prior says where to look, not what is found.
    """
    watch = Stopwatch()
    check_out(out)
    rig = read_rig(rig_file)
    _check_pairs(rig, pairs, rig_file)
    options: dict[str, Any] = {"stride_px": stride_px, "window_px": window_px, "max_sigma_px": max_sigma_px}
    options = {name: value for name, value in options.items() if value is not None}
    if volume:
        options |= {"volume_min_mm": volume[:3], "volume_max_mm": volume[3:]}
    if prior_file is None and (roi_file is not None or band_mm is not None):
        raise Failure(f"{'--roi' if roi_file is not None else '--band'}: expected with --prior")
    live: dict[str, Any] = {} if prior_file is None else {"prior": read_surface(prior_file)}
    if roi_file is not None:
        live["roi"] = read_roi(roi_file)
    if band_mm is not None:
        live["band_mm"] = band_mm
    results: list[tuple[Stereo | None, Error | None]] = []
    fusion: FuseInfo | None = None
    with working(threads) as context:
        results.extend(_match(rig, pair, options, live, context) for pair in pairs)
        surfaces = [result.surface for result, _ in results if result is not None and result.surface is not None]
        described = [_describe(pair[0], *result) for pair, result in zip(pairs, results, strict=True)]
        if not surfaces:
            error = next(error for _, error in results if error is not None)
            if as_json:
                missing = {"status": error.word, "surface": None, "pairs": described, "fusion": None}
                print_json(missing | {"timing_ms": watch.ms()})
            raise error
        surface = surfaces[0]
        if len(surfaces) > 1:
            surface, fusion = surface_fuse(surfaces, context=context)
    write_surface(out, surface)
    doubts = _doubts(described)
    for doubt in doubts:
        print(f"sgrt stereo: warning: {doubt}", file=sys.stderr)
    if as_json:
        print_json(
            {
                "status": "ok",
                "verdict": "weak" if doubts else "ok",
                "doubts": doubts,
                "surface": str(out),
                "points": surface.point_count,
                "pairs": described,
                "fusion": _describe_fusion(fusion),
                "timing_ms": watch.ms(),
            }
        )
    else:
        _print(out, surface, described, _describe_fusion(fusion))
    return 0
