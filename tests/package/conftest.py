"""What scripts/package has laid into dist/; a test of what is not there is skipped."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DIST = Path(os.environ.get("SGRT_DIST", ROOT / "dist"))

# Writes reference.ply and live.ply, (3, -2, 1.5) mm apart.
SCENE = """
import numpy as np
import sgrt

x, y = np.meshgrid(np.linspace(-80, 80, 41), np.linspace(-80, 80, 41))
z = 50 * np.exp(-(x**2 + 2 * y**2) / 4000) + 15 * np.exp(-((x - 40) ** 2 + (y - 30) ** 2) / 500)
points = np.stack([x, y, z], -1)
for name, shift in (("reference", (0, 0, 0)), ("live", (3, -2, 1.5))):
    sgrt.io.write_surface(f"{name}.ply", sgrt.Surface(points + shift).estimate_normals())
"""


def run(*command, **keywords):
    """Runs a command to success and returns what it printed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **keywords)
    assert done.returncode == 0, f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


def built(pattern):
    """The one file of dist that matches."""
    found = sorted(DIST.glob(pattern))
    if not found:
        pytest.skip(f"no {pattern} in {DIST}; scripts/package makes it")
    assert len(found) == 1, found
    return found[0]
