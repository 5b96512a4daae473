"""The tracker on a 5,000-point ROI of a torso that breathes and drifts:
.venv/bin/python benchmarks/track.py [--frames N]

Prints p50, p99 and p99.9 of a frame (sgrt.Tracker.push, the surface made before), its user CPU time, and whether
all bits are the same at 1, 2, 3, 4, 8 and 16 threads. Points are newly drawn, with 0.2 mm noise, for 20 frames that
are pushed again and again.
"""

import argparse
import hashlib
import resource
import time

import numpy as np
import sgrt
from icp import ISOCENTRE_MM, torso

NOISE_MM = 0.2


def surface(rng: np.random.Generator, count: int, shift_mm: np.ndarray) -> sgrt.Surface:
    points = torso(count, rng) + shift_mm + rng.normal(0, NOISE_MM, (count, 3))
    return sgrt.Surface(points, sigma_mm=np.full(count, NOISE_MM)).estimate_normals()


def stream(points: int, frames: int) -> tuple[sgrt.Surface, list[sgrt.Surface]]:
    """The reference, and frames of a slow drift with a breath of 0.5 mm."""
    rng = np.random.default_rng(points)
    reference = surface(rng, 20_000, np.zeros(3))
    phase = 2 * np.pi * np.arange(frames) / frames
    shifts = np.stack([0.2 * np.sin(phase), 0.3 * np.cos(phase), 0.5 * np.sin(2 * phase)], axis=1)
    return reference, [surface(rng, points, shift) for shift in shifts]


def follow(
    reference: sgrt.Surface, live: list[sgrt.Surface], frames: int, threads: int
) -> tuple[np.ndarray, float, str]:
    """Milliseconds of each frame, user CPU ms a frame, and the hash of all answers."""
    context = sgrt.Context(threads=threads)
    tracker = sgrt.Tracker(reference, isocentre_mm=ISOCENTRE_MM, context=context)
    digest, took = hashlib.sha256(), np.empty(frames)
    cpu = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    for i in range(frames):
        start = time.perf_counter()
        frame = tracker.push(live[i % len(live)], time_s=0.05 * i, context=context)
        took[i] = 1e3 * (time.perf_counter() - start)
        digest.update(frame.reference_from_live.tobytes() + frame.covariance.tobytes() + frame.beam.encode())
        assert frame.status == "ok"
    cpu = resource.getrusage(resource.RUSAGE_SELF).ru_utime - cpu
    return took, 1e3 * cpu / frames, digest.hexdigest()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--points", type=int, default=5000)
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2, 3, 4, 8, 16])
    arguments = parser.parse_args()
    reference, live = stream(arguments.points, 20)
    hashes = set()
    for threads in arguments.threads:
        took, cpu, digest = follow(reference, live, arguments.frames, threads)
        p50, p99, p999 = np.percentile(took, (50, 99, 99.9))
        print(
            f"{arguments.points} points, {arguments.frames} frames, {threads:2} thread(s):"
            f" p50 {p50:.3f}, p99 {p99:.3f}, p99.9 {p999:.3f} ms; {cpu:.3f} ms of user CPU a frame; {digest[:16]}",
            flush=True,
        )
        hashes.add(digest)
    print("the same bits at every number of threads" if len(hashes) == 1 else "THE BITS DIFFER")


if __name__ == "__main__":
    main()
