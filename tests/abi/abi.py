"""What the ABI's tests share: the header read, the built library found. Needs no third-party package but pytest."""

import os
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEADER = ROOT / "include" / "sgrt.h"
BUILD = Path(os.environ.get("SGRT_BUILD_DIR", ROOT / "build" / "dev"))


def run(*command, **options):
    """Output of a command; its own message where it fails."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}"
    return done.stdout


def library():
    """The built libsgrt.so."""
    path = BUILD / "libsgrt.so"
    assert path.exists(), f"{path} is not built (SGRT_BUILD_DIR names the build folder)"
    return path


def without_comments(text):
    """C or C++ source with comments and the content of string literals blanked; lines are kept."""

    def blank(match):
        token = match.group(0)
        if token.startswith("/"):
            return re.sub(r"[^\n]", " ", token)
        return token[0] + " " * (len(token) - 2) + token[-1]

    return re.sub(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])+'", blank, text, flags=re.S)


def header():
    """sgrt.h without comments."""
    return without_comments(HEADER.read_text())


def declared_functions():
    """Names of the functions that sgrt.h declares."""
    return set(re.findall(r"SGRT_API\s+[\w\s]+?[\s*](sgrt_\w+)\s*\(", header()))
