"""`sgrt calibrate`: folders of board images to a rig.json with its uncertainty, or the check of one."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import Any

import click

from .._core import Calibration, Rig, calibration_check, calibration_solve
from ..boards import Boards, find_boards, parse_board
from ..io import read_rig, write_rig
from ..io._files import write_json
from ._common import FILE, Failure, about, calibrating, check_out, common, print_json, progress_bar, report_of, working

MODELS = {"pinhole": 0, "brown5": 5, "rational8": 8}


def named_paths(items: tuple[str, ...], option: str, value: str) -> list[tuple[str, Path]]:
    """ID=PATH of an option that may stand several times."""
    out = []
    for item in items:
        name, sign, path = item.partition("=")
        if not (name and sign and path):
            raise Failure(f"{option} {item}: expected ID={value}")
        out.append((name, Path(path)))
    return out


def _pairs(items: tuple[str, ...], cameras: list[str]) -> list[tuple[str, str, str]]:
    out = []
    for item in items:
        name, sign, sides = item.partition("=")
        left, comma, right = sides.partition(",")
        if not (name and sign and comma and left and right):
            raise Failure(f"--pair {item}: expected ID=LEFT,RIGHT")
        for side in (left, right):
            if side not in cameras:
                raise Failure(f"--pair {item}: no camera {side!r}; there are {', '.join(cameras)}")
        if left == right or name in [n for n, _, _ in out]:
            raise Failure(f"--pair {item}: {'one camera twice' if left == right else 'given twice'}")
        out.append((name, left, right))
    return out


def _draw(picture: Path | None, boards: Boards, result: Calibration, report: dict[str, Any]) -> None:
    if picture is None:
        return
    try:
        draw = importlib.import_module("sgrt.calibration_picture").draw
    except ModuleNotFoundError as error:
        raise Failure(f"--picture needs {error.name}: pip install 'sgrt[plot]'") from error
    draw(picture, boards, result, report)


def _document(result: Calibration, boards: Boards) -> dict[str, Any]:
    return report_of(result) | {"images_without_board": boards.missing}


def _print(report: dict[str, Any], boards: Boards) -> None:
    for missing in boards.missing:
        print(f"{missing['camera']}/{missing['image']}: not used: {missing['why']}")
    for item in report["discarded"]:
        what = "" if item["point"] is None else f" point {item['point']}"
        residual = "" if item["residual_px"] is None else f" ({item['residual_px']:.2f} px)"
        print(f"{item['camera']}/{item['image']}{what}: not used: {item['why']}{residual}")
    for camera in report["cameras"]:
        line = f"{camera['id']}: {camera['images']} images, {camera['corners']} corners, RMS {camera['rms_px']:.3f} px"
        if "coverage" in camera:
            split = camera["split_half"]
            line += (
                f", coverage {100 * camera['coverage']:.0f} %, projection sigma"
                f" {camera['projection_sigma_px']['middle']:.3f} px in the middle,"
                f" {camera['projection_sigma_px']['worst']:.3f} px at worst"
            )
            if split["difference_px"] is not None:
                line += f", halves differ by {split['difference_px']:.3f} px (predicted {split['predicted_px']:.3f})"
        print(line)
    if "expected_rms_px" in report:
        expected = report["expected_rms_px"]
        print(f"RMS {report['rms_px']:.3f} px" + (f", expected {expected:.3f} px" if expected else ""))
    else:
        print(f"RMS {report['rms_px']:.3f} px a corner, noise {report['noise_px']:.3f} px a coordinate")
    for warning in report["warnings"]:
        print(f"warning: {warning}")


def _solve(boards: Boards, pairs: list[tuple[str, str, str]], model: str, rig_id: str, threads: int) -> Calibration:
    with working(threads) as context:
        return calibration_solve(
            **boards.arguments(), pairs=pairs, rig_id=rig_id, distortion_count=MODELS[model], context=context
        )


def _check(boards: Boards, rig: Rig, rig_file: Path, threads: int) -> Calibration:
    with working(threads) as context, about(rig_file):
        return calibration_check(rig, **boards.arguments(), context=context)


@click.group(
    "calibrate",
    invoke_without_command=True,
    subcommand_metavar="[room|laser|tof ...]",
    epilog="\b\nExample: sgrt calibrate --board chessboard:11x8:30 --camera left=im/left --camera right=im/right"
    " --pair pod1=left,right --out rig.json\n\b\nCheck:   sgrt calibrate --check rig.json --board chessboard:11x8:30"
    " --camera left=new/left --camera right=new/right",
)
@click.option(
    "--board", metavar="KIND:COLSxROWS:MM", help="chessboard (inner corners, side of a square) or circles (asymmetric)."
)
@click.option(
    "--camera",
    "cameras",
    multiple=True,
    metavar="ID=FOLDER",
    help="A camera and its images; file names equal in all folders.",
)
@click.option("--pair", multiple=True, metavar="ID=LEFT,RIGHT", help="A stereo pair to state in the rig.")
@click.option("--model", type=click.Choice(list(MODELS)), default="brown5", help="Lens model; default: brown5.")
@click.option("--id", "rig_id", default="calibrated rig", metavar="TEXT", help="Id of the rig.")
@click.option(
    "--check", "check_file", type=FILE, metavar="RIG", help="Hold this rig against the images instead of making one."
)
@click.option("--out", type=FILE, metavar="FILE", help="The rig.json to write.")
@click.option("--report", "report_file", type=FILE, metavar="FILE", help="Also write the report, JSON.")
@click.option(
    "--picture", type=FILE, metavar="FILE", help="Also draw a page, PNG: residuals, coverage, uncertainty, rig."
)
@common
@click.pass_context
def command(
    ctx: click.Context,
    board: str | None,
    cameras: tuple[str, ...],
    pair: tuple[str, ...],
    model: str,
    rig_id: str,
    check_file: Path | None,
    out: Path | None,
    report_file: Path | None,
    picture: Path | None,
    threads: int,
    as_json: bool,
) -> int | None:
    """Calibrates all cameras of a room in one solve from images of a board; --check: tries a rig on new images.

    The first camera's frame is the room of the rig; `sgrt calibrate room` brings it into IEC 61217. Exit code 1 where a
    check does not agree with the rig's own uncertainty (a warning names it).
    """
    if ctx.invoked_subcommand is not None:
        return None
    if board is None or not cameras:
        raise Failure("--board and --camera are missing; see sgrt calibrate --help")
    check_out(out, report_file, picture)
    target, folders = parse_board(board), named_paths(cameras, "--camera", "FOLDER")
    rig = read_rig(check_file) if check_file else None
    if rig is None and out is None:
        raise Failure("--out is missing: the rig.json to write")
    pairs = _pairs(pair, [name for name, _ in folders])  # before minutes are spent on the images
    with progress_bar() as progress:
        boards = find_boards(target, folders, threads=threads or os.cpu_count() or 1, progress=progress)
    with calibrating(as_json, lambda result: _document(result, boards)):
        result = (
            _solve(boards, pairs, model, rig_id, threads)
            if rig is None or check_file is None
            else _check(boards, rig, check_file, threads)
        )
    report = _document(result, boards)
    if report_file is not None:
        write_json(report_file, report)
    _draw(picture, boards, result, report)
    if out is not None and result.rig is not None:
        write_rig(out, result.rig)
    if as_json:
        print_json(report)
    else:
        _print(report, boards)
    return 1 if check_file and report["warnings"] else 0
