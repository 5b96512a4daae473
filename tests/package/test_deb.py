"""The Debian packages in dist, installed in a fresh Debian of nothing but what they ask for: the tests that they carry
(packaging/debian/tests) run there, with the distribution's numpy and C compiler."""

import os
import re
import shutil
from pathlib import Path

import pytest
from conftest import DIST, ROOT, built, run

SOURCES = "/etc/apt/sources.list.d/debian.sources", "/etc/apt/sources.list"
TESTS = ROOT / "packaging/debian/tests"


@pytest.fixture(scope="module")
def debian(tmp_path_factory):
    if not sorted(DIST.glob("*.deb")):
        pytest.skip(f"no packages in {DIST}; scripts/package deb makes them")
    if shutil.which("mmdebstrap") is None or os.geteuid() != 0:
        pytest.skip("needs mmdebstrap and root")
    folder = tmp_path_factory.mktemp("debian") / "root"
    hooks = [f"--customize-hook=copy-in {path} /var/tmp" for path in (*sorted(DIST.glob("*.deb")), TESTS)]
    hooks.append("--customize-hook=chroot $1 sh -c 'apt-get install -y --no-install-recommends /var/tmp/*.deb'")
    # From where this machine has its packages.
    source = next(path for path in map(Path, SOURCES) if path.exists())
    compiler = "--include=gcc,libc6-dev,pkg-config"
    run("mmdebstrap", "--mode=root", "--variant=apt", compiler, *hooks, "bookworm", folder, source)
    yield folder
    shutil.rmtree(folder)


@pytest.mark.parametrize("name", ["c-example", "python"])
def test_installed(debian, name):
    environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LANG": "C.UTF-8", "TMPDIR": "/var/tmp"}
    output = run("chroot", debian, f"/var/tmp/tests/{name}", env=environment)
    assert "ok" in output


def test_names():
    soname = re.search(r"\[libsgrt\.so\.(.*)\]", run("readelf", "-dW", ROOT / "build/dev/libsgrt.so")).group(1)
    library = built(f"libsgrt{soname}_*.deb")
    assert "liblz4-1" in run("dpkg-deb", "-f", library, "Depends")
    fields = run("dpkg-deb", "-f", built("python3-sgrt_*.deb"), "Depends")
    assert {"python3-numpy", "python3-click", "python3-pil", "python3-tqdm", f"libsgrt{soname}"} <= {
        re.split(r"[ :]", name.strip())[0] for name in fields.split(",")
    }
