"""surfsig tells what a scanned surface is.

import surfsig

cloud = surfsig.read("scan.ply")
s = surfsig.extract(cloud, radius=0.02)
s.k1, s.k2, s.normals, s.status            # curvature, per unit length, at every point
w = s.signatures([100, 2000])              # equal surfaces have equal signatures
surfsig.similarity(w[0], w[1])             # zeta, between 0 and 1
found = surfsig.find_surfaces(cloud)       # planes, cylinders, spheres, ... and which points are whose
odometry = surfsig.estimate_odometry("scans")  # poses of a moving sensor, by its scans

`__version__` is the package's version, `INSTRUCTION_SET` the instructions that its kernels run on here.
"""

from surfsig._surfsig import (
    INSTRUCTION_SET,
    FindSettings,
    Frame,
    OdometrySettings,
    RecurrenceSettings,
    RegistrationSettings,
    __version__,
)
from surfsig.alignment.free_directions import FreeDirection
from surfsig.browser import show
from surfsig.clean import crop, downsample, remove_outliers
from surfsig.coordinate_system import CoordinateSystem, GeoKeys
from surfsig.curvature import extract, extract_radii
from surfsig.errors import FileFormatError, InvalidInputError, SurfsigError
from surfsig.extraction import Extraction
from surfsig.field import (
    FieldMatches,
    FieldSignatures,
    extract_field_signatures,
    find_keypoints,
    match_fields,
)
from surfsig.files import (
    Chunks,
    ScanSequence,
    TimedScan,
    Trajectory,
    open_scan_sequence,
    read,
    read_trajectory,
    write,
    write_covariances,
    write_trajectory,
)
from surfsig.finding import (
    Instance,
    Instances,
    Library,
    LibraryEntry,
    find_instances,
    read_model,
    read_models,
)
from surfsig.flat_atom import flat_atom_length
from surfsig.fusion import fuse_scans
from surfsig.missing_returns import remove_missing_returns
from surfsig.odometry import (
    LoopClosure,
    Odometry,
    ScanStatus,
    TrackedScan,
    Tracker,
    deskew,
    estimate_odometry,
)
from surfsig.point_cloud import PointCloud
from surfsig.recurrences import (
    EqualSurfaces,
    Occurrence,
    Piece,
    Recurrence,
    Recurrences,
    find_recurrences,
)
from surfsig.registration import (
    Alternative,
    MultiwayRegistration,
    RegisteredPair,
    Registration,
    register,
    register_multiway,
)
from surfsig.shapes import (
    SurfaceAngle,
    SurfaceDistance,
    SurfacePatch,
    fit_circle,
    fit_cone,
    fit_cylinder,
    fit_line,
    fit_plane,
    fit_sphere,
    fit_torus,
)
from surfsig.signature_similarity import flip_signatures, similarity, similarity_class, similarity_matrix
from surfsig.status import FitUsed, Status
from surfsig.surfaces import (
    PipeJoint,
    PipeRun,
    PipeSegment,
    PointClass,
    Surface,
    Surfaces,
    find_surfaces,
)
from surfsig.tiles import (
    FileDataset,
    TileDataset,
    TilePart,
    TilesFailedError,
    TileSurface,
    TileSurfaces,
    extract_tiles,
    find_surfaces_tiles,
    map_tiles,
    open,
)
from surfsig.units import unit_mismatch
from surfsig.visibility import estimate_viewpoint

__all__ = [
    "INSTRUCTION_SET",
    "Alternative",
    "Chunks",
    "CoordinateSystem",
    "EqualSurfaces",
    "Extraction",
    "FieldMatches",
    "FieldSignatures",
    "FileDataset",
    "FileFormatError",
    "FindSettings",
    "FitUsed",
    "Frame",
    "FreeDirection",
    "GeoKeys",
    "Instance",
    "Instances",
    "InvalidInputError",
    "Library",
    "LibraryEntry",
    "LoopClosure",
    "MultiwayRegistration",
    "Occurrence",
    "Odometry",
    "OdometrySettings",
    "Piece",
    "PipeJoint",
    "PipeRun",
    "PipeSegment",
    "PointClass",
    "PointCloud",
    "Recurrence",
    "RecurrenceSettings",
    "Recurrences",
    "RegisteredPair",
    "Registration",
    "RegistrationSettings",
    "ScanSequence",
    "ScanStatus",
    "Status",
    "Surface",
    "SurfaceAngle",
    "SurfaceDistance",
    "SurfacePatch",
    "Surfaces",
    "SurfsigError",
    "TileDataset",
    "TilePart",
    "TileSurface",
    "TileSurfaces",
    "TilesFailedError",
    "TimedScan",
    "TrackedScan",
    "Tracker",
    "Trajectory",
    "__version__",
    "crop",
    "deskew",
    "downsample",
    "estimate_odometry",
    "estimate_viewpoint",
    "extract",
    "extract_field_signatures",
    "extract_radii",
    "extract_tiles",
    "find_instances",
    "find_keypoints",
    "find_recurrences",
    "find_surfaces",
    "find_surfaces_tiles",
    "fit_circle",
    "fit_cone",
    "fit_cylinder",
    "fit_line",
    "fit_plane",
    "fit_sphere",
    "fit_torus",
    "flat_atom_length",
    "flip_signatures",
    "fuse_scans",
    "map_tiles",
    "match_fields",
    "open",
    "open_scan_sequence",
    "read",
    "read_model",
    "read_models",
    "read_trajectory",
    "register",
    "register_multiway",
    "remove_missing_returns",
    "remove_outliers",
    "show",
    "similarity",
    "similarity_class",
    "similarity_matrix",
    "unit_mismatch",
    "write",
    "write_covariances",
    "write_trajectory",
]
