"""Results of a registration, schema sgrt-registration/1; a number that is not there is null."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import Coarse, Deform, Icp, PatientDisplacement
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


def _directions(result: Icp | Deform | None) -> list[dict[str, Any]]:
    """The covariance's principal directions, the least certain first, each with its smallest detectable shift."""
    if not isinstance(result, Icp):
        return []
    rows = zip(result.directions, result.direction_words, result.direction_sigma_mm, result.detectable_mm, strict=True)
    return [
        {"motion": motion, "words": words, "sigma_mm": sigma, "detectable_mm": smallest}
        for motion, words, sigma, smallest in rows
    ]


def _coarse(result: Icp | Deform | None, landmarks: Coarse | None) -> dict[str, Any] | None:
    """How the start was found, where it was looked for."""
    if landmarks is not None:
        return {
            "status": landmarks.status,
            "verdict_text": landmarks.verdict_text,
            "reference_from_live": landmarks.reference_from_live,
            "covariance": landmarks.covariance,
            "landmarks": {
                "common": landmarks.common_count,
                "used": landmarks.used_count,
                "runner_up": landmarks.runner_up_count,
            },
            "rms_mm": landmarks.rms_mm,
        }
    if isinstance(result, Icp) and not np.isnan(result.coarse_score):
        return {"score": result.coarse_score, "runner_up": result.coarse_runner_up}
    return None


def registration_document(
    result: Icp | Deform | None,
    *,
    coarse: Coarse | None = None,
    status: str | None = None,
    isocentre_mm: ArrayLike | None = None,
    timing_ms: float | None = None,
) -> dict[str, Any]:
    """The document of a result, its keys in the order of the schema; NaN becomes null when it is written.

    result: of icp_align or deform_align, or the `.result` of its error; None where there is none (then status and
    isocentre_mm say what is known). coarse: of landmarks_align, where it gave the start.
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
            "detectable": _directions(result),
        },
        "covariance_random": result.covariance_random if isinstance(result, Icp) else np.full((6, 6), _NAN),
        "covariance_shared": result.covariance_shared if isinstance(result, Icp) else np.full((6, 6), _NAN),
        "verdict_text": result.verdict_text if result else None,
        "coarse": _coarse(result, coarse),
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
