"""Landmarks on simulated heads: shapes x poses under the noise of a Kinect and of a time-of-flight camera.

    python benchmarks/landmarks.py [--shapes 20] [--poses 10] [--starts]

Each shape is the twin's head with every feature moved, scaled and resized by chance: another person. A view is a
depth camera's (parallel rays, a point every `pitch` mm, noise along the ray), the head turned by up to 60 degrees
about any axis. `head`: the model of any head. `own`: a model learnt from the person's own reference (a mesh with 0.1 mm
noise), as in treatment. Truth: the extrema of the phantom's exact mean curvature; `again` compares with the
reference's own points instead, as Soufi et al. (2016) did: their figures stand below. A landmark is asked for where the
camera sees it: nothing lies over it and its skin faces the camera within 80 degrees.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from typing import Any

import numpy as np
import sgrt
from sgrt.twin import raycast
from sgrt.twin.bodies import head
from sgrt.twin.phantom import Blob, Phantom

CONVEX = ("nose_apex", "ala_left", "ala_right", "chin")
FACING = np.cos(np.deg2rad(80))
SOUFI = "Soufi 2016 (quoted), a head phantom: Kinect 0.26 mm convex, 0.52 concave; time of flight 1.79 and 1.97"
SENSORS = {"kinect": (0.6, 1.5), "tof": (1.5, 3.6)}  # noise, pitch, mm
EXTENT = 125.0


def person(seed: int) -> Phantom:
    """Another head; left and right alike, as the twin's. Raises ValueError where it lacks a landmark."""
    base, rng = head(), np.random.default_rng(seed)
    grown = rng.normal(1.0, 0.05, 3)
    draws: dict[Any, np.ndarray] = {}

    def other(blob: Blob, index: int, move: float) -> Blob:
        c = np.array(blob.centre)
        draw = draws.setdefault((round(abs(c[0]) / 3), round(c[1]), round(c[2])), rng.normal(size=7))
        d = move * draw[:3] * (0.0 if abs(c[0]) < 3 else np.sign(c[0]), 1, 1)
        axes = np.array(blob.axes) * (1 + 0.05 * draw[4:])
        return Blob(float(blob.size * (1 + 0.07 * draw[3])), tuple((c + d) * grown), tuple(axes * grown), blob.turn_deg)

    made = dataclasses.replace(
        base,
        parts=tuple(other(b, i, 1.0) for i, b in enumerate(base.parts)),
        bumps=tuple(other(b, i, 0.6) for i, b in enumerate(base.bumps)),
    )
    # Seeds of the landmarks: those of the twin's head, moved to the nearest extremum of this one.
    marks = []
    for name, place, sign in base.marks:
        for trial in range(12):
            at = np.array(place) * grown + (0 if trial == 0 else 2.0) * np.random.default_rng(trial).normal(size=3)
            try:
                found = dataclasses.replace(made, marks=((name, tuple(at), sign),)).landmarks()[name]
            except (ValueError, np.linalg.LinAlgError):
                continue
            marks.append((name, tuple(found), sign))
            break
        else:
            raise ValueError(name)
    return dataclasses.replace(made, marks=tuple(marks))


def turn(rng: np.random.Generator) -> np.ndarray:
    """A rotation by up to 60 degrees about any axis."""
    axis = rng.normal(size=3)
    x, y, z = axis / np.linalg.norm(axis)
    angle = np.deg2rad(rng.uniform(0, 60))
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def view(body: Phantom, rotation: np.ndarray, noise: float, pitch: float, rng: np.random.Generator) -> np.ndarray:
    """H x W x 3: what a depth camera above sees of the turned body."""
    side = np.arange(-EXTENT, EXTENT, pitch)
    x, y = np.meshgrid(side + rng.uniform(-0.5, 0.5) * pitch, side[::-1] + rng.uniform(-0.5, 0.5) * pitch)
    origin = np.stack([x.ravel(), y.ravel(), np.full(x.size, 230.0)], -1) @ rotation
    ray = np.array([0.0, 0.0, -1.0]) @ rotation
    start = np.ascontiguousarray(origin, np.float32)
    found = raycast.scene(body).run(start, np.tile(ray, (len(origin), 1)).astype(np.float32), query="DISTANCE")
    hit = found < raycast.MISS
    t = np.where(hit, found, 0.0).astype(float)
    guess, on = t.copy(), np.flatnonzero(hit)
    for _ in range(12):  # Newton along the ray; who does not get there grazes the skin
        p = origin[on] + t[on, None] * ray
        f, *g = body.field(*(np.ascontiguousarray(p[:, k]) for k in range(3)))
        slope = np.minimum(sum(q * r for q, r in zip(g, ray, strict=True)), -1e-12)
        step = np.clip(f / slope, -2, 2)
        t[on] -= step
        on = on[np.abs(step) >= 1e-6]
        if not on.size:
            break
    hit[on] = False
    hit &= np.abs(t - guess) < raycast.STRAY_MM
    points = (origin + t[:, None] * ray) @ rotation.T
    points[:, 2] += noise * rng.normal(size=len(points))
    points[~hit] = np.nan
    return points.reshape(*x.shape, 3)


def reference(body: Phantom, rng: np.random.Generator) -> sgrt.Surface:
    points, faces = body.mesh(1.5)
    return sgrt.Surface(points + 0.1 * rng.normal(size=(len(points), 1)) * body.normal(points), faces=faces)


def in_view(points: np.ndarray, place: np.ndarray, pitch: float) -> bool:
    """Whether a camera above sees the place: no point of the surface lies more than 3 mm over it."""
    near = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1]) < max(3.0, 1.5 * pitch)
    return bool(near.sum() >= 3 and np.median(points[near, 2]) < place[2] + 2.5)


@dataclasses.dataclass
class Tally:
    asked: int = 0
    poses: int = 0
    found_poses: int = 0
    invented: int = 0
    rows: list[tuple[str, float, float, float, float]] = dataclasses.field(default_factory=list)
    seconds: float = 0.0

    def add(
        self,
        found: sgrt.Landmarks,
        truth: dict[str, np.ndarray],
        valley: dict[str, np.ndarray],
        seen: set[str],
        again: bool,
    ) -> None:
        covariance = found.repeat_covariance_mm2 if again else found.covariance_mm2
        for name, p, c in zip(found.names, found.positions_mm, covariance, strict=True):
            if not np.isfinite(p[0]) or name not in seen:
                continue
            d = p - truth[name]
            across = float(np.linalg.norm(d)) if name in CONVEX else float(abs(d @ valley[name]))
            self.rows.append((name, float(np.linalg.norm(d)), across, float(d @ np.linalg.solve(c, d)), 0.0))

    def line(self, title: str) -> str:
        if not self.rows:
            return f"{title:26s} nothing found"
        names = np.array([r[0] for r in self.rows])
        norm, across, z2 = (np.array([r[k] for r in self.rows]) for k in (1, 2, 3))
        convex = np.isin(names, CONVEX)
        inside = np.mean(z2 < 7.815)
        return (
            f"{title:26s} poses {self.found_poses}/{self.poses}, points {len(names)}/{self.asked}"
            f" ({100 * len(names) / self.asked:.1f} %), convex mean {norm[convex].mean():.2f} mm (95 %"
            f" {np.quantile(norm[convex], 0.95):.2f}), sulci across {across[~convex].mean():.2f} mm, in 95 % ellipsoid"
            f" {100 * inside:.1f} %, beyond 10 mm {np.sum(norm > 10)},"
            f" {1e3 * self.seconds / max(1, self.poses):.0f} ms CPU"
        )


def across_valleys(body: Phantom, truth: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Unit directions of the strongest bend at each landmark, body frame: across the valley of a sulcus."""
    out = {}
    for name, x in truth.items():
        g, h = body.gradient(x[None])[0], body.hessian(x[None])[0]
        n = g / np.linalg.norm(g)
        p = np.eye(3) - np.outer(n, n)
        values, vectors = np.linalg.eigh(p @ h @ p)
        out[name] = vectors[:, int(np.argmax(np.abs(values)))]
    return out


def off_by(pose: np.ndarray, rotation: np.ndarray, at: np.ndarray) -> tuple[float, float]:
    """mm at a place of the reference and degrees by which reference_from_live is wrong."""
    error = pose[:3, :3] @ rotation
    degrees = np.rad2deg(np.arccos(np.clip((np.trace(error) - 1) / 2, -1, 1)))
    return float(np.linalg.norm(pose[:3, :3] @ rotation @ at + pose[:3, 3] - at)), float(degrees)


def starts(shapes: int, poses: int, seed: int) -> None:
    """Registration without a guess: the start from a patient's own landmarks beside that from general features."""
    context = sgrt.Context(threads=1)
    rows: dict[tuple[str, str], list[tuple[float, float, float]]] = {}
    learning = []
    while shapes:
        seed += 1
        try:
            body = person(seed)
        except ValueError:
            continue
        shapes -= 1
        rng, apex = np.random.default_rng(seed), body.landmarks()["nose_apex"]
        points, faces = body.mesh(3.0)
        skin = sgrt.Surface(points + 0.1 * rng.normal(size=(len(points), 1)) * body.normal(points), faces=faces)
        start = time.process_time()
        own = sgrt.LandmarkModel.learn(skin, context=context)
        learning.append(time.process_time() - start)
        ids = np.arange(len(own.names), dtype=np.int32)
        for sensor, (noise, pitch) in SENSORS.items():
            for _ in range(poses):
                rotation = turn(rng)
                live = sgrt.Surface(view(body, rotation, noise, pitch, rng)).estimate_normals()
                for label in ("landmarks", "features"):
                    start, pose = time.process_time(), None
                    try:
                        if label == "landmarks":
                            found = sgrt.landmarks_find(live, own, context=context)
                            seen = np.isfinite(found.positions_mm[:, 0])
                            pose = sgrt.coarse_align(
                                own.positions_mm,
                                ids,
                                found.positions_mm[seen],
                                ids[seen],
                                isocentre_mm=(0, 0, 0),
                                context=context,
                            ).reference_from_live
                        else:
                            pose = sgrt.icp_align(
                                skin, live, isocentre_mm=(0, 0, 0), anywhere=True, context=context
                            ).reference_from_live
                    except sgrt.Error:
                        pass
                    seconds = time.process_time() - start
                    off = (np.nan, np.nan) if pose is None else off_by(pose, rotation, apex)
                    rows.setdefault((sensor, label), []).append((*off, seconds))
    print(f"learning the reference's landmarks, once: {1e3 * np.mean(learning):.0f} ms CPU, one thread")
    for (sensor, label), each in rows.items():
        mm, degrees, seconds = np.array(each).T
        right = (mm < 5) & (degrees < 5)
        print(
            f"{sensor}, by {label}: right {right.sum()} of {len(mm)}, refused {np.isnan(mm).sum()},"
            f" wrong {np.sum((mm >= 5) | (degrees >= 5))}; at the nose {np.mean(mm[right]):.2f} mm;"
            f" {1e3 * seconds.mean():.0f} ms CPU"
        )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--starts", action="store_true", help="registration starts instead")
    parser.add_argument("--shapes", type=int, default=20)
    parser.add_argument("--poses", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1000)
    args = parser.parse_args()
    if args.starts:
        starts(args.shapes, args.poses, args.seed)
        return
    tallies = {(s, m): Tally() for s in SENSORS for m in ("head", "own", "own, again")}
    context, shapes, seed = sgrt.Context(threads=2), 0, args.seed
    while shapes < args.shapes:
        seed += 1
        try:
            body = person(seed)
        except ValueError:
            continue
        shapes += 1
        truth, rng = body.landmarks(), np.random.default_rng(seed)
        valley = across_valleys(body, truth)
        outward = {n: body.normal(x[None])[0] for n, x in truth.items()}
        try:
            own = sgrt.LandmarkModel.learn(reference(body, rng), sgrt.LandmarkModel.head(), context=context)
            places = dict(zip(own.names, own.positions_mm, strict=True))
        except sgrt.NotFound as error:
            print("shape", seed, "reference:", error)
            own, places = None, {}
        for sensor, (noise, pitch) in SENSORS.items():
            for _ in range(args.poses):
                rotation = turn(rng)
                points = view(body, rotation, noise, pitch, rng)
                live = sgrt.Surface(points).estimate_normals()
                turned = {n: rotation @ x for n, x in truth.items()}
                axes = {n: rotation @ x for n, x in valley.items()}
                cloud = points.reshape(-1, 3)
                there = cloud[np.isfinite(cloud[:, 0])]
                facing = {n for n, v in outward.items() if (rotation @ v)[2] > FACING}
                seen = {n for n in facing if in_view(there, turned[n], pitch)}
                own_room = {n: rotation @ x for n, x in places.items()}
                for model, targets in (
                    (sgrt.LandmarkModel.head(), (("head", turned),)),
                    (own, (("own", turned), ("own, again", own_room))),
                ):
                    if model is None:
                        continue
                    start = time.process_time()
                    try:
                        found = sgrt.landmarks_find(live, model, context=context)
                    except sgrt.NotFound:
                        found = None
                    for label, places_in_room in targets:
                        tally = tallies[sensor, label]
                        tally.poses += 1
                        tally.asked += len(seen)
                        tally.seconds += time.process_time() - start
                        if found is not None:
                            tally.found_poses += 1
                            tally.add(found, places_in_room, axes, seen & set(places_in_room), label == "own, again")
    for (sensor, label), tally in tallies.items():
        print(tally.line(f"{sensor}, {label}"), flush=True)
    print(SOUFI)


if __name__ == "__main__":
    main()
