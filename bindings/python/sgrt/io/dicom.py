"""What a treatment plan says in DICOM (extra `dicom`): CT series, structure sets, plans. Patient coordinates (LPS), mm.

No patient identity leaves this module: of a file only UIDs, geometry and numbers are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FormatError, LimitError
from ._files import PathLike

MAX_SIDE = 32768
MAX_VOXELS_BYTES = 4 * 2**30
# Slices lie at these distances but for the rounding of DICOM's decimal strings.
POSITION_TOLERANCE_MM = 0.02
POSITIONS = ("HFS", "HFP", "FFS", "FFP", "HFDL", "HFDR", "FFDL", "FFDR")


@dataclass(frozen=True)
class CtSeries:
    """A CT volume. value = slope * voxels + intercept, HU; dicom_from_voxel maps (column, row, slice)."""

    voxels: NDArray[Any]
    dicom_from_voxel: NDArray[np.float64]
    slope: float
    intercept: float
    padding_hu: float | None
    patient_position: str | None
    frame_of_reference_uid: str
    series_uid: str


@dataclass(frozen=True)
class Structure:
    """Contours of one region of a structure set: arrays of points x 3."""

    name: str
    contours: list[NDArray[np.float64]]
    frame_of_reference_uid: str
    uid: str


@dataclass(frozen=True)
class Plan:
    """Isocentres by beam name; patient position."""

    isocentres_mm: dict[str, tuple[float, float, float]]
    patient_position: str | None
    frame_of_reference_uid: str
    uid: str
    structure_set_uids: list[str] = field(default_factory=list)


def _pydicom() -> Any:
    try:
        import pydicom
    except ImportError:
        raise FormatError('DICOM files need the extra dicom: pip install "sgrt[dicom]"') from None
    return pydicom


def _read(path: Path, *, pixels: bool = True) -> Any:
    pydicom = _pydicom()
    with path.open("rb"):  # the usual OSError where it cannot be read
        pass
    try:
        return pydicom.dcmread(path, stop_before_pixels=not pixels)
    except pydicom.errors.InvalidDicomError:
        raise FormatError(f"{path}: not a DICOM file") from None
    except Exception as error:  # a damaged file fails anywhere in the parser
        raise FormatError(f"{path}: damaged DICOM: {type(error).__name__}: {error}") from error


def _get(data: Any, name: str, path: Path) -> Any:
    try:
        value = data.get(name)
    except Exception as error:  # values are parsed when they are asked for
        raise FormatError(f"{path}: {name} cannot be read: {error}") from error
    if value is None or value == "":
        raise FormatError(f"{path}: has no {name}")
    return value


def _numbers(value: Any, count: int, name: str, path: Path) -> NDArray[np.float64]:
    try:
        numbers = np.array([float(x) for x in value], dtype=np.float64)
    except (TypeError, ValueError):
        raise FormatError(f"{path}: {name} is {value!r}; expected {count} numbers") from None
    if numbers.shape != (count,) or not np.all(np.isfinite(numbers)):
        raise FormatError(f"{path}: {name} is {value!r}; expected {count} finite numbers")
    return numbers


def _position(word: Any, path: Path) -> str | None:
    if word in (None, ""):
        return None
    if word not in POSITIONS:
        raise FormatError(f"{path}: PatientPosition is {word!r}; expected one of {', '.join(POSITIONS)}")
    return str(word)


# ---------------------------------------------------------------------------------------------------------------- CT


def _headers(source: Path) -> list[tuple[Path, Any]]:
    """The CT images of a folder, or one file; other files of a folder are passed over."""
    if not source.is_dir():
        header = _read(source, pixels=False)
        if header.get("Modality") != "CT":
            raise FormatError(
                f"{source}: is {header.get('Modality') or 'of no modality'}; expected a folder of CT images"
            )
        return [(source, header)]
    found = []
    for path in sorted(p for p in source.iterdir() if p.is_file()):
        try:
            header = _read(path, pixels=False)
        except FormatError:
            continue
        if header.get("Modality") == "CT" and "ImagePositionPatient" in header:
            found.append((path, header))
    if not found:
        raise FormatError(f"{source}: no CT image in this folder")
    return found


def _one_series(images: list[tuple[Path, Any]], source: Path, series_uid: str | None) -> list[tuple[Path, Any]]:
    by_uid: dict[str, list[tuple[Path, Any]]] = {}
    for path, header in images:
        by_uid.setdefault(str(_get(header, "SeriesInstanceUID", path)), []).append((path, header))
    if series_uid is None and len(by_uid) > 1:
        listed = "; ".join(f"{uid} ({len(group)} images)" for uid, group in sorted(by_uid.items()))
        raise FormatError(f"{source}: {len(by_uid)} CT series: {listed}; choose one")
    if series_uid is not None and series_uid not in by_uid:
        raise FormatError(f"{source}: no series {series_uid}; it has {', '.join(sorted(by_uid))}")
    return by_uid[series_uid] if series_uid else next(iter(by_uid.values()))


def _sorted_by_position(
    images: list[tuple[Path, Any]], source: Path
) -> tuple[list[tuple[Path, Any]], NDArray[np.float64], NDArray[np.float64]]:
    """The images along the normal of their plane, with dicom_from_voxel's axes (columns) and origin."""
    first_path, first = images[0]
    cosines = _numbers(_get(first, "ImageOrientationPatient", first_path), 6, "ImageOrientationPatient", first_path)
    spacing = _numbers(_get(first, "PixelSpacing", first_path), 2, "PixelSpacing", first_path)
    if not np.all((spacing > 0.01) & (spacing < 100)):
        raise FormatError(f"{first_path}: PixelSpacing is {spacing.tolist()}; expected 0.01 to 100 mm")
    along_row, along_column = cosines[:3], cosines[3:]
    normal = np.cross(along_row, along_column)
    unit = [float(np.sqrt(np.sum(axis**2))) for axis in (along_row, along_column, normal)]
    if max(abs(length - 1) for length in unit) > 1e-3:
        raise FormatError(
            f"{first_path}: ImageOrientationPatient is {cosines.tolist()}; expected two unit axes at 90 deg"
        )
    places = []
    for path, header in images:
        if not np.allclose(
            _numbers(header.ImageOrientationPatient, 6, "ImageOrientationPatient", path), cosines, atol=1e-4
        ):
            raise FormatError(f"{path}: ImageOrientationPatient differs from that of {first_path.name}")
        if not np.allclose(_numbers(header.PixelSpacing, 2, "PixelSpacing", path), spacing, rtol=1e-4):
            raise FormatError(f"{path}: PixelSpacing differs from that of {first_path.name}")
        places.append(_numbers(_get(header, "ImagePositionPatient", path), 3, "ImagePositionPatient", path))
    heights = np.array(places) @ normal
    order = np.argsort(heights, kind="stable")
    images, heights, origins = [images[i] for i in order], heights[order], np.array(places)[order]
    gap = _check_gaps([path for path, _ in images], heights, source)
    step = (origins[-1] - origins[0]) / (len(images) - 1) if len(images) > 1 else normal * gap
    axes = np.stack([along_row * spacing[1], along_column * spacing[0], step], axis=1)
    return images, axes, origins[0]


def _check_gaps(paths: list[Path], heights: NDArray[np.float64], source: Path) -> float:
    if len(heights) < 2:
        raise FormatError(f"{source}: one CT image; a volume needs two or more")
    gaps = np.diff(heights)
    gap = float(np.median(gaps))
    for i, found in enumerate(gaps):
        names = f"{paths[i].name} and {paths[i + 1].name}"
        if found < POSITION_TOLERANCE_MM:
            raise FormatError(f"{source}: {names} lie at the same place, {heights[i]:.2f} mm: a slice stands twice")
        if abs(found - gap) > max(POSITION_TOLERANCE_MM, 0.01 * gap):
            missing = round(found / gap) - 1
            what = (
                f"{missing} missing"
                if missing > 0 and abs(found / (missing + 1) - gap) < 0.05 * gap
                else "unequal slices"
            )
            raise FormatError(
                f"{source}: {names} are {found:.2f} mm apart, the others {gap:.2f} mm: {what}"
                f" between {heights[i]:.2f} and {heights[i + 1]:.2f} mm"
            )
    return gap


def _pixels(path: Path) -> tuple[Any, NDArray[Any]]:
    data = _read(path)
    try:
        return data, data.pixel_array
    except Exception as error:  # a codec that is not there, or damaged data
        syntax = data.file_meta.TransferSyntaxUID
        help_ = (
            " (pip install pylibjpeg pylibjpeg-libjpeg pylibjpeg-openjpeg reads most)" if syntax.is_compressed else ""
        )
        raise FormatError(
            f"{path}: pixels in transfer syntax {syntax.name} ({syntax}) cannot be read{help_}: {error}"
        ) from error


def read_ct(source: PathLike, *, series_uid: str | None = None) -> CtSeries:
    """A CT series from a folder (or the files of one), sorted by position.

    Raises FormatError: not DICOM, no CT, two series (listed; choose by series_uid), slices missing, doubled or unequal
    (named), images of unlike size or spacing, compressed pixels that cannot be read (with the transfer syntax and what
    to install). LimitError: more than 4 GiB.
    """
    source = Path(source)
    images = _one_series(_headers(source), source, series_uid)
    images, axes, origin = _sorted_by_position(images, source)
    path0, first = images[0]
    rows, columns = int(_get(first, "Rows", path0)), int(_get(first, "Columns", path0))
    if max(rows, columns) > MAX_SIDE or 2 * rows * columns * len(images) > MAX_VOXELS_BYTES:
        raise LimitError(f"{source}: {len(images)} images of {columns} x {rows}; expected at most 4 GiB")
    volume: NDArray[Any] | None = None
    rescale: tuple[float, float] | None = None
    for k, (path, header) in enumerate(images):
        if (int(header.Rows), int(header.Columns)) != (rows, columns):
            raise FormatError(f"{path}: {header.Columns} x {header.Rows} pixels; the others have {columns} x {rows}")
        data, pixels = _pixels(path)
        if pixels.shape != (rows, columns):
            raise FormatError(f"{path}: pixels of shape {pixels.shape}; expected one grey image")
        scale = (float(data.get("RescaleSlope", 1) or 1), float(data.get("RescaleIntercept", 0) or 0))
        if volume is None:
            volume = np.empty((len(images), rows, columns), pixels.dtype if pixels.dtype.itemsize == 2 else np.int16)
            rescale = scale
        if scale != rescale:
            raise FormatError(f"{path}: rescale slope and intercept {scale}; the others have {rescale}")
        volume[k] = pixels
    assert volume is not None and rescale is not None
    padding = first.get("PixelPaddingValue")
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, origin
    return CtSeries(
        voxels=volume,
        dicom_from_voxel=matrix,
        slope=rescale[0],
        intercept=rescale[1],
        padding_hu=None if padding is None else rescale[0] * float(padding) + rescale[1],
        patient_position=_position(first.get("PatientPosition"), path0),
        frame_of_reference_uid=str(_get(first, "FrameOfReferenceUID", path0)),
        series_uid=str(first.SeriesInstanceUID),
    )


# ------------------------------------------------------------------------------------------------- structures, plans


def _regions(data: Any) -> list[tuple[int, str, str, str]]:
    """(number, name, type, frame of reference) of each region."""
    types = {
        int(o.ReferencedROINumber): str(o.get("RTROIInterpretedType") or "")
        for o in data.get("RTROIObservationsSequence") or []
    }
    return [
        (
            int(r.ROINumber),
            str(r.get("ROIName") or ""),
            types.get(int(r.ROINumber), ""),
            str(r.get("ReferencedFrameOfReferenceUID") or ""),
        )
        for r in data.get("StructureSetROISequence") or []
    ]


def read_structure(path: PathLike, *, name: str | None = None) -> Structure:
    """The region of type EXTERNAL of an RTSTRUCT, or the one with this name.

    Raises FormatError: no structure set, no such region or more than one (what there is is listed), contours that are
    not closed and planar.
    """
    path = Path(path)
    data = _read(path)
    if data.get("Modality") != "RTSTRUCT":
        raise FormatError(f"{path}: is {data.get('Modality') or 'of no modality'}; expected RTSTRUCT")
    regions = _regions(data)
    chosen = [r for r in regions if (r[1] == name if name is not None else r[2] == "EXTERNAL")]
    if len(chosen) != 1:
        what = f"{len(chosen) or 'no'} region{'s' if len(chosen) > 1 else ''} " + (
            f"called {name!r}" if name is not None else "of type EXTERNAL"
        )
        listed = ", ".join(f"{n!r} ({t or 'no type'})" for _, n, t, _ in regions) or "none"
        raise FormatError(f"{path}: {what}; it has {listed}")
    number, found_name, _, frame = chosen[0]
    contours = []
    for item in data.get("ROIContourSequence") or []:
        if int(item.ReferencedROINumber) != number:
            continue
        for i, contour in enumerate(item.get("ContourSequence") or []):
            kind = contour.get("ContourGeometricType")
            if kind == "POINT":
                continue
            if kind not in ("CLOSED_PLANAR", "CLOSEDPLANAR_XOR"):
                raise FormatError(f"{path}: contour {i} of {found_name!r} is {kind}; expected CLOSED_PLANAR")
            flat = _numbers(contour.ContourData, len(contour.ContourData), f"contour {i} of {found_name!r}", path)
            if len(flat) % 3:
                raise FormatError(f"{path}: contour {i} of {found_name!r} has {len(flat)} numbers; expected 3 a point")
            if len(flat) >= 9:  # fewer than three points enclose nothing
                contours.append(flat.reshape(-1, 3))
    if not contours:
        raise FormatError(f"{path}: region {found_name!r} has no contour")
    return Structure(found_name, contours, frame, str(data.get("SOPInstanceUID") or ""))


def _isocentre(beam: Any, path: Path) -> tuple[float, float, float] | None:
    points = beam.get("ControlPointSequence") or beam.get("IonControlPointSequence") or []
    for point in points:
        place = point.get("IsocenterPosition")
        if place is not None:
            x, y, z = _numbers(place, 3, "IsocenterPosition", path)
            return float(x), float(y), float(z)
    return None


def read_plan(path: PathLike) -> Plan:
    """An RTPLAN: isocentres (300A,012C) by beam, patient position, frame of reference.

    Raises FormatError: no plan, no beam with an isocentre.
    """
    path = Path(path)
    data = _read(path)
    if data.get("Modality") not in ("RTPLAN",):
        raise FormatError(f"{path}: is {data.get('Modality') or 'of no modality'}; expected RTPLAN")
    isocentres = {}
    for i, beam in enumerate(data.get("BeamSequence") or data.get("IonBeamSequence") or []):
        place = _isocentre(beam, path)
        if place is not None:
            label = str(beam.get("BeamName") or beam.get("BeamNumber") or i)
            isocentres[label if label not in isocentres else f"{label} ({beam.get('BeamNumber', i)})"] = place
    if not isocentres:
        raise FormatError(f"{path}: no beam with an isocentre (300A,012C)")
    positions = {
        str(s.get("PatientPosition")) for s in data.get("PatientSetupSequence") or [] if s.get("PatientPosition")
    }
    if len(positions) > 1:
        raise FormatError(f"{path}: beams in unlike patient positions {', '.join(sorted(positions))}")
    structure_sets = [str(r.ReferencedSOPInstanceUID) for r in data.get("ReferencedStructureSetSequence") or []]
    return Plan(
        isocentres_mm=isocentres,
        patient_position=_position(next(iter(positions), None), path),
        frame_of_reference_uid=str(data.get("FrameOfReferenceUID") or ""),
        uid=str(data.get("SOPInstanceUID") or ""),
        structure_set_uids=structure_sets,
    )


def one_isocentre(plan: Plan, path: PathLike, beam: str | None) -> tuple[float, float, float]:
    """The isocentre of a beam, or the one that all beams share. Raises FormatError listing them where they differ."""
    listed = "; ".join(f"{name} {list(place)}" for name, place in plan.isocentres_mm.items())
    if beam is not None:
        if beam not in plan.isocentres_mm:
            raise FormatError(f"{path}: no beam {beam!r}; it has {listed}")
        return plan.isocentres_mm[beam]
    places = list(plan.isocentres_mm.values())
    if any(max(abs(a - b) for a, b in zip(place, places[0], strict=True)) > POSITION_TOLERANCE_MM for place in places):
        raise FormatError(f"{path}: beams with unlike isocentres: {listed}; choose a beam")
    return places[0]


def same_frame(uids: Sequence[tuple[str, str]]) -> None:
    """Raises FormatError unless all (what, frame of reference UID) agree; an absent UID agrees with none."""
    first_what, first = uids[0]
    for what, uid in uids[1:]:
        if uid != first:
            raise FormatError(
                f"{what} has frame of reference {uid or '(none)'}, {first_what} has {first or '(none)'}:"
                " they cannot be combined"
            )
