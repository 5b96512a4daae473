"""The site tells everything: each function of sgrt.h, each name of the package, each command; all of it offline."""

import html
import importlib.util
import re
import sys
from collections import Counter

import click
import pytest
import sgrt
from blocks import ROOT
from sgrt import cli

sys.path.insert(0, str(ROOT / "docs/_ext"))
HEADER = (ROOT / "include/sgrt.h").read_text()
SITE = ROOT / "build/site"


def manual():
    pytest.importorskip("sphinx")
    return __import__("c_manual")


def test_every_function_has_an_entry():
    c_manual = manual()
    found = c_manual.sections(HEADER)
    text = re.sub(r"/\*.*?\*/", "", HEADER, flags=re.S)
    declared = set(re.findall(r"SGRT_API\s+[\w\s]+?[\s*](sgrt_\w+)\s*\(", text))
    items = [item for section in found for item in section.items]
    entries = [item.name for item in items if item.kind == "function"]
    assert len(entries) == len(set(entries)) and len(declared) > 200
    assert declared <= set(entries)
    pages = "\n".join(c_manual.Writer(c_manual.roles(found)).page(section) for section in found)
    signatures = re.findall(r"^(?:\.\. c:function:: | {16})(?:\w+ )*?[\w ]*\*?(sgrt_\w+)\(", pages, flags=re.M)
    assert sorted(signatures) == sorted(entries)


def test_every_struct_and_number_has_an_entry():
    c_manual = manual()
    text = re.sub(r"/\*.*?\*/", "", HEADER, flags=re.S)
    names = c_manual.roles(c_manual.sections(HEADER))
    assert set(re.findall(r"typedef struct (\w+)", text)) <= names.keys()
    enums = set(re.findall(r"\b(SGRT_[A-Z]\w+) = ", text))
    assert enums and enums <= names.keys()


def test_the_manual_loses_no_word():
    c_manual = manual()
    found = c_manual.sections(HEADER)
    writer = c_manual.Writer(c_manual.roles(found))
    for section in found:
        page = Counter(re.findall(r"\w+", writer.page(section).replace("\\", "")))
        for item in section.items:
            for text in (item.comment, *(comment for _, comment in item.members)):
                lost = Counter(re.findall(r"\w+", text)) - page
                assert lost.keys() <= {"docs", "md"}, f"{section.name}: {item.name}: {lost}"


def test_every_function_is_explained():
    """By a comment of its own, by the one above it, or by a name that the header explains once."""
    c_manual = manual()
    for section in c_manual.sections(HEADER):
        above = None
        for item in section.items:
            told = item.comment or item.name.endswith(tuple(c_manual.USUAL))
            if item.kind == "function" and not told:
                assert above is not None and above.kind == "function" and item.under, f"{section.name}: {item.name}"
            above = item


def shown(mathml):
    """The text of MathML as its source would write it, without spaces, braces and marks of scripts."""
    equations = pytest.importorskip("equations")
    text = html.unescape(re.sub(r"<[^>]*>", "", mathml.replace("<msqrt>", "sqrt")))
    for word, letter in equations.LETTERS.items():
        text = text.replace(letter, word)
    for sign, letter in equations.SIGNS.items():
        text = text.replace(letter, sign)
    text = text.replace("√", "sqrt").replace("′", "'").replace("\u0303", "~").replace("·", ".").replace("∼", "~")
    return re.sub(r"[\s(){}_^]", "", text)


def test_equations_lose_nothing():
    """Each line of the theory's equations is set, and holds what its source does; the frames' matrix stays text."""
    equations = __import__("equations")
    count, plain = 0, []
    for page in sorted((ROOT / "docs/theory").glob("*.md")):
        text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.S | re.M)
        for block in re.findall(r"\n\n((?: {4}[^\n]*\n)+)", text):
            try:
                equations.lines(block)
            except equations.NotMath:
                plain.append(page.name)
                continue
            for line in block.rstrip("\n").split("\n"):
                source = equations.NUMBER.sub("", line)
                assert shown(equations.math(source.strip())) == re.sub(r"[\s(){}_^]", "", source), line
                count += 1
    assert count > 150 and plain == ["frames.md"]


def test_every_name_of_the_package_is_documented():
    pages = "\n".join(page.read_text() for page in (ROOT / "docs/python").glob("*.md"))
    told = set(re.findall(r"\.\. auto\w+:: sgrt\.([\w.]+)", pages))
    wanted = {name for name in sgrt.__all__ if name not in ("errors", "frames", "io")}
    wanted |= {f"frames.{name}" for name in sgrt.frames.__all__} | {f"io.{name}" for name in sgrt.io.__all__}
    if importlib.util.find_spec("embreex"):
        from sgrt import twin

        wanted |= {f"twin.{name}" for name in twin.__all__}
    assert wanted <= told


@pytest.fixture(scope="module")
def site():
    if not (SITE / "index.html").exists():
        pytest.skip("the site is not built: scripts/docs")
    return {str(path.relative_to(SITE)): path.read_text() for path in SITE.rglob("*.html")}


def test_every_command_is_on_its_page(site):
    def names(group, prefix):
        for name, command in group.commands.items():
            yield f"{prefix}-{name}"
            if isinstance(command, click.Group):
                yield from names(command, f"{prefix}-{name}")

    for name in names(cli.group, "sgrt"):
        assert f'id="{name}"' in site["command-line.html"], name


def test_nothing_is_fetched(site):
    """No script, style, font or picture from elsewhere: the site reads without a network."""
    fetched = re.compile(r"""<(?:script|img|link|iframe|source)\b[^>]*\b(?:src|href)=["'](?:https?:)?//[^"']*["']""")
    for name, page in site.items():
        assert not fetched.findall(page), name
    for style in SITE.rglob("*.css"):
        assert not re.findall(r"url\(\s*['\"]?(?:https?:)?//", style.read_text()), style
