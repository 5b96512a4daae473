"""Camera images: PNG, 8 or 16 bit grey."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, PngImagePlugin

from ..errors import FormatError, InvalidArgument, LimitError
from ._files import PathLike, naming, writing

MAX_SIDE = 32_768
MAX_DEFLATE = 1040  # deflate packs 1032 : 1 at best
COLOURS = {
    2: "RGB colour; save it as grey (e.g. with `convert in.png -colorspace Gray out.png`)",
    3: "a palette; save it as grey",
    4: "grey with an alpha channel; save it without",
    6: "RGB colour with an alpha channel; save it as grey",
}


def _check_header(stream: BinaryIO) -> None:
    head = stream.read(33)
    if not head.startswith(b"\x89PNG\r\n\x1a\n"):
        raise FormatError("not a PNG file")
    if len(head) < 33 or head[12:16] != b"IHDR":
        raise FormatError("PNG cut short: no header")
    width, height, depth, colour = struct.unpack(">IIBB", head[16:26])
    if colour != 0:
        raise FormatError(f"expected 8 or 16 bit grey, found {COLOURS.get(colour, f'colour type {colour}')}")
    if depth not in (8, 16):
        raise FormatError(f"expected 8 or 16 bit grey, found {depth} bit")
    if max(width, height) > MAX_SIDE:
        raise LimitError(f"{width} x {height} px; at most {MAX_SIDE} a side")
    size = os.fstat(stream.fileno()).st_size
    if min(width, height) < 1 or width * height * (depth // 8) > size * MAX_DEFLATE:
        raise FormatError(f"the header promises {width} x {height} px, but the file has {size} bytes")


def read_image(path: PathLike) -> NDArray[Any]:
    """A grey image, H x W, uint8 or uint16 as the file has it.

    Raises OSError (missing), FormatError (not PNG, colour, cut short), LimitError (a side above 32,768).
    """
    with naming(path), Path(path).open("rb") as stream:
        _check_header(stream)
        wide = stream.seek(24) == 24 and stream.read(1) == b"\x10"
        stream.seek(0)
        try:
            image = PngImagePlugin.PngImageFile(stream)
            image.load()
        except (OSError, SyntaxError, ValueError, EOFError, struct.error) as error:
            raise FormatError(f"broken PNG: {error}") from error
        return np.ascontiguousarray(np.asarray(image).astype(np.uint16 if wide else np.uint8))


def write_image(path: PathLike, image: NDArray[Any]) -> None:
    """Writes a grey image, H x W, uint8 or uint16."""
    if image.ndim != 2 or image.dtype not in (np.uint8, np.uint16) or not image.size:
        raise InvalidArgument(f"image: {image.dtype} of shape {image.shape}; expected uint8 or uint16, H x W")
    with writing(path) as stream:
        Image.fromarray(np.ascontiguousarray(image)).save(stream, format="PNG")
