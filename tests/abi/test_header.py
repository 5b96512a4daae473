"""sgrt.h stands alone: as C99 and later, as C++, with every compiler at hand, without a warning."""

import shutil

import pytest
from abi import HEADER, run

USE = """#include <sgrt.h>
int main(void) {
  double x[6] = {0};
  sgrt_view v = sgrt_view_of(x, SGRT_F64, 2, 3, 0);
  sgrt_mut_view m = sgrt_mut_view_of(x, SGRT_F64, 2, 3, 0);
  return v.strides[0] == 24 && v.strides[1] == 8 && m.ndim == 2 && sgrt_dtype_size(SGRT_I16) == 2 ? 0 : 1;
}
"""
FLAGS = ["-pedantic-errors", "-Wall", "-Wextra", "-Werror", "-Wshadow", "-Wconversion"]
C = [("gcc", "c99"), ("gcc", "c11"), ("gcc", "c17"), ("clang", "c99")]
CXX = [("g++", "c++11"), ("g++", "c++17"), ("g++", "c++20"), ("clang++", "c++11"), ("clang++", "c++20")]


def compiler(name):
    """The compiler itself or, of clang, a version that Debian numbers."""
    for candidate in [name, *(f"{name}-{version}" for version in range(22, 13, -1))]:
        if path := shutil.which(candidate):
            return path
    pytest.skip(f"{name} is not installed")


@pytest.mark.parametrize(("name", "standard"), C + CXX)
def test_header_alone(name, standard, tmp_path):
    source = tmp_path / ("use.c" if (name, standard) in C else "use.cpp")
    source.write_text(USE)
    binary = tmp_path / "use"
    run(compiler(name), f"-std={standard}", *FLAGS, "-I", HEADER.parent, source, "-o", binary)
    run(binary)
