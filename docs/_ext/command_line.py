"""The help of the command line for sphinx-click: plain text, in which nothing is markup."""

from __future__ import annotations

import re
from typing import Any

from c_manual import escaped
from sphinx.application import Sphinx


def plain(line: str) -> str:
    """A line of help: `names` are literal, **Required** is sphinx-click's own."""
    parts = re.split(r"(`[^`]+`|\*\*Required\*\*)", line.replace("\b", ""))
    return "".join(
        escaped(p) if i % 2 == 0 else f"``{p.strip('`')}``" if p[0] == "`" else p for i, p in enumerate(parts)
    )


def text(app: Sphinx, context: Any, lines: list[str]) -> None:
    """Of a command: its paragraphs."""
    lines[:] = [plain(line) for line in lines]


def options(app: Sphinx, context: Any, lines: list[str]) -> None:
    """Of its options: what stands under `.. option::`."""
    lines[:] = [line if re.match(r"\s*(\.\.|:)", line) else plain(line) for line in lines]


def epilog(app: Sphinx, context: Any, lines: list[str]) -> None:
    """The examples, as a block of code."""
    examples = [line.strip(" |\b") for line in lines if line.strip(" |\b")]
    lines[:] = ["::", "", *(f"   {line}" for line in examples), ""] if examples else []


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("sphinx-click-process-description", text)
    app.connect("sphinx-click-process-options", options)
    app.connect("sphinx-click-process-epilog", epilog)
    return {"parallel_read_safe": True}
