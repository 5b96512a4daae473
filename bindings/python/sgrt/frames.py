"""Frames of the room (IEC 61217, DICOM, couch) and the six numbers of a registration; all computed by the library."""

from ._core import frame_couch_turn as couch_turn
from ._core import frame_fixed_from_couch as fixed_from_couch
from ._core import frame_fixed_from_dicom as fixed_from_dicom
from ._core import frame_fixed_from_gantry as fixed_from_gantry
from ._core import frame_four_dof as four_dof
from ._core import frame_pose_from_correction as pose_from_correction
from ._core import frame_pose_from_displacement as pose_from_displacement
from ._core import frame_shift_from_pose as shift_from_pose

__all__ = [
    "couch_turn",
    "fixed_from_couch",
    "fixed_from_dicom",
    "fixed_from_gantry",
    "four_dof",
    "pose_from_correction",
    "pose_from_displacement",
    "shift_from_pose",
]
