"""What is shipped and under which licences: the bill of materials, and the licence of every file."""

import json
import os
import re
import subprocess
import sys

import pytest
from conftest import ROOT, run

PERMISSIVE = {"Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "MIT", "MIT-CMU", "MPL-2.0"}


@pytest.fixture(scope="module")
def sbom():
    return run(sys.executable, "-W", "error", ROOT / "scripts/sbom")


def licences(component):
    (entry,) = component["licenses"]
    return entry.get("expression") or entry["license"]["id"]


def test_sbom_is_cyclonedx(sbom):
    from cyclonedx.schema import SchemaVersion
    from cyclonedx.validation.json import JsonStrictValidator

    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(sbom) is None
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(sbom.replace('"libsgrt"', "7", 1)) is not None


def test_what_is_inside_is_permissive(sbom):
    components = json.loads(sbom)["components"]
    inside = {c["name"]: c for c in components if c["scope"] == "required"}
    assert inside.keys() == {"flann", "lz4", "eigen", "ceres-solver", "nlohmann-json", "pybind11"}
    for component in inside.values():
        assert set(licences(component).split(" AND ")) <= PERMISSIVE and component["version"]
    around = {c["name"]: licences(c) for c in components if c["scope"] == "excluded"}
    assert around["libstdc++"] == "GPL-3.0-or-later WITH GCC-exception-3.1"
    for name, text in around.items():
        assert name in ("libstdc++", "glibc") or set(text.split(" AND ")) <= PERMISSIVE, name


def test_every_inside_has_its_notice(sbom):
    for component in json.loads(sbom)["components"]:
        if component["scope"] == "required":
            notice = (ROOT / f"packaging/notices/{component['name']}.txt").read_text()
            assert f"SPDX: {licences(component)}\n" in notice and re.search("Copyright", notice)


def test_sbom_is_reproducible(sbom):
    assert run(sys.executable, ROOT / "scripts/sbom") == sbom


def test_sbom_refuses_a_stranger():
    """A header of a package that scripts/sbom does not know is an error, not an omission."""
    code = """import runpy, sys
m = runpy.run_path(sys.argv[1])
m["inside"](dict.fromkeys([*m["KNOWN"], "libcholmod3"], "1"))"""
    command = [sys.executable, "-c", code, ROOT / "scripts/sbom"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "unknown packages are compiled in: libcholmod3" in done.stderr


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="not a git checkout: reuse would judge what is built, too")
def test_every_file_has_a_licence():
    environment = os.environ | {"PATH": f"{os.path.dirname(sys.executable)}:{os.environ['PATH']}"}
    run("reuse", "--root", ROOT, "lint", "--quiet", env=environment)
