"""What `cmake --install` lays down, and programs built from it by find_package and pkg-config (gcc: test_examples)."""

import os
import re
import subprocess

import pytest
from conftest import ROOT, run

EXAMPLE = ROOT / "examples/01_register.c"
SOURCE = (ROOT / "include/sgrt.h").read_text()
VERSION = ".".join(re.findall(r"#define SGRT_VERSION_\w+ (\d+)", SOURCE))
SONAME = f"libsgrt.so.{VERSION.rpartition('.')[0]}"


def check_six_numbers(output):
    """The example's displacement: (3, -2, 1.5) mm."""
    numbers = [float(text) for text in re.findall(r"(?:LAT|LNG|VRT|pitch|roll|rtn) ([-+]\d+\.\d+)", output)]
    assert numbers == pytest.approx([3, -2, 1.5, 0, 0, 0], abs=0.03), output
    assert "verdict: ok" in output


def dynamic_section(library):
    return re.findall(r"\((\w+)\)\s+[^\[]*\[(.*)\]", run("readelf", "-dW", library))


def test_files(prefix):
    files = sorted(str(path.relative_to(prefix)) for path in prefix.rglob("*") if not path.is_dir())
    copied = [*ROOT.glob("LICENSES/*"), *ROOT.glob("examples/*.c"), *ROOT.glob("examples/*.py")]
    notices = [f"share/doc/sgrt/notices/{path.name}" for path in ROOT.glob("packaging/notices/*")]
    copies = [f"share/doc/sgrt/{path.relative_to(ROOT)}" for path in copied] + notices
    assert len(copies) > 15
    assert [name for name in files if name not in copies] == [
        "include/sgrt.h",
        "lib/cmake/sgrt/sgrtConfig.cmake",
        "lib/cmake/sgrt/sgrtConfigVersion.cmake",
        "lib/cmake/sgrt/sgrtTargets-release.cmake",
        "lib/cmake/sgrt/sgrtTargets.cmake",
        "lib/libsgrt.so",
        f"lib/{SONAME}",
        "lib/pkgconfig/sgrt.pc",
        "share/doc/sgrt/LICENSE",
    ]


def test_library_needs_permissive_system_libraries_only(prefix):
    section = dynamic_section(prefix / "lib/libsgrt.so")
    assert ("SONAME", SONAME) in section
    needed = {re.sub(r"\.so.*", "", value) for kind, value in section if kind == "NEEDED"}
    assert needed <= {"libstdc++", "libgcc_s", "libm", "libc", "liblz4", "ld-linux-x86-64"}
    assert not [value for kind, value in section if kind in ("RPATH", "RUNPATH")]


def test_find_package(prefix, tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(
        f"""cmake_minimum_required(VERSION 3.25)
        project(consumer C)
        find_package(sgrt {VERSION} REQUIRED)
        add_executable(consumer {EXAMPLE})
        target_link_libraries(consumer PRIVATE sgrt::sgrt)
        if(TARGET sgrt::sgrt_core)
          message(FATAL_ERROR "the core is exported")
        endif()
        """
    )
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", tmp_path / "build")
    check_six_numbers(run(tmp_path / "build/consumer"))


def test_find_package_refuses_another_minor_version(prefix, tmp_path):
    major, minor, _ = VERSION.split(".")
    (tmp_path / "CMakeLists.txt").write_text(
        f"""cmake_minimum_required(VERSION 3.25)
        project(consumer C)
        find_package(sgrt {major}.{int(minor) + 1} REQUIRED)
        """
    )
    done = subprocess.run(
        ["cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={prefix}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0 and f"version: {VERSION}" in done.stderr


@pytest.mark.parametrize("example", sorted(EXAMPLE.parent.glob("*.c")), ids=lambda path: path.name)
def test_pkg_config_builds_the_installed_examples(example, prefix, tmp_path):
    """With no other flag, from where they are installed."""
    environment = os.environ | {"PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
    assert run("pkg-config", "--modversion", "sgrt", env=environment).strip() == VERSION
    flags = run("pkg-config", "--cflags", "--libs", "sgrt", env=environment).split()
    run("cc", prefix / "share/doc/sgrt/examples" / example.name, "-o", tmp_path / "consumer", *flags)
    output = run(tmp_path / "consumer", env=os.environ | {"LD_LIBRARY_PATH": str(prefix / "lib")})
    if example == EXAMPLE:
        check_six_numbers(output)
