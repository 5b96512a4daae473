"""SGRT_REQUIRE_PERMISSIVE against made-up dependencies: what it refuses and what it lets through."""

import subprocess

import pytest
from conftest import ROOT

WITH_SUITESPARSE = "#define CERES_USE_EIGEN_SPARSE\n// #define CERES_NO_SUITESPARSE\n// #define CERES_NO_CXSPARSE\n"
WITHOUT = "#define CERES_USE_EIGEN_SPARSE\n#define CERES_NO_SUITESPARSE\n#define CERES_NO_CXSPARSE\n"


def configure(folder, config, links):
    """Configures a library that reaches `links` through a private static core; what CMake said, "" where it agreed."""
    header = folder / "include/ceres/internal/config.h"
    header.parent.mkdir(parents=True)
    header.write_text(config)
    (folder / "empty.c").touch()
    (folder / "CMakeLists.txt").write_text(
        f"""cmake_minimum_required(VERSION 3.25)
        project(permissive C)
        set(CERES_INCLUDE_DIR {folder}/include)
        add_library(Ceres::ceres INTERFACE IMPORTED)
        add_library(headers INTERFACE)
        target_include_directories(headers INTERFACE ${{CERES_INCLUDE_DIR}})
        add_library(core STATIC empty.c)
        target_link_libraries(core PUBLIC headers PRIVATE {links})
        add_library(library SHARED empty.c)
        target_link_libraries(library PRIVATE core)
        include({ROOT}/cmake/Permissive.cmake)
        sgrt_require_permissive(library)
        """
    )
    command = ["cmake", "-S", folder, "-B", folder / "build", "-G", "Ninja"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stderr


def test_ceres_headers_alone_are_fine(tmp_path):
    assert configure(tmp_path, WITH_SUITESPARSE, "m") == ""


def test_ceres_without_suitesparse_is_fine(tmp_path):
    assert configure(tmp_path, WITHOUT, "Ceres::ceres") == ""


# REQ-ABI-013
@pytest.mark.parametrize("links", ["Ceres::ceres", "ceres", "$<LINK_ONLY:Ceres::ceres>", "/usr/lib/libceres.a"])
def test_ceres_with_suitesparse_is_refused(tmp_path, links):
    assert "SGRT_REQUIRE_PERMISSIVE: library links" in configure(tmp_path, WITH_SUITESPARSE, links)


# REQ-ABI-013
@pytest.mark.parametrize("links", ["cholmod", "/usr/lib/x86_64-linux-gnu/libspqr.so"])
def test_suitesparse_is_refused(tmp_path, links):
    assert "copyleft" in configure(tmp_path, WITHOUT, links)
