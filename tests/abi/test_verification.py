"""Each requirement has a test, each anomaly its regression test, and each error status is raised by a test."""

import json
import re
import subprocess
import sys

import pytest
from abi import HEADER, ROOT

VERIFICATION = ROOT / "docs/verification"


# REQ-REL-004
def test_every_requirement_has_a_test():
    done = subprocess.run([sys.executable, ROOT / "scripts/trace", "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_requirements_are_named_once():
    requirements = json.loads((VERIFICATION / "requirements.json").read_text())
    names = [r["id"] for r in requirements]
    assert len(names) == len(set(names)) >= 80
    assert all(r["text"].endswith(".") and r["source"] for r in requirements)


def exists(test: str) -> bool:
    """Of "path:name": the file holds a test of that name."""
    path, _, name = test.partition(":")
    file = ROOT / path
    return file.is_file() and re.search(rf"\b{re.escape(name)}\b", file.read_text()) is not None


# REQ-REL-004
def test_anomalies_name_tests_that_exist():
    keys = {"id", "date", "found_by", "description", "effect", "fixed_in", "regression_test"}
    anomalies = json.loads((VERIFICATION / "anomalies.json").read_text())
    assert len({a["id"] for a in anomalies}) == len(anomalies)
    for anomaly in anomalies:
        assert set(anomaly) == keys, anomaly["id"]
        assert exists(anomaly["regression_test"]), f"{anomaly['id']}: no test {anomaly['regression_test']}"


STATUSES = re.findall(r"^  (SGRT_E_\w+) = \d+", HEADER.read_text(), re.MULTILINE)


# REQ-REL-003
@pytest.mark.parametrize("status", STATUSES)
def test_every_status_is_raised_by_a_test(status):
    """By a C test against the ABI: a CHECK that a call gives it. SGRT_E_INTERNAL, a defect of the library, has no input
    that raises it, but a callback of C++ that throws does."""
    if status == "SGRT_E_INVALID_ARGUMENT":
        raised = re.compile(r"\bCHECK_INVALID\(")
    elif status == "SGRT_E_INTERNAL":
        assert "status != SGRT_E_INTERNAL" in (ROOT / "tests/calls/test_bounded.cpp").read_text()
        return
    else:
        raised = re.compile(rf"\bCHECK_STATUS\([^;]*\b{status}\b|==\s*{status}\b")
    tests = [path.name for path in (ROOT / "tests/capi").glob("*.c") if raised.search(path.read_text())]
    assert tests, f"no C test raises {status}"
