"""Results of a registration, schema sgrt-registration/1; a number that is not there is null."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import Deform, Icp, PatientDisplacement
from ..errors import FormatError, InvalidArgument
from ..frames import shift_from_pose
from ._files import PathLike, check_schema, naming, numbers, parse_json, read_text, write_json

SCHEMA = "sgrt-registration/1"
_NAN = float("nan")
_NO_SHIFT = dict.fromkeys(PatientDisplacement().as_dict(), _NAN)


DEFORM = (
    "rigid_share",
    "structure_mm",
    "runner_up_share",
    "runner_up_distance_mm",
    "runner_up_rivalry",
    "scale",
    "scale_sigma",
    "deformation_rms_mm",
    "deformation_max_mm",
)


def _free(result: Icp | Deform | None) -> list[dict[str, Any]]:
    if isinstance(result, Icp):
        pairs = zip(result.free_motions, result.free_words, strict=True)
        return [{"motion": motion, "words": words} for motion, words in pairs]
    return [{"motion": None, "words": words} for words in result.free_words] if result else []


def registration_document(
    result: Icp | Deform | None,
    *,
    status: str | None = None,
    isocentre_mm: ArrayLike | None = None,
    timing_ms: float | None = None,
) -> dict[str, Any]:
    """The document of a result, its keys in the order of the schema; NaN becomes null when it is written.

    result: of icp_align or deform_align, or the `.result` of its error; None where there is none (then status and
    isocentre_mm say what is known).
    timing_ms: written by the command line only.
    """
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "status": status or (result.status if result else "ok"),
        "verdict": result.verdict if result and result.verdict != "none" else None,
        "reference_from_live": result.reference_from_live if result else np.full((4, 4), _NAN),
        "isocentre_mm": result.isocentre_mm if result else np.full(3, _NAN),
        "patient_displacement": result.displacement.as_dict() if result else _NO_SHIFT,
        "couch_correction": result.correction.as_dict() if result else _NO_SHIFT,
        "covariance": result.covariance if result else np.full((6, 6), _NAN),
        "observability": {
            "free": _free(result),
            "sigma_mm": result.sigma_mm if result else np.full(3, _NAN),
            "sigma_deg": result.sigma_deg if result else np.full(3, _NAN),
            "detectable": None,
        },
        "rms_mm": result.rms_mm if result else _NAN,
        "inlier_share": result.inlier_share if result else _NAN,
        "iterations": result.iterations if isinstance(result, Icp) else 0,
    }
    if isinstance(result, Deform):
        document["deform"] = {name: getattr(result, name) for name in DEFORM}
    if isocentre_mm is not None:
        document["isocentre_mm"] = np.asarray(isocentre_mm, dtype=np.float64)
    if timing_ms is not None:
        document["timing_ms"] = timing_ms
    return document


def write_registration(path: PathLike, result: Icp | Deform | None, **known: Any) -> None:
    """Writes registration_document(result, **known)."""
    write_json(path, registration_document(result, **known))


def read_pose(path: PathLike) -> NDArray[np.float64]:
    """reference_from_live, 4 x 4, of a registration result or of `{"reference_from_live": 4x4}`.

    Raises OSError, FormatError (also where the registration found no pose).
    """
    text = read_text(path)
    with naming(path):
        value = parse_json(text)
        if "schema" in value:
            check_schema(value, SCHEMA)
            if value.get("status") != "ok":
                raise FormatError(f"a registration without a pose: its status is {value.get('status')!r}")
        if "reference_from_live" not in value:
            raise FormatError("reference_from_live is missing")
        pose = numbers(value["reference_from_live"], (4, 4), "reference_from_live")
        try:
            shift_from_pose(pose, (0, 0, 0))
        except InvalidArgument as error:
            raise FormatError(str(error)) from error
        return pose
