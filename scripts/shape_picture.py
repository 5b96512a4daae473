#!/usr/bin/env python3
"""Draws docs/images/shape.png: mean curvature and landmarks of a simulated head (needs matplotlib).

.venv/bin/python scripts/shape_picture.py
"""

from pathlib import Path

import numpy as np
import sgrt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from sgrt.twin import bodies

OUT = Path(__file__).parents[1] / "docs/images/shape.png"
NOISE_MM, TURN = 0.4, np.deg2rad(25)


def seen_head():
    """What a camera above sees of a turned head, with noise; the patient's reference."""
    body = bodies.head()
    points, _ = body.mesh(1.5)
    points = points[(points[:, 2] > 0) & (points[:, 1] > -125)]
    normals = body.normal(points)
    c, s = np.cos(TURN), np.sin(TURN)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    live, facing = points @ turn.T, normals @ turn.T
    shown = facing[:, 2] > 0.2
    noise = NOISE_MM * np.random.default_rng(0).normal(size=(shown.sum(), 1))
    return sgrt.Surface(live[shown] + noise * facing[shown], normals=facing[shown]), sgrt.Surface(
        points, normals=normals
    )


def main():
    live, reference = seen_head()
    curvature = sgrt.surface_curvature(live)
    own = sgrt.LandmarkModel.learn(reference, sgrt.LandmarkModel.head())
    found = sgrt.landmarks_find(live, own)
    figure = Figure(figsize=(11, 6), layout="constrained")
    left, right = figure.subplots(1, 2)
    x, y = live.points[:, 0], live.points[:, 1]
    known = curvature.reason == 0
    dots = left.scatter(x[known], y[known], c=curvature.mean[known], s=2, cmap="RdBu_r", vmin=-0.12, vmax=0.12)
    figure.colorbar(dots, ax=left, shrink=0.7, label="mean curvature H, 1/mm (convex positive)")
    left.set_title(f"curvature of a noisy head ({NOISE_MM} mm)")
    right.scatter(x, y, c=live.normals[:, 2], s=2, cmap="gray", vmin=0, vmax=1.2)
    for name, place in zip(found.names, found.positions_mm, strict=True):
        if not np.isfinite(place[0]):
            continue
        right.plot(*place[:2], "o", color="#c53030", ms=5)
        side = -1 if name.endswith("_right") else 1
        right.annotate(
            name,
            place[:2],
            xytext=(5 * side, 0),
            textcoords="offset points",
            ha="right" if side < 0 else "left",
            va="center",
            fontsize=7,
            color="#9b2c2c",
            bbox={"boxstyle": "square,pad=0.1", "color": "white", "alpha": 0.7},
        )
    right.set_title(f"its landmarks, by its own reference (score {found.score:.2f})")
    for axis in (left, right):
        axis.set(aspect="equal", xlabel="x, mm", ylabel="y, mm", xlim=(-90, 105), ylim=(-120, 110))
    FigureCanvasAgg(figure)
    figure.savefig(OUT, dpi=90)
    print(OUT)


if __name__ == "__main__":
    main()
