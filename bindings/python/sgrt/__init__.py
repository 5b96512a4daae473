"""Surface-guided radiation therapy: from camera images of a patient's skin to a six-degree couch shift.

Lengths are mm, angles rad unless a name ends in _deg; a pose `a_from_b` maps b-coordinates to a; the room frame is IEC
61217 fixed. Every number comes from the C library (include/sgrt.h); files and the command line are Python's. This is
not a medical device.
"""

from . import errors, frames, io
from ._core import (
    STEREO_REASONS,
    Camera,
    Context,
    CouchCorrection,
    FuseInfo,
    Icp,
    Pair,
    PatientDisplacement,
    Reference,
    Rig,
    Roi,
    Stereo,
    StereoSession,
    Surface,
    icp_align,
    stereo_match,
    surface_distance,
    surface_fuse,
    version,
)
from .errors import (
    Cancelled,
    Degenerate,
    Error,
    FormatError,
    InsufficientData,
    InternalError,
    InvalidArgument,
    LimitError,
    NotConverged,
    NotFound,
    OutOfMemory,
)

__version__ = version()

__all__ = [
    "STEREO_REASONS",
    "Camera",
    "Cancelled",
    "Context",
    "CouchCorrection",
    "Degenerate",
    "Error",
    "FormatError",
    "FuseInfo",
    "Icp",
    "InsufficientData",
    "InternalError",
    "InvalidArgument",
    "LimitError",
    "NotConverged",
    "NotFound",
    "OutOfMemory",
    "Pair",
    "PatientDisplacement",
    "Reference",
    "Rig",
    "Roi",
    "Stereo",
    "StereoSession",
    "Surface",
    "errors",
    "frames",
    "icp_align",
    "io",
    "stereo_match",
    "surface_distance",
    "surface_fuse",
    "version",
]
