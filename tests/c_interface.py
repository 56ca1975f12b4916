"""The C interface called from Python, for its tests."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_float,
    c_int,
    c_int32,
    c_int64,
    c_size_t,
    c_uint8,
    c_uint32,
    c_void_p,
)
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

SIGNATURE = 242
MOMENTS = 35

PROGRESS = CFUNCTYPE(c_int, c_void_p, c_size_t, c_size_t)

_TYPES: dict[str, Any] = {
    "float": c_float,
    "double": c_double,
    "uint32_t": c_uint32,
    "surfsig_status": c_uint8,
    "surfsig_fit_used": c_uint8,
    "surfsig_surface_kind": c_uint8,
}

Columns = dict[str, "NDArray[Any] | None"]
"""Copies of a result's columns; None for one that it does not have."""


class Failed(Exception):
    """A call's code, and the library's last error."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(f"{code}: {text}")


class Sphere(Structure):
    """A surfsig_sphere."""

    _fields_ = (("centre", c_double * 3), ("radius", c_double), ("residual", c_double))


class Cylinder(Structure):
    """A surfsig_cylinder."""

    _fields_ = (
        ("axis", c_double * 3),
        ("centre", c_double * 3),
        ("radius", c_double),
        ("residual", c_double),
    )


class Transform(Structure):
    """A surfsig_transform."""

    _fields_ = (("matrix", c_double * 16),)

    @classmethod
    def of(cls, matrix: NDArray[np.float64]) -> Transform:
        """Give a matrix (4, 4) to C."""
        return cls((c_double * 16)(*matrix.ravel()))

    def array(self) -> NDArray[np.float64]:
        """Return the matrix, (4, 4)."""
        return np.array(self.matrix[:]).reshape(4, 4)


class Scan(Structure):
    """A surfsig_scan."""

    _fields_ = (("cloud", c_void_p), ("viewpoint", c_void_p), ("directions", c_void_p))


class FreeDirection(Structure):
    """A surfsig_free_direction."""

    _fields_ = (("axis", c_double * 3), ("point", c_double * 3))


class Registration(Structure):
    """A surfsig_registration."""

    _fields_ = (
        ("found", c_bool),
        ("trusted", c_bool),
        ("doubts", c_uint32),
        ("T_target_source", Transform),
        ("covariance", c_double * 36),
        ("center", c_double * 3),
        ("free_direction_count", c_size_t),
        ("free_directions", FreeDirection * 6),
        ("matches", c_size_t),
        ("inliers", c_size_t),
        ("overlap", c_double),
        ("explained", c_double),
        ("free_space", c_double),
        ("scale", c_double),
        ("scale_standard_error", c_double),
        ("alternative_count", c_size_t),
        ("alternatives", Transform * 8),
        ("rms", c_double),
        ("radius", c_double),
    )


class Instance(Structure):
    """A surfsig_instance."""

    _fields_ = (
        ("model", c_size_t),
        ("T_scene_model", Transform),
        ("covariance", c_double * 36),
        ("center", c_double * 3),
        ("score", c_double),
        ("visible", c_double),
        ("overlap", c_double),
        ("rms", c_double),
        ("free_direction_count", c_size_t),
        ("free_directions", FreeDirection * 6),
        ("point_count", c_size_t),
    )


class ScanPose(Structure):
    """A surfsig_scan_pose."""

    _fields_ = (
        ("status", c_uint8),
        ("overlap", c_double),
        ("T_map_scan", Transform),
        ("covariance", c_double * 36),
        ("free_direction_count", c_size_t),
        ("free_directions", FreeDirection * 6),
    )


@dataclass
class Options:
    """What the setters are called with."""

    axes: int | None = None
    fit: int | None = None
    viewpoint: Any = None
    normals: NDArray[np.float32] | None = None
    threads: int | None = None
    neighbors: int | None = None
    robust: bool = False
    indices: NDArray[np.uint32] | None = None
    positions: NDArray[np.float64] | None = None
    voxel: float | None = None
    progress: Callable[[int, int], int] | None = None


@dataclass
class CInterface:
    """The functions of surfsig.h, with NumPy arrays for pointers."""

    library: Path
    header: Path
    functions: Any = field(init=False)
    columns_of: dict[str, dict[str, tuple[Any, int]]] = field(init=False)
    """By "extraction" and "surfaces": the type and width of each column that the header lists."""

    def __post_init__(self) -> None:
        self.functions = f = ctypes.CDLL(str(self.library))
        for name in ("version", "last_error", "status_name", "surface_kind_name", "scan_status_name"):
            getattr(f, f"surfsig_{name}").restype = c_char_p
        for name in ("", "surface_", "primitive_", "registration_", "find_"):
            getattr(f, f"surfsig_{name}options_new").restype = c_void_p
        sized = ("cloud", "extraction", "surfaces", "odometry", "model", "instances")
        sizes = tuple(f"{name}_size" for name in sized)
        for name in (*sizes, "surfaces_label_count", "surface_kind_parameters"):
            getattr(f, f"surfsig_{name}").restype = c_size_t
        numbers = ("radius", "major_radius", "half_angle", "independent_error")
        for name in (
            "similarity",
            "extraction_radius",
            "odometry_voxel",
            "model_radius",
            "model_spacing",
            *(f"primitive_{number}" for number in numbers),
        ):
            getattr(f, f"surfsig_{name}").restype = c_double
        for name in ("primitive_point", "primitive_axis", "surfaces_covariance"):
            getattr(f, f"surfsig_{name}").restype = POINTER(c_double)
        f.surfsig_odometry_segment.restype = c_int64
        f.surfsig_surfaces_labels.restype = POINTER(c_int32)
        f.surfsig_instances_indices.restype = POINTER(c_uint32)
        f.surfsig_transform_identity.restype = Transform
        text = self.header.read_text()
        self.columns_of = {kind: _columns(text, kind) for kind in ("extraction", "surfaces")}
        for kind, columns in self.columns_of.items():
            for name, (scalar, _) in columns.items():
                getattr(f, f"surfsig_{kind}_{name}").restype = POINTER(scalar)

    def check(self, code: int) -> None:
        """Raise where a call failed."""
        if code != 0:
            raise Failed(code, self.functions.surfsig_last_error().decode())

    @contextmanager
    def options(self, values: Options) -> Iterator[c_void_p]:
        """Make options, and free them in the end."""
        f = self.functions
        made = c_void_p(f.surfsig_options_new())

        def set_option(name: str, *arguments: Any) -> None:
            self.check(getattr(f, f"surfsig_options_set_{name}")(made, *arguments))

        # As long as it may be called.
        call = PROGRESS(lambda _, done, total: values.progress(done, total) if values.progress else 0)
        try:
            if values.axes is not None:
                set_option("axes", c_int(values.axes))
            if values.fit is not None:
                set_option("fit", c_int(values.fit))
            if values.viewpoint is not None:
                set_option("viewpoint", (c_double * 3)(*values.viewpoint))
            if values.neighbors is not None:
                set_option("neighbors", c_uint32(values.neighbors))
            if values.robust:
                set_option("robust", c_int(1))
            if values.threads is not None:
                set_option("threads", c_uint32(values.threads))
            if values.voxel is not None:
                set_option("voxel", c_double(values.voxel))
            if values.progress is not None:
                set_option("progress", call, c_void_p())
            for name in ("normals", "indices", "positions"):
                array = getattr(values, name)
                if array is not None:
                    set_option(name, address(array), c_size_t(len(array)))
            yield made
        finally:
            f.surfsig_options_free(made)

    @contextmanager
    def cloud(
        self, first: c_void_p, count: int, stride: int, *, precision: str = "f32", origin: Any = None
    ) -> Iterator[c_void_p]:
        """Make a cloud, and free it in the end."""
        added = None if origin is None else (c_double * 3)(*origin)
        made = c_void_p(1)
        code = getattr(self.functions, f"surfsig_cloud_new_{precision}")(
            first, c_size_t(count), c_size_t(stride), added, byref(made)
        )
        assert (code == 0) == bool(made)
        self.check(code)
        assert self.functions.surfsig_cloud_size(made) == count
        try:
            yield made
        finally:
            self.functions.surfsig_cloud_free(made)

    def cloud_of(self, points: NDArray[Any], *, origin: Any = None) -> Any:
        """Make a cloud of the rows of an array, whatever their distance."""
        precision = "f64" if points.dtype == np.float64 else "f32"
        return self.cloud(address(points), len(points), points.strides[0], precision=precision, origin=origin)

    def extract(
        self, cloud: c_void_p, radius: float | Literal["auto"], options: Options | None = None
    ) -> c_void_p:
        """Return an extraction that the caller frees; of `radius` neighbours where that is a whole number."""
        f = self.functions
        made = c_void_p(1)
        with self.options(options or Options()) as chosen:
            if radius == "auto":
                code = f.surfsig_extract_auto_radius(cloud, chosen, byref(made))
            elif isinstance(radius, int):
                code = f.surfsig_extract_nearest(cloud, c_uint32(radius), chosen, byref(made))
            else:
                code = f.surfsig_extract(cloud, c_double(radius), chosen, byref(made))
        assert (code == 0) == bool(made)
        self.check(code)
        return made

    def extract_radii(
        self, cloud: c_void_p, radii: list[float], options: Options | None = None
    ) -> list[c_void_p]:
        """Return extractions that the caller frees."""
        made = (c_void_p * len(radii))(*range(1, len(radii) + 1))
        sizes = (c_double * len(radii))(*radii)
        with self.options(options or Options()) as chosen:
            count = c_size_t(len(radii))
            code = self.functions.surfsig_extract_radii(cloud, sizes, count, chosen, made)
        assert all((code == 0) == bool(one) for one in made)
        self.check(code)
        return [c_void_p(one) for one in made]

    def columns(self, kind: str, handle: c_void_p) -> Columns:
        """Return copies of all columns of an "extraction" or of "surfaces"."""
        size = getattr(self.functions, f"surfsig_{kind}_size")(handle)
        columns: Columns = {}
        for name, (_, width) in self.columns_of[kind].items():
            first = getattr(self.functions, f"surfsig_{kind}_{name}")(handle)
            shape = (size,) if width == 1 else (size, width)
            columns[name] = np.ctypeslib.as_array(first, shape).copy() if first else None
        return columns

    def signatures(
        self, extraction: c_void_p, queries: NDArray[np.uint32] | None, count: int
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return rows and statuses, in buffers that held something else before."""
        rows = np.full((count, SIGNATURE), 7, np.float32)
        statuses = np.full(count, 77, np.uint8)
        where = c_void_p() if queries is None else address(queries)
        self.check(
            self.functions.surfsig_signatures(
                extraction, where, c_size_t(count), address(rows), address(statuses)
            )
        )
        return rows, statuses


def _columns(header: str, kind: str) -> dict[str, tuple[Any, int]]:
    """Read the header's list of columns."""
    listed = re.search(rf"#define SURFSIG_{kind.upper()}_COLUMNS\(X\)((?: \\\n  X\(.*\))+)", header)
    assert listed is not None
    entries = re.findall(r"X\((\w+), (\w+), (\d+)\)", listed[1])
    return {name: (_TYPES[scalar], int(width)) for scalar, name, width in entries}


def address(array: NDArray[Any]) -> c_void_p:
    """Return where an array begins."""
    return c_void_p(array.ctypes.data)
