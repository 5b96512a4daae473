"""The sdist in dist: what it holds, and that a wheel builds from it."""

import tarfile
import zipfile

import pytest
from conftest import ROOT, built, run


@pytest.fixture(scope="module")
def sdist():
    return built("*.tar.gz")


def test_holds_the_source_and_nothing_built(sdist):
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    for wanted in ("include/sgrt.h", "LICENSE", "packaging/notices/eigen.txt", "libsgrt/layers.txt", "CHANGELOG.md"):
        assert wanted in names
    known = set(run("git", "-C", ROOT, "ls-files", "-z").split("\0")) | {"PKG-INFO"}
    assert not {name for name in names if name not in known}


def test_a_wheel_builds_from_it(sdist, tmp_path):
    """In an environment that holds nothing: pip fetches what the build requires."""
    run("tar", "-xf", sdist, "-C", tmp_path)
    (source,) = tmp_path.iterdir()
    run("/usr/bin/python3", "-m", "venv", tmp_path / "venv")
    pip = [tmp_path / "venv/bin/python", "-m", "pip", "--disable-pip-version-check"]
    run(*pip, "wheel", "-q", "--no-deps", "-w", tmp_path / "out", source)
    (wheel,) = (tmp_path / "out").glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert any(name.startswith("sgrt/_core.") for name in names) and "sgrt/py.typed" in names
