"""The wheel in dist: what is inside, under which licences, and that it works in clean environments, beside OpenCV."""

import json
import re
import subprocess
import zipfile

import pytest
from conftest import ROOT, SCENE, built, run

SYSTEM = {"libstdc++.so.6", "libgcc_s.so.1", "libm.so.6", "libc.so.6", "ld-linux-x86-64.so.2"}
COPYLEFT = re.compile(r"cholmod|spqr|umfpack|suitesparse|cxsparse|glog|gomp|gmp|mpfr|fftw|gsl|readline|ceres")
CV = "opencv-python-headless"  # opencv-python without its windows, which need the system's OpenGL
BESIDE_OF = {"numpy 1.26": ["numpy==1.26.*", f"{CV}<4.12", "click==8.1.*"], "numpy 2": ["numpy>=2", CV]}
# A process that has both, loaded in the order of its first argument, does a job with each.
BESIDE = """
import sys
for name in sys.argv[1].split(","):
    __import__(name)
import cv2, numpy as np, sgrt
reference, live = (sgrt.io.read_surface(f"{name}.ply") for name in ("reference", "live"))
cv2.GaussianBlur(np.zeros((512, 512), np.float32), (31, 31), 5)
result = sgrt.icp_align(reference, live, isocentre_mm=(0, 0, 0))
cv2.solvePnP(np.random.rand(8, 3), np.random.rand(8, 2), np.eye(3), None)
print(result.displacement.lng_mm)
"""
GPL = """
import importlib.metadata as m, re
for d in m.distributions():
    text = " ".join([d.metadata.get("License-Expression") or "", (d.metadata.get("License") or "")[:200],
                     *[c for c in d.metadata.get_all("Classifier") or [] if c.startswith("License")]])
    if re.search(r"\\bA?GPL|GNU (AFFERO )?GENERAL", text, re.I) and "LGPL" not in text:
        print(d.name, text)
"""


@pytest.fixture(scope="module")
def wheel():
    return built("*.whl")


@pytest.fixture(scope="module")
def unpacked(wheel, tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    zipfile.ZipFile(wheel).extractall(folder)
    return folder


def libraries(unpacked):
    return sorted(unpacked.rglob("*.so*"))


def test_small_and_for_debian_12(wheel):
    assert wheel.stat().st_size <= 12e6
    tags = re.findall(r"manylinux_2_(\d+)_x86_64", wheel.name)
    assert tags and min(map(int, tags)) <= 36, wheel.name


def test_needs_nothing_but_itself_and_the_run_time(unpacked):
    own = {path.name for path in libraries(unpacked)}
    assert len(own) == 3, own  # the extension, libsgrt, lz4
    for path in libraries(unpacked):
        section = run("readelf", "-dW", path)
        needed = set(re.findall(r"\(NEEDED\).*\[(.*?)\]", section))
        assert needed <= SYSTEM | own, path
        assert not [name for name in needed | own if COPYLEFT.search(name)]
        for value in re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*?)\]", section):
            assert all(part.startswith("$ORIGIN") for part in value.split(":")), f"{path}: {value}"
        assert ".symtab" not in run("readelf", "-SW", path), f"{path} is not stripped"


def test_no_path_of_the_machine_that_built_it(unpacked):
    for path in unpacked.rglob("*"):
        assert not path.is_file() or str(ROOT).encode() not in path.read_bytes(), path


def test_licences_of_all_that_is_inside(unpacked):
    (folder,) = unpacked.glob("*.dist-info/licenses")
    inside = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    wanted = [*ROOT.glob("LICENSES/*.txt"), *ROOT.glob("packaging/notices/*")]
    assert len(wanted) > 10
    for path in wanted:
        assert inside[path.relative_to(ROOT).as_posix()].read_bytes() == path.read_bytes()


@pytest.mark.parametrize("packages", BESIDE_OF.values(), ids=BESIDE_OF.keys())
def test_in_a_clean_environment(wheel, packages, tmp_path):
    run("/usr/bin/python3", "-m", "venv", tmp_path / "venv")
    python, environment = tmp_path / "venv/bin/python", {"PATH": "/usr/bin:/bin"}
    run(python, "-m", "pip", "install", "-q", "--disable-pip-version-check", wheel, packages[0], *packages[2:])
    assert run(python, "-c", GPL, env=environment) == ""
    run(python, "-c", SCENE, cwd=tmp_path, env=environment)
    assert run(tmp_path / "venv/bin/sgrt", "--version", env=environment).startswith("sgrt ")
    options = ["--reference", "reference.ply", "--live", "live.ply", "--isocentre", "0", "0", "0", "--json"]
    result = json.loads(run(tmp_path / "venv/bin/sgrt", "register", *options, cwd=tmp_path, env=environment))
    found = [result["patient_displacement"][name] for name in ("lat_mm", "lng_mm", "vrt_mm")]
    assert result["status"] == "ok" and found == pytest.approx([3, -2, 1.5], abs=0.05)
    command = [tmp_path / "venv/bin/sgrt", "register", "--reference", "none.ply", *options[2:]]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "none.ply" in done.stderr
    run(python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *packages)
    for order in ("cv2,sgrt", "sgrt,cv2"):
        lng_mm = float(run(python, "-c", BESIDE, order, cwd=tmp_path, env=environment))
        assert lng_mm == pytest.approx(-2, abs=0.05)
