"""`sgrt advise`: which region of interest to track."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .._core import Advice, Roi, roi_advise
from ..io import write_roi
from ._common import FILE, about, check_out, common, placed, print_json, read_placed, working

SCHEMA = "sgrt-advice/1"


def _forecast(advice: Advice, i: int) -> dict[str, Any]:
    return {
        "error_mm": float(advice.error_mm[i]),
        "error_deg": float(advice.error_deg[i]),
        "share": float(advice.share[i]),
        "score": float(advice.score[i]),
        "flagged": advice.flagged[i],
        "words": advice.words[i],
    }


def _proposal(advice: Advice) -> dict[str, Any]:
    names = ("error_mm", "error_deg", "share", "score", "flagged", "words", "polygon_xy_mm")
    return {name: getattr(advice, f"proposal_{name}") for name in names} | {"better": advice.better}


def _line(name: str, f: dict[str, Any]) -> None:
    flag = "falls short: " if f["flagged"] else ""
    print(
        f"{name:30} {f['error_mm']:8.3f} mm {f['error_deg']:8.3f} deg {100 * f['share']:5.1f} % of the points"
        f"  {flag}{f['words']}"
    )


@click.command(
    "advise",
    epilog="\b\nExample: sgrt advise --reference reference.ply --isocentre 0 0 0 --candidate face.json --candidate"
    " brow.json --out better.json",
)
@placed(
    "The region is for a couch turned by DEG: reference and candidates turn with it, as in sgrt register.", roi=False
)
@click.option(
    "--candidate",
    "candidates",
    type=FILE,
    multiple=True,
    metavar="FILE",
    help="A region to judge, roi.json; may be given again and again.",
)
@click.option("--sigma", "sigma_mm", type=float, metavar="MM", help="One sigma of a live point; default: 0.3.")
@click.option("--limit-mm", type=float, metavar="MM", help="A region that errs by more falls short; default: 1.")
@click.option("--limit-deg", type=float, metavar="DEG", help="Likewise; default: 0.5.")
@click.option(
    "--max-share",
    type=float,
    metavar="SHARE",
    help="Of the reference's points that the proposal may take; default: that of the largest candidate, or 0.4.",
)
@click.option("--out", type=FILE, metavar="FILE", help="Write the proposal, roi.json.")
@common
def command(
    reference: Path,
    isocentre_mm: tuple[float, ...],
    couch_deg: float,
    candidates: tuple[Path, ...],
    sigma_mm: float | None,
    limit_mm: float | None,
    limit_deg: float | None,
    max_share: float | None,
    out: Path | None,
    threads: int,
    as_json: bool,
) -> int:
    """Ranks regions by the error that they promise at the isocentre, and proposes a better one."""
    if out is not None:
        check_out(out)
    surface, regions = read_placed(reference, candidates, couch_deg, isocentre_mm)
    known = {"live_sigma_mm": sigma_mm, "limit_mm": limit_mm, "limit_deg": limit_deg, "max_share": max_share}
    given = {name: value for name, value in known.items() if value is not None}
    with working(threads) as context, about(reference):
        rois = [region for region in regions if region is not None]
        advice = roi_advise(surface, rois, isocentre_mm=isocentre_mm, context=context, **given)
    if out is not None:
        write_roi(out, Roi.polygon(advice.proposal_polygon_xy_mm))
    ranked = [] if advice.order is None else [int(i) for i in advice.order]
    if as_json:
        rows = [{"candidate": str(candidates[i])} | _forecast(advice, i) for i in ranked]
        document = {"schema": SCHEMA, "status": "ok", "isocentre_mm": isocentre_mm, "candidates": rows}
        print_json(document | {"proposal": _proposal(advice)})
        return 0
    for i in ranked:
        _line(str(candidates[i]), _forecast(advice, i))
    _line("proposal" if advice.better or not ranked else "proposal (no better)", _proposal(advice))
    return 0
