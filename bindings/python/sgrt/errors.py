"""One exception class a status of sgrt.h; `except sgrt.Error` catches them all."""

from __future__ import annotations

from . import _core


class Error(Exception):
    """What the library answered instead of a result: one line that names the argument, its value and what was expected.

    status: the number in sgrt.h. result: for statuses 10 to 19 the result with its diagnostics, its numbers NaN; else
    None.
    """

    status: int = 23

    def __init__(self, message: str = "", *, result: object = None) -> None:
        super().__init__(message)
        self.result = result

    @property
    def word(self) -> str:
        """The status as it stands in JSON: "degenerate", "not_found", ..."""
        return _core.status_word(self.status)


class InvalidArgument(Error, ValueError):
    """Shape, dtype, range, non-finite."""

    status = 1


class FormatError(Error, ValueError):
    """A text or file that is malformed, of an unknown schema or lacks a field."""

    status = 2


class InsufficientData(Error):
    """Too few points, pairs or pixels."""

    status = 10


class Degenerate(Error):
    """The data leave a direction free."""

    status = 11


class NotConverged(Error):
    """The iteration limit came first."""

    status = 12


class NotFound(Error):
    """No match, no overlap."""

    status = 13


class Cancelled(Error):
    """The progress callback asked for it."""

    status = 20


class OutOfMemory(Error, MemoryError):
    """No memory for it; handles stay usable."""

    status = 21


class LimitError(Error):
    """Larger than a documented limit."""

    status = 22


class InternalError(Error):
    """A defect of the library; please report the message."""

    status = 23


_CLASSES = {
    cls.status: cls
    for cls in (
        InvalidArgument,
        FormatError,
        InsufficientData,
        Degenerate,
        NotConverged,
        NotFound,
        Cancelled,
        OutOfMemory,
        LimitError,
        InternalError,
    )
}


def class_of(status: int) -> type[Error]:
    """The exception class of a status."""
    return _CLASSES.get(status, InternalError)
