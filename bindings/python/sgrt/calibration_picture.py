"""The page of a calibration: residuals, coverage and projection uncertainty of each camera, and the rig from above."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ._core import Calibration
from .boards import Boards
from .io._files import writing

Array = NDArray[np.float64]
MOST_CAMERAS = 6  # a page shows; the report has all


def draw(path: Path, boards: Boards, result: Calibration, report: dict[str, Any]) -> None:
    """Writes a PNG, whole or not at all. report: the document of the result."""
    shown = report["cameras"][:MOST_CAMERAS]
    figure = Figure(figsize=(16, 4.2 * (len(shown) + 1)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(shown) + 1, 3, squeeze=False)
    rms = report["rms_px"]
    figure.suptitle(f"Calibration: {len(report['cameras'])} cameras, RMS {rms:.3f} px a corner", fontsize=16)
    corners = result.corners if result.corners is not None else np.zeros((0, 8))
    ids = [name for name, _ in boards.cameras]
    for row, camera in zip(axes, shown, strict=False):
        number = ids.index(camera["id"])
        own = corners[corners[:, 0] == number]
        size = boards.cameras[number][1]
        _residuals(row[0], camera, own, size)
        _histogram(row[1], camera, own)
        _uncertainty(figure, row[2], camera, size)
    _warnings(axes[-1, 0], report)
    _rig(axes[-1, 1], result)
    _images(axes[-1, 2], report, corners, boards)
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=90, format="png")
    with writing(path) as stream:
        stream.write(buffer.getvalue())


def _frame(axes: Any, size: tuple[int, int]) -> None:
    axes.set_xlim(-0.5, size[0] - 0.5)
    axes.set_ylim(size[1] - 0.5, -0.5)
    axes.set_aspect("equal")


def _residuals(axes: Any, camera: dict[str, Any], own: Array, size: tuple[int, int]) -> None:
    good = own[own[:, 7] > 0]
    scale = 0.03 * size[0] / max(camera["rms_px"] or 1.0, 1e-6)
    axes.quiver(*good[:, 3:5].T, *(scale * good[:, 5:7]).T, angles="xy", scale_units="xy", scale=1, width=0.0015)
    axes.plot(*own[own[:, 7] == 0][:, 3:5].T, "rx", label="not used")
    _frame(axes, size)
    axes.set_title(f"{camera['id']}: residuals x {scale:.0f}, RMS {camera['rms_px']:.3f} px")


def _histogram(axes: Any, camera: dict[str, Any], own: Array) -> None:
    good = own[own[:, 7] > 0]
    limit = 5 * max(camera["rms_px"] or 1.0, 1e-6) / np.sqrt(2)
    bins = np.linspace(-limit, limit, 41)
    axes.hist(good[:, 5], bins, histtype="step", label="x")
    axes.hist(good[:, 6], bins, histtype="step", label="y")
    axes.set_xlabel("residual, px")
    axes.legend()
    axes.set_title(f"{camera['images']} images, {camera['corners']} corners")


def _uncertainty(figure: Figure, axes: Any, camera: dict[str, Any], size: tuple[int, int]) -> None:
    if "projection_map" not in camera:
        axes.set_axis_off()
        return
    chart = camera["projection_map"]
    sigma = np.array([[np.nan if v is None else v for v in row] for row in chart["sigma_px"][1]])
    filled = axes.contourf(chart["columns_px"], chart["rows_px"], np.log10(np.maximum(sigma, 1e-6)), 16, cmap="viridis")
    bar = figure.colorbar(filled, ax=axes, shrink=0.9)
    bar.set_label("log10 of one sigma, px")
    down, across = len(camera["coverage_cells"]), len(camera["coverage_cells"][0])
    for i, line in enumerate(camera["coverage_cells"]):
        for j, covered in enumerate(line):
            if not covered:
                axes.plot((j + 0.5) * size[0] / across, (i + 0.5) * size[1] / down, "wx")
    _frame(axes, size)
    axes.set_title(f"projection uncertainty at {chart['distance_mm'][1]:.0f} mm; x: no corner here")


def _warnings(axes: Any, report: dict[str, Any]) -> None:
    axes.set_axis_off()
    lines = report["warnings"] or ["no warnings"]
    wrapped = []
    for line in lines[:14]:
        words, current = line.split(), ""
        for word in words:
            if len(current) + len(word) > 62:
                wrapped.append(current)
                current = "   "
            current += word + " "
        wrapped.append(current)
    axes.text(0, 1, "\n".join(wrapped), va="top", fontsize=8, transform=axes.transAxes)
    axes.set_title("Warnings")


def _rig(axes: Any, result: Calibration) -> None:
    if result.rig is None:
        axes.set_axis_off()
        return
    for camera in result.rig.cameras:
        pose = camera.camera_from_room
        centre = -pose[:3, :3].T @ pose[:3, 3]
        ahead = pose[2, :3]
        reach = 200.0
        axes.plot([centre[0], centre[0] + reach * ahead[0]], [centre[2], centre[2] + reach * ahead[2]], "-", lw=1)
        axes.plot(centre[0], centre[2], "o")
        axes.annotate(camera.id, (centre[0], centre[2]), fontsize=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("X, mm")
    axes.set_ylabel("Z, mm")
    axes.set_title(f"Rig, room: {result.rig.room}")


def _images(axes: Any, report: dict[str, Any], corners: Array, boards: Boards) -> None:
    for number, camera in enumerate(report["cameras"]):
        own = corners[(corners[:, 0] == number) & (corners[:, 7] > 0)]
        rms = [
            (p, float(np.sqrt(np.mean(np.sum(own[own[:, 1] == p][:, 5:7] ** 2, axis=1))))) for p in np.unique(own[:, 1])
        ]
        if rms:
            axes.plot(*zip(*rms, strict=True), ".-", lw=0.7, label=camera["id"])
    axes.set_xlabel("image, in the order of the names")
    axes.set_ylabel("RMS, px")
    axes.set_ylim(bottom=0)
    axes.legend(fontsize=8)
    axes.set_title(f"{len(boards.placements)} placements, {len(boards.missing)} images without a board")
