"""Frames of a time-of-flight camera: taps in an .npz file, and the offsets of its pixels in an .npy file."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FormatError, LimitError
from ._files import PathLike, naming, writing

DTYPES = ("uint16", "int16", "float32")
MAX_BYTES = 4 * 2**30


@dataclass(frozen=True)
class TofFrames:
    """taps: frames x frequencies x taps x H x W, counts. saturation: counts at which taps clip; None: not stated."""

    taps: NDArray[Any]
    saturation: float | None = None


def _load(path: Path) -> Any:
    if not zipfile.is_zipfile(path):
        with path.open("rb"):  # a missing file is an OSError
            pass
        raise FormatError("not an .npz file")
    with zipfile.ZipFile(path) as archive:
        size = sum(item.file_size for item in archive.infolist())
    if size > MAX_BYTES:
        raise LimitError(f"{size} bytes of arrays, expected at most {MAX_BYTES}")
    return np.load(path, allow_pickle=False)


def read_tof(path: PathLike) -> TofFrames:
    """The frames of an .npz file with `taps` (frames x frequencies x taps x H x W) and optionally `saturation`.

    Raises OSError, FormatError: no such array, another dtype than uint16, int16 or float32, another number of
    dimensions. LimitError: more than 4 GiB.
    """
    file = Path(path)
    with naming(file):
        try:
            with _load(file) as archive:
                if "taps" not in archive.files:
                    raise FormatError(f"has no array 'taps'; it has {', '.join(archive.files) or 'none'}")
                taps = archive["taps"]
                saturation = archive["saturation"] if "saturation" in archive.files else None
        except (ValueError, EOFError, KeyError, zipfile.BadZipFile, zipfile.LargeZipFile) as error:
            if isinstance(error, FormatError):
                raise
            raise FormatError(f"not an .npz file that can be read: {error}") from error
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
        with file.open("rb"):
            pass
        try:
            offset = np.load(file, allow_pickle=False)
        except (ValueError, EOFError) as error:
            raise FormatError(f"not an .npy file that can be read: {error}") from error
        if not isinstance(offset, np.ndarray) or offset.ndim != 2 or offset.dtype.kind != "f":
            raise FormatError("expected one array of height x width floats")
        return np.ascontiguousarray(offset, dtype=np.float64)


def write_pixel_offset(path: PathLike, offset_mm: NDArray[Any]) -> None:
    """Writes the offsets as float32 .npy."""
    with writing(path) as stream:
        np.save(stream, np.asarray(offset_mm, dtype=np.float32))
