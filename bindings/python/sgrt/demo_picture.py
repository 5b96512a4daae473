"""The picture of the demo: a camera image, the two surfaces, and their distance before and after the registration."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ._core import Icp, Surface
from .io._files import writing

Array = NDArray[np.float64]
BLUE, ORANGE = np.array([0.36, 0.55, 0.80]), np.array([0.95, 0.60, 0.28])
ROWS = (
    ("lateral", "lat_mm", "mm"),
    ("longitudinal", "lng_mm", "mm"),
    ("vertical", "vrt_mm", "mm"),
    ("pitch", "pitch_deg", "deg"),
    ("roll", "roll_deg", "deg"),
    ("rotation", "rtn_deg", "deg"),
)


@dataclass(frozen=True)
class Scene:
    """What is drawn: an image, both surfaces, the signed distances (mm, one a live point) and the six numbers."""

    image: NDArray[Any]
    reference: Surface
    live: Surface
    before_mm: Array
    after_mm: Array
    true: dict[str, float]
    result: Icp


def oblique(points: Array) -> tuple[Array, Array]:
    """Seen from above the patient's right foot: position on the page (N, 2) and height towards the eye (N,)."""
    turn, tilt = np.deg2rad(35.0), np.deg2rad(50.0)
    x = np.cos(turn) * points[:, 0] - np.sin(turn) * points[:, 1]
    y = np.sin(turn) * points[:, 0] + np.cos(turn) * points[:, 1]
    page = np.stack([x, np.sin(tilt) * y + np.cos(tilt) * points[:, 2]], axis=1)
    return page, np.sin(tilt) * points[:, 2] - np.cos(tilt) * y


def draw(scene: Scene, path: Path) -> None:
    """Writes a PNG of about 2000 x 1100 pixels, whole or not at all."""
    figure = Figure(figsize=(16, 8.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 3)
    figure.suptitle("From a pod's camera image to the patient's six-degree shift (simulated room)", fontsize=16)
    _camera(axes[0, 0], scene.image)
    _surfaces(axes[0, 1], scene)
    _table(axes[0, 2], scene)
    limit = float(np.ceil(np.nanpercentile(np.abs(scene.before_mm), 99)))
    _distance(figure, axes[1, 0], scene.live, scene.before_mm, limit, "4  Distance to the reference, as found")
    _distance(figure, axes[1, 1], scene.live, scene.after_mm, limit, "5  ... after registration, same colours")
    _distance(figure, axes[1, 2], scene.live, scene.after_mm, 0.2, "6  ... after registration, fine colours")
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=125, format="png")
    with writing(path) as stream:
        stream.write(buffer.getvalue())


def _camera(axes: Any, image: NDArray[Any]) -> None:
    axes.imshow(image, cmap="gray", interpolation="antialiased")
    axes.set_title("1  The left camera of pod 1 sees speckle")
    axes.set_axis_off()


def _surfaces(axes: Any, scene: Scene) -> None:
    light = np.array([-0.3, -0.5, 0.81])
    apart = 0.0
    for surface, tint, name in ((scene.reference, BLUE, "reference"), (scene.live, ORANGE, "patient now")):
        normals = surface.normals if surface.normals is not None else np.zeros_like(surface.points)
        shade = 0.25 + 0.75 * np.clip(normals @ light, 0, 1)
        page, height = oblique(surface.points)
        order = np.argsort(height, kind="stable")
        colours = np.clip(tint * shade[:, None] * 1.15, 0, 1)
        axes.scatter(page[order, 0] + apart, page[order, 1], s=2.0, c=colours[order], linewidths=0)
        axes.text(page[:, 0].mean() + apart - 120, page[:, 1].min() - 30, name, ha="center", va="top", fontsize=12)
        apart += 560.0
    axes.set_title("2  Reconstructed from both pods")
    axes.set_aspect("equal")
    axes.set_axis_off()


def _table(axes: Any, scene: Scene) -> None:
    measured = scene.result.displacement.as_dict()
    sigma = [*scene.result.sigma_mm, *scene.result.sigma_deg]
    cells = [
        [f"{scene.true[key]:+.3f} {unit}", f"{measured[key]:+.3f} {unit}", f"{spread:.3f}"]
        for (_, key, unit), spread in zip(ROWS, sigma, strict=True)
    ]
    table = axes.table(
        cellText=cells,
        rowLabels=[name for name, _, _ in ROWS],
        colLabels=["true", "measured", "one sigma"],
        loc="center",
        bbox=(0.16, 0.12, 0.84, 0.76),
    )
    table.auto_set_font_size(False)
    table.set_fontsize(11)
    axes.set_title("3  The shift at the isocentre")
    axes.text(0.6, 0.04, f"verdict: {scene.result.verdict_text}", ha="center", fontsize=12, transform=axes.transAxes)
    axes.set_axis_off()


def _distance(figure: Figure, axes: Any, surface: Surface, distance_mm: Array, limit: float, title: str) -> None:
    points, value = surface.points, distance_mm.ravel()
    known = np.isfinite(value)
    axes.scatter(*points[~known, :2].T, s=1.5, c="0.8", linewidths=0)
    dots = axes.scatter(
        *points[known, :2].T, s=2.5, c=value[known], cmap="RdBu_r", vmin=-limit, vmax=limit, linewidths=0
    )
    figure.colorbar(dots, ax=axes, label="mm, positive: outside the reference", shrink=0.9)
    axes.set_title(title)
    axes.set_xlabel("X, mm (room, from above)")
    axes.set_ylabel("Y, mm")
    axes.set_aspect("equal")
