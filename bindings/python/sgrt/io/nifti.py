"""NIfTI volumes (extra `dicom`): right-anterior-superior coordinates are turned to DICOM's left-posterior-superior."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FormatError, LimitError
from ._files import PathLike
from .dicom import MAX_SIDE, MAX_VOXELS_BYTES

LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def read_nifti(path: PathLike) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """(voxels: slices x rows x columns, HU, int16 or float32; dicom_from_voxel: 4 x 4, maps (column, row, slice), mm).

    Raises FormatError: not NIfTI, not a single three-dimensional volume, no orientation. LimitError: above 4 GiB.
    """
    path = Path(path)
    try:
        import nibabel
    except ImportError:
        raise FormatError('NIfTI files need the extra dicom: pip install "sgrt[dicom]"') from None
    with path.open("rb"):
        pass
    try:
        image = nibabel.load(path)
        shape = tuple(int(n) for n in image.shape)
        affine = np.asarray(image.affine, dtype=np.float64)
    except Exception as error:  # nibabel's own classes and whatever a damaged header raises
        raise FormatError(f"{path}: not a NIfTI file: {error}") from error
    if len(shape) != 3 or min(shape) < 2:
        raise FormatError(f"{path}: shape {shape}; expected one volume of three dimensions")
    if max(shape) > MAX_SIDE or 4 * shape[0] * shape[1] * shape[2] > MAX_VOXELS_BYTES:
        raise LimitError(f"{path}: shape {shape}; expected at most 4 GiB")
    if not np.all(np.isfinite(affine)):
        raise FormatError(f"{path}: the header states no orientation")
    try:
        values = np.asanyarray(image.dataobj)
    except Exception as error:
        raise FormatError(f"{path}: damaged data: {error}") from error
    whole = values.dtype.kind in "iu" and values.min() >= -32768 and values.max() <= 32767
    voxels = values.astype(np.int16 if whole else np.float32, copy=False).transpose(2, 1, 0)
    return voxels, LPS_FROM_RAS @ affine
