"""An installation of build/dev (SGRT_BUILD_DIR names another tree) in a temporary prefix."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def run(*command, **keywords):
    """Runs a command to success and returns what it printed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **keywords)
    assert done.returncode == 0, f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="session")
def prefix(tmp_path_factory):
    # Moved after the installation: nothing in it may know the path that it was installed to.
    tree = os.environ.get("SGRT_BUILD_DIR", ROOT / "build/dev")
    first = tmp_path_factory.mktemp("first") / "prefix"
    run("cmake", "--install", tree, "--prefix", first)
    return first.rename(tmp_path_factory.mktemp("moved") / "prefix")
