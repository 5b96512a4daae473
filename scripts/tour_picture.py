#!/usr/bin/env python3
"""Draws the pictures of docs/tour.md from the files that its commands leave in FOLDER (needs matplotlib).

.venv/bin/python scripts/tour_picture.py FOLDER
"""

import sys
from pathlib import Path

import numpy as np
import sgrt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

OUT = Path(__file__).parents[1] / "docs/images"


def page(width, height, rows, columns, **options):
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, **options)


def save(figure, name):
    figure.savefig(OUT / name, dpi=90)
    print(OUT / name)


def images(folder):
    figure, axes = page(11, 4.2, 1, 3, width_ratios=[1.25, 1.25, 1])
    left, right = (sgrt.io.read_image(folder / f"plan-pod1-{side}.png") for side in ("left", "right"))
    for axis, image, side in zip(axes, (left, right), ("left", "right"), strict=False):
        axis.imshow(np.minimum(image, np.percentile(image, 99.5)), cmap="gray")
        axis.set_title(f"pod 1, {side} camera")
    axes[2].imshow(left[450:530, 600:680], cmap="gray")
    axes[2].set_title("80 x 80 px of the left one")
    for axis in axes:
        axis.set_axis_off()
    save(figure, "tour-images.png")


def above(figure, axis, points, values, label, limits, colours):
    dots = axis.scatter(points[:, 0], points[:, 1], c=values, s=2, cmap=colours, vmin=limits[0], vmax=limits[1])
    figure.colorbar(dots, ax=axis, shrink=0.75, label=label)
    axis.set(aspect="equal", xlabel="X, mm (room, from above)", ylabel="Y, mm")


def surface(folder):
    figure, axes = page(10, 5.4, 1, 2)
    plan = sgrt.io.read_surface(folder / "plan.ply")
    shade = np.clip(plan.normals @ np.array([-0.35, -0.45, 0.82]), 0, 1)
    axes[0].scatter(plan.points[:, 0], plan.points[:, 1], c=0.25 + 0.75 * shade, s=2, cmap="gray", vmin=0, vmax=1.05)
    axes[0].set(aspect="equal", xlabel="X, mm (room, from above)", ylabel="Y, mm", title=f"{len(plan.points)} points")
    above(figure, axes[1], plan.points, plan.sigma_mm, "mm", (0, 0.1), "viridis")
    axes[1].set_title("one sigma along the normal")
    save(figure, "tour-surface.png")


def distance(folder):
    figure, axes = page(10, 5.4, 1, 2)
    plan, now = (sgrt.io.read_surface(folder / f"{name}.ply") for name in ("plan", "now"))
    result = sgrt.icp_align(plan, now, isocentre_mm=(0, 0, 0))
    above(figure, axes[0], now.points, sgrt.surface_distance(plan, now), "mm, outside positive", (-10, 10), "RdBu_r")
    above(figure, axes[1], now.points, result.distance_mm, "mm, outside positive", (-0.2, 0.2), "RdBu_r")
    axes[0].set_title("as found")
    axes[1].set_title("after the registration (another scale)")
    save(figure, "tour-distance.png")


if __name__ == "__main__":
    for draw in (images, surface, distance):
        draw(Path(sys.argv[1]))
