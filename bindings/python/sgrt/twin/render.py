"""One camera's expected image: which skin point each pixel sees and how much light it returns.

    e = g E [ V max(0, cos t) (r0 / r)^2 a P(projector(X)) + L a (0.6 + 0.4 n_z) ],  then the lens' blur

Exact geometry (ray, Newton, shadow ray) is computed for every fourth pixel of every fourth row; between
them 1/Z and the two light terms are interpolated by cubics wherever the fourth differences say that the
depth is good to 5 um, and every other pixel (silhouettes, edges of shadows, folds) gets its own ray.
Theory: docs/theory/twin.md.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from .camera import Camera, into_frame, ray_table, spread, turned_back
from .checks import Array
from .pattern import Projector
from .phantom import Phantom
from .raycast import XYZ, first_hit, sees
from .sensor import Sensor

PITCH = 4
DEPTH_TOLERANCE_MM = 5e-3  # moves a speckle by less than 4e-4 px
RENDER_DONE_MM = 1e-4
MARGIN_PX = 6
WIDEST = 0.6  # tangent of the field angle, far outside the image, up to which the lens formula is used
AMBIENT = 0.05  # of the projector's brightest light at the reference distance
BACKGROUND = 0.006  # share of the full well that an empty pixel collects
REFERENCE_ALBEDO = 0.6
REFERENCE_LIFT_MM = 100.0  # exposure is set for skin this far above the isocentre


@dataclass(frozen=True)
class View:
    """What a render needs besides the phantom: one camera, its pod's projector and the sensor."""

    camera: Camera
    projector: Projector
    sensor: Sensor


def expected_electrons(view: View, phantom: Phantom, room_from_body: Array) -> np.ndarray:
    """Noise-free electrons, (height, width) float32, blurred by the lens, not yet cut at the full well."""
    camera, sensor = view.camera, view.sensor
    width, height = camera.image_size
    image = np.full((height, width), BACKGROUND * sensor.full_well_e * camera.gain, np.float32)
    region = bounding_region(camera, phantom, room_from_body)
    if region is not None:
        top, bottom, left, right = region
        part = image[top:bottom, left:right]
        _render_region(view, phantom, room_from_body, region, part)
        _blur(part, sensor.blur_px)
    return image


def bounding_region(camera: Camera, phantom: Phantom, room_from_body: Array) -> tuple[int, int, int, int] | None:
    """Rows [top, bottom) and columns [left, right) that hold the body's image; None if out of view."""
    width, height = camera.image_size
    vertices = phantom.mesh(12.0)[0]
    in_camera = into_frame(tuple((camera.matrix @ room_from_body).ravel()), *vertices.T)
    if np.all(in_camera[2] < 10.0):
        return None
    if np.any(in_camera[2] < 10.0):
        return 0, height, 0, width
    x, y = in_camera[0] / in_camera[2], in_camera[1] / in_camera[2]
    if max(np.min(np.abs(x)), np.min(np.abs(y))) > WIDEST:
        return None
    u, v = camera.pixel(np.clip(x, -WIDEST, WIDEST), np.clip(y, -WIDEST, WIDEST))
    slack = MARGIN_PX + 3.0 * camera.intrinsics[0] / np.min(in_camera[2])  # the coarse mesh cuts corners
    left, right = max(0, int(np.min(u) - slack)), min(width, int(np.max(u) + slack) + 1)
    top, bottom = max(0, int(np.min(v) - slack)), min(height, int(np.max(v) + slack) + 1)
    return (top, bottom, left, right) if left < right and top < bottom else None


def cast(camera: Camera, phantom: Phantom, room_from_body: Array, x: Array, y: Array, done_mm: float) -> Cast:
    """Cast the viewing rays of normalised image points (x, y), each (N,)."""
    length = np.sqrt(x * x + y * y + 1.0)
    body_from_room = _flat_inverse(room_from_body)
    d = turned_back(camera.camera_from_room, x / length, y / length, 1.0 / length)
    d = turned_back(_flat(room_from_body), *d)
    origin = np.array(into_frame(body_from_room, *camera.centre))
    t, hits, gradient = first_hit(phantom, origin, d, done_mm)
    norm = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
    at = t[hits]
    points = tuple(origin[i] + at * d[i][hits] for i in range(3))
    return Cast(hits, length[hits] / at, points, tuple(g / norm for g in gradient))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Cast:
    """Hits: ray indices (M,), 1 / depth along the camera's z, skin points and normals (body frame)."""

    hits: np.ndarray
    inverse_depth: Array
    points: XYZ
    normals: XYZ


@dataclass(frozen=True)
class Light:
    """At M skin points: direct light (signed), ambient light, and whether the projector sees them."""

    direct: Array
    ambient: Array
    lit: np.ndarray


def shade(view: View, phantom: Phantom, room_from_body: Array, hit: Cast) -> Light:
    """Lambert's law for the pod's projector, its inverse square, shadow rays, and a soft sky."""
    source = np.array(into_frame(_flat_inverse(room_from_body), *view.projector.centre))
    (px, py, pz), (nx, ny, nz) = hit.points, hit.normals
    dx, dy, dz = source[0] - px, source[1] - py, source[2] - pz
    r2 = dx * dx + dy * dy + dz * dz
    reach = np.sqrt(np.sum((view.projector.centre - [0.0, 0.0, REFERENCE_LIFT_MM]) ** 2))
    albedo = phantom.reflectance(px, py, pz)
    direct = albedo * (nx * dx + ny * dy + nz * dz) / np.sqrt(r2) * (reach * reach / r2)
    up = room_from_body[2, 0] * nx + room_from_body[2, 1] * ny + room_from_body[2, 2] * nz
    return Light(direct, albedo * (0.6 + 0.4 * up), sees(phantom, hit.points, hit.normals, source))


def _render_region(view: View, phantom: Phantom, room_from_body: Array, region: tuple, out: np.ndarray) -> None:
    """Write the expected electrons of the region's body pixels into `out`."""
    top, bottom, left, right = region
    rows, columns = bottom - top, right - left
    coarse = _coarse(view, phantom, room_from_body, region)
    cell = _smooth_cells(coarse)
    w = spread(coarse.w, PITCH)[:rows, :columns]
    direct = spread(coarse.direct, PITCH)[:rows, :columns]
    ambient = spread(coarse.ambient, PITCH)[:rows, :columns]
    smooth = _to_pixels(cell, rows, columns)
    lit = _to_pixels(coarse.lit[1:-2, 1:-2], rows, columns) & smooth

    body = smooth.copy()
    ray_x, ray_y = (table[top:bottom, left:right] for table in ray_table(view.camera))
    near = _to_pixels(_may_hold_body(coarse.hit), rows, columns)
    odd = np.nonzero(near & ~smooth)
    if odd[0].size:
        hit = cast(view.camera, phantom, room_from_body, ray_x[odd], ray_y[odd], RENDER_DONE_MM)
        light = shade(view, phantom, room_from_body, hit)
        index = odd[0][hit.hits], odd[1][hit.hits]
        body[index], lit[index] = True, light.lit
        w[index], direct[index], ambient[index] = hit.inverse_depth, light.direct, light.ambient

    electrons = np.ascontiguousarray(ambient) * np.float32(AMBIENT)
    np.maximum(direct, 0.0, out=direct)
    where = np.flatnonzero(lit)
    column, row = _pattern_place(view, room_from_body, *(np.take(a, where) for a in (ray_x, ray_y, w)))
    flat = electrons.reshape(-1)
    flat[where] += np.take(direct, where) * view.projector.intensity(column, row)
    peak_e = view.sensor.exposure * view.sensor.full_well_e * view.camera.gain
    electrons *= np.float32(peak_e / (REFERENCE_ALBEDO * (1.0 + AMBIENT)))
    np.add(out, electrons, out=out, where=body)


@dataclass(frozen=True)
class _Nodes:
    """The coarse grid, from one node before the region to two after it: 1/Z and light at every hit."""

    hit: np.ndarray
    w: Array
    direct: np.ndarray
    ambient: np.ndarray
    lit: np.ndarray


def _coarse(view: View, phantom: Phantom, room_from_body: Array, region: tuple) -> _Nodes:
    top, bottom, left, right = region
    u = left + PITCH * np.arange(-1.0, -(-(right - left) // PITCH) + 2)
    v = top + PITCH * np.arange(-1.0, -(-(bottom - top) // PITCH) + 2)
    shape = v.size, u.size
    x, y = view.camera.ray(*(grid.ravel() for grid in np.meshgrid(u, v)))
    hit = cast(view.camera, phantom, room_from_body, x, y, RENDER_DONE_MM)
    light = shade(view, phantom, room_from_body, hit)

    def grid(values: np.ndarray, dtype: type) -> np.ndarray:
        out = np.zeros(shape, dtype)
        out.ravel()[hit.hits] = values
        return out

    return _Nodes(
        grid(True, bool),  # type: ignore[arg-type]
        grid(hit.inverse_depth, np.float64),
        grid(light.direct, np.float32),
        grid(light.ambient, np.float32),
        grid(light.lit, bool),
    )


def _smooth_cells(nodes: _Nodes) -> np.ndarray:
    """Cells of smooth depth whose 16 support nodes are all on skin and all lit or all dark."""
    w = np.where(nodes.hit, nodes.w, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        # A cubic is wrong by at most 3/128 of the fourth difference, in each direction.
        fourth = np.full(w.shape, np.nan)
        fourth[2:-2] = np.abs(np.diff(w, n=4, axis=0))
        fourth[:, 2:-2] = np.fmax(fourth[:, 2:-2], np.abs(np.diff(w, n=4, axis=1)))
        tight = _windows(fourth, 4, 4, np.fmax) * (6.0 / 128.0) < DEPTH_TOLERANCE_MM * w[1:-2, 1:-2] ** 2
    some_lit = _windows(nodes.lit, 4, 4, np.logical_or)
    all_lit = _windows(nodes.lit, 4, 4, np.logical_and)
    return tight & _windows(nodes.hit, 4, 4, np.logical_and) & (some_lit == all_lit)


def _may_hold_body(hit: np.ndarray) -> np.ndarray:
    """Cells within a cell of any hit; (rows - 3, columns - 3)."""
    return _windows(hit, 4, 4, np.logical_or)


def _windows(a: np.ndarray, rows: int, columns: int, combine: np.ufunc) -> np.ndarray:
    """`combine` over every rows x columns window."""
    out = functools.reduce(combine, [a[i : a.shape[0] - rows + 1 + i] for i in range(rows)])
    return functools.reduce(combine, [out[:, i : a.shape[1] - columns + 1 + i] for i in range(columns)])


def _to_pixels(cells: np.ndarray, rows: int, columns: int) -> np.ndarray:
    return np.repeat(np.repeat(cells, PITCH, axis=0), PITCH, axis=1)[:rows, :columns]


def _pattern_place(view: View, room_from_body: Array, x: Array, y: Array, w: Array) -> tuple[Array, Array]:
    """Pattern coordinates of the points at inverse depth w on the camera rays (x, y, 1)."""
    m, c = view.camera.camera_from_room, view.camera.centre
    p = view.projector.projector_from_room
    q = np.array(p).reshape(4, 4)[:3, :3] @ np.array(m).reshape(4, 4)[:3, :3].T  # projector_from_camera
    o = into_frame(p, *c)
    den = q[2, 0] * x + q[2, 1] * y + (q[2, 2] + o[2] * w)
    (width, height), f = view.projector.image_size, view.projector.focal_px
    column = f * (q[0, 0] * x + q[0, 1] * y + (q[0, 2] + o[0] * w)) / den + 0.5 * (width - 1)
    row = f * (q[1, 0] * x + q[1, 1] * y + (q[1, 2] + o[1] * w)) / den + 0.5 * (height - 1)
    return column, row


def _blur(image: np.ndarray, sigma: float) -> None:
    """The lens' Gaussian, in place, with the edge repeated."""
    if sigma > 0.0:
        image[:] = ndimage.gaussian_filter(image, sigma, mode="nearest", radius=max(2, int(np.ceil(4.0 * sigma))))


def _flat(matrix: Array) -> tuple[float, ...]:
    return tuple(matrix.ravel().tolist())


def _flat_inverse(matrix: Array) -> tuple[float, ...]:
    inverse = np.eye(4)
    inverse[:3, :3] = matrix[:3, :3].T
    inverse[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return _flat(inverse)
