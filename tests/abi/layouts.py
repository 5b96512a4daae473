"""Prints the size and offsets of every public struct and the value of every constant of sgrt.h, as this C compiler
lays them out: the table of layouts.txt, which freeze.py writes."""

import re
import tempfile
from pathlib import Path

from abi import HEADER, header, run

HEAD = "struct size; member offset size; constant = value"


def structs():
    """(name, [members]) in the header's order."""
    found = []
    for body, name in re.findall(r"typedef struct \w+ \{(.*?)\}\s*(\w+);", header(), flags=re.S):
        members = []
        for declaration in body.split(";"):
            for part in declaration.split(","):
                match = re.search(r"(\w+)\s*(?:\[\d+\])*\s*$", part)
                if match:
                    members.append(match.group(1))
        found.append((name, members))
    return found


def constants():
    """Names of the enumerators in the header's order."""
    return [
        name for body in re.findall(r"enum \{(.*?)\}", header(), flags=re.S) for name in re.findall(r"(\w+) =", body)
    ]


def program():
    lines = ["#include <stdio.h>", "#include <sgrt.h>", "int main(void) {"]
    for name, members in structs():
        lines.append(f'  printf("{name} %zu\\n", sizeof({name}));')
        for member in members:
            lines.append(
                f'  printf("  {member} %zu %zu\\n", offsetof({name}, {member}), sizeof((({name} *)0)->{member}));'
            )
    for name in constants():
        lines.append(f'  printf("{name} = %d\\n", (int){name});')
    return "\n".join([*lines, "  return 0;", "}", ""])


def table():
    with tempfile.TemporaryDirectory() as folder:
        source, binary = Path(folder, "layouts.c"), Path(folder, "layouts")
        source.write_text(program())
        run("cc", "-std=c99", "-I", HEADER.parent, source, "-o", binary)
        return run(binary)


if __name__ == "__main__":
    print(HEAD)
    print(table(), end="")
