"""Times ours and a peer alternately (A B A B ...) and makes a row of it.

A peer lives in a process of its own, benchmarks/peers.py in the virtual environment .venv-peers, so that its libraries
and thread pools cannot meet ours. Both sides read the same .npz file, prepare, and take the time of each call
themselves, by time.perf_counter round the call alone.
"""

import json
import math
import os
import statistics
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
PEERS_VENV = ROOT / ".venv-peers"

Arrays = dict[str, np.ndarray]
Timed = Callable[[int], tuple[float, Arrays]]  # of the round: milliseconds, what came out


def need_peers() -> Path:
    """The Python of .venv-peers, made where it is missing or its requirements have changed."""
    requirements = (Path(__file__).parent / "peers.txt").read_text()
    stamp = PEERS_VENV / "requirements.stamp"
    python = PEERS_VENV / "bin/python"
    if not stamp.exists() or stamp.read_text() != requirements:
        subprocess.run(["/usr/bin/python3", "-m", "venv", PEERS_VENV], check=True)
        subprocess.run([python, "-m", "pip", "install", "-q", *requirements.split()], check=True)
        stamp.write_text(requirements)
    return python


class Peer:
    """A named peer of peers.py with its inputs loaded and prepared; call it with the number of the round."""

    def __init__(self, name: str, inputs: Path, threads: int):
        pools = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
        environment = os.environ | dict.fromkeys(pools, str(threads))
        command = [need_peers(), Path(__file__).with_name("peers.py"), name, inputs, str(threads)]
        self.output = inputs.with_name("peer.npz")
        self.process = subprocess.Popen(
            [*command, self.output], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, text=True
        )
        self._answer()  # prepared

    def __call__(self, index: int) -> tuple[float, Arrays]:
        self.process.stdin.write(f"{index}\n")
        self.process.stdin.flush()
        milliseconds = self._answer()
        with np.load(self.output) as arrays:
            return milliseconds, dict(arrays)

    def _answer(self) -> float:
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"the peer ended with exit code {self.process.wait()}")
        return json.loads(line)

    def __enter__(self) -> "Peer":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()


def timed(work: Callable[[int], Arrays]) -> Timed:
    """The time of the call alone. Short ones are repeated for 20 ms, the median counts: else the caches that the other
    side has emptied are what is measured."""

    def call(index: int) -> tuple[float, Arrays]:
        times: list[float] = []
        while sum(times) < 20:
            start = time.perf_counter()
            arrays = work(index)
            times.append((time.perf_counter() - start) * 1e3)
        return statistics.median(times), arrays

    return call


def alternate(ours: Timed, peer: Timed, repeats: int) -> tuple[float, float, list[Arrays], list[Arrays]]:
    """Medians of both over A B A B ... (one round before them is not counted), and what both gave in each round."""
    ours(0)
    peer(0)
    rounds = [(ours(index), peer(index)) for index in range(repeats)]
    (a, ours_arrays), (b, peer_arrays) = (zip(*side, strict=True) for side in zip(*rounds, strict=True))
    return statistics.median(a), statistics.median(b), list(ours_arrays), list(peer_arrays)


def row(
    work: str,
    ours_ms: float,
    peer: str,
    peer_ms: float,
    ours_error: float,
    peer_error: float,
    unit: str,
    threads: int,
) -> dict[str, str | float | int | None]:
    """ratio: how many times as long as ours the peer takes. An error is null where there was no answer."""
    return {
        "work": work,
        "ours_ms": _short(ours_ms),
        "peer": peer,
        "peer_ms": _short(peer_ms),
        "ratio": _short(peer_ms / ours_ms),
        "ours_error": _short(ours_error),
        "peer_error": _short(peer_error),
        "unit": unit,
        "threads": threads,
    }


def _short(value: float) -> float | None:
    return float(f"{value:.4g}") if math.isfinite(value) else None
