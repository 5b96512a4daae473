"""Draws docs/images/track.png, a tracked session of a simulated torso:
.venv/bin/python benchmarks/track_picture.py [FILE]

A patient who breathes, drifts, coughs, is hidden from the cameras for a moment and is set up again.
"""

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import sgrt
from icp import ISOCENTRE_MM, torso

STEP_S, LENGTH_S, TOLERANCE_MM = 0.2, 60, 2.0
HIDDEN_S, REPAIRED_S = (38, 41), 48
COLOURS = {"lat_mm": "#0072b2", "lng_mm": "#d55e00", "vrt_mm": "#009e73"}


def motion(t: float) -> np.ndarray:
    """Where the body is, mm: breath, a drift towards the feet until the set-up is repaired, a cough."""
    drift = 0.06 * (t if t < REPAIRED_S else t - REPAIRED_S)
    cough = 4 * np.exp(-(((t - 22) / 0.7) ** 2))
    return np.array([0.2 * np.sin(0.3 * t), -drift + 0.1 * np.sin(1.4 * t), 0.3 * np.sin(1.4 * t) + cough])


def session() -> tuple[np.ndarray, list[sgrt.TrackFrame]]:
    rng = np.random.default_rng(1)

    def surface(count: int, shift: np.ndarray) -> sgrt.Surface:
        points = torso(count, rng) + shift + rng.normal(0, 0.3, (count, 3))
        return sgrt.Surface(points, sigma_mm=np.full(count, 0.3)).estimate_normals()

    tracker = sgrt.Tracker(surface(20000, np.zeros(3)), isocentre_mm=ISOCENTRE_MM)
    times = np.arange(0, LENGTH_S, STEP_S)
    frames = []
    for t in times:
        hidden = HIDDEN_S[0] <= t < HIDDEN_S[1]
        frames.append(tracker.push(None if hidden else surface(4000, motion(t)), time_s=float(t)))
    return times, frames


def main() -> None:
    path = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs/images/track.png")
    times, frames = session()
    figure, axes = plt.subplots(figsize=(9, 3.6), layout="constrained")
    axes.axhspan(-TOLERANCE_MM, TOLERANCE_MM, color="0.93", label="tolerance")
    on = np.array([frame.beam == "on" for frame in frames])
    axes.fill_between(
        times,
        0,
        1,
        where=~on,
        step="post",
        transform=axes.get_xaxis_transform(),
        color="#cc3311",
        alpha=0.15,
        lw=0,
        label="beam holds",
    )
    for key, colour in COLOURS.items():
        axes.plot(
            times, [getattr(frame.displacement, key) for frame in frames], color=colour, lw=1.2, label=key[:3].upper()
        )
    axes.plot(times, [frame.displacement.mag_mm for frame in frames], color="0.2", lw=0.8, ls=":", label="length")
    axes.set(xlim=(0, LENGTH_S), xlabel="time, s", ylabel="displacement at the isocentre, mm")
    axes.legend(ncols=6, loc="upper center", bbox_to_anchor=(0.5, 1.14), frameon=False)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    print(f"{path}: the beam is on in {on.mean():.0%} of {len(frames)} frames")


if __name__ == "__main__":
    main()
