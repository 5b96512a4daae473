"""Files, one module a format. Readers check everything and name the file and the cause; writers write whole files or
none.

A missing file is an OSError, a malformed one sgrt.FormatError (also a ValueError).
"""

from .captures import Capture, read_captures, write_captures
from .landmarks import (
    LandmarkSet,
    landmarks_align,
    landmarks_document,
    read_landmark_model,
    read_landmarks,
    write_landmark_model,
    write_landmarks,
)
from .nurbs import read_nurbs_curve, read_nurbs_surface, write_nurbs
from .ply import read_surface, write_surface
from .png import read_image, write_image
from .poses import PoseTrack, read_poses, write_poses
from .registration import read_pose, registration_document, write_registration
from .rig import read_rig, write_rig
from .roi import read_roi, write_roi
from .scan import Scan, ScanFrame, read_scan, write_scan
from .tof import TofFrames, read_pixel_offset, read_tof, write_pixel_offset, write_tof

__all__ = [
    "Capture",
    "LandmarkSet",
    "PoseTrack",
    "Scan",
    "ScanFrame",
    "TofFrames",
    "landmarks_align",
    "landmarks_document",
    "read_captures",
    "read_image",
    "read_landmark_model",
    "read_landmarks",
    "read_nurbs_curve",
    "read_nurbs_surface",
    "read_pixel_offset",
    "read_pose",
    "read_poses",
    "read_rig",
    "read_roi",
    "read_scan",
    "read_surface",
    "read_tof",
    "registration_document",
    "write_captures",
    "write_image",
    "write_landmark_model",
    "write_landmarks",
    "write_nurbs",
    "write_pixel_offset",
    "write_poses",
    "write_registration",
    "write_rig",
    "write_roi",
    "write_scan",
    "write_surface",
    "write_tof",
]
