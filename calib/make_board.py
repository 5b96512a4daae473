#!/usr/bin/env python3
"""Prints a calibration board: make_board.py chessboard:11x8:30 board.svg board.pdf

Files end in .svg or .pdf and are drawn at true size; print at 100 %, without "fit to page". A bar of 100 mm beside the
board verifies the print: measure it with a caliper, and give `sgrt calibrate --board` the spacing times what you
measured over 100. Needs nothing but Python.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

MARGIN = 15.0  # mm round the pattern
FOOT = 22.0  # mm below it, for the bar and the text
POINT = 72 / 25.4  # of PDF, a mm
ROUND = 0.5522847498307936  # control points of a quarter circle


def shapes(kind: str, columns: int, rows: int, spacing: float) -> tuple[float, float, list[tuple]]:
    """Width and height of the pattern, and its dark shapes: ("box", x, y, w, h) or ("disc", x, y, r); y down, mm."""
    if kind == "chessboard":  # columns x rows inner corners: one square more each way; the first one is dark
        squares = [
            ("box", j * spacing, i * spacing, spacing, spacing)
            for i in range(rows + 1)
            for j in range(columns + 1)
            if (i + j) % 2 == 0
        ]
        return (columns + 1) * spacing, (rows + 1) * spacing, squares
    discs = [
        ("disc", (2 * j + i % 2 + 1) * spacing, (i + 1) * spacing, 0.5 * spacing)
        for i in range(rows)
        for j in range(columns)
    ]
    return (2 * columns + 1) * spacing, (rows + 1) * spacing, discs


def svg(width: float, height: float, dark: list[tuple], lines: list[tuple], text: str) -> bytes:
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm"'
        f' viewBox="0 0 {width:g} {height:g}">',
        f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
    ]
    for shape in dark:
        if shape[0] == "box":
            parts.append('<rect x="{:g}" y="{:g}" width="{:g}" height="{:g}"/>'.format(*shape[1:]))
        else:
            parts.append('<circle cx="{:g}" cy="{:g}" r="{:g}"/>'.format(*shape[1:]))
    for x0, y0, x1, y1 in lines:
        parts.append(f'<path d="M {x0:g} {y0:g} L {x1:g} {y1:g}" stroke="black" stroke-width="0.2"/>')
    parts.append(f'<text x="{MARGIN:g}" y="{height - 5:g}" font-family="sans-serif" font-size="4">{text}</text></svg>')
    return "\n".join(parts).encode()


def disc_path(x: float, y: float, r: float) -> str:
    k = ROUND * r
    curves = [
        (x + r, y + k, x + k, y + r, x, y + r),
        (x - k, y + r, x - r, y + k, x - r, y),
        (x - r, y - k, x - k, y - r, x, y - r),
        (x + k, y - r, x + r, y - k, x + r, y),
    ]
    return f"{x + r:.5f} {y:.5f} m " + " ".join(" ".join(f"{v:.5f}" for v in c) + " c" for c in curves) + " f"


def pdf(width: float, height: float, dark: list[tuple], lines: list[tuple], text: str) -> bytes:
    """One page, mm with y up by the first matrix."""
    parts = [f"{POINT:.8f} 0 0 {POINT:.8f} 0 0 cm"]
    for shape in dark:
        if shape[0] == "box":
            _, x, y, w, h = shape
            parts.append(f"{x:.5f} {height - y - h:.5f} {w:.5f} {h:.5f} re f")
        else:
            parts.append(disc_path(shape[1], height - shape[2], shape[3]))
    parts.append("0.2 w")
    parts += [f"{x0:.5f} {height - y0:.5f} m {x1:.5f} {height - y1:.5f} l S" for x0, y0, x1, y1 in lines]
    parts.append(f"BT /F 4 Tf {MARGIN:.3f} 5 Td ({text}) Tj ET")
    content = "\n".join(parts).encode()
    box = f"[0 0 {width * POINT:.4f} {height * POINT:.4f}]"
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Contents 4 0 R"
        " /Resources << /Font << /F << /Type /Font /Subtype /Type1 /BaseFont /Helvetica >> >> >> >>".encode(),
        f"<< /Length {len(content)} >>\nstream\n".encode() + content + b"\nendstream",
    ]
    out, offsets = b"%PDF-1.4\n", []
    for n, body in enumerate(objects, 1):
        offsets.append(len(out))
        out += f"{n} 0 obj\n".encode() + body + b"\nendobj\n"
    table = "".join(f"{offset:010d} 00000 n \n" for offset in offsets)
    out += f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n{table}".encode()
    return (
        out + f"trailer << /Size {len(objects) + 1} /Root 1 0 R >>\nstartxref\n{out.rfind(b'xref')}\n%%EOF\n".encode()
    )


def main(arguments: list[str]) -> int:
    if len(arguments) < 2 or arguments[0] in ("-h", "--help"):
        print(__doc__)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else 2
    match = re.fullmatch(r"(chessboard|circles):(\d+)x(\d+):(\d+(?:\.\d+)?)", arguments[0])
    if not match or min(int(match[2]), int(match[3])) < 3 or float(match[4]) <= 0:
        print(f"make_board: {arguments[0]}: expected chessboard:COLSxROWS:MM or circles:COLSxROWS:MM", file=sys.stderr)
        return 2
    w, h, dark = shapes(match[1], int(match[2]), int(match[3]), float(match[4]))
    width, height = max(w, 100.0) + 2 * MARGIN, h + MARGIN + FOOT
    dark = [(s[0], s[1] + MARGIN, s[2] + MARGIN, *s[3:]) for s in dark]
    y = h + MARGIN + 6
    bar = [(MARGIN, y, MARGIN + 100, y), *((MARGIN + x, y - 2, MARGIN + x, y + 2) for x in range(0, 101, 10))]
    text = f"sgrt --board {arguments[0]}   the bar is 100 mm"
    for name in arguments[1:]:
        draw = {".svg": svg, ".pdf": pdf}.get(Path(name).suffix.lower())
        if draw is None:
            print(f"make_board: {name}: expected a name that ends in .svg or .pdf", file=sys.stderr)
            return 2
        Path(name).write_bytes(draw(width, height, dark, bar, text))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
