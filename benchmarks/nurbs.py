"""Evaluation of a bicubic B-spline surface of 40 x 40 control points. Truth: Cox-de Boor in NumPy's long double."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import sgrt
from harness import Arrays, Peer, alternate, row, timed

SIDE = 40
ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # S, S_u, S_v, S_uu, S_uv, S_vv


def basis(knots: np.ndarray, degree: int, u: np.ndarray, order: int = 0) -> np.ndarray:
    """Values at u (N) of the functions' derivatives, N x count, by eq. 10.5 and 10.6; the last span is closed."""
    knots, u = knots.astype(np.longdouble), u.astype(np.longdouble)
    last = knots[knots < knots[-1]].max()
    values = ((knots[:-1] <= u[:, None]) & (u[:, None] < knots[1:])).astype(np.longdouble)
    values[u == knots[-1]] = (knots[:-1] == last) & (knots[1:] > last)
    for p in range(1, degree + 1):
        width = knots[p:-1] - knots[: -p - 1], knots[p + 1 :] - knots[1:-p]
        left, right = (np.divide(1, w, out=np.zeros_like(w), where=w > 0) for w in width)
        if p > degree - order:
            values = p * (values[:, :-1] * left - values[:, 1:] * right)
        else:
            values = (u[:, None] - knots[: -p - 1]) * left * values[:, :-1] + (
                knots[p + 1 :] - u[:, None]
            ) * right * values[:, 1:]
    return values


def scene() -> Arrays:
    """A wavy skin of 400 x 400 mm."""
    rng = np.random.default_rng(40)
    x, y = np.meshgrid(np.linspace(-200, 200, SIDE), np.linspace(-200, 200, SIDE), indexing="ij")
    z = 40 * np.cos(x / 90) * np.cos(y / 120) + rng.normal(0, 1, x.shape)
    knots = np.concatenate([np.zeros(3), np.linspace(0, 1, SIDE - 2), np.ones(3)])
    return {"points": np.stack([x, y, z], -1), "knots": knots}


def truth(inputs: Arrays, order: tuple[int, int], grid: bool) -> np.ndarray:
    bu, bv = (basis(inputs["knots"], 3, inputs[name], k) for name, k in zip("uv", order, strict=True))
    points = inputs["points"].astype(np.longdouble)
    if grid:
        return np.tensordot(bu, np.tensordot(bv, points, (1, 1)), (1, 1))
    return np.stack([np.sum(bu @ points[:, :, c] * bv, axis=1) for c in range(3)], axis=-1)


def error(inputs: Arrays, got: np.ndarray, orders: int, grid: bool) -> float:
    """The largest error of any number against its order's largest value."""
    worst = 0.0
    for k, order in enumerate(ORDERS[:orders]):
        exact = truth(inputs, order, grid)
        mine = got if orders == 1 else got[..., k, :]
        worst = max(worst, float(abs(mine - exact).max() / abs(exact).max()))
    return worst


def works(surface: sgrt.NurbsSurface, context: sgrt.Context) -> Iterator[tuple]:
    """(work, peer, inputs, call, number of orders, grid)."""
    rng = np.random.default_rng(41)

    def grid(side: int, order: int) -> tuple[Arrays, object]:
        at = np.linspace(0, 1, side)
        shape = (side, side, 3) if order == 0 else (side, side, 6, 3)
        out = np.empty(shape)
        return {"u": at, "v": at}, lambda _: {"points": surface.grid_at(at, at, order, out=out, context=context)}

    def scattered(count: int, order: int) -> tuple[Arrays, object]:
        u, v = rng.uniform(0, 1, (2, count))
        out = np.empty((count, (order + 1) * (order + 2) // 2, 3))

        def call(_: int) -> Arrays:
            surface.derivatives(u, v, order, out=out, context=context)
            return {"points": out[:, 0] if order == 0 else out}

        return {"u": u, "v": v}, call

    yield "grid 500 x 500", "splipy", *grid(500, 0), 1, True
    yield "grid 500 x 500, to 2nd derivatives", "splipy derivatives", *grid(500, 2), 6, True
    yield "grid 200 x 200", "geomdl", *grid(200, 0), 1, True
    yield "scattered 100000", "scipy RectBivariateSpline.ev", *scattered(100_000, 0), 1, False
    yield "scattered 2000, to 2nd derivatives", "geomdl derivatives", *scattered(2000, 2), 6, False
    yield (
        "scattered 100000, to 2nd derivatives",
        "scipy RectBivariateSpline.ev to 2nd",
        *scattered(100_000, 2),
        6,
        False,
    )


def rows(folder: Path, repeats: int, threads: int) -> Iterator[dict]:
    shape = scene()
    surface = sgrt.NurbsSurface(shape["points"], (3, 3), knots=(shape["knots"], shape["knots"]))
    for work, name, parameters, call, orders, grid in works(surface, sgrt.Context(threads=threads)):
        inputs = shape | parameters
        path = folder / "nurbs.npz"
        np.savez(path, **inputs)
        with Peer(name, path, threads) as peer:
            ours_ms, peer_ms, a, b = alternate(timed(call), peer, repeats)
        ours, theirs = (error(inputs, side[-1]["points"], orders, grid) for side in (a, b))
        yield row(f"NURBS 40 x 40 {work}", ours_ms, name, peer_ms, ours, theirs, "relative", threads)
