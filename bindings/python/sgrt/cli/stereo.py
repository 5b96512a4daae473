"""`sgrt stereo`: image pairs of pods to one surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .._core import Context, FuseInfo, Rig, Stereo, Surface, stereo_match, surface_fuse
from ..errors import Error
from ..io import read_image, read_rig, write_surface
from ._common import FILE, Failure, Stopwatch, about, check_out, common, print_json, working


def _match(rig: Rig, pair: tuple[str, Path, Path], options: dict[str, Any], context: Context) -> Stereo:
    pair_id, left, right = pair
    images = read_image(left), read_image(right)
    with about(f"pair {pair_id} ({left}, {right})"):
        return stereo_match(rig, pair_id, *images, context=context, **options)


def _check_pairs(rig: Rig, pairs: tuple[tuple[str, Path, Path], ...], rig_file: Path) -> None:
    known = [pair.id for pair in rig.pairs]
    for i, (pair_id, _, _) in enumerate(pairs):
        if pair_id not in known:
            raise Failure(f"{rig_file}: has no pair {pair_id!r}; it has {', '.join(known) or 'none'}")
        if pair_id in [p for p, _, _ in pairs[:i]]:
            raise Failure(f"--pair {pair_id}: given twice")


def _describe(pair_id: str, result: Stereo | None) -> dict[str, Any]:
    if result is None:
        return {"id": pair_id}
    return {
        "id": pair_id,
        "points": result.point_count,
        "grid": [result.reason.shape[1], result.reason.shape[0]] if result.reason is not None else None,
        "reasons": result.counts,
        "noise_left": result.noise_left,
        "median_sigma_px": result.median_sigma_px,
        "median_sigma_mm": result.median_sigma_mm,
    }


def _describe_fusion(info: FuseInfo | None) -> dict[str, Any] | None:
    names = ("point_count", "overlap_count", "disagreement_mean_mm", "disagreement_rms_mm", "disagreement_expected_mm")
    return None if info is None else {name: getattr(info, name) for name in names}


def _print(out: Path, surface: Surface, pairs: list[dict[str, Any]], fusion: dict[str, Any] | None) -> None:
    for pair in pairs:
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
@common
def command(
    rig_file: Path,
    pairs: tuple[tuple[str, Path, Path], ...],
    out: Path,
    volume: tuple[float, ...] | None,
    stride_px: int | None,
    window_px: int | None,
    threads: int,
    as_json: bool,
) -> int:
    """Reconstructs a surface from pairs of speckle images.

    The surface holds normals, sigma_mm and covariance; from one pair it is the organised grid, from several one fused
    cloud, and how far the pods disagree where they overlap is reported.
    """
    watch = Stopwatch()
    check_out(out)
    rig = read_rig(rig_file)
    _check_pairs(rig, pairs, rig_file)
    options: dict[str, Any] = {"stride_px": stride_px, "window_px": window_px}
    options = {name: value for name, value in options.items() if value is not None}
    if volume:
        options |= {"volume_min_mm": volume[:3], "volume_max_mm": volume[3:]}
    results: list[Stereo] = []
    fusion: FuseInfo | None = None
    try:
        with working(threads) as context:
            results.extend(_match(rig, pair, options, context) for pair in pairs)
            surfaces = [result.surface for result in results if result.surface is not None]
            surface = surfaces[0]
            if len(surfaces) > 1:
                surface, fusion = surface_fuse(surfaces, context=context)
    except Error as error:
        if as_json and 10 <= error.status < 20:
            found = [*results, error.result if isinstance(error.result, Stereo) else None]
            described = [_describe(pair[0], result) for pair, result in zip(pairs, found, strict=False)]
            print_json(
                {"status": error.word, "surface": None, "pairs": described, "fusion": None, "timing_ms": watch.ms()}
            )
        raise
    write_surface(out, surface)
    described = [_describe(pair[0], result) for pair, result in zip(pairs, results, strict=True)]
    if as_json:
        print_json(
            {
                "status": "ok",
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
