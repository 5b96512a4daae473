"""The module graph and the house rules, read from the source: who includes what, what the core never calls, and that
every function of the skin is one guard."""

import re

import pytest
from abi import ROOT, declared_functions, without_comments

LIB = ROOT / "libsgrt"
SOURCES = sorted(p for p in LIB.rglob("*") if p.suffix in {".hpp", ".cpp", ".inl", ".h"})
TEXTS = {p.relative_to(LIB).as_posix(): p.read_text() for p in SOURCES}
# Not guarded: they return a constant or this thread's buffer and call nothing that can fail.
UNGUARDED = {"sgrt_version", "sgrt_last_error", "sgrt_status_word"}


def layers():
    graph = {}
    for line in (LIB / "layers.txt").read_text().splitlines():
        if line.strip() and not line.startswith("#"):
            module, _, allowed = line.partition(":")
            graph[module.strip()] = set(allowed.split())
    return graph


def includes(text):
    """(delimiter, path) of every #include."""
    return re.findall(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', text, flags=re.M)


def offenders(pattern, allowed=lambda name: False):
    """Lines of the library's code, comments aside, that match; as file:line: text."""
    found = []
    for name, text in TEXTS.items():
        if allowed(name):
            continue
        for number, line in enumerate(without_comments(text).splitlines(), 1):
            if re.search(pattern, line):
                found.append(f"libsgrt/{name}:{number}: {line.strip()}")
    return "\n".join(found)


def including(pattern, allowed=lambda name: False):
    """The files that include a path that matches."""
    return [
        f"libsgrt/{name}: {path}"
        for name, text in TEXTS.items()
        if not allowed(name)
        for _, path in includes(text)
        if re.match(pattern, path)
    ]


# REQ-ABI-015
def test_the_graph_has_no_cycle():
    graph = layers()

    def below(module, seen=()):
        assert module not in seen, f"cycle: {' <- '.join((*seen, module))}"
        for lower in graph[module]:
            below(lower, (*seen, module))

    for module in graph:
        below(module)


# REQ-ABI-015
def test_every_include_goes_down():
    graph, wrong = layers(), []
    for name, text in TEXTS.items():
        module = name.split("/")[0]
        assert module in graph, f"libsgrt/{name}: {module} is not in layers.txt"
        for mark, path in includes(text):
            if mark != '"':
                continue
            target = path.split("/")[0]
            if "/" not in path or path not in TEXTS or (target != module and target not in graph[module]):
                wrong.append(f"libsgrt/{name}: {path}")
    assert not wrong, "\n".join(wrong)


def test_public_header_only_in_the_skin():
    assert not including(r"sgrt\.h$", lambda name: name.startswith("capi/"))


@pytest.mark.parametrize(
    ("library", "where"),
    [
        (r"flann/", r"core/nearest\.cpp"),
        (r"nlohmann/", r"\w+/\w*_json\.(cpp|inl)"),
        (r"\w+/\w*_json\.inl", r"\w+/\w*_json\.(cpp|inl)"),
        (r"(unsupported/)?Eigen/", r"core/eigen\.hpp"),
        (r"opencv2?/", r"calibration/\w+\.cpp"),
        (r"ceres/tiny_solver", r"(registration|tracking|laser|calibration)/\w+\.cpp"),
        (r"ceres/(?!tiny_solver)", r"calibration/\w+\.cpp"),
    ],
)
def test_third_party_stays_in_its_place(library, where):
    assert not including(library, lambda name: re.fullmatch(where, name))


def test_headers_show_no_third_party_but_eigen():
    """A .hpp includes our own headers, Eigen through core/eigen.hpp, and the standard library."""
    wrong = []
    for name, text in TEXTS.items():
        if not name.endswith(".hpp"):
            continue
        for mark, path in includes(text):
            standard = mark == "<" and re.fullmatch(r"[a-z_0-9]+", path)
            skin = name.startswith("capi/") and path == "sgrt.h"
            eigen = name == "core/eigen.hpp" and path.startswith("Eigen/")
            if not (mark == '"' or standard or skin or eigen):
                wrong.append(f"libsgrt/{name}: {path}")
    assert not wrong, "\n".join(wrong)


# REQ-ABI-011
def test_no_streams_clock_environment_or_chance():
    headers = (
        r"(iostream|fstream|cstdio|stdio\.h|ctime|time\.h|random|filesystem|csignal|signal\.h|clocale|locale|omp\.h)$"
    )
    # nearest.cpp includes it to take FLANN's own printf and stderr away.
    assert including(headers) == ["libsgrt/core/nearest.cpp: stdio.h"]
    assert not offenders(
        r"\b(std::c(out|err|log|in)|f?printf|puts|f?putc|perror|fopen|getenv|setenv|setlocale|abort|exit|_Exit|quick_exit"
        r"|time|clock|clock_gettime|gettimeofday|rand|srand|random_device|mt19937|signal|sigaction)\s*\("
    )
    assert not offenders(r"\b(system_clock|high_resolution_clock|steady_clock|std::c(out|err|log|in)\b)")
    assert not offenders(r"#\s*pragma\s+omp\b")


def skin_functions():
    """name -> body of every sgrt_ function that capi/*.cpp defines; the files are as clang-format leaves them."""
    found = {}
    for name, text in TEXTS.items():
        if not (name.startswith("capi/") and name.endswith(".cpp")):
            continue
        code = without_comments(text)
        for match in re.finditer(
            r"^[A-Za-z][\w\s*]*?[\s*](sgrt_\w+)\([^;{}]*?\) \{([^\n]+(?=\}$)|\n.*?(?=^\}$))", code, flags=re.M | re.S
        ):
            assert match.group(1) not in found, f"{match.group(1)} is defined twice"
            found[match.group(1)] = match.group(2)
    return found


def test_the_skin_defines_the_headers_functions():
    defined, declared = set(skin_functions()), declared_functions()
    assert defined == declared, f"not in sgrt.h: {defined - declared}; not defined: {declared - defined}"


def one_guard(body):
    """Whether the body is a single statement, a call of guard or guard_text and nothing beside it."""
    match = re.match(r"\s*(return )?guard(_text)?\(", body)
    if not match:
        return False
    depth = 1
    for at in range(match.end(), len(body)):
        depth += {"(": 1, ")": -1}.get(body[at], 0)
        if depth == 0:
            return body[at + 1 :].strip() == ";"
    return False


# REQ-ABI-004
def test_every_function_of_the_skin_is_one_guard():
    wrong = [name for name, body in skin_functions().items() if name not in UNGUARDED and not one_guard(body)]
    assert not wrong, f"not wrapped by guard: {wrong}"


def test_the_test_sees_a_missing_guard():
    assert one_guard("\n  return guard([&] { f(g()); });\n")
    assert not one_guard("\n  f();\n  return guard([&] { g(); });\n")
    assert not one_guard("\n  return guard([&] { g(); }) + f();\n")
    assert not one_guard("\n  delete p;\n")


# REQ-ABI-004
def test_handles_are_deleted_under_the_guard():
    frees = {name for name in declared_functions() if name.endswith("_free")}
    bodies = skin_functions()
    assert frees and all("guard([&] { delete" in bodies[name] for name in frees)
