"""The reference surface: from CT, structure set or capture, in IEC 61217 with the plan's isocentre at the origin.

The document beside a reference tells where it came from, without patient identity: schema sgrt-reference/1.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import SKIN_FLAGS, Context, Surface, Volume, contours_close, volume_skin
from .errors import FormatError
from .frames import fixed_from_dicom
from .io._files import PathLike
from .io.dicom import Plan, one_isocentre, read_ct, read_plan, read_structure, same_frame
from .io.nifti import read_nifti
from .io.ply import read_surface

SCHEMA = "sgrt-reference/1"
FRAME = "IEC 61217 fixed, mm"
# Whatever the patient's position, the couch lies below.
DOWN_IN_FIXED = (0.0, 0.0, -1.0)
SIDES = ("LAT", "LNG", "VRT")
FACES_A_SIDE = 0.9  # cosine; the rim of a cut faces nowhere


@dataclass(frozen=True)
class ReferenceSurface:
    """surface: room frame. document: its JSON. volume: the closed body that it is a part of; None if captured."""

    surface: Surface
    document: dict[str, Any]
    volume: Volume | None = None


@dataclass(frozen=True)
class _Frame:
    """How DICOM coordinates of this plan become the room's."""

    fixed_from_dicom: NDArray[np.float64]
    position: str
    isocentre_mm: tuple[float, float, float]
    plan: Plan | None


def _frame(
    plan_file: PathLike | None,
    beam: str | None,
    isocentre_mm: ArrayLike | None,
    position: str | None,
    source: PathLike,
    source_position: str | None,
) -> _Frame:
    plan = read_plan(plan_file) if plan_file is not None else None
    known = {word for word in (position, plan.patient_position if plan else None, source_position) if word}
    if len(known) > 1:
        raise FormatError(
            f"{source}: patient positions disagree: asked {position}, plan {plan.patient_position if plan else None},"
            f" source {source_position}"
        )
    if not known:
        raise FormatError(f"{source}: the patient position is not known; give it (HFS, HFP, FFS ...)")
    word = known.pop()
    if plan is not None and plan_file is not None and isocentre_mm is None:
        place = one_isocentre(plan, plan_file, beam)
    else:
        x, y, z = np.zeros(3) if isocentre_mm is None else np.asarray(isocentre_mm, dtype=np.float64)
        place = (float(x), float(y), float(z))
    return _Frame(fixed_from_dicom(word, place), word, place, plan)


def _cuts(volume: Volume) -> list[dict[str, Any]]:
    """Where the body goes on beyond the scan: a side of the room and the box of the cut, mm."""
    cut = (volume.flags & 1).astype(bool)
    points, normals = volume.points[cut], volume.normals[cut]
    found = []
    for k, name in enumerate(SIDES):
        for sign in (-1, 1):
            side = points[sign * normals[:, k] > FACES_A_SIDE]
            if len(side):
                found.append(
                    {"side": f"{'+' if sign > 0 else '-'}{name}", "box_mm": [side.min(axis=0), side.max(axis=0)]}
                )
    return found


def _document(
    kind: str, frame: _Frame, source: dict[str, Any], volume: Volume, threshold_hu: float | None
) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "kind": kind,
        "frame": FRAME,
        "patient_position": frame.position,
        "isocentre_dicom_mm": frame.isocentre_mm,
        "isocentre_mm": [0.0, 0.0, 0.0],
        "source": source | ({"plan_uid": frame.plan.uid} if frame.plan else {}),
        "threshold_hu": threshold_hu,
        "bias_mm": volume.mean_bias_mm if kind == "ct" else None,
        "sigma_mm": volume.median_sigma_mm,
        "couch_found": volume.couch_found if kind == "ct" else None,
        "slices": {
            "count": volume.slice_count,
            "spacing_mm": volume.slice_spacing_mm,
            "largest_gap_mm": volume.largest_gap_mm,
        },
        "volume_mm3": volume.volume_mm3,
        "vertices": {"all": len(volume.flags), **volume.counts},
        "cut": _cuts(volume),
    }


def _reference(
    kind: str, frame: _Frame, source: dict[str, Any], volume: Volume, threshold_hu: float | None, whole: bool
) -> ReferenceSurface:
    surface = volume.surface(() if whole else SKIN_FLAGS)
    return ReferenceSurface(surface, _document(kind, frame, source, volume, threshold_hu), volume)


def from_ct(
    source: PathLike,
    *,
    plan: PathLike | None = None,
    beam: str | None = None,
    isocentre_mm: ArrayLike | None = None,
    position: str | None = None,
    series_uid: str | None = None,
    threshold_hu: float | None = None,
    closing_mm: float = 4.0,
    whole: bool = False,
    context: Context | None = None,
) -> ReferenceSurface:
    """The skin of a planning CT: a folder of DICOM images, or a NIfTI file (head first supine unless said).

    plan: RTPLAN whose isocentre becomes the origin (beam: where the beams' differ); isocentre_mm: in its
    place, DICOM coordinates, mm; without either the origin is DICOM's. position: HFS ... where the files do not tell.
    threshold_hu, closing_mm: see volume_skin. whole: the closed body instead of measured skin alone.

    Raises FormatError: see io.dicom; a plan for another frame of reference; positions that disagree. NotFound: no body.
    """
    path = Path(source)
    nifti = path.name.endswith((".nii", ".nii.gz"))
    if nifti:
        voxels, dicom_from_voxel = read_nifti(path)
        slope, intercept, padding = 1.0, 0.0, None
        frame = _frame(plan, beam, isocentre_mm, position, path, None if position else "HFS")
        origin: dict[str, Any] = {"file": path.name}
    else:
        ct = read_ct(path, series_uid=series_uid)
        voxels, dicom_from_voxel = ct.voxels, ct.dicom_from_voxel
        slope, intercept, padding = ct.slope, ct.intercept, ct.padding_hu
        frame = _frame(plan, beam, isocentre_mm, position, path, ct.patient_position)
        if frame.plan and frame.plan.frame_of_reference_uid:
            same_frame([(str(path), ct.frame_of_reference_uid), (str(plan), frame.plan.frame_of_reference_uid)])
        origin = {"series_uid": ct.series_uid, "frame_of_reference_uid": ct.frame_of_reference_uid}
    volume = volume_skin(
        voxels,
        frame.fixed_from_dicom @ dicom_from_voxel,
        rescale_slope=slope,
        rescale_intercept=intercept,
        threshold_hu=threshold_hu,
        closing_mm=closing_mm,
        padding_hu=padding,
        down=DOWN_IN_FIXED,
        context=context,
    )
    return _reference("ct", frame, origin, volume, threshold_hu, whole)


def from_structure(
    source: PathLike,
    *,
    name: str | None = None,
    plan: PathLike | None = None,
    beam: str | None = None,
    isocentre_mm: ArrayLike | None = None,
    position: str | None = None,
    pixel_mm: float | None = None,
    whole: bool = False,
    context: Context | None = None,
) -> ReferenceSurface:
    """The body of an RTSTRUCT: the region of type EXTERNAL, or the one with this name. Arguments as from_ct.

    A structure set does not tell the patient position: the plan does, or `position`.
    Raises FormatError: see io.dicom.
    """
    structure = read_structure(source, name=name)
    frame = _frame(plan, beam, isocentre_mm, position, source, None)
    if frame.plan and frame.plan.frame_of_reference_uid:
        same_frame([(str(source), structure.frame_of_reference_uid), (str(plan), frame.plan.frame_of_reference_uid)])
    turn = frame.fixed_from_dicom
    contours = [points @ turn[:3, :3].T + turn[:3, 3] for points in structure.contours]
    options = {} if pixel_mm is None else {"pixel_mm": pixel_mm}
    volume = contours_close(contours, context=context, **options)
    origin = {
        "structure_set_uid": structure.uid,
        "region": structure.name,
        "contours": len(contours),
        "frame_of_reference_uid": structure.frame_of_reference_uid,
    }
    return _reference("rtstruct", frame, origin, volume, None, whole)


def from_capture(source: PathLike, *, plan: PathLike | None = None) -> ReferenceSurface:
    """A surface that was captured in the treatment room (PLY, room frame): taken as it is, its isocentre the origin."""
    surface = read_surface(source)
    found = read_plan(plan) if plan is not None else None
    origin: dict[str, Any] = {"file": Path(source).name} | ({"plan_uid": found.uid} if found else {})
    document = {
        "schema": SCHEMA,
        "kind": "captured",
        "frame": FRAME,
        "patient_position": found.patient_position if found else None,
        "isocentre_dicom_mm": None,
        "isocentre_mm": [0.0, 0.0, 0.0],
        "source": origin,
        "threshold_hu": None,
        "bias_mm": None,
        "sigma_mm": float(np.nanmedian(surface.sigma_mm)) if surface.sigma_mm is not None else None,
        "vertices": {"all": surface.point_count},
    }
    return ReferenceSurface(surface, document)
