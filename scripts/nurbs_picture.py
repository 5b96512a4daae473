#!/usr/bin/env python3
"""Draws docs/images/nurbs.png: figures 10.4, 10.5 and 10.6 of the chapter with libsgrt (needs matplotlib).

.venv/bin/python scripts/nurbs_picture.py
"""

from pathlib import Path

import numpy as np
import sgrt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

OUT = Path(__file__).parents[1] / "docs/images/nurbs.png"
KNOTS = {  # those of fig. 10.4
    1: [0, 0, 0.25, 0.5, 0.75, 1, 1],
    2: [0, 0, 0, 0.33, 0.67, 1, 1, 1],
    3: [0, 0, 0, 0, 0.5, 1, 1, 1, 1],
}
COLOURS = ("#2b6cb0", "#dd6b20", "#2f855a", "#805ad5", "#c53030")
DEGREE = {1: "linear", 2: "quadratic", 3: "cubic"}


def basis_functions(degree, u):
    """N_0 ... N_4 at u: each is the curve whose control point i alone lies at 1."""
    heights = []
    for i in range(5):
        points = np.zeros((5, 3))
        points[i, 2] = 1
        heights.append(sgrt.NurbsCurve(points, degree, knots=np.array(KNOTS[degree], float)).evaluate(u)[:, 2])
    return heights


def nose(x, y):
    """A cheek with a nose: a ridge that rises to a tip of 8 mm radius, and its two wings."""
    ridge = 16 * np.exp(-((x / 9) ** 2)) * np.exp(-(((y - 14) / 24) ** 2))
    tip = 12 * np.exp(-(x**2 + (y + 4) ** 2) / 100)
    wings = sum(7 * np.exp(-((x - side) ** 2 + (y + 6) ** 2) / 30) for side in (-13, 13))
    return ridge + tip + wings - 0.008 * x**2


def draw_basis(axes):
    u = np.linspace(0, 1, 401)
    for axis, degree in zip(axes, KNOTS, strict=True):
        for i, (height, colour) in enumerate(zip(basis_functions(degree, u), COLOURS, strict=True)):
            axis.plot(u, height, color=colour, label=f"$N_{{{i},{degree}}}$")
        axis.vlines(KNOTS[degree], -0.04, 0, color="black", lw=2)
        axis.set(title=f"10.4: {DEGREE[degree]}, degree {degree}", xlabel="u", ylim=(-0.05, 1.25))
        axis.legend(fontsize=8, ncol=5, loc="upper center", handlelength=0.8, columnspacing=0.8)


def draw_curves(axis):
    points = np.array([[0, 0, 0], [2, 4, 0], [5, 4.5, 0], [6, 0.5, 0], [9, 2, 0]], float)
    u = np.linspace(0, 1, 400)
    axis.plot(*points.T[:2], "o", color="black", label="control points")
    for degree, colour in zip(KNOTS, COLOURS, strict=False):
        curve = sgrt.NurbsCurve(points, degree, knots=np.array(KNOTS[degree], float))
        axis.plot(*curve.evaluate(u).T[:2], color=colour, label=f"$c_{degree}$, {DEGREE[degree]}")
    axis.set(title="10.5: the degree makes it smooth", xlabel="x, mm", ylabel="y, mm", ylim=(-0.5, 7.5))
    axis.legend(fontsize=8)


def draw_nose(axes):
    pitch = 3.6
    x, y = np.arange(-30, 30.1, pitch), np.arange(-30, 36.1, pitch)
    z = nose(x[None, :], y[:, None]) + np.random.default_rng(1).normal(0, 0.3, (y.size, x.size))
    image = sgrt.Surface.from_height_field(z, origin_mm=(x[0], y[0]), spacing_mm=(pitch, pitch))
    shape = sgrt.NurbsSurface.chapter(image, (3, 3))
    dense = shape.grid(121, 121)
    fine = np.linspace(-30, 30, 121)[None, :], np.linspace(-30, 36, 121)[:, None]
    titles = ("10.6 a: the nose", f"10.6 b: control points, {pitch} mm apart, 0.3 mm noise", "10.6 c: degree 3")
    for axis, title in zip(axes, titles, strict=True):
        axis.set_title(title)
        axis.view_init(55, -70)
        axis.set(box_aspect=(60, 66, 32))
        axis.set_axis_off()
    axes[0].plot_surface(*np.broadcast_arrays(*fine), nose(*fine), color="#d8b49c", lw=0)
    axes[1].scatter(*image.points.reshape(-1, 3).T, s=4, color="black")
    axes[2].plot_surface(*np.moveaxis(dense, (0, 1, 2), (2, 1, 0)), color="#d8b49c", lw=0)


def main():
    figure = Figure(figsize=(15, 8.4), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 12)
    draw_basis([figure.add_subplot(grid[0, 3 * i : 3 * i + 3]) for i in range(3)])
    draw_curves(figure.add_subplot(grid[0, 9:]))
    draw_nose([figure.add_subplot(grid[1, 4 * i : 4 * i + 4], projection="3d") for i in range(3)])
    figure.savefig(OUT, dpi=110)


if __name__ == "__main__":
    main()
