"""The header's functions, the library's exports and what the Python extension imports are one set."""

import pytest
from abi import BUILD, declared_functions, library, run


def symbols(path, *options):
    lines = run("nm", "-D", *options, path).splitlines()
    return {line.split()[-1].split("@")[0] for line in lines if line.strip()}


def test_the_header_declares_functions():
    names = declared_functions()
    assert {"sgrt_version", "sgrt_icp_align", "sgrt_rig_text", "sgrt_surface_free"} <= names


# REQ-ABI-005
def test_exports_are_the_headers_functions():
    exported, declared = symbols(library(), "--defined-only"), declared_functions()
    assert exported == declared, f"only exported: {exported - declared}; only declared: {declared - exported}"


# REQ-PY-001
def test_python_reaches_every_function():
    found = sorted(BUILD.rglob("_core*.so"))
    if not found:
        pytest.skip(f"_core is not built in {BUILD} (configure with -DSGRT_PYTHON=ON)")
    imported = {name for name in symbols(found[0], "--undefined-only") if name.startswith("sgrt_")}
    declared = declared_functions()
    assert imported == declared, f"not reached by Python: {declared - imported}; unknown: {imported - declared}"
