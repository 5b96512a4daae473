"""The frozen ABI: symbols.txt (prototypes), layouts.txt (structs and constants) and libsgrt.abi (both, as abidw of
libabigail describes them), all read from sgrt.h by this compiler.

    python tests/abi/freeze.py    write them anew after something was added

It refuses what breaks a program that is already built (something removed or changed) until the minor version in sgrt.h
is raised: that number is in the SONAME, so that an old program does not load the new library by mistake."""

import re
import shutil
import sys
import tempfile
from pathlib import Path

from abi import HEADER, header, run
from layouts import HEAD, table

FOLDER = Path(__file__).parent
SYMBOLS, LAYOUTS, ABIXML = FOLDER / "symbols.txt", FOLDER / "layouts.txt", FOLDER / "libsgrt.abi"
ADVICE = """
what was removed or changed breaks programs that are already built: take it back or, before 1.0 alone, raise
SGRT_VERSION_MINOR in include/sgrt.h and name the break in CHANGELOG.md. What was added breaks nothing. Then
`python tests/abi/freeze.py` writes the tables anew (libsgrt.abi too, where abidw of abigail-tools is installed)."""


def prototypes():
    """Every function's declaration, in the header's order."""
    return [" ".join(text.split()) for text in re.findall(r"SGRT_API\s+([^;{]*?);", header())]


def name_of(prototype):
    return re.search(r"(sgrt_\w+)\(", prototype).group(1)


def without_names(prototype):
    """The parameters' types alone: their names are no part of the ABI."""
    head, _, parameters = prototype.rpartition(")")[0].partition("(")
    types = [re.sub(r"(?<=[\s*])\w+((?:\[\d*\])*)$", r"\1", part.strip()).strip() for part in parameters.split(",")]
    return f"{head}({', '.join(types)})"


def version():
    return ".".join(re.findall(r"#define SGRT_VERSION_(?:MAJOR|MINOR) (\d+)", HEADER.read_text()))


def symbols():
    """The table of symbols.txt; its first line says of which SONAME it is."""
    return "\n".join([f"libsgrt.so.{version()}", *sorted(map(without_names, prototypes()), key=name_of), ""])


def layouts():
    return f"{HEAD}\n{table()}"


def entries(text):
    """{what: how} of a table without its first line. Of a struct with struct_size the size may grow."""
    found, struct, lines = {}, "", text.splitlines()[1:]
    for line in lines:
        if "(" in line:
            found[name_of(line)] = line
        elif " = " in line:
            name, _, value = line.partition(" = ")
            found[name] = value
        elif line.startswith(" "):
            member, place = line.strip().split(" ", 1)
            found[f"{struct}.{member}"] = place
        else:
            struct, size = line.split()
            found[struct] = size
    return {what: "sized" if f"{what}.struct_size" in found else how for what, how in found.items()}


def breaks(old, new):
    """What of the old table the new one lacks or has changed."""
    before, now = entries(old), entries(new)
    return [
        f"{what}: was {how}, is {now[what]}" if what in now else f"{what}: removed"
        for what, how in before.items()
        if now.get(what) != how
    ]


def stub(folder):
    """A shared object with the header's functions, empty, and debug information: what abidw and abidiff read. The built
    library has none, and its exports are the header's functions (test_exports.py)."""
    source, binary = Path(folder, "stub.c"), Path(folder, "libsgrt.so")
    source.write_text("#include <sgrt.h>\n" + "".join(f"{p} {{ __builtin_trap(); }}\n" for p in prototypes()))
    flags = ["-std=c99", "-g", "-w", "-shared", "-fPIC", f"-ffile-prefix-map={folder}=.", "-I", HEADER.parent]
    run("gcc", *flags, f"-Wl,-soname,libsgrt.so.{version()}", source, "-o", binary)
    return binary


def abixml(folder):
    """abidw's description, with no path and no line number in it."""
    out = Path(folder, "libsgrt.abi")
    quiet = ["--no-corpus-path", "--no-comp-dir-path", "--no-show-locs", "--no-elf-needed"]
    run("abidw", *quiet, "--out-file", out, stub(folder))
    return out.read_text()


def main():
    fresh = {SYMBOLS: symbols(), LAYOUTS: layouts()}
    old_version = SYMBOLS.read_text().split("\n", 1)[0] if SYMBOLS.exists() else ""
    if old_version == f"libsgrt.so.{version()}":
        broken = [line for path, text in fresh.items() for line in breaks(path.read_text(), text)]
        if broken:
            return "\n".join([*broken, ADVICE])
    for path, text in fresh.items():
        path.write_text(text)
    if shutil.which("abidw"):
        with tempfile.TemporaryDirectory() as folder:
            ABIXML.write_text(abixml(folder))
    else:
        print(f"abidw (abigail-tools) is not installed: {ABIXML.name} is left as it was", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
