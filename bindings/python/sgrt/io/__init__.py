"""Files, one module a format. Readers check everything and name the file and the cause; writers write whole files or
none.

A missing file is an OSError, a malformed one sgrt.FormatError (also a ValueError).
"""

from .captures import Capture, read_captures, write_captures
from .nurbs import read_nurbs_curve, read_nurbs_surface, write_nurbs
from .ply import read_surface, write_surface
from .png import read_image, write_image
from .poses import PoseTrack, read_poses, write_poses
from .registration import read_pose, registration_document, write_registration
from .rig import read_rig, write_rig
from .roi import read_roi, write_roi
from .scan import Scan, ScanFrame, read_scan, write_scan

__all__ = [
    "Capture",
    "PoseTrack",
    "Scan",
    "ScanFrame",
    "read_captures",
    "read_image",
    "read_nurbs_curve",
    "read_nurbs_surface",
    "read_pose",
    "read_poses",
    "read_rig",
    "read_roi",
    "read_scan",
    "read_surface",
    "registration_document",
    "write_captures",
    "write_image",
    "write_nurbs",
    "write_poses",
    "write_registration",
    "write_rig",
    "write_roi",
    "write_scan",
    "write_surface",
]
