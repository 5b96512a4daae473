"""Each block of Python and shell in README and the documentation runs, each block of C compiles.

A block that needs a camera or a patient's data says so in a comment above it, `<!-- not run: WHY -->`; that its
commands and options are there is checked all the same.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
from pathlib import Path

import click
import pytest
from blocks import PAGES, ROOT, blocks, same
from sgrt import cli

pytest.importorskip("sgrt.twin")
pytest.importorskip("matplotlib")


def in_order():
    """Blocks of Python and shell as a reader meets them."""
    found = sorted(blocks("python") + blocks("shell"), key=lambda block: (PAGES.index(block.page), block.line))
    return [block for block in found if block.why is None]


@pytest.mark.parametrize("block", in_order(), ids=lambda block: block.name)
def test_runs(block, pages, capfd):
    if block.language == "python":
        pages(block).python(block.code, block.name)
        printed = capfd.readouterr().out
    else:
        printed = pages(block).shell(block.code)
    for line in block.shown.strip().split("\n") if block.shown else []:
        assert any(same(line, other) for other in printed.split("\n")), f"not printed: {line}\n{printed}"


@pytest.mark.parametrize("block", blocks("c"), ids=lambda block: block.name)
def test_c_compiles(block, tmp_path):
    source = tmp_path / "block.c"
    source.write_text(block.code)
    warnings = ["-std=c99", "-pedantic-errors", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    done = subprocess.run(["gcc", *warnings, f"-I{ROOT}/include", source], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_how_to_shows_what_its_example_prints(tmp_path):
    build = Path(os.environ.get("SGRT_BUILD_DIR", ROOT / "build/dev"))
    library = [f"-I{ROOT}/include", f"-L{build}", f"-Wl,-rpath,{build}", "-lsgrt", "-lm"]
    subprocess.run(["gcc", "-O1", ROOT / "examples/05_capture_loop.c", "-o", tmp_path / "loop", *library], check=True)
    printed = subprocess.run([tmp_path / "loop"], capture_output=True, text=True, check=True).stdout.strip().split("\n")
    page = (ROOT / "docs/howto-c.md").read_text()
    shown = re.search(r"```text\n(.*?)^```", page, re.S | re.M)[1].strip().split("\n")
    assert len(shown) == len(printed)
    for line, other in zip(shown, printed, strict=True):
        assert same(line, other), f"{line}\n{other}"


def commands(text):
    """The calls of `sgrt` in a block of shell: lists of words."""
    for line in text.replace("\\\n", " ").split("\n"):
        words = shlex.split(line, comments=True)
        if words[:1] == ["sgrt"]:
            yield words[1:]


@pytest.mark.parametrize("block", blocks("shell"), ids=lambda block: block.name)
def test_commands_and_options_are_there(block):
    for words in commands(block.code):
        command = cli.group
        while isinstance(command, click.Group) and words and words[0] in command.commands:
            command = command.commands[words.pop(0)]
        assert command is not cli.group or words == ["--version"], words
        known = {option for parameter in command.params for option in parameter.opts} | {"--help", "--version"}
        assert not [word for word in words if word.startswith("--") and word not in known], words


def formats_calls():
    """The calls that docs/formats.md states: the command and the options on its lines."""
    text = (ROOT / "docs/formats.md").read_text().partition("## The command line")[2]
    for call in re.split(r"^ {4}sgrt ", text, flags=re.M)[1:]:
        words = re.split(r"\n\n", call)[0].split()
        group, name = cli.group, []
        while isinstance(group, click.Group) and any(word in group.commands for word in words[0].split("|")):
            name.append(words.pop(0))
            group = group.commands[name[-1].split("|")[0]]
        yield " ".join(name), group, set(re.findall(r"--[a-z][a-z-]*", call))


def test_formats_states_every_command_with_options_that_exist():
    told = set()
    for name, command, options in formats_calls():
        head, _, last = name.rpartition(" ")
        told |= {f"{head} {word}".strip() for word in last.split("|")}
        known = {option for parameter in command.params for option in parameter.opts}
        assert options <= known | {"--help"}, name

    def names(group, head):
        for name, command in group.commands.items():
            if not (isinstance(command, click.Group) and not command.invoke_without_command):
                yield f"{head} {name}".strip()
            if isinstance(command, click.Group):
                yield from names(command, name)

    assert set(names(cli.group, "")) <= told


def test_formats_states_every_schema():
    page = (ROOT / "docs/formats.md").read_text()
    sources = [*(ROOT / "bindings/python").rglob("*.py"), *(ROOT / "libsgrt").rglob("*.cpp")]
    schemas = {found for path in sources for found in re.findall(r"sgrt-[a-z-]+/\d", path.read_text())}
    assert (
        schemas and {schema for schema in schemas if f"`{schema}`" not in page and f'"{schema}"' not in page} == set()
    )


def test_what_is_not_run_says_why():
    for block in blocks("shell") + blocks("python"):
        assert block.why is None or len(block.why.split()) > 2, block.name
        if block.language == "python":
            compile(block.code, block.name, "exec")


@pytest.mark.parametrize("block", blocks("json"), ids=lambda block: block.name)
def test_json_parses(block):
    json.loads(block.code)


def test_code_is_fenced():
    """An indented block would be neither coloured nor tested."""
    for page in PAGES:
        if "theory" in page.parts or page.name in ("formats.md", "changelog.md", "results.md"):
            continue
        text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.S | re.M)
        code = re.findall(r"(?:^|\n\n) {4}(?:import |from \w+ import|sgrt |\./|#include|pip |cmake )[^\n]*", text)
        assert not code, f"{page}: {code[0]}"
