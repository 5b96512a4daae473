"""Deformation-aware registration against drawn smooth deformations:
.venv/bin/python benchmarks/deform.py [--trials N]

Heads and torsos of the simulated room, 1 to 3 mm of surface motion in drawn directions: one to three bumps, a
smooth step across a drawn plane, or a windowed wave. Prints, by the share that stayed rigid (moved by less than 0.1
mm), how many were answered, refused or called weak, and the error at the isocentre beside that of a rigid
registration.
"""

import argparse

import numpy as np
import sgrt
from sgrt import twin
from sgrt.frames import pose_from_displacement

NAMES = ("lat_mm", "lng_mm", "vrt_mm", "pitch_deg", "roll_deg", "rtn_deg")
BODIES = {
    "head": (twin.head, ((-85, -105, 10), (85, 95, 300)), 70.0, (0.0, 0.0, 0.0)),
    "torso": (twin.torso, ((-150, -220, -100), (150, 190, 300)), 130.0, (20.0, 30.0, 20.0)),
}


def cloud(body: str, seed: int, count: int) -> np.ndarray:
    phantom, box, _, _ = BODIES[body]
    points, normals = phantom().sample_surface(count, seed)
    low, high = np.array(box)
    return points[(normals[:, 2] > 0.1) & np.all((points > low) & (points < high), axis=1)]


def unit(rng: np.random.Generator, stretch=(1, 1, 1)) -> np.ndarray:
    v = rng.normal(size=3) * stretch
    return v / np.sqrt(v @ v)


def window(points: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    q = np.sum((points - centre) ** 2, axis=1) / radius**2
    return np.where(q < 1, (1 - q) ** 2, 0)


def deformation(rng: np.random.Generator, points: np.ndarray, size: float):
    """A function of points: how far the skin moves, mm."""
    amount, kind = rng.uniform(1, 3), rng.integers(3)
    some = points[rng.integers(len(points))]
    if kind == 0:
        bumps = [
            (points[rng.integers(len(points))], rng.uniform(0.35, 1) * size, amount * unit(rng))
            for _ in range(rng.integers(1, 4))
        ]
        return lambda p: sum(window(p, c, r)[:, None] * d for c, r, d in bumps)
    direction = amount * unit(rng)
    if kind == 1:
        across = unit(rng, (1, 1, 0.3))
        at, width = np.quantile(points @ across, rng.uniform(0.1, 0.6)), rng.uniform(0.2, 0.6) * size

        def step(p):
            t = np.clip((at - p @ across) / width, 0, 1)
            return (t * t * (3 - 2 * t))[:, None] * direction

        return step
    radius, wave, phase = rng.uniform(0.6, 1.2) * size, rng.normal(size=3) / (0.35 * size), rng.uniform(0, 6.28)
    return lambda p: (window(p, some, radius) * np.sin(p @ wave + phase))[:, None] * 1.5 * direction


def trial(body: str, noise_mm: float, count: int, seed: int) -> tuple[float, str, float, float]:
    """Share that stayed rigid, verdict, error of the rigid registration and of the aware one, mm."""
    rng = np.random.default_rng(seed)
    isocentre = np.array(BODIES[body][3])
    plan, now = cloud(body, 2 * (seed % 3) + 1, count), cloud(body, 2 * (seed % 3) + 2, count)
    change = deformation(rng, plan, BODIES[body][2])(now)
    shift = dict(zip(NAMES, [*rng.uniform(-3, 3, 3), *rng.uniform(-1, 1, 3)], strict=True))
    back = pose_from_displacement(sgrt.PatientDisplacement(**shift), isocentre)
    live = (now + change - back[:3, 3]) @ back[:3, :3]
    reference, moved = (
        sgrt.Surface(p + rng.normal(0, noise_mm, p.shape), sigma_mm=np.full(len(p), noise_mm)).estimate_normals()
        for p in (plan, live)
    )

    def error(align):
        try:
            result = align(reference, moved, isocentre_mm=isocentre)
        except sgrt.Error:
            return "refused", np.nan
        d = [getattr(result.displacement, n) - shift[n] for n in NAMES[:3]]
        return result.verdict, float(np.sqrt(np.sum(np.square(d))))

    rigid_share = float(np.mean(np.sqrt(np.sum(change**2, axis=1)) < 0.1))
    return rigid_share, *error(sgrt.deform_align), error(sgrt.icp_align)[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument(
        "--points", type=int, default=20_000, help="of the whole body; a third or so lies in the region"
    )
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    for body in BODIES:
        for noise_mm in (0.3, 0.5):
            found = [trial(body, noise_mm, arguments.points, arguments.seed + i) for i in range(arguments.trials)]
            for low, high in ((0.6, 1.01), (0.5, 0.6), (0.0, 0.5)):
                some = [f for f in found if low <= f[0] < high]
                verdicts = [f[1] for f in some]
                errors = np.array([f[2] for f in some if f[1] == "ok"] or [np.nan])
                rigid = np.array([f[3] for f in some] or [np.nan])
                print(
                    f"{body}, {noise_mm} mm noise, {low:.0%} to {min(high, 1):.0%} rigid: {len(some)} scenes,"
                    f" {verdicts.count('ok')} ok, {verdicts.count('weak')} weak, {verdicts.count('refused')} refused;"
                    f" error median {np.nanmedian(errors):.3f}, max {np.max(errors):.3f} mm,"
                    f" above 0.3: {np.sum(errors > 0.3)};"
                    f" rigid ICP median {np.nanmedian(rigid):.2f}, max {np.nanmax(rigid):.2f} mm",
                    flush=True,
                )


if __name__ == "__main__":
    main()
