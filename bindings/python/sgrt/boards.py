"""Boards in folders of images: a folder a camera, file names equal in all folders for one placement of the board."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ._core import BoardDetection, Context, board_detect, board_points
from .errors import Error, FormatError, InvalidArgument, LimitError, NotFound

SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"}


@dataclass(frozen=True)
class Board:
    """kind: 'chessboard' (inner corners) or 'circles' (asymmetric).

    spacing_mm: side of a square; distance of two rows of circles.
    """

    kind: str
    columns: int
    rows: int
    spacing_mm: float

    @property
    def points(self) -> NDArray[np.float64]:
        """N x 3, mm."""
        return board_points(self.kind, self.columns, self.rows, self.spacing_mm)

    @property
    def half_turn_ambiguous(self) -> bool:
        """Turned by half a turn the board looks the same."""
        return (self.rows if self.kind == "circles" else self.columns + self.rows) % 2 == 0

    def find(self, image: NDArray[Any], context: Context | None = None) -> BoardDetection:
        """The board in a grey image. Raises NotFound."""
        return board_detect(self.kind, self.columns, self.rows, self.spacing_mm, image, context=context)


def parse_board(text: str) -> Board:
    """'chessboard:COLSxROWS:SQUARE_MM' or 'circles:COLSxROWS:SPACING_MM'. Raises InvalidArgument."""
    match = re.fullmatch(r"(chessboard|circles):(\d+)x(\d+):([-+.\deE]+)", text)
    try:
        board = Board(match[1], int(match[2]), int(match[3]), float(match[4])) if match else None
    except ValueError:
        board = None
    if board is None:
        raise InvalidArgument(
            f"--board {text}: expected chessboard:COLSxROWS:SQUARE_MM or circles:COLSxROWS:SPACING_MM"
        )
    board.points  # noqa: B018  # the library's own check of the numbers
    return board


def read_photo(path: Path) -> NDArray[Any]:
    """A grey image of a PNG, JPEG, BMP, TIFF or PGM file, uint8 or uint16; colour becomes its luma.

    Raises OSError, FormatError.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path) as image:
                if max(image.size) > 32768:
                    raise LimitError(f"{path}: {image.size[0]} x {image.size[1]}, expected sides of at most 32768")
                wide = image.mode.startswith("I;16")
                return np.ascontiguousarray(
                    np.asarray(image if wide else image.convert("L")).astype("u2" if wide else "u1")
                )
    except (SyntaxError, ValueError, EOFError, Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise FormatError(f"{path}: not an image: {error}") from error
    except OSError as error:
        if error.filename is not None:
            raise
        raise FormatError(f"{path}: not an image that can be read: {error}") from error


@dataclass
class Boards:
    """What the cameras saw of a board: the arguments of calibration_solve, and the images without it."""

    board: Board
    cameras: list[tuple[str, tuple[int, int]]] = field(default_factory=list)
    placements: list[str] = field(default_factory=list)
    index: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    pixels: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    sigma_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    missing: list[dict[str, str]] = field(default_factory=list)

    def arguments(self) -> dict[str, Any]:
        """The keyword arguments that calibration_solve and calibration_check share."""
        return {
            "cameras": self.cameras,
            "points": self.board.points,
            "index": self.index,
            "pixels": self.pixels,
            "placements": self.placements,
            "half_turn_ambiguous": self.board.half_turn_ambiguous,
        }


def images_of(folder: Path) -> list[Path]:
    """The images of a folder by name. Raises FormatError where there is none, OSError where there is no folder."""
    files = sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES and not p.name.startswith("."))
    if not files:
        raise FormatError(f"{folder}: no image in it ({', '.join(sorted(SUFFIXES))})")
    return files


def _look(board: Board, path: Path) -> tuple[tuple[int, int], BoardDetection | str]:
    image = read_photo(path)
    try:
        found: BoardDetection | str = board.find(image)
    except NotFound as error:
        found = str(error)
    except Error as error:
        raise type(error)(f"{path}: {error}") from error
    return (image.shape[1], image.shape[0]), found


def find_boards(
    board: Board,
    folders: Sequence[tuple[str, Path]],
    *,
    threads: int = 1,
    progress: Callable[[float, str], None] | None = None,
) -> Boards:
    """Finds the board in every image of every camera's folder.

    folders: (camera id, folder). An image without the board is listed in `missing`. Raises FormatError: an image that
    cannot be read, or of another size than the camera's first; NotFound: a camera in none of whose images the board was
    found.
    """
    names = [name for name, _ in folders]
    for name in names:
        if names.count(name) > 1:
            raise InvalidArgument(f"--camera {name}: two cameras with one id")
    files = [(c, path) for c, (_, folder) in enumerate(folders) for path in images_of(folder)]
    out = Boards(board, placements=sorted({path.name for _, path in files}))
    place = {name: i for i, name in enumerate(out.placements)}
    index, pixels, sigmas = [], [], []
    sizes: dict[int, tuple[tuple[int, int], Path]] = {}
    for n, ((camera, path), (size, found)) in enumerate(
        zip(files, _looks(board, [p for _, p in files], threads), strict=True)
    ):
        if progress:
            progress((n + 1) / len(files), "find the board")
        first_size, first = sizes.setdefault(camera, (size, path))
        if size != first_size:
            raise FormatError(f"{path}: {size[0]} x {size[1]} pixels, {first} has {first_size[0]} x {first_size[1]}")
        if isinstance(found, str):
            out.missing.append({"camera": names[camera], "image": path.name, "why": found})
            continue
        rows, seen = index_rows(found.pixels, camera, place[path.name])
        index.append(rows)
        pixels.append(found.pixels[seen])
        sigmas.append(found.sigma_px[seen])
    out.cameras = [(name, sizes[c][0]) for c, name in enumerate(names)]
    for c, name in enumerate(names):
        if not any(part[0, 0] == c for part in index):
            why = next(m["why"] for m in out.missing if m["camera"] == name)
            raise NotFound(f"{folders[c][1]}: the board is in none of the images of camera {name}: {why}")
    out.index = np.concatenate(index)
    out.pixels, out.sigma_px = np.concatenate(pixels), np.concatenate(sigmas)
    return out


def index_rows(pixels: NDArray[Any], camera: int, placement: int) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
    """camera, placement, point of each point of a board that was found (its pixel is finite), and their numbers."""
    seen = np.flatnonzero(np.isfinite(pixels[:, 0]))
    rows = np.stack([np.full(len(seen), camera), np.full(len(seen), placement), seen], axis=1)
    return rows.astype(np.int32), seen


def _looks(board: Board, paths: list[Path], threads: int) -> Iterator[tuple[tuple[int, int], BoardDetection | str]]:
    """In order; the library works without Python's lock, so threads help."""
    if threads == 1:
        yield from (_look(board, path) for path in paths)
        return
    with ThreadPoolExecutor(threads) as pool:
        try:
            yield from pool.map(lambda path: _look(board, path), paths)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
