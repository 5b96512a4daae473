"""What every command has: --threads, --json, a progress bar, one-line errors and exit codes."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click
from tqdm import tqdm

from .._core import Calibration, Context, Roi, Surface
from ..errors import Cancelled, Error
from ..frames import couch_turn
from ..io import read_roi, read_surface
from ..io._files import plain

Command = TypeVar("Command", bound=Callable[..., Any])
FILE = click.Path(path_type=Path)
BAR_AFTER_S = 1.0


class Failure(Exception):
    """What a command says itself; exit code 2."""


def exit_code(error: BaseException) -> int:
    """The table of docs/abi.md. A file that cannot be read or written is the call's fault, memory is not."""
    if isinstance(error, Failure):
        return 2
    if isinstance(error, Error):
        if error.status < 10:
            return 2
        return 1 if error.status < 20 else 130 if error.word == "cancelled" else 3
    return 3 if isinstance(error, MemoryError) else 2


def one_line(message: str) -> str:
    return " ".join(message.split())


def common(command: Command) -> Command:
    """The options of every command."""

    @click.option(
        "--threads", type=click.IntRange(0, 256), default=0, metavar="N", help="Threads in all; default: one a core."
    )
    @click.option("--json", "as_json", is_flag=True, help="Print one JSON document on standard output.")
    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        try:
            return command(*args, **kwargs)
        except KeyboardInterrupt:  # click would print an empty line of its own
            raise Cancelled("cancelled") from None

    return wrapped  # type: ignore[return-value]


def placed(couch_words: str, roi: bool = True) -> Callable[[Command], Command]:
    """The options that say where the patient should be: the reference, the isocentre, the ROI and the couch."""

    def add(command: Command) -> Command:
        options = [
            click.option(
                "--reference",
                type=FILE,
                required=True,
                metavar="FILE",
                help="Where the patient should be, PLY, room frame.",
            ),
            click.option(
                "--isocentre",
                "isocentre_mm",
                type=float,
                nargs=3,
                required=True,
                metavar="X Y Z",
                help="Where the motion is reported, mm, room frame.",
            ),
        ]
        if roi:
            words = "The part of the reference that counts, roi.json."
            options.append(click.option("--roi", type=FILE, metavar="FILE", help=words))
        options.append(
            click.option("--couch-angle", "couch_deg", type=float, default=0.0, metavar="DEG", help=couch_words)
        )
        for option in reversed(options):
            command = option(command)
        return command

    return add


def read_placed(
    reference: Path, regions: Sequence[Path | None], couch_deg: float, isocentre_mm: tuple[float, ...]
) -> tuple[Surface, list[Roi | None]]:
    """The reference and its regions, turned with the couch about the isocentre."""
    surface = read_surface(reference)
    read = [read_roi(file) if file else None for file in regions]
    if couch_deg == 0:
        return surface, read
    turn = couch_turn(couch_deg, isocentre_mm)
    moved: list[Roi | None] = []
    for file, region in zip(regions, read, strict=True):
        with about(file):
            moved.append(region.moved(turn) if region is not None else None)
    return surface.moved(turn), moved


@contextlib.contextmanager
def progress_bar() -> Iterator[Callable[[float, str], None]]:
    """A progress bar on standard error, once the work takes over a second and a person looks."""
    tqdm.monitor_interval = 0  # its monitor would be one thread more than granted
    bar = tqdm(
        total=1.0,
        delay=BAR_AFTER_S,
        leave=False,
        disable=None,  # off where standard error is no terminal
        file=sys.stderr,
        bar_format="{desc} {percentage:3.0f} %|{bar}| {elapsed}",
    )

    def progress(fraction: float, stage: str) -> None:
        if not bar.disable:
            bar.set_description_str(stage, refresh=False)
            bar.update(fraction - bar.n)

    with bar:
        yield progress


@contextlib.contextmanager
def working(threads: int) -> Iterator[Context]:
    """A context with a progress bar."""
    with progress_bar() as progress:
        yield Context(threads=threads, progress=progress)


class Stopwatch:
    def __init__(self) -> None:
        self._start = time.perf_counter()

    def ms(self) -> float:
        return round((time.perf_counter() - self._start) * 1e3, 3)


@contextlib.contextmanager
def about(what: object) -> Iterator[None]:
    """Puts what a call was about before the library's message."""
    try:
        yield
    except Error as error:
        raise type(error)(f"{what}: {error}", result=error.result) from error


def outward_option(command: Command) -> Command:
    """Where normals turn to, for a surface that has none."""
    return click.option(
        "--viewpoint",
        "viewpoint_mm",
        type=float,
        nargs=3,
        default=(0.0, 0.0, 1e4),
        metavar="X Y Z",
        help="A surface without normals gets some, turned towards this point, mm; default: 0 0 10000, above the couch.",
    )(command)


def outward(
    surface: Surface, path: Path, viewpoint_mm: tuple[float, float, float], context: Context
) -> tuple[Surface, str]:
    """The surface with normals, and whose they are. What is outward of a file without normals is assumed, and said."""
    if surface.normals is not None:
        return surface, "the surface's"
    place = " ".join(f"{x:g}" for x in viewpoint_mm)
    print(f"sgrt: {path}: has no normals; outward is taken to be towards {place} (--viewpoint)", file=sys.stderr)
    return surface.estimate_normals(viewpoint_mm=viewpoint_mm, context=context), f"estimated, towards {place}"


def report_of(result: Calibration) -> dict[str, Any]:
    """The report, schema sgrt-calibration/1."""
    document: dict[str, Any] = json.loads(result.report)
    return document


def check_out(*paths: Path | None) -> None:
    """Says before the work, not after it, that a result has no place; None: it is not wanted."""
    for path in paths:
        if path is None:
            continue
        if not path.parent.is_dir():
            raise Failure(f"{path}: the folder {path.parent} does not exist")
        if path.is_dir():
            raise Failure(f"{path}: is a folder")
        if not os.access(path.parent, os.W_OK):
            raise Failure(f"{path}: the folder {path.parent} is not writable")


@contextlib.contextmanager
def calibrating(as_json: bool, document: Callable[[Calibration], dict[str, Any]] = report_of) -> Iterator[None]:
    """A calibration that gives no answer has a report all the same, which says why: it is printed before the error."""
    try:
        yield
    except Error as error:
        if as_json and isinstance(error.result, Calibration):
            print_json(document(error.result))
        raise


def print_json(document: dict[str, Any]) -> None:
    print(json.dumps(plain(document), allow_nan=False))
