"""The theory's equations, written in its pages as plain text, to MathML, which browsers draw without script or font.

The text stays as linear as it is written: `z^2 / (f B) sigma_d` keeps its slash and its order. Letters, scripts and
signs alone are set, so that nothing comes to mean another thing; every character is used once (tests/docs).
A block with anything else in it, a matrix of several rows for one, stays as it is.
"""

from __future__ import annotations

import re
from html import escape

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform

GREEK = {"alpha": "α", "beta": "β", "gamma": "γ", "theta": "θ", "kappa": "κ", "lambda": "λ", "nu": "ν", "xi": "ξ"}
GREEK |= {"rho": "ρ", "tau": "τ", "phi": "φ", "chi": "χ", "psi": "ψ"}
WORDS = {"sigma": "σ", "delta": "δ", "pi": "π"}  # in a sentence they may be words
LETTERS = GREEK | WORDS | {"integral": "∫", "sum": "∑"}
SIGNS = {
    "<=": "≤",
    ">=": "≥",
    "!=": "≠",
    "->": "→",
    "<-": "←",
    "+-": "±",
    "...": "…",
    "..": "..",
    "-": "−",
    "*": "*",
    "~": "∼",
}
NUMBER = re.compile(r"\s{2,}\((\d+[a-z]?(?:(?:-|, )\d+)?)\)$")
TOKEN = re.compile(
    r"(?P<space>\s+)|(?P<number>\d+(?:\.\d+)?)"
    rf"|(?P<identifier>\w+_(?:from|in)_\w+|(?!(?:{'|'.join(LETTERS)})_)[^\W\d_]{{3,}}_[^\W\d_]{{3,}})"
    r"|(?P<word>[^\W\d_]+~?)(?P<index>\d*)|(?P<script>[_^])|(?P<primes>'+)"
    r"|(?P<sign><=|>=|!=|:=|->|<-|\+-|\.\.\.?|[-+*/=<>.,;:()\[\]|%×⟨⟩~])"
)
SUBSCRIPT = re.compile(r"\{([^}]*)\}|\(([^)]*)\)|([^\W_]+(?:[-+,][^\W_]+)*)")
SUPERSCRIPT = re.compile(r"\{([^}]*)\}|(\([^)]*\))|(-?\d+(?:\.\d+)?|-?[^\W\d_]|\+)")


class NotMath(Exception):
    """Something that these rules do not read."""


def math(text: str) -> str:
    """MathML of one line, in parts between which it may be broken."""
    parts = re.split(r"\s{2,}", text)
    return "".join(f"<math><mrow>{row(part)}</mrow></math>" for part in parts)


def row(text: str) -> str:
    done: list[str] = []
    at, before = 0, ""  # before: the token that a minus follows
    while at < len(text):
        match = TOKEN.match(text, at)
        if not match:
            raise NotMath(text[at:])
        at = match.end()
        if match["space"]:
            done.append('<mspace width="0.22em"/>')
            continue
        if match["word"] == "sqrt" and text[at : at + 1] == "(":
            end = closing(text, at)
            done.append(f"<msqrt>{row(text[at + 1 : end])}</msqrt>")
            at, before = end + 1, ")"
            continue
        if match["script"]:
            raise NotMath(text[match.start() :])
        base = atom(match, before)
        base, at = scripts(base, text, at)
        done.append(base)
        before = match.group()
    return "".join(done)


def closing(text: str, at: int) -> int:
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] == "(") - (text[i] == ")")
        if depth == 0:
            return i
    raise NotMath(text)


def atom(match: re.Match[str], before: str) -> str:
    if match["number"]:
        return f"<mn>{match['number']}</mn>"
    if match["identifier"]:
        return f"<mtext>{match['identifier']}</mtext>"
    if match["primes"]:
        raise NotMath(match.group())
    if match["word"]:
        word = match["word"]
        letter = LETTERS.get(word, word[:-1] + "\u0303" if word.endswith("~") else word)
        if letter in "∑∫√":
            return f'<mo largeop="false">{letter}</mo>'
        if word == "sqrt":
            return "<mo>√</mo>"
        if match["index"] and len(letter) > 1:
            return f"<mi>{letter}{match['index']}</mi>"
        if match["index"]:  # chi2 is the square, k1 the first
            script = "msup" if word == "chi" else "msub"
            return f"<{script}><mi>{letter}</mi><mn>{match['index']}</mn></{script}>"
        if re.fullmatch(r"d[A-Za-z]", word):
            return f'<mi mathvariant="normal">d</mi><mi>{word[1]}</mi>'
        return f"<mi>{letter}</mi>"
    sign = SIGNS.get(match["sign"], match["sign"])
    if sign == "." and match.end() < len(match.string) and re.match(r"[\s\w(]", match.string[match.end() :]):
        return '<mo lspace="0.15em" rspace="0.15em">·</mo>'
    if sign in "()[]|⟨⟩":
        return f'<mo stretchy="false" lspace="0" rspace="0">{sign}</mo>'
    if sign == "/":
        return '<mo lspace="0.1em" rspace="0.1em">/</mo>'
    tight = not match.string[match.end() : match.end() + 1].isspace()
    unary = sign == "−" and (not before or before in "=([,/+-<;→" or (before == "|" and tight))
    return f'<mo form="prefix">{sign}</mo>' if unary else f"<mo>{escape(sign)}</mo>"


def scripts(base: str, text: str, at: int) -> tuple[str, int]:
    """Primes, subscript and superscript behind an atom, in any order."""
    below, above = "", ""
    while at < len(text) and text[at] in "'_^":
        if text[at] == "'":
            base = f'<mrow>{base}<mo lspace="0" rspace="0">′</mo></mrow>'
            at += 1
            continue
        pattern, lower = (SUBSCRIPT, True) if text[at] == "_" else (SUPERSCRIPT, False)
        match = pattern.match(text, at + 1)
        if not match:
            raise NotMath(text[at:])
        inner = row(next(group for group in match.groups() if group is not None))
        if lower:  # x_a_b: the subscript has one of its own
            below = f"<msub><mrow>{below}</mrow><mrow>{inner}</mrow></msub>" if below else inner
        else:
            above += inner
        at = match.end()
    if below and above:
        return f"<msubsup>{base_row(base)}<mrow>{below}</mrow><mrow>{above}</mrow></msubsup>", at
    if below or above:
        script = "msub" if below else "msup"
        return f"<{script}>{base_row(base)}<mrow>{below or above}</mrow></{script}>", at
    return base, at


def base_row(base: str) -> str:
    return f"<mrow>{base}</mrow>" if base.count("<mi") > 1 else base


def lines(block: str) -> list[str]:
    """The lines of a block as HTML; NotMath where one of them is not read."""
    if re.search(r"^\s*\[", block, flags=re.M):
        raise NotMath("a matrix")
    done = []
    for line in block.split("\n"):
        number = NUMBER.search(line)
        text = line[: number.start()] if number else line
        if not text.strip():
            continue
        indent = (len(text) - len(text.lstrip())) / 2
        anchor = f' id="eq-{re.split("[-,]", number[1])[0]}"' if number else ""
        told = f'<span class="number">({number[1]})</span>' if number else ""
        style = f' style="padding-left: {indent + 1}em"' if indent else ""
        done.append(f'<div class="equation"{anchor}{style}><span>{math(text.strip())}</span>{told}</div>')
    return done


RAISED = str.maketrans("-0123456789T", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹ᵀ")
POWER = re.compile(r"(?<=[\w)\]|'])\^(-?\d+|T)(?![\w(])")
LETTER = re.compile(rf"\b(?:({'|'.join(GREEK)})(?![^\W\d_])|({'|'.join(WORDS)})(?=[_^'(]|\d\b| [=<>+/] ))")


def prose(text: str) -> str:
    """Powers and Greek letters within a sentence."""
    text = LETTER.sub(lambda match: LETTERS[match.group()], text)
    return POWER.sub(lambda match: match[1].translate(RAISED), text)


class Equations(SphinxTransform):
    """Indented blocks of the theory pages; powers and letters in their sentences."""

    default_priority = 400

    def apply(self) -> None:
        if not self.env.docname.startswith("theory/"):
            return
        for block in list(self.document.findall(nodes.literal_block)):
            if block.get("language") in (None, "none", "default"):
                try:
                    html = "\n".join(lines(block.astext()))
                except NotMath:
                    continue
                block.replace_self(nodes.raw("", f'<div class="equations">{html}</div>', format="html"))
        for text in list(self.document.findall(nodes.Text)):
            if not isinstance(text.parent, nodes.literal | nodes.literal_block | nodes.raw) and prose(text) != text:
                text.parent.replace(text, nodes.Text(prose(text)))


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_transform(Equations)
    return {"parallel_read_safe": True}
