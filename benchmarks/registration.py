"""Campaigns of registration, each against exact truth; figures go into RESULTS.md:
.venv/bin/python benchmarks/registration.py NAME [--trials N] [--first SEED]

A trial is a function of its seed, so a campaign can be run in parts (--first) and their counts added. NAME:

coverage      share of errors inside the 95 % region, NEES/6; noise and the error modes of both surfaces are redrawn
shapes        plane, sphere, cylinder, cone, surface of revolution: are their free motions named?
convergence   starts 30 mm and 20 deg away
anywhere      no start: right, refused, wrong; time of a call
head          the head's region by two pods: bias and noise
regions       15 regions of head, breast and limb: predicted against real error
speed         of a prepared registration of 20,000 and 100,000 points
bits          hash of 1,000 frames at 1, 2, 3, 4, 8 and 16 threads
"""

import argparse
import hashlib
import time

import numpy as np
import sgrt
from icp import torso
from scipy.spatial import cKDTree
from scipy.stats import rankdata

ISOCENTRE_MM = np.array([10.0, -20.0, -15.0])
NOISE_MM = 0.3


def rotation(vector: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(vector)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def direction(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def motion(rng: np.random.Generator, mm: float, deg: float) -> np.ndarray:
    """D of so many mm and degrees about the isocentre."""
    d = np.eye(4)
    d[:3, :3] = rotation(np.radians(deg) * direction(rng))
    d[:3, 3] = mm * direction(rng) + ISOCENTRE_MM - d[:3, :3] @ ISOCENTRE_MM
    return d


def moved(points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    return points @ pose[:3, :3].T + pose[:3, 3]


def error_of(reference_from_live: np.ndarray, true: np.ndarray) -> np.ndarray:
    """delta of D_true = D exp(delta) about the isocentre: rad, mm."""
    e = reference_from_live @ true
    turn, shift = e[:3, :3], moved(ISOCENTRE_MM[None], e)[0] - ISOCENTRE_MM
    w = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    return np.concatenate([w, shift])


def noisy(points: np.ndarray, rng: np.random.Generator, noise_mm: float = NOISE_MM) -> sgrt.Surface:
    return sgrt.Surface(
        points + rng.normal(0, noise_mm, points.shape), sigma_mm=np.full(len(points), noise_mm)
    ).estimate_normals()


# ----------------------------------------------------------------------------------------------------------- coverage


def calibration_modes(points: np.ndarray) -> np.ndarray:
    """What an error of a pod's calibration does to its points, one sigma: a shift, a turn, a scale and a bend."""
    x = points / 150
    zero, one = np.zeros(len(x)), np.ones(len(x))
    return np.stack(
        [
            0.05 * np.stack([zero, zero, one], axis=1),
            0.04 * np.stack([x[:, 2], zero, -x[:, 0]], axis=1),
            0.04 * x,
            0.06 * np.stack([zero, zero, x[:, 0] ** 2 - x[:, 1] * x[:, 0]], axis=1),
        ]
    )


def coverage(trials: range) -> None:
    """Each trial draws points, noise and, for either surface, its rig's calibration."""
    nees = []
    for seed in trials:
        rng = np.random.default_rng([1, seed])
        true = motion(rng, 8, 2)
        surfaces = []
        for side, count in (("plan", 6000), ("treatment", 3000)):
            points = torso(count, rng) if side == "plan" else moved(torso(count, rng), true)
            modes = calibration_modes(points)
            seen = points + np.tensordot(rng.normal(size=len(modes)), modes, 1) + rng.normal(0, NOISE_MM, points.shape)
            surfaces.append(
                sgrt.Surface(
                    seen,
                    sigma_mm=np.full(count, NOISE_MM),
                    modes=modes,
                    mode_names=[f"{side} rig {k}" for k in range(len(modes))],
                )
            )
        result = sgrt.icp_align(*surfaces, isocentre_mm=ISOCENTRE_MM)
        e = error_of(result.reference_from_live, true)
        nees.append(e @ np.linalg.solve(result.covariance, e))
    nees = np.array(nees)
    print(f"{len(nees)} trials: inside the 95 % region {np.mean(nees < 12.592):.4f}, NEES/6 {nees.mean() / 6:.3f}")


# ------------------------------------------------------------------------------------------------------------- shapes


def shape(name: str, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    a = np.pi * (0.1 + 0.8 * u)
    y = -150 + 300 * v
    if name == "plane":
        return np.stack([-150 + 300 * u, y, 0 * u], axis=1)
    if name == "sphere":
        z = 0.1 + 0.9 * v
        r = np.sqrt(1 - z**2)
        return 100 * np.stack([r * np.cos(2 * np.pi * u), r * np.sin(2 * np.pi * u), z], axis=1)
    radius = {"cylinder": 80 + 0 * y, "cone": 40 + 0.3 * (y + 150), "revolution": 70 + 20 * np.sin(y / 60)}[name]
    return np.stack([radius * np.cos(a), y, radius * np.sin(a)], axis=1)


FREE = {"plane": 3, "sphere": 3, "cylinder": 2, "cone": 1, "revolution": 1}


def true_free(name: str) -> np.ndarray:
    """The motions that the shape leaves free in its own frame: rows (rotation, translation)."""
    e = np.eye(6)
    return {
        "plane": e[[2, 3, 4]],
        "sphere": e[:3],
        "cylinder": e[[1, 4]],
        "cone": e[[1]],
        "revolution": e[[1]],
    }[name]


def at_isocentre(motions: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Motions of the shape's frame, seen in the room about the isocentre, turns at 100 mm."""
    w = motions[:, :3] @ pose[:3, :3].T
    t = motions[:, 3:] @ pose[:3, :3].T + np.cross(pose[:3, 3] - ISOCENTRE_MM, w) * 1.0
    return np.concatenate([100 * w, t], axis=1)


def shapes(trials: range) -> None:
    for noise_mm in (0.0, 0.3):
        for name, count in FREE.items():
            missed, worst = 0, 0.0
            for seed in trials:
                rng = np.random.default_rng([2, seed])
                pose = motion(rng, 100, 180 * rng.random())
                points = [moved(shape(name, *rng.random((2, 5000))), pose) for _ in range(2)]
                if noise_mm > 0:
                    pair = [noisy(x, rng, noise_mm) for x in points]
                else:
                    pair = [sgrt.Surface(x).estimate_normals() for x in points]
                try:
                    sgrt.icp_align(*pair, isocentre_mm=ISOCENTRE_MM)
                    missed += 1
                except sgrt.Degenerate as error:
                    found = error.result.free_motions * np.array([100, 100, 100, 1, 1, 1])
                    space = np.linalg.qr(at_isocentre(true_free(name), pose).T)[0]
                    if len(found) != count:
                        missed += 1
                        continue
                    off = found.T - space @ (space.T @ found.T)
                    worst = max(worst, np.max(np.linalg.norm(off, axis=0) / np.linalg.norm(found, axis=1)))
                except sgrt.Error:
                    missed += 1
            print(f"{name}, {noise_mm} mm: {missed} misses of {len(trials)}, worst angle of a direction {worst:.3f}")


# -------------------------------------------------------------------------------------------------------- convergence


def convergence(trials: range) -> None:
    rng = np.random.default_rng(3)
    reference = sgrt.Reference(noisy(torso(20000, rng), rng, 0.2))
    good, wrong, iterations = 0, 0, []
    for seed in trials:
        rng = np.random.default_rng([3, seed])
        true = motion(rng, 30, 20)
        live = noisy(moved(torso(5000, rng), true), rng, 0.2)
        try:
            result = reference.align(live, isocentre_mm=ISOCENTRE_MM)
        except sgrt.Error as error:
            print(f"  seed {seed}: {error}")
            continue
        e = error_of(result.reference_from_live, true)
        right = np.linalg.norm(e[3:]) < 0.2 and np.degrees(np.linalg.norm(e[:3])) < 0.1
        good += right
        wrong += not right and result.verdict == "ok"
        if not right:
            print(f"  seed {seed}: {np.linalg.norm(e[3:]):.2f} mm off, {result.verdict_text}")
        iterations.append(result.iterations)
    print(f"{good} of {len(trials)} converged, {wrong} wrong and ok, {np.mean(iterations):.1f} iterations")


def anywhere(trials: range) -> None:
    rng = np.random.default_rng(4)
    reference = sgrt.Reference(noisy(torso(20000, rng), rng, 0.2))
    context = sgrt.Context(threads=2)
    good = refused = wrong = 0
    took, cpu = [], time.process_time()
    for seed in trials:
        rng = np.random.default_rng([4, seed])
        true = motion(rng, 300 * rng.random(), 180 * rng.random())
        body = torso(8000, rng)
        if seed % 2:  # one pod blocked: what lies on one side is seen
            body = body[body @ direction(rng) > -40]
        live = noisy(body, rng, 0.2).moved(true)
        start = time.perf_counter()
        try:
            result = reference.align(live, isocentre_mm=ISOCENTRE_MM, anywhere=True, context=context)
        except sgrt.Error as error:
            refused += 1
            print(f"  seed {seed}: {error}")
            continue
        finally:
            took.append(1e3 * (time.perf_counter() - start))
        off = np.linalg.norm(error_of(result.reference_from_live, true)[3:])
        if off < 0.5:
            good += 1
        elif result.verdict == "ok":
            wrong += 1
            print(f"  seed {seed}: WRONG by {off:.1f} mm")
        else:
            refused += 1
            print(f"  seed {seed}: {off:.1f} mm off, {result.verdict_text}")
    cpu = 1e3 * (time.process_time() - cpu) / len(trials)
    counts = f"{good} right, {refused} refused, {wrong} wrong of {len(trials)}"
    print(f"{counts}; {np.median(took):.0f} ms, {cpu:.0f} ms of CPU")


# --------------------------------------------------------------------------------------------------------------- head


def head(trials: range) -> None:
    """The face, rendered for both pods of the simulated room (exact rig), matched, fused, laid on the plan's skin."""
    from sgrt import twin

    room, phantom = twin.Room(3), twin.head()
    points, normals = twin.sample_surface(phantom, 30000, 1)
    reference = sgrt.Surface(points, normals=normals, sigma_mm=np.full(len(points), 0.01))
    isocentre = points.mean(axis=0)
    low, high = points.min(axis=0), points.max(axis=0)
    up = points[normals[:, 2] > 0.3]
    print(f"head from {np.round(low)} to {np.round(high)}, {len(up)} points face up")
    prepared = sgrt.Reference(reference)
    rig, context = sgrt.Rig(room.rig_json()), sgrt.Context(threads=2)
    sessions = {
        pair.id: sgrt.StereoSession(rig, pair.id, volume_min_mm=low - 60, volume_max_mm=high + 60) for pair in rig.pairs
    }
    errors, sigmas = [], []
    for seed in trials:
        pose, _ = twin.random_displacement(100 + seed, 10, 3)
        images = room.capture(phantom, pose, seed=seed)
        seen = []
        for pod, (left, right) in room.pairs.items():
            seen.append(sessions[pod].push(images[left], images[right], time_s=float(seed), context=context).surface)
        live = sgrt.surface_fuse(seen, context=context)[0]
        # The twin displaces about the room's origin: carried to the isocentre.
        truth, _ = sgrt.frames.shift_from_pose(np.linalg.inv(pose), isocentre)
        result = prepared.align(live, isocentre_mm=isocentre, context=context)
        found = result.displacement.as_dict()
        errors.append([found[key] - truth.as_dict()[key] for key in list(found)[:6]])
        sigmas.append([*result.sigma_mm, *result.sigma_deg])
        print(f"  {seed}: {np.round(errors[-1], 3)}, {result.verdict_text}, {live.points.shape}", flush=True)
    errors = np.array(errors)
    print(f"bias {np.round(errors.mean(axis=0), 4)} (mm, mm, mm, deg, deg, deg)")
    print(f"noise {np.round(errors.std(axis=0, ddof=1), 4)}, said {np.round(np.mean(sigmas, axis=0), 4)}")


# ------------------------------------------------------------------------------------------------------------ regions


def bodies() -> dict[str, tuple]:
    """Height over (x, y) of each body, its half sides and an isocentre inside."""

    def face(x, y):
        z = 75 * np.sqrt(np.clip(1 - (x / 85) ** 2 - (y / 120) ** 2, 0.02, 1))
        for u, v, h, s, t in (
            (0, -5, 24, 9, 16),
            (-32, 28, -7, 13, 9),
            (32, 28, -7, 13, 9),
            (0, -45, 4, 18, 6),
            (0, -80, 9, 16, 12),
        ):
            z = z + h * np.exp(-(((x - u) / s) ** 2) / 2 - ((y - v) / t) ** 2 / 2)
        return z

    def breast(x, y):
        z = 90 * np.sqrt(np.clip(1 - (x / 190) ** 2, 0.02, 1))
        for u, v, h, s in ((-75, 0, 42, 42), (75, 0, 38, 42)):
            z = z + h * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * s**2))
        return z

    def limb(x, y):
        r = 55 + 0.05 * y
        z = np.sqrt(np.clip(r**2 - x**2, 4, None))
        return z + 6 * np.exp(-((x - 15) ** 2) / 300 - (y - 110) ** 2 / 700)

    return {
        "head": (face, 70, 100, np.array([0.0, 0, -10])),
        "breast": (breast, 150, 130, np.array([-70.0, 0, 60])),
        "limb": (limb, 45, 150, np.array([0.0, 0, 0])),
    }


def ellipse(x: float, y: float, a: float, b: float) -> sgrt.Roi:
    t = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    return sgrt.Roi.polygon(np.stack([x + a * np.cos(t), y + b * np.sin(t)], axis=1))


REGIONS = {
    "head": [(0, 0, 60, 85), (0, 0, 30, 40), (0, 70, 25, 14), (50, 0, 14, 30), (0, -40, 40, 40)],
    "breast": [(0, 0, 140, 120), (-75, 0, 60, 60), (0, 95, 90, 25), (75, 10, 35, 35), (0, -95, 120, 25)],
    "limb": [(0, 0, 42, 145), (0, -60, 40, 70), (0, 105, 40, 40), (0, 0, 25, 60), (0, -110, 30, 25)],
}


def plain_icp(reference, normals, tree, inside, live, isocentre, rounds=15) -> np.ndarray:
    """Point-to-plane ICP without any doubt of its own: what an ordinary program makes of the region."""
    pose = np.eye(4)
    for _ in range(rounds):
        y = moved(live, pose)
        distance, at = tree.query(y, distance_upper_bound=10)
        use = np.isfinite(distance)
        use[use] = inside[at[use]]
        n, q = normals[at[use]], reference[at[use]]
        j = np.concatenate([np.cross(y[use] - isocentre, n), n], axis=1)
        step = np.linalg.lstsq(j, -np.einsum("ij,ij->i", y[use] - q, n), rcond=1e-9)[0]
        turn = rotation(step[:3])
        delta = np.eye(4)
        delta[:3, :3] = turn
        delta[:3, 3] = step[3:] + isocentre - turn @ isocentre
        pose = delta @ pose
    return pose


def regions(trials: range, noise_mm: float = 0.5, points: int = 4000) -> None:
    """Predicted error of each region against the real one on new draws; that of plain ICP where ours refuses."""
    predicted, real, flagged, beyond = [], [], [], []
    for body, (height, half_x, half_y, isocentre) in bodies().items():

        def draw(rng, count=points, height=height, half_x=half_x, half_y=half_y):
            xy = rng.uniform(-1, 1, (count, 2)) * [half_x, half_y]
            return np.column_stack([xy, height(*xy.T)]) + rng.normal(0, noise_mm, (count, 3))

        rois = [ellipse(*region) for region in REGIONS[body]]
        mm = np.zeros((len(trials), len(rois)))
        deg = np.zeros_like(mm)
        for k, seed in enumerate(trials):
            rng = np.random.default_rng([6, seed])
            reference = sgrt.Surface(draw(rng), sigma_mm=np.full(points, noise_mm)).estimate_normals()
            x, n = np.asarray(reference.points), np.asarray(reference.normals)
            known = np.isfinite(n).all(axis=1)
            x, n = x[known], n[known]
            live, tree = draw(rng), cKDTree(x)
            for i, (u, v, a, b) in enumerate(REGIONS[body]):
                inside = ((x[:, 0] - u) / a) ** 2 + ((x[:, 1] - v) / b) ** 2 < 1
                try:
                    pose = sgrt.icp_align(reference, sgrt.Surface(live), isocentre_mm=isocentre, roi=rois[i])
                    pose = pose.reference_from_live
                except sgrt.Error:
                    pose = plain_icp(x, n, tree, inside, live, isocentre)
                mm[k, i] = np.linalg.norm(moved(isocentre[None], pose)[0] - isocentre)
                deg[k, i] = np.degrees(np.arccos(np.clip((np.trace(pose[:3, :3]) - 1) / 2, -1, 1)))
        advice = sgrt.roi_advise(reference, rois, isocentre_mm=isocentre, live_sigma_mm=noise_mm)
        rms_mm, rms_deg = np.sqrt(np.mean(mm**2, axis=0)), np.sqrt(np.mean(deg**2, axis=0))
        for i in range(len(rois)):
            print(
                f"{body:7}{REGIONS[body][i]!s:22} real {rms_mm[i]:7.3f} mm {rms_deg[i]:7.3f} deg, predicted"
                f" {advice.error_mm[i]:7.3f} {advice.error_deg[i]:7.3f}"
                f" {'flagged' if advice.flagged[i] else '':8}{advice.words[i]}"
            )
        predicted += list(advice.score)
        real += list(np.hypot(rms_mm / 1, rms_deg / 0.5))
        flagged += list(advice.flagged)
        beyond += list((rms_mm > 1) | (rms_deg > 0.5))
        print(
            f"{body:7}proposal: {advice.proposal_error_mm:.3f} mm, {advice.proposal_error_deg:.3f} deg"
            f" on {100 * advice.proposal_share:.0f} % of the points, better {advice.better}"
        )
    flagged, beyond = np.array(flagged), np.array(beyond)
    spearman = np.corrcoef(rankdata(predicted), rankdata(real))[0, 1]
    print(
        f"Spearman {spearman:.3f}; beyond the limits {beyond.sum()} of {len(beyond)}, of them flagged"
        f" {np.sum(flagged & beyond)}, false alarms {np.sum(flagged & ~beyond)}"
    )


def bits(trials: range) -> None:
    rng = np.random.default_rng(7)
    reference = noisy(torso(8000, rng), rng)
    live = [noisy(torso(3000, rng) + rng.normal(0, 0.5, 3), rng) for _ in range(20)]
    hashes = set()
    for threads in (1, 2, 3, 4, 8, 16):
        context = sgrt.Context(threads=threads)
        tracker = sgrt.Tracker(reference, isocentre_mm=ISOCENTRE_MM, context=context)
        digest = hashlib.sha256()
        for i in trials:
            frame = tracker.push(live[i % len(live)], time_s=0.05 * i, context=context)
            digest.update(frame.reference_from_live.tobytes() + frame.covariance.tobytes())
        hashes.add(digest.hexdigest())
        print(f"{threads:2} threads: {digest.hexdigest()[:16]}")
    print("equal" if len(hashes) == 1 else "DIFFERENT")


def speed(trials: range) -> None:
    """A prepared registration, certificate included: wall time and user CPU time of all threads, and of preparing."""
    for count in (20_000, 100_000):
        rng = np.random.default_rng(8)
        true = motion(rng, 11, 2.7)
        reference, live = (
            sgrt.Surface(x + rng.normal(0, 0.2, x.shape), sigma_mm=np.full(count, 0.2))
            for x in (torso(count, rng), moved(torso(count, rng), true))
        )
        for threads in (1, 2):
            context = sgrt.Context(threads=threads)
            start = time.perf_counter()
            prepared = sgrt.Reference(reference, context=context)
            preparing = 1e3 * (time.perf_counter() - start)
            took, cpu = [], time.process_time()
            for _ in trials:
                start = time.perf_counter()
                prepared.align(live, isocentre_mm=ISOCENTRE_MM, context=context)
                took.append(1e3 * (time.perf_counter() - start))
            cpu = 1e3 * (time.process_time() - cpu) / len(trials)
            print(
                f"{count} points, {threads} thread(s): least {min(took):.2f}, p50 {np.median(took):.2f} ms,"
                f" {cpu:.2f} ms of CPU; preparing {preparing:.0f} ms"
            )


CAMPAIGNS = {
    "coverage": (coverage, 2000),
    "shapes": (shapes, 100),
    "convergence": (convergence, 500),
    "anywhere": (anywhere, 200),
    "head": (head, 12),
    "regions": (regions, 20),
    "bits": (bits, 1000),
    "speed": (speed, 200),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", choices=CAMPAIGNS)
    parser.add_argument("--trials", type=int)
    parser.add_argument("--first", type=int, default=0)
    arguments = parser.parse_args()
    campaign, trials = CAMPAIGNS[arguments.name]
    start = time.process_time()
    campaign(range(arguments.first, arguments.first + (arguments.trials or trials)))
    print(f"{time.process_time() - start:.0f} s of CPU")


if __name__ == "__main__":
    main()
