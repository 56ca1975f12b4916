"""surfsig tells what a scanned surface is.

import surfsig

cloud = surfsig.read("scan.ply")
s = surfsig.extract(cloud, radius=0.02)
s.k1, s.k2, s.normals, s.status            # curvature, per unit length, at every point
w = s.signatures([100, 2000])              # equal surfaces have equal signatures
surfsig.similarity(w[0], w[1])             # zeta, between 0 and 1
way = surfsig.odometry("scans")            # poses of a moving sensor, by its scans
found = surfsig.surfaces(cloud)            # planes, cylinders, spheres, ... and which points are whose

`__version__` is the package's version, `INSTRUCTION_SET` the instructions that its kernels run on here.
"""

from surfsig._surfsig import INSTRUCTION_SET, Frame, __version__
from surfsig.clean import crop, downsample, remove_outliers
from surfsig.coordinate_system import CoordinateSystem
from surfsig.curvature import extract, extract_radii
from surfsig.errors import FileFormatError, InvalidInputError, SurfsigError
from surfsig.extraction import Extraction, FitUsed, Status
from surfsig.field import FieldMatches, FieldSignatures, field_signatures, keypoints, match_fields
from surfsig.files import (
    ScanSequence,
    TimedScan,
    Trajectory,
    read,
    read_trajectory,
    scan_sequence,
    write,
    write_covariances,
    write_trajectory,
)
from surfsig.finding import Instance, Instances, Library, LibraryEntry, find
from surfsig.flat_atom import flat_atom_length
from surfsig.missing_returns import remove_missing_returns
from surfsig.odometry import Odometry, ScanStatus, odometry
from surfsig.point_cloud import PointCloud
from surfsig.recurrences import Recurrence, Recurrences, recurrences
from surfsig.registration import Registration, register
from surfsig.shapes import FittedShape, fit_cylinder, fit_plane, fit_sphere
from surfsig.similarity import flipped, similarity, similarity_class, similarity_matrix
from surfsig.surfaces import PointClass, Surface, Surfaces, surfaces
from surfsig.units import unit_mismatch

__all__ = [
    "INSTRUCTION_SET",
    "CoordinateSystem",
    "Extraction",
    "FieldMatches",
    "FieldSignatures",
    "FileFormatError",
    "FitUsed",
    "FittedShape",
    "Frame",
    "Instance",
    "Instances",
    "InvalidInputError",
    "Library",
    "LibraryEntry",
    "Odometry",
    "PointClass",
    "PointCloud",
    "Recurrence",
    "Recurrences",
    "Registration",
    "ScanSequence",
    "ScanStatus",
    "Status",
    "Surface",
    "Surfaces",
    "SurfsigError",
    "TimedScan",
    "Trajectory",
    "__version__",
    "crop",
    "downsample",
    "extract",
    "extract_radii",
    "field_signatures",
    "find",
    "fit_cylinder",
    "fit_plane",
    "fit_sphere",
    "flat_atom_length",
    "flipped",
    "keypoints",
    "match_fields",
    "odometry",
    "read",
    "read_trajectory",
    "recurrences",
    "register",
    "remove_missing_returns",
    "remove_outliers",
    "scan_sequence",
    "similarity",
    "similarity_class",
    "similarity_matrix",
    "surfaces",
    "unit_mismatch",
    "write",
    "write_covariances",
    "write_trajectory",
]
