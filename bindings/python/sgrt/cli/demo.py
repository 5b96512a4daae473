"""`sgrt demo`: the main job end to end in a simulated room."""

from __future__ import annotations

import importlib
from pathlib import Path

import click

from ._common import FILE, Failure, common


@click.command("demo", epilog="\b\nExample: sgrt demo --out demo-out")
@click.option(
    "--out", type=FILE, default=Path("sgrt-demo"), metavar="DIR", help="Where the files go; default: sgrt-demo."
)
@common
def command(out: Path, threads: int, as_json: bool) -> int | None:
    """The main job: a simulated room, two pods, capture -> surface -> six shifts, with a picture.

    Needs the extras twin and plot: pip install 'sgrt[twin,plot]'.
    """
    try:
        run = importlib.import_module("sgrt.demo").run
    except ModuleNotFoundError as error:
        raise Failure(f"the demo needs {error.name}: pip install 'sgrt[twin,plot]'") from error
    code: int | None = run(out=out, threads=threads, as_json=as_json)
    return code
