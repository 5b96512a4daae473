"""Rendered speckle pairs with exact truth: flat, tilted, sphere, head. Used by stereo_accuracy.py.

A rectified pod 2 m away. The pattern is a Gaussian random field fixed to the left image's rays (as a projector beside
the left camera throws it), band-limited, and evaluated at exact places: no interpolation of an image takes part.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import sgrt
from scipy import ndimage

FOCAL_PX, BASE_MM, DEPTH_MM = 2400.0, 250.0, 2000.0
OFFSET_PX = FOCAL_PX * BASE_MM / DEPTH_MM - 40.25  # principal points apart, so that 2 m lies at 40.25 px
CORRELATION_PX = 2.0  # the pattern's autocorrelation falls to 1/e there
FINE = 4  # samples of the pattern a pixel along x

Depth = Callable[
    [np.ndarray, np.ndarray, float], np.ndarray
]  # of pixels of a camera at x_mm: z, NaN beside the surface


@dataclass
class Scene:
    name: str
    width: int
    height: int
    depth: Depth  # of rays (u, v, 1) from (x_mm, 0, 0)
    normal: Callable[[np.ndarray], np.ndarray]  # of points


def rays(scene: Scene, x: np.ndarray, y: np.ndarray, right: bool) -> tuple[np.ndarray, np.ndarray]:
    cx = (scene.width - 1) / 2 + (OFFSET_PX if right else 0)
    return (x - cx) / FOCAL_PX, (y - (scene.height - 1) / 2) / FOCAL_PX


def disparity(scene: Scene, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """x_left - x_right at left pixels; NaN beside the surface."""
    return FOCAL_PX * BASE_MM / scene.depth(*rays(scene, x, y, False), 0.0) - OFFSET_PX


def truth(scene: Scene, edge_px: int = 8, max_incidence_deg: float = 60) -> tuple[np.ndarray, np.ndarray]:
    """Disparity a pixel, and where it counts: seen by both, incidence and distance from depth edges as asked."""
    y, x = np.mgrid[: scene.height, : scene.width].astype(float)
    d = disparity(scene, x, y)
    u, v = rays(scene, x, y, False)
    z = scene.depth(u, v, 0.0)
    points = np.stack([u * z, v * z, z], axis=-1)
    facing = -np.sum(scene.normal(points) * points, axis=-1) / np.linalg.norm(points, axis=-1)
    u, v = rays(scene, x - d, y, True)
    hidden = ~(np.abs(scene.depth(u, v, BASE_MM) - z) < 1)
    steps = np.abs(np.diff(d, axis=1, append=d[:, -1:])) > 1, np.abs(np.diff(d, axis=0, append=d[-1:])) > 1
    edge = steps[0] | steps[1] | ~np.isfinite(d)
    grown = ndimage.maximum_filter(edge | hidden, 2 * edge_px + 1)
    inside = (x - d >= 0) & (x - d <= scene.width - 1)
    return d, np.isfinite(d) & ~hidden & ~grown & inside & (facing >= np.cos(np.radians(max_incidence_deg)))


def pattern(scene: Scene, seed: int) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """T(x, row) with unit variance; rows are whole, x is not."""
    rng = np.random.default_rng(seed)
    margin = 80
    fine = rng.standard_normal((scene.height, (scene.width + 2 * margin) * FINE))
    sigma = CORRELATION_PX / 2  # of the filter: the autocorrelation exp(-r^2 / (4 sigma^2))
    fine = ndimage.gaussian_filter(fine, (sigma, sigma * FINE), mode="wrap")
    fine = ndimage.spline_filter1d(fine / fine.std(), order=5, axis=1)

    def at(x: np.ndarray, rows: np.ndarray) -> np.ndarray:
        places = np.stack([rows, (x + margin) * FINE])
        # Along y the places are whole: the order matters along x alone.
        out = np.empty(x.shape)
        for row in range(x.shape[0]):
            out[row] = ndimage.map_coordinates(fine[rows[row, 0]], places[1:, row], order=5, prefilter=False)
        return out

    return at


def render(
    scene: Scene, seed: int = 1, mean: float = 128, contrast: float = 0.2, noise: float = 2.55, bits: int = 8
) -> tuple[np.ndarray, np.ndarray]:
    """Left and right image. contrast: standard deviation over mean; noise: grey levels of 255."""
    y, x = np.mgrid[: scene.height, : scene.width]
    pattern_at, behind = pattern(scene, seed), pattern(scene, seed + 1000)
    z_left = scene.depth(*rays(scene, x.astype(float), y.astype(float), False), 0.0)
    left = np.where(np.isfinite(z_left), pattern_at(x.astype(float), y), -1 / contrast)
    u, v = rays(scene, x.astype(float), y.astype(float), True)
    z = scene.depth(u, v, BASE_MM)
    seen_from_left = FOCAL_PX * (u * z + BASE_MM) / z + (scene.width - 1) / 2
    x_left = np.where(np.isfinite(z), seen_from_left, 0)
    back = scene.depth(*rays(scene, x_left, y.astype(float), False), 0.0)
    shown = np.where(np.abs(back - z) < 1, pattern_at(x_left, y), behind(x_left, y))
    right = np.where(np.isfinite(z), shown, -1 / contrast)
    rng = np.random.default_rng(seed + 77)
    scale = (2**bits - 1) / 255
    images = []
    for image in (left, right):
        grey = (mean * (1 + contrast * image) + rng.normal(0, noise, image.shape)) * scale
        images.append(np.clip(np.rint(grey), 0, 2**bits - 1).astype(np.uint8 if bits == 8 else np.uint16))
    return images[0], images[1]


def rig_of(scene: Scene) -> sgrt.Rig:
    cameras = []
    for name, x_mm, cx in (("left", 0.0, 0.0), ("right", BASE_MM, OFFSET_PX)):
        pose = np.eye(4)
        pose[0, 3] = -x_mm
        cameras.append(
            {
                "id": name,
                "image_size": [scene.width, scene.height],
                "model": "pinhole",
                "intrinsics": [FOCAL_PX, FOCAL_PX, (scene.width - 1) / 2 + cx, (scene.height - 1) / 2],
                "camera_from_room": pose.tolist(),
            }
        )
    pairs = [{"id": "pod", "left": "left", "right": "right"}]
    text = {"schema": "sgrt-rig/1", "id": "benchmark", "room": "camera left", "cameras": cameras, "pairs": pairs}
    return sgrt.Rig(json.dumps(text))


def plane(name: str, about_x_deg: float, about_y_deg: float, width: int = 640, height: int = 512) -> Scene:
    a, b = np.radians([about_x_deg, about_y_deg])
    n = np.array([-np.sin(b), np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b)])

    def depth(u, v, x_mm):
        return (n[2] * DEPTH_MM - n[0] * x_mm) / (n[0] * u + n[1] * v + n[2])

    return Scene(name, width, height, depth, lambda points: np.broadcast_to(n, points.shape))


def sphere(radius: float = 80, width: int = 400, height: int = 400) -> Scene:
    centre = np.array([0.0, 0.0, DEPTH_MM + radius * 0.5])

    def depth(u, v, x_mm):
        m = np.array([x_mm, 0, 0]) - centre
        r2 = u * u + v * v + 1
        b = m[0] * u + m[1] * v + m[2]
        with np.errstate(invalid="ignore"):
            return (-b - np.sqrt(b * b - r2 * (m @ m - radius**2))) / r2

    return Scene(f"sphere {radius:g} mm", width, height, depth, lambda points: (points - centre) / radius)


def head(width: int = 480, height: int = 560) -> Scene:
    """An ellipsoid with a nose, eye sockets, lips and chin, as a radius over directions."""
    centre = np.array([0.0, 0.0, DEPTH_MM + 50])
    axes = np.array([74.0, 98.0, 92.0])
    bumps = (  # direction x, y (y down), height mm, width mm (half) across and along
        (0.0, 0.10, 19, 8.0, 13.0),
        (-0.36, -0.16, -7, 11.0, 8.0),
        (0.36, -0.16, -7, 11.0, 8.0),
        (0.0, 0.44, 4, 16.0, 5.0),
        (0.0, 0.74, 7, 14.0, 11.0),
    )

    def over(points):  # how far a point lies outside, mm along the radius
        q = points - centre
        r = np.linalg.norm(q, axis=-1)
        n = q / r[..., None]
        radius = 1 / np.sqrt(np.sum((n / axes) ** 2, axis=-1))
        for bx, by, height_mm, across, along in bumps:
            front = n[..., 2] < 0
            gx, gy = (n[..., 0] - bx) * 80 / across, (n[..., 1] - by) * 90 / along
            radius = radius + np.where(front, height_mm * np.exp(-(gx**2 + gy**2) / 2), 0)
        return r - radius

    def depth(u, v, x_mm):
        direction = np.stack([u, v, np.ones_like(u)], axis=-1)
        origin = np.array([x_mm, 0.0, 0.0])
        z = np.full(u.shape, centre[2] - 125.0)
        for _ in range(140):  # a sphere trace
            z = z + 0.6 * np.clip(over(origin + direction * z[..., None]), -5, 12)
        for _ in range(3):
            h = 1e-3
            value = over(origin + direction * z[..., None])
            slope = (over(origin + direction * (z + h)[..., None]) - value) / h
            z = z - np.clip(value / np.where(np.abs(slope) > 0.05, slope, -0.05), -1, 1)
        miss = np.abs(over(origin + direction * z[..., None])) > 1e-6
        return np.where(miss | (z > centre[2]), np.nan, z)

    def normal(points):
        h = 1e-3
        steps = [over(points + h * e) - over(points - h * e) for e in np.eye(3)]
        n = np.stack(steps, axis=-1)
        return n / np.linalg.norm(n, axis=-1, keepdims=True)

    return Scene("head", width, height, depth, normal)


def scenes() -> list[Scene]:
    return [
        plane("flat", 0, 0),
        plane("tilted 4 deg", 0, 4),
        plane("tilted 45 deg", 0, 45),
        plane("tilted 60 deg", 0, 58),
        sphere(),
        head(),
    ]
