"""The main job end to end in a simulated room: images of two pods -> surfaces -> six shifts, beside the truth.

Ten random displacements of a torso phantom are captured and measured twice: with the rig as it is, and with a rig that
carries a drawn calibration error, as a real one does. Needs the extras `twin` and `plot`.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from . import twin
from ._core import Context, Icp, Rig, StereoSession, Surface, icp_align, surface_distance, surface_fuse
from .demo_picture import Scene, draw
from .errors import Error
from .io import registration_document, write_image, write_registration, write_rig, write_surface
from .io._files import plain, writing

SEED = 1
TRIALS = 10
MAX_MM, MAX_DEG = 15.0, 3.0
CALIBRATION_PX = 0.1
ISOCENTRE_MM = (0.0, 0.0, 0.0)
PODS = ("pod1", "pod2")
RIGS = ("exact", "perturbed")
KEYS = ("lat_mm", "lng_mm", "vrt_mm", "pitch_deg", "roll_deg", "rtn_deg")

Images = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Capture:
    """What one pod saw of one placement: its images and, by rig, the surface."""

    images: Images
    surfaces: dict[str, Surface | None]


class Pod:
    """One pod of the room, simulated and reconstructed in a process of its own."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.room = twin.Room(SEED)
        self.phantom = twin.torso()
        self.sessions = {
            kind: StereoSession(Rig(text), name, volume_min_mm=[-400, -500, -300], volume_max_mm=[400, 500, 300])
            for kind, text in rigs(self.room).items()
        }

    def capture(self, index: int) -> Capture:
        left, right = self.room.pairs[self.name]
        images = self.room.capture(self.phantom, placement(index)[0], seed=index, cameras=[left, right])
        surfaces: dict[str, Surface | None] = {}
        for kind, session in self.sessions.items():
            try:
                surfaces[kind] = session.push(images[left], images[right], time_s=float(index)).surface
            except Error:
                surfaces[kind] = None  # the pod has no answer; the other one may
        return Capture(images, surfaces)


def rigs(room: twin.Room) -> dict[str, str]:
    return {"exact": room.rig_json(), "perturbed": room.perturbed_rig_json(SEED, CALIBRATION_PX)}


def placement(index: int) -> tuple[NDArray[np.float64], dict[str, float]]:
    """Where the body is: index 0 is the reference, the others are displaced."""
    if index == 0:
        return np.eye(4), dict.fromkeys((*KEYS, "mag_mm"), 0.0)
    return twin.random_displacement(1000 * SEED + index, MAX_MM, MAX_DEG)


_pods: dict[str, Pod] = {}


def _capture(name: str, index: int) -> Capture:
    if name not in _pods:
        _pods[name] = Pod(name)
    return _pods[name].capture(index)


def captures(threads: int) -> Iterator[dict[str, Capture]]:
    """The placements in order, each with both pods; a process a pod where two threads are granted."""
    if threads == 1:
        for index in range(TRIALS + 1):
            yield {pod: _capture(pod, index) for pod in PODS}
        return
    context = multiprocessing.get_context("spawn")
    pools = {pod: ProcessPoolExecutor(1, mp_context=context) for pod in PODS}
    try:
        futures = {pod: [pool.submit(_capture, pod, i) for i in range(TRIALS + 1)] for pod, pool in pools.items()}
        for index in range(TRIALS + 1):
            yield {pod: futures[pod][index].result() for pod in PODS}
    finally:
        for pool in pools.values():
            pool.shutdown(wait=True, cancel_futures=True)


def fused(pods: dict[str, Capture], kind: str, context: Context) -> Surface | None:
    seen = [surface for capture in pods.values() if (surface := capture.surfaces[kind]) is not None]
    return surface_fuse(seen, context=context)[0] if seen else None


def measure(reference: Surface | None, live: Surface | None, context: Context) -> Icp | None:
    """The registration; None where there is no answer."""
    if reference is None or live is None:
        return None
    try:
        return icp_align(reference, live, isocentre_mm=ISOCENTRE_MM, context=context)
    except Error:
        return None


def errors_of(true: dict[str, float], result: Icp | None) -> tuple[float, float]:
    """The largest error of a shift, mm, and of a turn, deg; NaN without an answer."""
    if result is None:
        return float("nan"), float("nan")
    off = [abs(result.displacement.as_dict()[key] - true[key]) for key in KEYS]
    return max(off[:3]), max(off[3:])


def run(*, out: Path, threads: int = 0, as_json: bool = False) -> int:
    """Simulates, measures, prints a table; writes the picture, the JSON and the files of the first trial into `out`."""
    out.mkdir(parents=True, exist_ok=True)
    if not os.access(out, os.W_OK):
        raise PermissionError(13, "Permission denied", str(out))
    threads = threads or os.cpu_count() or 1
    context = Context(threads=1)  # the other core simulates
    trials: list[dict[str, Any]] = []
    references: dict[str, Surface | None] = {}
    scene: Scene | None = None
    if not as_json:
        print(f"{'trial':5} {'':8}" + "".join(f"{key:>11}" for key in KEYS) + f"{'worst error':>18}")
    with tqdm(total=TRIALS + 1, delay=1.0, leave=False, disable=None, file=sys.stderr, desc="capturing") as bar:
        for index, pods in enumerate(captures(threads)):
            surfaces = {kind: fused(pods, kind, context) for kind in RIGS}
            bar.update()
            if index == 0:
                references = surfaces
                save_images(out, "reference", pods)
                continue
            true = placement(index)[1]
            results = {kind: measure(references[kind], surfaces[kind], context) for kind in RIGS}
            trials.append(trial_document(true, results))
            if not as_json:
                with tqdm.external_write_mode(file=sys.stdout):
                    print_trial(index, true, results)
            if index == 1:
                save_images(out, "live", pods)
                scene = first_scene(out, pods, true, references["exact"], surfaces["exact"], results["exact"], context)
    document = {
        "schema": "sgrt-demo/1",
        "seed": SEED,
        "worst": {kind: worst(trials, kind) for kind in RIGS},
        "trials": trials,
    }
    write_rig(out / "rig.json", Rig(rigs(twin.Room(SEED))["exact"]))
    with writing(out / "demo.json") as stream:
        stream.write(json.dumps(plain(document), indent=1, allow_nan=False).encode())
    if scene:
        draw(scene, out / "demo.png")
    if as_json:
        print(json.dumps(plain(document), allow_nan=False))
    else:
        print_worst(document, out)
    return 0 if all(trial[kind] is not None for trial in trials for kind in RIGS) else 1


def trial_document(true: dict[str, float], results: dict[str, Icp | None]) -> dict[str, Any]:
    document: dict[str, Any] = {"true": true}
    for kind, result in results.items():
        mm, deg = errors_of(true, result)
        document[kind] = result and {**registration_document(result), "error_mm": mm, "error_deg": deg}
    return document


def worst(trials: list[dict[str, Any]], kind: str) -> dict[str, float]:
    """The largest error of all trials; NaN when one had no answer."""
    if any(trial[kind] is None for trial in trials):
        return {"error_mm": float("nan"), "error_deg": float("nan")}
    return {key: max(trial[kind][key] for trial in trials) for key in ("error_mm", "error_deg")}


def save_images(out: Path, name: str, pods: dict[str, Capture]) -> None:
    for capture in pods.values():
        for camera, image in capture.images.items():
            write_image(out / f"{name}-{camera}.png", image)


def first_scene(
    out: Path,
    pods: dict[str, Capture],
    true: dict[str, float],
    reference: Surface | None,
    live: Surface | None,
    result: Icp | None,
    context: Context,
) -> Scene | None:
    """Writes the surfaces and the registration of the first trial; what the picture shows."""
    if reference is None or live is None or result is None:
        return None
    write_surface(out / "reference.ply", reference)
    write_surface(out / "live.ply", live)
    write_registration(out / "registration.json", result)
    before = surface_distance(reference, live, context=context)
    after = result.distance_mm
    image = next(iter(pods["pod1"].images.values()))
    return Scene(image, reference, live, before, after, true, result) if after is not None else None


def print_trial(index: int, true: dict[str, float], results: dict[str, Icp | None]) -> None:
    print(f"{index:5} {'true':8}" + "".join(f"{true[key]:+11.3f}" for key in KEYS))
    for kind, result in results.items():
        if result is None:
            print(f"{'':5} {kind:8} no answer")
            continue
        mm, deg = errors_of(true, result)
        measured = result.displacement.as_dict()
        print(
            f"{'':5} {'measured' if kind == 'exact' else 'perturb.':8}"
            + "".join(f"{measured[key]:+11.3f}" for key in KEYS)
            + f"{mm:8.3f} mm {deg:.3f} deg"
        )


def print_worst(document: dict[str, Any], out: Path) -> None:
    exact, perturbed = (document["worst"][kind] for kind in RIGS)
    print(
        f"\nWorst of {TRIALS} displacements up to {MAX_MM:g} mm and {MAX_DEG:g} deg, two pods, default noise:\n"
        f"  exact rig                     {exact['error_mm']:.3f} mm  {exact['error_deg']:.3f} deg\n"
        f"  rig perturbed by {CALIBRATION_PX:g} px       {perturbed['error_mm']:.3f} mm "
        f" {perturbed['error_deg']:.3f} deg\n"
        f"Picture: {out / 'demo.png'}   figures: {out / 'demo.json'}\n"
        f"Try: sgrt register --reference {out / 'reference.ply'} --live {out / 'live.ply'} --isocentre 0 0 0"
    )
