"""Frames of a time-of-flight camera: taps in an .npz file, and the offsets of its pixels in an .npy file."""

from __future__ import annotations

import contextlib
import math
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ..errors import Error, FormatError, LimitError
from ._files import PathLike, naming, writing

DTYPES = ("uint16", "int16", "float32")
MAX_BYTES = 4 * 2**30


@dataclass(frozen=True)
class TofFrames:
    """taps: frames x frequencies x taps x H x W, counts. saturation: counts at which taps clip; None: not stated."""

    taps: NDArray[Any]
    saturation: float | None = None


@contextlib.contextmanager
def _parsing(kind: str) -> Iterator[None]:
    """zipfile, zlib and numpy raise a dozen types for bytes that are not what they say, TokenError among them."""
    try:
        yield
    except (Error, MemoryError):
        raise
    except Exception as error:
        words = " ".join(str(error).split())
        raise FormatError(f"not {kind} file that can be read: {words or type(error).__name__}") from error


def _array(stream: IO[bytes], size: int) -> NDArray[Any]:
    """The array of an .npy file of so many bytes, which are there before it is allocated."""
    version = npy.read_magic(stream)
    read = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}.get(version)
    if read is None:
        raise FormatError(f"an array of the format {version[0]}.{version[1]}; expected 1.0 or 2.0")
    shape, _, dtype = read(stream)
    if dtype.hasobject:
        raise ValueError("an array of Python objects")
    if math.prod(shape) * dtype.itemsize > size - stream.tell():
        raise FormatError(f"cut short: the header promises {shape} of {dtype}, {size - stream.tell()} bytes follow it")
    stream.seek(0)
    return np.asarray(npy.read_array(stream, allow_pickle=False))


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Of an .npz file: `taps`, and `saturation` where it is there."""
    with path.open("rb"):  # a missing file is an OSError
        pass
    with _parsing("an .npz"):
        if not zipfile.is_zipfile(path):
            raise FormatError("not an .npz file")
        with zipfile.ZipFile(path) as archive:
            items = {item.filename.removesuffix(".npy"): item for item in archive.infolist()}
            size = sum(item.file_size for item in items.values())
            if size > MAX_BYTES:
                raise LimitError(f"{size} bytes of arrays, expected at most {MAX_BYTES}")
            if "taps" not in items:
                raise FormatError(f"has no array 'taps'; it has {', '.join(items) or 'none'}")
            found: dict[str, NDArray[Any]] = {}
            for name in ("taps", "saturation"):
                if name in items:
                    with archive.open(items[name]) as stream:
                        found[name] = _array(stream, items[name].file_size)
            return found


def read_tof(path: PathLike) -> TofFrames:
    """The frames of an .npz file with `taps` (frames x frequencies x taps x H x W) and optionally `saturation`.

    Raises OSError, FormatError: no such array, another dtype than uint16, int16 or float32, another number of
    dimensions. LimitError: more than 4 GiB.
    """
    file = Path(path)
    with naming(file):
        found = _arrays(file)
        taps, saturation = found["taps"], found.get("saturation")
        if taps.ndim != 5:
            raise FormatError(
                f"taps: {taps.ndim} dimensions, {taps.shape}; expected frames x frequencies x taps x height x width"
            )
        if taps.dtype.newbyteorder("=").name not in DTYPES:
            raise FormatError(f"taps: dtype {taps.dtype}; expected {', '.join(DTYPES)}")
        if 0 in taps.shape:
            raise FormatError(f"taps: shape {taps.shape}, without a pixel")
        if saturation is not None and (saturation.size != 1 or saturation.dtype.kind not in "uif"):
            raise FormatError(f"saturation: {saturation.dtype} of shape {saturation.shape}; expected one number")
        level = None if saturation is None else float(saturation.reshape(()))
        if level is not None and not (np.isfinite(level) and level > 0):
            raise FormatError(f"saturation: {level}; expected a finite number above 0")
        return TofFrames(np.ascontiguousarray(taps.astype(taps.dtype.newbyteorder("="), copy=False)), level)


def write_tof(path: PathLike, frames: TofFrames) -> None:
    """Writes the frames as an .npz file, compressed."""
    arrays: dict[str, Any] = {"taps": frames.taps}
    if frames.saturation is not None:
        arrays["saturation"] = np.float64(frames.saturation)
    with writing(path) as stream:
        np.savez_compressed(stream, **arrays)


def read_pixel_offset(path: PathLike) -> NDArray[np.float64]:
    """The offsets of a time-of-flight camera's pixels, H x W, mm. Raises OSError, FormatError."""
    file = Path(path)
    with naming(file):
        with file.open("rb") as stream, _parsing("an .npy"):
            offset = _array(stream, file.stat().st_size)
        if offset.ndim != 2 or offset.dtype.kind != "f":
            raise FormatError("expected one array of height x width floats")
        return np.ascontiguousarray(offset, dtype=np.float64)


def write_pixel_offset(path: PathLike, offset_mm: NDArray[Any]) -> None:
    """Writes the offsets as float32 .npy."""
    with writing(path) as stream:
        np.save(stream, np.asarray(offset_mm, dtype=np.float32))
