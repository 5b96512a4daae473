"""The Python reference: docstrings as they are written in this project (plain paragraphs) for autodoc."""

from __future__ import annotations

import inspect
import re
from typing import Any

import sgrt.errors
from c_manual import by_parameter, escaped
from sphinx.application import Sphinx

# pybind11's types to what a reader wants to know.
TYPES = (
    (r"~?\bsgrt\._core\.", "sgrt."),
    (
        r"~?numpy\.ndarray\[tuple\[~?typing\.Any, \.\.\.\], ~?numpy\.dtype\[~?(?:numpy|typing)\.(\w+)\]\]",
        r"NDArray[\1]",
    ),
    (r"~?numpy\._typing\._array_like\._Buffer \|.*?\[complex \| bytes \| str\]", "ArrayLike"),
    (r"str \| ~?os\.PathLike\[str\]", "PathLike"),
    (r"typing\.SupportsInt \| typing\.SupportsIndex", "int"),
    (r"typing\.SupportsFloat \| typing\.SupportsIndex", "float"),
    (r"numpy\.typing\.NDArray\[numpy\.(\w+)\]", r"NDArray[\1]"),
    (r"numpy\.typing\.ArrayLike", "ArrayLike"),
    (r"collections\.abc\.", ""),
    (r"\bnumpy\.ndarray\b", "NDArray"),
    (r"^\((?:self|arg0): [\w.]+(?:, )?", "("),
)
EXCEPTIONS = [name for name, value in vars(sgrt.errors).items() if isinstance(value, type) and name != "Error"]


def shorter(signature: str | None) -> str | None:
    for pattern, replacement in TYPES if signature else ():
        signature = re.sub(pattern, replacement, signature or "")
    return signature


def signature(app: Sphinx, what: str, name: str, obj: Any, options: Any, arguments: str, result: str) -> Any:
    return shorter(arguments), shorter(result)


def docstring(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Plain text to reStructuredText: nothing in it is markup but `names` and indented examples."""
    done: list[str] = []
    if isinstance(obj, type) and (made := re.match(r"__init__(\(.*\)) -> None", obj.__init__.__doc__ or "")):
        done += [".. code-block:: python", "", f"   {obj.__name__}{shorter(made[1])}", ""]
    names = set(re.findall(r"(\w+):", signature_line(obj)))
    for paragraph in re.split(r"\n\s*\n", "\n".join(lines).strip()):
        if all(line.startswith("    ") for line in paragraph.split("\n")) and done:
            done += ["::", "", paragraph, ""]
            continue
        *text, c_names = (
            re.split(r"(?:^|\n)C: ", paragraph) if re.search(r"(?:^|\n)C: ", paragraph) else (paragraph, "")
        )
        text, raises = (*re.split(r"\bRaises:? ", " ".join(" ".join(text).split()), maxsplit=1), "")[:2]
        opening, parameters, ending = by_parameter(text, names)
        done += [inline(opening), ""]
        done += [f"- **{escaped(who)}**: {inline(told)}" for who, told in parameters] + ["", inline(ending), ""]
        done += [f"**Raises** {inline(raises)}", ""] if raises else []
        done += (
            ["C: " + ", ".join(f":c:func:`{found}`" for found in re.findall(r"sgrt_\w+", c_names)), ""]
            if c_names
            else []
        )
    if what == "property" and (kind := re.search(r"-> (.*)", getattr(getattr(obj, "fget", None), "__doc__", "") or "")):
        done[0] = f"*{escaped(shorter(kind[1]) or '')}*: {done[0]}"
    lines[:] = "\n".join(done).split("\n")


def signature_line(obj: Any) -> str:
    """The signature that pybind11 wrote: of a class its constructor's."""
    text = (getattr(obj, "__init__", obj) if isinstance(obj, type) else obj).__doc__ or ""
    return text.split("\n")[0] if "->" in text.split("\n")[0] else python_parameters(obj)


def python_parameters(obj: Any) -> str:
    try:
        return "".join(f"{parameter}: " for parameter in inspect.signature(obj).parameters)
    except (TypeError, ValueError):
        return ""


def inline(text: str) -> str:
    """`names` become literal, exceptions links; the rest is taken as it stands."""
    parts = re.split(r"(`[^`]+`|\b(?:sgrt\.)?(?:" + "|".join(EXCEPTIONS) + r")\b)", text)
    for i, part in enumerate(parts):
        if i % 2 == 0:
            parts[i] = escaped(part)
        else:
            parts[i] = (
                f"``{part.strip('`')}``" if part.startswith("`") else f":py:class:`~sgrt.{part.removeprefix('sgrt.')}`"
            )
    return "".join(parts)


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-signature", signature)
    app.connect("autodoc-process-docstring", docstring)
    return {"parallel_read_safe": True}
