"""What the built library needs, and that no object of ours holds state: no writable global, no code before main."""

import re
import shutil

import pytest
from abi import BUILD, library, run

# The C and C++ run-time, and lz4 (BSD), which FLANN's header calls.
NEEDS = re.compile(r"(libstdc\+\+|libgcc_s|libc|libm|libpthread|libdl|librt|liblz4|ld-linux[\w-]*)\.so\.\d+$")
FORBIDDEN = ("libceres", "libcholmod", "libspqr", "libglog", "libopencv", "libgomp", "libhdf5", "libtbb", "libblas")


# REQ-ABI-012
def test_needs_only_the_run_time():
    needed = re.findall(r"\(NEEDED\).*\[(.*?)\]", run("readelf", "-dW", library()))
    assert needed
    assert not [name for name in needed if name.startswith(FORBIDDEN)]
    assert not [name for name in needed if not NEEDS.match(name)]


def test_soname_holds_the_version():
    soname = re.search(r"\(SONAME\).*\[(.*?)\]", run("readelf", "-dW", library())).group(1)
    assert re.fullmatch(r"libsgrt\.so\.\d+\.\d+", soname)


def test_no_executable_stack_and_no_text_relocation():
    segments = run("readelf", "-lW", library())
    assert re.search(r"GNU_STACK.* RW ", segments)
    assert "TEXTREL" not in run("readelf", "-dW", library())


def objects():
    found = sorted(p for name in ("sgrt", "sgrt_core") for p in (BUILD / "CMakeFiles" / f"{name}.dir").rglob("*.o"))
    assert found, f"no objects in {BUILD}"
    return found


def writable_sections(path):
    """Index -> name of the sections that can be written after loading; thread-locals are not globals."""
    found = {}
    for index, name, flags in re.findall(
        r"\[\s*(\d+)\] (\S+)\s+\S+\s+[0-9a-f]+ [0-9a-f]+ [0-9a-f]+ [0-9a-f]+\s+([A-Za-z]*)\s",
        run("readelf", "-SW", path),
    ):
        if "W" in flags and "T" not in flags and not name.startswith((".data.rel.ro", ".data.rel.local.DW.ref")):
            found[index] = name
    return found


def globals_of(path):
    """Writable data of an object file, demangled."""
    sections, names = writable_sections(path), []
    for line in run("readelf", "-sW", path).splitlines():
        fields = line.split()
        if len(fields) >= 8 and fields[3] == "OBJECT" and fields[6] in sections and int(fields[2], 0) > 0:
            names.append(fields[7])
    demangled = run("c++filt", *names).splitlines() if names else []
    return [name for name in demangled if not ALLOWED.search(name)]


# Not ours, and nothing that a caller could change: the run-time's own; tables without members that FLANN's headers,
# which include <iostream>, bring into nearest.cpp; the cache sizes of this machine, which Eigen asks for once.
ALLOWED = re.compile(
    r"^(DW\.ref\.__gxx_personality_v0|std::__ioinit|flann::anyimpl::get_policy<[\w:]+>\(\)::policy"
    r"|(guard variable for )?Eigen::internal::manage_caching_sizes\(.*\)::m_cacheSizes)$"
)


# REQ-ABI-010
@pytest.mark.skipif(shutil.which("readelf") is None, reason="readelf is not installed")
def test_no_writable_globals():
    found = {path.name: names for path in objects() if (names := globals_of(path))}
    assert not found, "\n".join(f"{path}: {name}" for path, names in found.items() for name in names)


# REQ-ABI-010
def test_nothing_runs_before_main():
    """But the standard streams' count of their users, in the one file that includes FLANN."""
    found = []
    for path in objects():
        if path.name == "nearest.cpp.o":
            continue
        for name, size in re.findall(
            r"\] (\.(?:init_array|ctors)\S*)\s+\S+\s+[0-9a-f]+ [0-9a-f]+ ([0-9a-f]+)", run("readelf", "-SW", path)
        ):
            if int(size, 16) > 0:
                found.append(f"{path.name}: {name}")
    assert not found, f"static initialisers: {found}"


def test_the_audit_sees_a_global(tmp_path):
    """The audit must be able to fail."""
    source, binary = tmp_path / "state.cpp", tmp_path / "state.o"
    source.write_text(
        "int counter = 1; static int hidden; int next() { static int n = counter; return ++n + ++hidden; }"
    )
    run("g++", "-c", source, "-o", binary)
    assert {"counter", "hidden"} <= set(globals_of(binary))
    source.write_text("thread_local int mine = 1; extern const int table[]; const int table[] = {1, 2};")
    run("g++", "-c", source, "-o", binary)
    assert globals_of(binary) == []
