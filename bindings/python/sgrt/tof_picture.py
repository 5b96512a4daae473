"""The range picture of a time-of-flight camera in colour, as the chapter's fig. 10.2b: near is red, far is black."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from ._core import Tof
from .io._files import writing

NEAR_TO_FAR = ["#e00000", "#ff8c00", "#ffe600", "#30c030", "#20c0e0", "#2040d0", "#000000"]
ABSENT = "#d8d8d8"


def draw(path: Path, result: Tof) -> None:
    """Writes a PNG: amplitude, range in colour and sigma; absent pixels are light grey."""
    assert result.range_mm is not None and result.amplitude is not None
    assert result.sigma_mm is not None and result.flags is not None
    absent = (result.flags & 63) != 0
    figure = Figure(figsize=(15, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, 3)
    near = LinearSegmentedColormap.from_list("near to far", NEAR_TO_FAR).with_extremes(bad=ABSENT)
    planes = (
        ("amplitude, counts", result.amplitude[0], "gray", np.zeros_like(absent)),
        ("range along the ray, mm", result.range_mm, near, absent),
        ("one sigma of the range, mm", result.sigma_mm, "viridis", absent),
    )
    for ax, (title, plane, colours, hidden) in zip(axes, planes, strict=True):
        shown = np.ma.masked_where(hidden | ~np.isfinite(plane), plane)
        low, high = np.percentile(shown.compressed(), (1, 99)) if shown.count() else (0.0, 1.0)
        image = ax.imshow(shown, cmap=colours, vmin=low, vmax=high)
        ax.set_title(title)
        ax.set_xticks([])
        ax.set_yticks([])
        figure.colorbar(image, ax=ax, shrink=0.9)
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=100, format="png", metadata={"Software": None})
    with writing(path) as stream:
        stream.write(buffer.getvalue())
