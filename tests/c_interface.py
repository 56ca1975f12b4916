"""The C interface called from Python, for its tests."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, byref, c_char_p, c_double, c_float, c_int, c_size_t, c_uint8, c_uint32, c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SIGNATURE = 242

COLUMNS: dict[str, tuple[Any, tuple[int, ...]]] = {
    "k1": (c_float, ()),
    "k2": (c_float, ()),
    "normals": (c_float, (3,)),
    "directions": (c_float, (3,)),
    "residual": (c_float, ()),
    "condition": (c_float, ()),
    "count": (c_uint32, ()),
    "status": (c_uint8, ()),
    "linearity": (c_float, ()),
    "planarity": (c_float, ()),
    "scattering": (c_float, ()),
}


class Failed(Exception):
    """A call's code, and the library's last error."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(f"{code}: {text}")


@dataclass
class Options:
    """What the setters are called with."""

    axes: int | None = None
    viewpoint: Any = None
    threads: int | None = None
    indices: NDArray[np.uint32] | None = None


@dataclass
class CInterface:
    """The functions of surfsig.h, with NumPy arrays for pointers."""

    library: Path
    functions: Any = field(init=False)

    def __post_init__(self) -> None:
        self.functions = f = ctypes.CDLL(str(self.library))
        for name in ("surfsig_version", "surfsig_last_error", "surfsig_status_name"):
            getattr(f, name).restype = c_char_p
        f.surfsig_options_new.restype = c_void_p
        f.surfsig_extraction_size.restype = c_size_t
        f.surfsig_similarity.restype = c_double
        for name, (kind, _) in COLUMNS.items():
            getattr(f, f"surfsig_extraction_{name}").restype = POINTER(kind)

    def check(self, code: int) -> None:
        """Raise where a call failed."""
        if code != 0:
            raise Failed(code, self.functions.surfsig_last_error().decode())

    def options(self, values: Options) -> c_void_p:
        """Return options that the caller frees."""
        f = self.functions
        made = c_void_p(f.surfsig_options_new())
        try:
            if values.axes is not None:
                self.check(f.surfsig_options_set_axes(made, c_int(values.axes)))
            if values.viewpoint is not None:
                self.check(f.surfsig_options_set_viewpoint(made, (c_double * 3)(*values.viewpoint)))
            if values.threads is not None:
                self.check(f.surfsig_options_set_threads(made, c_uint32(values.threads)))
            if (indices := values.indices) is not None:
                count = c_size_t(len(indices))
                self.check(f.surfsig_options_set_indices(made, address(indices), count))
        except Failed:
            f.surfsig_options_free(made)
            raise
        return made

    def extract(
        self,
        first: c_void_p,
        count: int,
        stride: int,
        radius: float,
        *,
        precision: str = "f32",
        origin: Any = None,
        options: Options | None = None,
    ) -> c_void_p:
        """Return an extraction that the caller frees."""
        f = self.functions
        chosen = self.options(options) if options else c_void_p()
        added = None if origin is None else (c_double * 3)(*origin)
        made = c_void_p(1)
        try:
            code = getattr(f, f"surfsig_extract_{precision}")(
                first, c_size_t(count), c_size_t(stride), added, c_double(radius), chosen, byref(made)
            )
        finally:
            f.surfsig_options_free(chosen)
        assert (code == 0) == bool(made)
        self.check(code)
        return made

    def columns(self, extraction: c_void_p) -> dict[str, NDArray[Any]]:
        """Return copies of all columns."""
        size = self.functions.surfsig_extraction_size(extraction)
        columns = {}
        for name, (kind, width) in COLUMNS.items():
            first = getattr(self.functions, f"surfsig_extraction_{name}")(extraction)
            assert bool(first) == (size > 0)
            shape = (size, *width)
            columns[name] = np.ctypeslib.as_array(first, shape).copy() if size else np.zeros(shape, kind)
        return columns

    def signatures(
        self, extraction: c_void_p, places: NDArray[np.uint32] | None, count: int
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return rows and statuses, in buffers that held something else before."""
        rows = np.full((count, SIGNATURE), 7, np.float32)
        statuses = np.full(count, 77, np.uint8)
        where = c_void_p() if places is None else address(places)
        self.check(
            self.functions.surfsig_signatures(
                extraction, where, c_size_t(count), address(rows), address(statuses)
            )
        )
        return rows, statuses


def address(array: NDArray[Any]) -> c_void_p:
    """Return where an array begins."""
    return c_void_p(array.ctypes.data)
