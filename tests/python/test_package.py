"""The package: no arithmetic of its own, complete stubs, an exception class a status, docstrings that name C."""

import ast
import importlib.metadata
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import sgrt
from conftest import ROOT
from packaging.requirements import Requirement
from sgrt import _core

PACKAGE = ROOT / "bindings/python/sgrt"
HEADER = (ROOT / "include/sgrt.h").read_text()


def modules() -> list[Path]:
    return [path for path in sorted(PACKAGE.rglob("*.py")) if "twin" not in path.relative_to(PACKAGE).parts]


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_computes_nothing_that_a_clinic_acts_on(path):
    """No numpy.linalg and no scipy outside the simulated room: such numbers come from the library."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Attribute) and node.attr == "linalg":
            names = ["numpy.linalg"]
        for name in names:
            assert not re.match(r"scipy\b|numpy\.linalg\b", name), f"{path}:{node.lineno}: {name}"


def test_the_extension_sees_sgrt_h_alone():
    sources = list((ROOT / "bindings/python/src").iterdir())
    own = {path.name for path in sources if path.suffix == ".hpp"}
    for path in sources:
        quoted = re.findall(r'#include "(.*?)"', path.read_text())
        assert set(quoted) <= own, path
        angled = re.findall(r"#include <(.*?)>", path.read_text())
        assert not [name for name in angled if "/" in name and not name.startswith("pybind11/")], path


def test_stub_is_what_the_extension_says():
    check = subprocess.run([sys.executable, ROOT / "scripts/stubs", "--check"], capture_output=True, text=True)
    assert check.returncode == 0, check.stderr


def test_stubtest():
    pytest.importorskip("mypy")
    check = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "sgrt._core", "--allowlist", ROOT / "tests/python/stubtest.txt"],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert check.returncode == 0, check.stdout


def test_version_stands_in_the_header_alone():
    numbers = re.findall(r"#define SGRT_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", HEADER)
    assert sgrt.__version__ == sgrt.version() == ".".join(numbers)
    assert "version" in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dynamic"]


def test_one_exception_class_a_status():
    codes = {int(n): word for word, n in re.findall(r"SGRT_E_(\w+) = (\d+)", HEADER)}
    classes = {cls.status: cls for cls in vars(sgrt).values() if isinstance(cls, type) and issubclass(cls, sgrt.Error)}
    del classes[sgrt.Error.status]
    classes[23] = sgrt.InternalError
    assert classes.keys() == codes.keys()
    for status, cls in classes.items():
        assert cls("x").word == codes[status].lower()
        assert sgrt.errors.class_of(status) is cls
    assert issubclass(sgrt.InvalidArgument, ValueError)
    assert issubclass(sgrt.FormatError, ValueError)
    assert issubclass(sgrt.OutOfMemory, MemoryError)
    assert sgrt.errors.class_of(99) is sgrt.InternalError
    assert _core.status_word(99) == "unknown"


def functions() -> dict[str, object]:
    found = {}
    for name, value in vars(_core).items():
        if name.startswith("__") or isinstance(value, tuple):
            continue
        found[name] = value
        if isinstance(value, type):
            for method in vars(value):
                if not method.startswith("_") and callable(getattr(value, method)):
                    found[f"{name}.{method}"] = getattr(value, method)
    return found


def test_docstrings_name_their_c_function():
    header = set(re.findall(r"\bsgrt_\w+", HEADER))
    for name, value in functions().items():
        named = re.findall(r"C: (.*)$", value.__doc__, flags=re.M)
        if name in ("Roi", "PatientDisplacement.as_dict", "CouchCorrection.as_dict"):
            continue
        assert named, name
        assert set(re.findall(r"sgrt_\w+", named[-1])) <= header, name


def test_defaults_are_the_librarys():
    """What the header says of a default stands in the signature."""
    for noun in ("icp", "coarse"):
        signature = getattr(_core, f"{noun}_align").__doc__.splitlines()[0]
        options = re.search(rf"typedef struct sgrt_{noun}_options \{{(.*?)\}}", HEADER, flags=re.S)[1]
        defaults = re.findall(r"(?:int32_t|double) (\w+);\s*/\* [^*]*?default ([\d.e-]+)", options)
        assert len(defaults) >= 4
        for option, value in defaults:
            written = re.search(rf" {option}: [^=]*= ([\d.e-]+)", signature)
            assert written and float(written[1]) == float(value), option


def test_the_library_stands_beside_the_extension():
    """The extension finds libsgrt by $ORIGIN, in a wheel and in an editable install."""
    needs = subprocess.run(["readelf", "-d", _core.__file__], capture_output=True, text=True, check=True).stdout
    assert re.search(r"(RUNPATH|RPATH).*\[\$ORIGIN\]", needs)
    library = re.search(r"NEEDED.*\[(libsgrt\.so\.\S+)\]", needs)[1]
    beside = Path(_core.__file__).parent / library
    assert beside.is_file()
    assert not beside.is_symlink()


def test_import_is_quiet_and_lean():
    code = (
        "import sgrt, sys; print(sorted(m for m in sys.modules if m.split('.')[0] in ('scipy', 'matplotlib', 'click')))"
    )
    run = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True)
    assert (run.stdout, run.stderr) == ("[]\n", "")


def test_reprs(reference, rig, stereo):
    for thing in (reference, rig, stereo, rig.cameras[0], rig.pairs[0], sgrt.Context(), sgrt.PatientDisplacement()):
        assert re.search(r"sgrt\.|PatientDisplacement", repr(thing))
    assert "8000 points" in repr(reference)
    assert repr(sgrt.Roi.polygon(np.eye(3)[:, :2])) == "<sgrt.Roi polygon of 3 vertices>"


def licence(distribution):
    """What a package's metadata says of its licence, in short."""
    data = distribution.metadata
    classifiers = [c for c in data.get_all("Classifier") or [] if c.startswith("License ::")]
    return " ".join([data.get("License-Expression") or "", (data.get("License") or "")[:300], *classifiers])


COPYLEFT = re.compile(r"\bA?GPL|GNU\s+(AFFERO\s+)?GENERAL", re.IGNORECASE)


def test_what_pip_brings_is_under_permissive_licences():
    """The packages that sgrt asks for, with the extras of users, and what those ask for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    todo = [*project["dependencies"], *extras["dicom"], *extras["twin"], *extras["plot"]]
    seen = {}
    while todo:
        requirement = Requirement(todo.pop())
        name = requirement.name.lower().replace("_", "-")
        if name in seen or (requirement.marker and not requirement.marker.evaluate({"extra": ""})):
            continue
        distribution = importlib.metadata.distribution(name)
        seen[name] = licence(distribution)
        todo += distribution.requires or []
    assert {"numpy", "click", "pydicom", "matplotlib", "contourpy"} <= seen.keys()
    assert not {name: text for name, text in seen.items() if COPYLEFT.search(text)}
    assert COPYLEFT.search("GNU GENERAL PUBLIC LICENSE") and COPYLEFT.search("License :: GPLv3")
