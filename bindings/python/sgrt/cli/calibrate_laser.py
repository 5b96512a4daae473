"""`sgrt calibrate laser`: a laser unit from sweeps of its stripe over a board in several places."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from .._core import Rig, calibration_laser
from ..boards import parse_board
from ..io import Scan, read_rig, read_scan, write_rig
from ..io._files import write_json
from ..stripes import sights
from ._common import FILE, Failure, about, calibrating, check_out, common, print_json, progress_bar, report_of, working


def _camera(rig: Rig, rig_file: Path, laser: str, wanted: str | None) -> str:
    """The laser's camera: what --camera says, what the rig says, or the only one there is."""
    document = json.loads(rig.to_json())
    stated = [entry.get("camera") for entry in document.get("lasers", []) if entry.get("id") == laser]
    known = [camera.id for camera in rig.cameras]
    camera = wanted or (stated[0] if stated else known[0] if len(known) == 1 else None)
    if camera is None:
        raise Failure(f"{rig_file}: has {len(known)} cameras and no laser {laser!r}; say which by --camera")
    if camera not in known:
        raise Failure(f"{rig_file}: has no camera {camera!r}; it has {', '.join(known)}")
    return str(camera)


def _print(report: dict[str, Any]) -> None:
    for place in report["placements"]:
        rms = place["stripe_rms_px"]
        print(
            f"{place['name']}: {place['stripe_points']} stripe points"
            f" ({'none' if rms is None else f'{rms:.3f} px RMS'}), {place['corners']} corners"
            f" ({place['corner_rms_px']:.3f} px RMS)"
        )
    print(
        f"{report['laser']}: stripes explained to {report['rms_px']:.3f} px RMS"
        f" ({report['residuals_over_sigma']:.2f} times their sigma); a point is good to"
        f" {report['point_sigma_mm']:.3f} mm by the calibration"
    )
    for warning in report["warnings"]:
        print(f"warning: {warning}")


@click.command(
    "laser",
    epilog="\b\nExample: sgrt calibrate laser --rig rig.json --board chessboard:11x8:30 --scan near/scan.json"
    " --scan far/scan.json --scan tilted/scan.json --out laser.json",
)
@click.option(
    "--rig", "rig_file", type=FILE, required=True, metavar="FILE", help="The rig.json with the laser's camera."
)
@click.option("--board", required=True, metavar="KIND:COLSxROWS:MM", help="As of sgrt calibrate.")
@click.option(
    "--scan",
    "scan_files",
    type=FILE,
    multiple=True,
    required=True,
    metavar="FILE",
    help="A sweep over the board, scan.json; one for each place of the board. Its dark frame shows the board alone.",
)
@click.option("--camera", metavar="ID", help="The laser's camera; default: what the rig says, or its only one.")
@click.option(
    "--noise-px", type=float, default=0.0, metavar="PX", help="One sigma of a corner; default: what the rig states."
)
@click.option("--out", type=FILE, required=True, metavar="FILE", help="The rig.json with the laser.")
@click.option("--report", "report_file", type=FILE, metavar="FILE", help="Also write the report, JSON.")
@common
def command(
    rig_file: Path,
    board: str,
    scan_files: tuple[Path, ...],
    camera: str | None,
    noise_px: float,
    out: Path,
    report_file: Path | None,
    threads: int,
    as_json: bool,
) -> int:
    """Calibrates a laser unit: fan, mirror axis, offset and angle scale, with their covariance.

    A laser of the scans' id in the rig is where the solve starts; else it finds a start by itself. Scans of one and the
    same angle are of a laser without a mirror: its light plane is written as the fan.
    """
    check_out(out, report_file)
    target, rig = parse_board(board), read_rig(rig_file)
    scans: list[tuple[Path, Scan]] = [(path, read_scan(path)) for path in scan_files]
    lasers = sorted({scan.laser for _, scan in scans})
    if len(lasers) > 1:
        raise Failure(f"--scan: of several lasers, {', '.join(lasers)}; expected one")
    camera = _camera(rig, rig_file, lasers[0], camera)
    with progress_bar() as progress:
        seen = sights(target, scans, camera, progress=progress)
    with calibrating(as_json), working(threads) as context, about(rig_file):
        result = calibration_laser(rig, lasers[0], **seen, noise_px=noise_px, context=context)
    report = report_of(result)
    if report_file is not None:
        write_json(report_file, report)
    assert result.rig is not None
    write_rig(out, result.rig)
    if as_json:
        print_json(report)
    else:
        _print(report)
    return 0
