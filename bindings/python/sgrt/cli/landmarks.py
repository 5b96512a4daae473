"""`sgrt landmarks`: anatomical landmarks on a surface."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from .._core import Context, LandmarkModel, Landmarks, landmarks_find
from ..errors import Error
from ..io import landmarks_document, read_landmark_model, read_surface, write_landmark_model
from ..io._files import write_json
from ._common import FILE, Failure, Stopwatch, about, check_out, common, outward, outward_option, print_json, working


def _named(name: str) -> LandmarkModel | None:
    """head, any, or a file."""
    if name == "any":
        return None
    return LandmarkModel.head() if name == "head" else read_landmark_model(name)


def _model(
    name: str, reference: Path | None, viewpoint_mm: tuple[float, float, float], context: Context
) -> LandmarkModel:
    named = _named(name)
    if reference is None:
        if named is None:
            raise Failure("--model any: needs --reference, whose most distinctive points are looked for")
        return named
    surface = read_surface(reference)
    with about(reference):
        surface, _ = outward(surface, reference, viewpoint_mm, context)
        return LandmarkModel.learn(surface, named, context=context)


def _print(found: Landmarks) -> None:
    print(f"{'':18}{'x':>10}{'y':>10}{'z':>10}{'sigma':>12}{'score':>8}   mm; sigma: of the distance")
    for name, place, covariance, score in zip(
        found.names, found.positions_mm, found.covariance_mm2, found.scores, strict=True
    ):
        if np.isfinite(place[0]):
            x, y, z = place
            print(f"{name:18}{x:10.2f}{y:10.2f}{z:10.2f}{np.sqrt(np.trace(covariance)):12.2f}{score:8.2f}")
        else:
            print(f"{name:18}  not in view")
    print(f"score {found.score:.2f} (next best {found.runner_up_score:.2f}), size {found.size:.2f} of the model's")


@click.command("landmarks", epilog="Example: sgrt landmarks surface.ply --json")
@click.argument("surface_file", type=FILE, metavar="SURFACE.ply")
@click.option(
    "--model",
    "model_name",
    default="head",
    show_default=True,
    metavar="head|any|FILE",
    help="What is looked for: landmarks of any head; any: the most distinctive points of --reference; a model's file.",
)
@click.option(
    "--reference",
    type=FILE,
    metavar="FILE",
    help="The patient's own reference, PLY: the model is found on it first, then its skin on the surface: far surer.",
)
@click.option("--save-model", type=FILE, metavar="FILE", help="Write the model that was used.")
@click.option("--out", type=FILE, metavar="FILE", help="Write the landmarks, landmarks.json.")
@outward_option
@common
def command(
    surface_file: Path,
    model_name: str,
    reference: Path | None,
    save_model: Path | None,
    out: Path | None,
    viewpoint_mm: tuple[float, float, float],
    threads: int,
    as_json: bool,
) -> int:
    """Finds landmarks by the curvature of the skin: position, covariance and score of each, in any pose of the body.

    A surface that does not show what is looked for gives not_found.
    """
    watch = Stopwatch()
    check_out(save_model, out)
    surface = read_surface(surface_file)
    try:
        with working(threads) as context:
            model = _model(model_name, reference, viewpoint_mm, context)
            with about(surface_file):
                surface, normals = outward(surface, surface_file, viewpoint_mm, context)
                found = landmarks_find(surface, model, context=context)
    except Error as error:
        if as_json and 10 <= error.status < 20:
            result = error.result if isinstance(error.result, Landmarks) else None
            document = landmarks_document(None, status=error.word, timing_ms=watch.ms())
            if result is not None:
                document |= {"score": result.score, "candidates": result.candidate_count}
            print_json(document)
        raise
    if save_model is not None:
        write_landmark_model(save_model, model)
    document = landmarks_document(found, model=model.id, normals=normals)
    if out is not None:
        write_json(out, document)
    if as_json:
        print_json(document | {"timing_ms": watch.ms()})
    else:
        _print(found)
    return 0
