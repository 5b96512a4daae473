"""The C manual: include/sgrt.h, section by section, as pages of the C domain (docs/c/*.rst).

The header is written by hand as a manual, in one manner: a line of dashes begins a section, a comment belongs to the
declaration right below it, a comment beside a member to that member. Here that manner is read, and words that name
something of the header become links.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

ERROR = re.compile(r"^(SGRT_E_\w+(?:, SGRT_E_\w+)*|statuses 10-19)(?:\.?$|\s{2,})(.*)")
THEORY = re.compile(r"docs/((?:theory/)?\w+)\.md")


@dataclass
class Item:
    """A declaration with its comment; kind: prose, function, opaque, struct, enum, type, macro."""

    kind: str
    name: str
    text: str  # the declaration without its body
    comment: str
    members: list[tuple[str, str]] = field(default_factory=list)  # declaration, comment
    under: bool = False  # right below another declaration, whose comment is also its own


@dataclass
class Section:
    name: str
    items: list[Item] = field(default_factory=list)


# What the header says once for all functions of such a name.
USUAL = {
    "_free": "Frees it; NULL is fine.",
    "_init": "Writes the defaults and ``struct_size``. size: ``sizeof`` of the struct at the caller.",
    "_summary": "Its numbers; ``struct_size`` must be set by the caller.",
    "_array": "Lends an array, which lives as long as its owner; an absent one has data NULL.",
    "_text": "Lends a text; NULL where the field is unknown or the index out of range.",
}


def plain(comment: str) -> str:
    """A comment's text: its stars and the columns before it taken off."""
    lines = comment.strip().removeprefix("/*").removesuffix("*/").strip("\n").split("\n")
    return "\n".join(
        [lines[0].strip(), *(re.sub(r"^ ?\* ?", "", line.lstrip()).rstrip() for line in lines[1:])]
    ).strip()


def chunks(text: str) -> list[tuple[str, str]]:
    """The header cut into ('comment' | 'code' | 'gap', text)."""
    found: list[tuple[str, str]] = []
    at = 0
    while at < len(text):
        if match := re.compile(r"\s+").match(text, at):
            if match.group().count("\n") > 1:
                found.append(("gap", ""))
        elif match := re.compile(r"/\*.*?\*/", re.S).match(text, at):
            found.append(("comment", match.group()))
        elif match := re.compile(r"#(?:[^\n]*\\\n)*[^\n]*").match(text, at):
            found.append(("macro", match.group()))
        else:
            end = declaration_end(text, at)
            found.append(("code", text[at:end]))
            at = end
            continue
        at = match.end()
    return found


def declaration_end(text: str, at: int) -> int:
    """Behind the `;` or the body that ends the declaration at `at`."""
    depth = 0
    skip = re.compile(r"/\*.*?\*/", re.S)
    while True:
        if match := skip.match(text, at):
            at = match.end()
            continue
        depth += (text[at] == "{") - (text[at] == "}")
        at += 1
        if depth == 0 and (text[at - 1] == ";" or (text[at - 1] == "}" and text[at : at + 1] == "\n")):
            return at


def members(body: str, separator: str) -> list[tuple[str, str]]:
    """(declaration, comment) of each member; a comment stands behind its member, or before the first of several."""
    found: list[tuple[str, str]] = []
    before = ""
    behind = rf"(?:\s*{separator})?[ \t]*"
    for part in re.finditer(rf"(?P<c>/\*.*?\*/)|(?P<d>[^{separator}/]+){behind}(?P<b>/\*.*?\*/)?", body, re.S):
        if part["c"]:
            before = plain(part["c"])
        elif part["d"].strip():
            found.append((" ".join(part["d"].split()), " ".join(filter(None, (before, plain(part["b"] or ""))))))
            before = ""
    return found


def item_of(code: str, comment: str) -> Item:
    head, brace, rest = code.partition("{")
    line = " ".join(re.sub(r"/\*.*?\*/", "", code, flags=re.S).split())
    if match := re.match(r"typedef struct (\w+) \w+;", line):
        return Item("opaque", match[1], "", comment)
    if match := re.match(r"typedef struct (\w+) \{", line):
        return Item("struct", match[1], "", comment, members(rest.rpartition("}")[0], ";"))
    if line.startswith("enum"):
        return Item("enum", "", "", comment, members(rest.rpartition("}")[0], ","))
    if line.startswith("typedef"):
        name = re.search(r"\(\*(\w+)\)|(\w+);$", line)
        assert name, line
        return Item("type", name[1] or name[2], line.removeprefix("typedef ").rstrip(";"), comment)
    signature = " ".join(head.split()) if brace else line.rstrip(";")
    signature = re.sub(r"^(SGRT_API|static inline) ", "", signature)
    name = re.search(r"(sgrt_\w+)\(", signature)
    assert name, line
    return Item("function", name[1], signature, comment)


def sections(header: str) -> list[Section]:
    """What the header declares between `extern "C" {` and its end."""
    text = header.partition('extern "C" {\n#endif')[2].partition("#ifdef __cplusplus")[0]
    found: list[Section] = []
    comment, gap = "", True
    for kind, chunk in chunks(text):
        if kind == "comment" and (title := re.match(r"/\* -+ (\w+) \*/", chunk)):
            found.append(Section(title[1]))
        elif kind == "comment":
            flush(found, comment)
            comment = plain(chunk)
        elif kind == "gap":
            flush(found, comment)
            comment = ""
        elif kind == "code":
            found[-1].items.append(item_of(chunk, comment))
            found[-1].items[-1].under = not gap and not comment
            comment = ""
        gap = kind == "gap"
    return found


def flush(found: list[Section], comment: str) -> None:
    """A comment with no declaration under it is prose of the section."""
    if comment:
        found[-1].items.append(Item("prose", "", "", comment))


def roles(found: list[Section]) -> dict[str, str]:
    """The role of each name of the header."""
    names: dict[str, str] = {}
    for section in found:
        for item in section.items:
            if item.kind == "enum":
                names |= {declaration.partition(" ")[0]: "c:enumerator" for declaration, _ in item.members}
            elif item.name:
                names[item.name] = {"function": "c:func", "type": "c:type"}.get(item.kind, "c:struct")
    return names


def escaped(text: str) -> str:
    return re.sub(r"([\\*`|_])", r"\\\1", text)


def by_parameter(text: str, names: set[str]) -> tuple[str, list[tuple[str, str]], str]:
    """A paragraph cut where it speaks of parameters ("left, right: H x W. stride: ..."): its opening, each, its end."""
    parts = re.split(r"(?:^|(?<=[.;] ))(\*?\w+(?:(?:, | and )\*?\w+)*): ", text)
    opening, found = parts[0], []
    for who, what in zip(parts[1::2], parts[2::2], strict=True):
        if set(re.findall(r"\w+", who)) - {"and"} <= names:
            found.append((who, what.strip()))
        elif found:
            found[-1] = (found[-1][0], f"{found[-1][1]} {who}: {what}".strip())
        else:
            opening += f"{who}: {what}"
    ending = ""
    if found:  # what comes behind the last parameter's first sentence is of the whole
        who, what = found[-1]
        first, *rest = re.split(r"(?<=\w)\. (?=[A-Z*(]|\w+ may be NULL)", what, maxsplit=1)
        found[-1], ending = (who, first + "." if rest else first), "".join(rest)
    return opening.strip(), found, ending


class Writer:
    """Text of the header as reStructuredText."""

    def __init__(self, names: dict[str, str]) -> None:
        self.names = names

    def inline(self, text: str) -> str:
        """One paragraph: names become links, the rest is taken as it stands."""
        parts = re.split(
            r"(docs/(?:theory/)?\w+\.md|\*\*[^*]+\*\*|`[^`]+`|\b(?:sgrt|SGRT)_\w+(?:\.\.\.|\(\))?|\b\w+_\w+\b)", text
        )
        done = []
        for i, part in enumerate(parts):
            if i % 2 == 0:
                done.append(escaped(part))
            elif match := THEORY.fullmatch(part):
                done.append(f":doc:`/{match[1]}`\\ ")
            elif part.startswith("**"):
                done.append(part)
            elif part.removesuffix("()") in self.names:
                done.append(f":{self.names[part.removesuffix('()')]}:`{part.removesuffix('()')}`\\ ")
            else:
                done.append(f"``{part.strip('`')}``\\ ")
        return "".join(done).replace("\\  ", " ").strip().removesuffix("\\").rstrip()

    def text(self, comment: str, indent: str, parameters: set[str] = frozenset()) -> list[str]:
        """A comment: paragraphs, parameters as a list, errors as a list of definitions."""
        lines: list[str] = []
        comment = re.sub(r"\s*since \d+\.\d+\.?$", "", comment)
        paragraph: list[str] = []
        errors: list[tuple[str, list[str]]] = []
        for line in [*comment.split("\n"), ""]:
            if match := ERROR.match(line):
                errors.append((match[1], [match[2]]))
            elif errors and re.match(r"\s{8,}\S", line):
                errors[-1][1].append(line.strip())
            elif line.strip():
                paragraph.append(line.strip())
                continue
            if paragraph:
                opening, rest, ending = by_parameter(" ".join(paragraph), set(parameters))
                lines += [indent + self.inline(opening), ""] if opening else []
                lines += [f"{indent}- **{escaped(who)}**: {self.inline(what)}" for who, what in rest]
                lines += ["", indent + self.inline(ending), ""] if rest else []
                paragraph = []
        for code, cause in errors:
            words = " ".join(filter(None, cause)).rstrip(". ")
            lines += [f"{indent}{self.inline(code)}", f"{indent}   {self.inline(words) or 'as its name says'}", ""]
        return lines

    def item(self, item: Item, others: list[Item]) -> list[str]:
        """others: functions under this one that share its comment."""
        since = re.search(r"since (\d+\.\d+)\.?$", item.comment)
        parameters = set(re.findall(r"(\w+)(?:\[\d*\])?[,)]", item.text))
        body = self.text(item.comment, "   ", parameters) + ([f"   *since {since[1]}*", ""] if since else [])
        if item.kind == "prose":
            return self.text(item.comment, "")
        if item.kind == "function":
            usual = [text for end, text in USUAL.items() if item.name.endswith(end)]
            more = [f"                {other.text}" for other in others]
            return [f".. c:function:: {item.text}", *more, "", *(body or [f"   {text}" for text in usual]), ""]
        if item.kind == "type":
            return [f".. c:type:: {item.text}", "", *body]
        if item.kind == "opaque":
            return [f".. c:struct:: {item.name}", "", *(body or ["   Opaque.", ""])]
        if item.kind == "struct":
            return [f".. c:struct:: {item.name}", "", *body, *self.table(item.members)]
        lines = self.text(item.comment, "")
        for declaration, comment in item.members:
            body = self.inline(" ".join(comment.split()))
            lines += [f".. c:enumerator:: {declaration}", "   :no-contents-entry:", ""]
            lines += [f"   {body}", ""] if body else []
        return lines

    def table(self, rows: list[tuple[str, str]]) -> list[str]:
        lines = ["   .. list-table::", "      :class: members", "      :widths: 40 60", ""]
        for declaration, comment in rows:
            lines.append(f"      * - ``{declaration}``")
            lines.append(f"        - {self.inline(' '.join(comment.split()))}".rstrip())
        return [*lines, ""]

    def page(self, section: Section) -> str:
        lines = [section.name, "=" * len(section.name), ""]
        items = list(section.items)
        while items:
            item, others = items.pop(0), []
            while item.kind == "function" and items and shares(item, items[0]):
                others.append(items.pop(0))
            lines += self.item(item, others)
        return "\n".join(lines)


def shares(item: Item, below: Item) -> bool:
    """Whether a function without a comment is told by the comment of the one above."""
    return below.kind == "function" and below.under and bool(item.comment) and not below.name.endswith(tuple(USUAL))


def index(header: str, found: list[Section], writer: Writer) -> str:
    """The header's opening and the list of its sections."""
    count = sum(item.kind == "function" for section in found for item in section.items)
    opening = plain(header[: header.index("*/") + 2]).split("\n\n")[2:-1]
    lines = ["The C interface, sgrt.h", "=======================", ""]
    lines += [
        f"{count} functions in {len(found)} sections, in the order of the pipeline, as ``include/sgrt.h`` declares"
    ]
    lines += [
        "and explains them. What the library promises about them: :doc:`/abi`. A first program: :doc:`/howto-c`.",
        "",
    ]
    for paragraph in opening:
        lines += [writer.inline(" ".join(paragraph.split())), ""]
    lines += [".. list-table::", "   :class: members", "   :widths: 20 80", ""]
    for section in found:
        about = next((item.comment for item in section.items if item.comment), "")
        sentence = re.split(r"(?<!eq)(?<=[a-z)])\.(?:\s|$)", " ".join(about.split()))[0]
        lines += [f"   * - :doc:`{section.name}`", f"     - {writer.inline(sentence)}"]
    lines += ["", ".. toctree::", "   :hidden:", "", *(f"   {section.name}" for section in found), ""]
    return "\n".join(lines)


def generate(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "c"
    folder.mkdir(exist_ok=True)
    header = (Path(app.srcdir).parent / "include/sgrt.h").read_text()
    found = sections(header)
    writer = Writer(roles(found))
    wanted = {f"{section.name}.rst": writer.page(section) for section in found}
    wanted["index.rst"] = index(header, found, writer)
    for old in folder.glob("*.rst"):
        if old.name not in wanted:
            old.unlink()
    for name, text in wanted.items():
        path = folder / name
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


def read_together(app: Sphinx, env: BuildEnvironment, names: list[str]) -> None:
    """One page of the manual changed: all are read anew, for a declaration that moved would be there twice."""
    manual = {name for name in env.found_docs if name.startswith("c/")}
    if manual & set(names):
        for name in manual & set(env.all_docs):
            env.clear_doc(name)
        names += sorted(manual - set(names))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", generate)
    app.connect("env-before-read-docs", read_together)
    return {"parallel_read_safe": True}
