"""`sgrt calibrate room`: a rig, or several pods, into the room's frame by a phantom."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .._core import Calibration, calibration_room
from ..io import read_rig, write_rig
from ..io._files import write_json
from ..phantoms import read_phantom, sights
from ._common import FILE, about, calibrating, check_out, common, print_json, report_of, working
from .calibrate import named_paths


def fit_room(
    rig_files: tuple[Path, ...],
    points: Path,
    images: tuple[str, ...],
    rig_id: str | None,
    noise_px: float,
    threads: int,
) -> Calibration:
    """calibration_room from files; every error names its file."""
    rigs = [read_rig(path) for path in rig_files]
    phantom = read_phantom(points)
    sizes = {camera.id: (camera.width, camera.height) for rig in rigs for camera in rig.cameras}
    seen = sights(phantom, sizes, named_paths(images, "--images", "FILE"))
    with working(threads) as context, about(points):
        return calibration_room(
            rigs, **seen, rig_id=rig_id, point_sigma_mm=phantom.sigma_mm, noise_px=noise_px, context=context
        )


def _print(report: dict[str, Any]) -> None:
    for fit in [*report["rigs"], *report["pairs"]]:
        sigma = " ".join(f"{s:.3f}" for s in fit["sigma_mm"])
        turn = " ".join(f"{s:.4f}" for s in fit["sigma_deg"])
        print(
            f"{fit['name']}: {fit['points']} points, {fit['rms_px']:.3f} px RMS,"
            f" {fit['point_rms_mm']:.3f} mm RMS in space;"
            f" one sigma at the isocentre {sigma} mm, {turn} deg"
        )
    if report["pair_disagreement_mm"] is not None:
        print(f"pairs differ by {report['pair_disagreement_mm']:.3f} mm RMS on the phantom's points")
    for item in report["discarded"]:
        print(f"{item['camera']} point {item['point']}: not used: {item['why']}")
    for warning in report["warnings"]:
        print(f"warning: {warning}")


@click.command(
    "room",
    epilog="\b\nExample: sgrt calibrate room --rig rig.json --points phantom.json --images l=l.png --images r=r.png"
    " --out room.json",
)
@click.option(
    "--rig",
    "rig_files",
    type=FILE,
    multiple=True,
    required=True,
    metavar="FILE",
    help="A calibrated rig; several pods become one rig.",
)
@click.option(
    "--points",
    type=FILE,
    required=True,
    metavar="FILE",
    help="The phantom, phantom.json: a plate, or points with pixels.",
)
@click.option("--images", multiple=True, metavar="ID=FILE", help="A camera's image of the plate.")
@click.option("--id", "rig_id", metavar="TEXT", help="Id of the rig; default: that of the first one.")
@click.option(
    "--noise-px",
    type=float,
    default=0.0,
    metavar="PX",
    help="One sigma of a found point; default: what the rig states.",
)
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The rig.json in the room's frame.")
@click.option("--report", "report_file", type=FILE, metavar="FILE", help="Also write the report, JSON.")
@common
def command(
    rig_files: tuple[Path, ...],
    points: Path,
    images: tuple[str, ...],
    rig_id: str | None,
    noise_px: float,
    out: Path,
    report_file: Path | None,
    threads: int,
    as_json: bool,
) -> int:
    """Brings a rig into the room (IEC 61217) by a phantom whose points are known there, with the covariance."""
    check_out(out, report_file)
    with calibrating(as_json):
        result = fit_room(rig_files, points, images, rig_id, noise_px, threads)
    report = report_of(result)
    if report_file is not None:
        write_json(report_file, report)
    if result.rig is not None:
        write_rig(out, result.rig)
    if as_json:
        print_json(report)
    else:
        _print(report)
    return 0
