"""The code blocks of README and the documentation, read as a reader copies them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), ROOT / "calib/README.md"]
FENCE = re.compile(r"(?:<!-- not run: (?P<why>[^>]+?) -->\n+)?^```(?P<language>\w*)\n(?P<code>.*?)^```$", re.S | re.M)

SHOWN = re.compile(r"\n\n```text\n(.*?)^```$", re.S | re.M)


@dataclass(frozen=True)
class Block:
    page: Path
    line: int
    language: str
    code: str
    why: str | None  # not run
    shown: str  # what the page says that it prints; "" where it does not say

    @property
    def name(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def blocks(language: str) -> list[Block]:
    """All of one language, page by page, in their order."""
    found = []
    for page in PAGES:
        text = page.read_text()
        for match in FENCE.finditer(text):
            if match["language"] == language:
                line = text.count("\n", 0, match.start("code")) + 1
                shown = SHOWN.match(text, match.end())
                found.append(Block(page, line, language, match["code"], match["why"], shown[1] if shown else ""))
    return found


def same(shown: str, printed: str) -> bool:
    """Whether a line was printed: its words, its numbers to 0.02 or 5 %; times and what `...` stands for may differ."""
    ours, theirs = shown.split(), printed.split()
    if "..." in ours:
        ours = ours[: ours.index("...")]
        theirs = theirs[: len(ours)]
    return len(ours) == len(theirs) and all(
        close(a, b) or ours[i + 1 : i + 2] == ["ms"] for i, (a, b) in enumerate(zip(ours, theirs, strict=True))
    )


def close(a: str, b: str) -> bool:
    try:
        x, y = (float(word.strip("[](),%;")) for word in (a, b))
    except ValueError:
        return a == b
    return a == b or abs(x - y) <= max(0.02, 0.05 * abs(x))
