"""Promise 9: the library lives beside OpenCV, OpenMP users, Open3D and another Ceres in one process, whichever is
loaded first, and gives the same bytes as alone. They are looked for in this environment, in .venv-peers (or the folder
of packages that SGRT_PEERS names) and last among Debian's packages; one that is not installed is skipped with that
reason. `scripts/verify beside` installs them all."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PEERS = [str(folder) for folder in ROOT.glob(".venv-peers/lib/python3*/site-packages")]
if "SGRT_PEERS" in os.environ:
    PEERS = [os.environ["SGRT_PEERS"]]
PEERS.append("/usr/lib/python3/dist-packages")

WORK = """
import hashlib, numpy as np, sgrt
y, x = np.mgrid[-60:61:5, -60:61:5].astype(float)
z = 30 * np.cos(x / 55) * np.cos(y / 80) + 6 * np.sin(x / 14 + 0.4) * np.cos(y / 18)
skin = sgrt.Surface(np.stack([x, y, z], -1)).estimate_normals()
pose = np.eye(4)
pose[:3, 3] = 0.8, -0.6, 0.4
live = skin.moved(pose)
found = sgrt.icp_align(skin, live, isocentre_mm=(0, 0, 0))
print(hashlib.sha256(np.asarray(found.reference_from_live).tobytes()).hexdigest())
"""

# What makes each of them work, with threads of its own where it has some.
OTHERS = {
    "cv2": "import cv2, numpy as n; cv2.GaussianBlur(n.ones((512, 512), n.float32), (0, 0), 3)",
    "torch": "import torch; torch.set_num_threads(4); (torch.ones(400, 400) @ torch.ones(400, 400)).sum().item()",
    "sklearn": "import numpy as n; from sklearn.cluster import KMeans; KMeans(3, n_init=2).fit(n.eye(40))",
    "open3d": "import open3d as o, numpy as n; o.geometry.PointCloud(o.utility.Vector3dVector(n.eye(3)))",
    "pyceres": "import pyceres; pyceres.Problem()",
    "scipy": "import numpy as n; from scipy.optimize import least_squares; least_squares(lambda x: x - 1, n.zeros(3))",
}

# Libraries of C++ whose names could clash, loaded so that all may bind to them.
LIBRARIES = ["libceres.so.3", "libgomp.so.1", "libpcl_registration.so.1.13", "libflann_cpp.so.1.9"]


def run(code):
    code = f"import sys; sys.path += {PEERS}\n{code}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def alone():
    return run(WORK)


def test_the_work_is_the_same_twice(alone):
    assert len(alone.strip()) == len(hashlib.sha256().hexdigest())
    assert run(WORK) == alone


@pytest.mark.parametrize("first", ["sgrt", "other"])
@pytest.mark.parametrize("name", OTHERS)
def test_beside(name, first, alone):
    if run(f"import importlib.util as u; print(u.find_spec({name!r}) is not None)").strip() != "True":
        pytest.skip(f"{name} is not installed")
    other = OTHERS[name]
    code = f"{WORK}\n{other}\n{WORK}" if first == "sgrt" else f"{other}\n{WORK}\n{other}\n{WORK}"
    assert run(code) == alone * 2


@pytest.mark.parametrize("first", ["sgrt", "other"])
@pytest.mark.parametrize("name", LIBRARIES)
def test_beside_a_library(name, first, alone):
    load = f"import ctypes; ctypes.CDLL({name!r}, ctypes.RTLD_GLOBAL)"
    done = subprocess.run([sys.executable, "-c", load], capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip(f"{name} is not installed")
    code = f"{WORK}\n{load}\n{WORK}" if first == "sgrt" else f"{load}\n{WORK}\n{WORK}"
    assert run(code) == alone * 2
