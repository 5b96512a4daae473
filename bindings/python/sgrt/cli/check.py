"""`sgrt check`: the daily check of a room against its stored rig, with a trend."""

from __future__ import annotations

import datetime
import json
from pathlib import Path
from typing import Any

import click

from .._core import calibration_check, stereo_match, surface_fuse
from ..boards import Boards, find_boards, parse_board
from ..errors import FormatError
from ..io import read_image, read_rig
from ..io._files import parse_json, plain, read_text, writing
from ._common import FILE, Failure, about, check_out, common, print_json, working
from .calibrate import named_paths
from .calibrate_room import fit_room

SCHEMA = "sgrt-check/1"
EPIPOLAR_PX = 0.1  # stereo's own limit: beyond it a rig is out of calibration


def _item(name: str, value: float | None, limit: float, unit: str) -> dict[str, Any]:
    """A figure with its limit; one that is not there does not pass."""
    return {"name": name, "value": value, "limit": limit, "unit": unit, "pass": value is not None and value <= limit}


def _phantom(
    rig: Path, points: Path, images: tuple[str, ...], mm: float, deg: float, threads: int
) -> list[dict[str, Any]]:
    report = json.loads(fit_room((rig,), points, images, None, 0.0, threads).report)
    items = []
    for fit in [*report["rigs"], *report["pairs"]]:
        moved = fit["phantom_displacement"]
        items.append(_item(f"phantom seen by {fit['name']}, shift", moved["mag_mm"], mm, "mm"))
        turn = max(abs(moved[key]) for key in ("pitch_deg", "roll_deg", "rtn_deg"))
        items.append(_item(f"phantom seen by {fit['name']}, turn", turn, deg, "deg"))
    if report["pair_disagreement_mm"] is not None:
        items.append(_item("pairs against each other on the phantom", report["pair_disagreement_mm"], mm, "mm"))
    return items


def _board(rig_file: Path, board: str, cameras: tuple[str, ...], ratio: float, threads: int) -> list[dict[str, Any]]:
    boards: Boards = find_boards(parse_board(board), named_paths(cameras, "--camera", "FOLDER"), threads=threads or 1)
    with working(threads) as context, about(rig_file):
        result = calibration_check(read_rig(rig_file), **boards.arguments(), context=context)
    expected = result.expected_rms_px
    limit = ratio * expected if expected == expected else 0.5
    return [_item("board in all cameras, RMS", result.rms_px, limit, "px")]


def _captures(
    rig_file: Path, pairs: tuple[tuple[str, Path, Path], ...], mm: float, threads: int
) -> list[dict[str, Any]]:
    rig = read_rig(rig_file)
    surfaces, items = [], []
    with working(threads) as context:
        for pair_id, left, right in pairs:
            with about(f"pair {pair_id} ({left}, {right})"):
                result = stereo_match(rig, pair_id, read_image(left), read_image(right), context=context)
            if result.surface is None:
                raise Failure(f"pair {pair_id}: no surface")
            surfaces.append(result.surface)
            rms = result.epipolar_rms_px
            items.append(_item(f"{pair_id}, off the epipolar lines", rms if rms == rms else None, EPIPOLAR_PX, "px"))
        if len(surfaces) > 1:
            _, info = surface_fuse(surfaces, context=context)
            rms = info.disagreement_rms_mm
            items.append(_item("pods against each other on the capture", rms if rms == rms else None, mm, "mm"))
    return items


def _append(path: Path, line: dict[str, Any]) -> list[dict[str, Any]]:
    """The trend so far, this check included; the file is written whole."""
    text = read_text(path) if path.exists() else ""
    trend = []
    for n, row in enumerate(text.splitlines(), 1):
        try:
            trend.append(parse_json(row))
        except FormatError as error:
            raise FormatError(f"{path}: line {n}: {error}") from error
    with writing(path) as stream:
        stream.write(
            (text + ("" if not text or text.endswith("\n") else "\n") + json.dumps(plain(line)) + "\n").encode()
        )
    return [*trend, line]


@click.command(
    "check",
    epilog="\b\nExample: sgrt check --rig rig.json --points phantom.json --images l=l.png --images r=r.png"
    " --trend trend.jsonl\n\b\nOr: sgrt check --rig rig.json --pair pod1 l1.png r1.png --pair pod2 l2.png r2.png",
)
@click.option(
    "--rig", "rig_file", type=FILE, required=True, metavar="FILE", help="The stored rig, in the room's frame."
)
@click.option("--points", type=FILE, metavar="FILE", help="A phantom at the isocentre, phantom.json.")
@click.option("--images", multiple=True, metavar="ID=FILE", help="A camera's image of the phantom's plate.")
@click.option("--board", metavar="KIND:COLSxROWS:MM", help="A board held anywhere: the cameras against each other.")
@click.option("--camera", "cameras", multiple=True, metavar="ID=FOLDER", help="A camera's images of that board.")
@click.option(
    "--pair",
    "pairs",
    type=(str, FILE, FILE),
    multiple=True,
    metavar="ID LEFT RIGHT",
    help="An ordinary capture of a pod; of several pods also against each other.",
)
@click.option("--tolerance-mm", type=click.FloatRange(min=0, min_open=True), default=0.5, help="Default: 0.5 mm.")
@click.option("--tolerance-deg", type=click.FloatRange(min=0, min_open=True), default=0.2, help="Default: 0.2 deg.")
@click.option(
    "--tolerance-ratio",
    type=click.FloatRange(min=1),
    default=2.0,
    help="Of a board's RMS to what the rig lets expect; default: 2.",
)
@click.option("--trend", type=FILE, metavar="FILE", help="Append the figures to this file, a JSON document a line.")
@common
def command(
    rig_file: Path,
    points: Path | None,
    images: tuple[str, ...],
    board: str | None,
    cameras: tuple[str, ...],
    pairs: tuple[tuple[str, Path, Path], ...],
    tolerance_mm: float,
    tolerance_deg: float,
    tolerance_ratio: float,
    trend: Path | None,
    threads: int,
    as_json: bool,
) -> int:
    """Holds the room against its stored rig: pass or fail, with the figures. Exit code 1: fail."""
    if trend is not None:
        check_out(trend)
    items: list[dict[str, Any]] = []
    if points is not None:
        items += _phantom(rig_file, points, images, tolerance_mm, tolerance_deg, threads)
    if board is not None:
        items += _board(rig_file, board, cameras, tolerance_ratio, threads)
    if pairs:
        items += _captures(rig_file, pairs, tolerance_mm, threads)
    if not items:
        raise Failure("nothing to check: give --points with --images, --board with --camera, or --pair")
    passed = all(item["pass"] for item in items)
    line = {
        "schema": SCHEMA,
        "time": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "rig": read_rig(rig_file).id,
        "pass": passed,
        "figures": items,
    }
    history = _append(trend, line) if trend is not None else [line]
    if as_json:
        print_json(line)
    else:
        for item in items:
            value = "none" if item["value"] is None else f"{item['value']:.3f}"
            print(
                f"{'pass' if item['pass'] else 'FAIL'}  {item['name']}: {value} {item['unit']}"
                f" (limit {item['limit']:.3f})"
            )
        print(f"{'pass' if passed else 'FAIL'}" + (f"; check {len(history)} of {trend}" if trend else ""))
    return 0 if passed else 1
