"""Every example is compiled (against an installation) and run; each ends well and prints something."""

import os
import re
import sys

import pytest
from conftest import ROOT, run
from test_install import check_six_numbers

EXAMPLES = ROOT / "examples"


@pytest.mark.parametrize("source", sorted(EXAMPLES.glob("*.c")), ids=lambda path: path.name)
def test_c(source, prefix, tmp_path):
    warnings = ["-std=c99", "-pedantic-errors", "-Wall", "-Wextra", "-Werror"]
    paths = [f"-I{prefix}/include", f"-L{prefix}/lib", f"-Wl,-rpath,{prefix}/lib"]
    run("gcc", *warnings, source, "-o", tmp_path / "example", *paths, "-lsgrt", "-lm")
    check_output(source, run(tmp_path / "example", cwd=tmp_path))


@pytest.mark.parametrize("source", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_python(source, tmp_path):
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    check_output(source, run(sys.executable, "-W", "error", source, cwd=tmp_path, env=environment))


def check_output(source, output):
    if source.stem.endswith("_register"):
        check_six_numbers(output)
    elif source.stem.endswith("_stereo"):
        found = re.findall(r"true +([-+\d.]+)  measured +([-+\d.]+)", output)
        assert len(found) == 7 and all(float(true) == pytest.approx(float(x), abs=0.05) for true, x in found), output
    elif source.stem.endswith("_capture_loop"):
        # Cough, slide, too late, nobody there: the beam holds; in every other frame it is on.
        assert re.findall(r"^beam (ON|HOLD)", output, flags=re.M) == [
            *(["ON"] * 3),
            "HOLD",
            "ON",
            *(["HOLD"] * 3),
            "ON",
            "ON",
        ]
        assert "cancelled" in output and "no surface" in output and "VRT +6.00 mm" in output, output
    else:
        assert output.strip()
