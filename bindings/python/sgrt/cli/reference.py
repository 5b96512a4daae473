"""`sgrt reference`: the reference surface from a plan, and the store of references."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..io import read_roi, read_surface, write_surface
from ..io._files import check_schema, naming, parse_json, read_text, write_json, writing
from ..io.dicom import POSITIONS
from ..reference import SCHEMA, ReferenceSurface, from_capture, from_ct, from_structure
from ..store import Entry, ReferenceStore
from ._common import FILE, Command, Failure, check_out, common, print_json, working


def beside(surface: Path) -> Path:
    """The document of a reference: reference.ply has reference.json."""
    return surface.with_suffix(".json")


@click.group(
    "reference",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="\b\nExample: sgrt reference ct CT/ --plan plan.dcm --out reference.ply",
)
def group() -> None:
    """Makes reference surfaces from planning CT, structure sets or captures, and keeps them in a store."""


# ------------------------------------------------------------------------------------------------------------- making

OUT = click.option(
    "--out", type=FILE, required=True, metavar="FILE", help="The reference, PLY; its document lies beside it, .json."
)
PLAN = click.option("--plan", type=FILE, metavar="RTPLAN", help="The plan whose isocentre becomes the origin.")


def placed(command: Command) -> Command:
    """The options of a reference that comes in DICOM coordinates, named as the arguments of from_ct."""
    options = [
        PLAN,
        click.option("--beam", metavar="NAME", help="The beam whose isocentre counts, where they differ."),
        click.option(
            "--isocentre",
            "isocentre_mm",
            type=float,
            nargs=3,
            metavar="X Y Z",
            help="DICOM coordinates, mm, instead of the plan's.",
        ),
        click.option("--position", type=click.Choice(POSITIONS), help="Patient position, where the files do not tell."),
        click.option(
            "--whole",
            is_flag=True,
            help="The closed body; default: measured skin alone, without cuts, couch contact and closed airways.",
        ),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def _write(out: Path, made: ReferenceSurface, as_json: bool) -> None:
    if beside(out) == out:
        raise Failure(f"--out {out}: expected a name that ends in .ply")
    write_json(beside(out), made.document)
    write_surface(out, made.surface)
    if as_json:
        print_json(made.document | {"out": str(out)})
        return
    d = made.document
    print(f"{out}: {made.surface.point_count} points, {d['frame']}, patient {d['patient_position'] or 'as captured'}")
    if d["kind"] == "ct":
        couch = "removed" if d["couch_found"] else "not found"
        print(f"expected bias {d['bias_mm']:+.3f} mm, sigma {d['sigma_mm']:.3f} mm, couch {couch}")
    for cut in d.get("cut", []):
        low, high = ([round(float(x)) for x in corner] for corner in cut["box_mm"])
        print(f"the body goes on beyond the scan on {cut['side']}: from {low} to {high} mm")


@group.command("ct", epilog="\b\nExample: sgrt reference ct CT/ --plan plan.dcm --out reference.ply")
@click.argument("source", type=FILE)
@placed
@click.option("--series", "series_uid", metavar="UID", help="The CT series, where the folder has several.")
@click.option(
    "--threshold",
    "threshold_hu",
    type=float,
    metavar="HU",
    help="Where the skin lies; default: half-way from air to the tissue at each place.",
)
@click.option(
    "--closing",
    "closing_mm",
    type=click.FloatRange(0, 50),
    default=4.0,
    show_default=True,
    metavar="MM",
    help="Airways narrower than twice this are closed.",
)
@OUT
@common
def ct(source: Path, out: Path, threads: int, as_json: bool, **options: Any) -> int:
    """The skin of a planning CT: SOURCE is a folder of DICOM images, or a NIfTI file."""
    check_out(out)
    with working(threads) as context:
        made = from_ct(source, **options, context=context)
    _write(out, made, as_json)
    return 0


@group.command("rtstruct", epilog="\b\nExample: sgrt reference rtstruct rtss.dcm --plan plan.dcm --out reference.ply")
@click.argument("source", type=FILE)
@click.option("--region", "name", metavar="NAME", help="The region; default: the one of type EXTERNAL.")
@placed
@OUT
@common
def rtstruct(source: Path, out: Path, threads: int, as_json: bool, **options: Any) -> int:
    """The body of an RTSTRUCT: its stacked contours as a closed surface."""
    check_out(out)
    with working(threads) as context:
        made = from_structure(source, **options, context=context)
    _write(out, made, as_json)
    return 0


@group.command("captured", epilog="\b\nExample: sgrt reference captured surface.ply --out reference.ply")
@click.argument("source", type=FILE)
@PLAN
@OUT
@common
def captured(source: Path, plan: Path | None, out: Path, threads: int, as_json: bool) -> int:
    """A surface captured in the room, PLY, taken as it is."""
    check_out(out)
    if out.resolve() == source.resolve():
        raise Failure(f"--out {out}: is the source itself")
    _write(out, from_capture(source, plan=plan), as_json)
    return 0


# -------------------------------------------------------------------------------------------------------------- store

STORE = click.option("--store", type=FILE, required=True, metavar="FILE", help="The store, one SQLite file.")


def _brief(entry: Entry) -> dict[str, Any]:
    return {
        "id": entry.id,
        "plan": entry.plan,
        "field": entry.field,
        "version": entry.version,
        "created": entry.created,
        "kind": entry.kind,
        "roi": entry.roi is not None,
    }


def _line(entry: Entry) -> str:
    words = [f"{entry.id:4}", entry.plan, entry.field, f"v{entry.version}", entry.kind, entry.created]
    return "  ".join(words + ["roi"] * (entry.roi is not None))


@group.command(
    "add", epilog="\b\nExample: sgrt reference add reference.ply --store references.sqlite --plan-id P1 --field F1"
)
@click.argument("source", type=FILE)
@STORE
@click.option("--plan-id", required=True, metavar="NAME", help="The plan; no personal data.")
@click.option("--field", required=True, metavar="NAME", help="The field.")
@click.option("--roi", type=FILE, metavar="FILE", help="The part of it that counts, roi.json.")
@common
def add(source: Path, store: Path, plan_id: str, field: str, roi: Path | None, threads: int, as_json: bool) -> int:
    """Adds a reference (PLY, with its document beside it) as the next version of its plan and field."""
    read_surface(source)  # what cannot be read must not be stored
    with naming(beside(source)):
        document = parse_json(read_text(beside(source)))
        check_schema(document, SCHEMA)
    region = None
    if roi is not None:
        read_roi(roi)
        region = parse_json(read_text(roi))
    with ReferenceStore(store, create=True) as references:
        entry = references.add(source.read_bytes(), document, plan=plan_id, field=field, roi=region)
    if as_json:
        print_json(_brief(entry))
    else:
        print(_line(entry))
    return 0


@group.command("list", epilog="\b\nExample: sgrt reference list --store references.sqlite --json")
@STORE
@click.option("--plan-id", metavar="NAME", help="Only those of this plan.")
@click.option("--field", metavar="NAME", help="Only those of this field.")
@common
def list_(store: Path, plan_id: str | None, field: str | None, threads: int, as_json: bool) -> int:
    """The references of a store, oldest first."""
    with ReferenceStore(store) as references:
        entries = references.entries(plan=plan_id, field=field)
    if as_json:
        print_json({"references": [_brief(entry) for entry in entries]})
    for entry in [] if as_json else entries:
        print(_line(entry))
    return 0


@group.command("show", epilog="\b\nExample: sgrt reference show 3 --store references.sqlite --json")
@click.argument("number", type=int)
@STORE
@common
def show(number: int, store: Path, threads: int, as_json: bool) -> int:
    """One reference: where it came from, its expected error, its ROI."""
    with ReferenceStore(store) as references:
        entry = references.entry(number)
    document = _brief(entry) | {"document": entry.document, "roi": entry.roi}
    if as_json:
        print_json(document)
        return 0
    print(_line(entry))
    for key, value in entry.document.items():
        print(f"  {key}: {value}")
    return 0


@group.command("export", epilog="\b\nExample: sgrt reference export 3 --store references.sqlite --out reference.ply")
@click.argument("number", type=int)
@STORE
@OUT
@common
def export(number: int, store: Path, out: Path, threads: int, as_json: bool) -> int:
    """Writes a reference as it was added, with its document (.json) and its ROI (.roi.json) beside it."""
    check_out(out)
    if beside(out) == out:
        raise Failure(f"--out {out}: expected a name that ends in .ply")
    with ReferenceStore(store) as references:
        entry, surface = references.entry(number), references.surface(number)
    write_json(beside(out), entry.document)
    if entry.roi is not None:
        write_json(out.with_suffix(".roi.json"), entry.roi)
    with writing(out) as stream:
        stream.write(surface)
    if as_json:
        print_json(_brief(entry) | {"out": str(out)})
    else:
        print(f"{out}: {_line(entry).strip()}")
    return 0
