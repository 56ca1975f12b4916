"""Arrays of any library that shares its memory: NumPy's protocols, and DLPack (PyTorch, JAX, CuPy, ...)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.files.columns import cloud_from_columns, numeric_columns
from surfsig.point_cloud import PointCloud, plain_array

# kDLCPU and kDLCUDAHost of dlpack.h: memory that the processor sees.
_PROCESSOR_MEMORY = (1, 3)


def cloud_of(data: Any) -> PointCloud:
    """Make a cloud of an array (n, 3), or of a structured one with fields x, y, z.

    A structured array of two axes is an organised cloud.

    Raises
    ------
    InvalidInputError
        If it holds no coordinates, or lies on a GPU.
    """
    array = _processor_array(data)
    if not array.dtype.names:
        return PointCloud(array)
    columns = numeric_columns(array.ravel(), "the structured array")
    grid = (array.shape[0], array.shape[1]) if array.ndim == 2 else None
    return cloud_from_columns(columns, source="the structured array", grid=grid, error=InvalidInputError)


def _processor_array(data: Any) -> NDArray[Any]:
    """Give an object's numbers as a NumPy array, in the same memory where its library shares it."""
    kind = f"{type(data).__module__}.{type(data).__name__}"
    speaks_numpy = hasattr(data, "__array__") or hasattr(data, "__array_interface__")
    try:
        device = data.__dlpack_device__()[0] if hasattr(data, "__dlpack_device__") else None
        # Open3D answers with an enumeration, which equals no number.
        device = getattr(device, "value", device)
        foreign = device not in (None, *_PROCESSOR_MEMORY)
        if foreign or (not speaks_numpy and hasattr(data, "__cuda_array_interface__")):
            raise InvalidInputError(f"{kind} lies on a GPU: copy it to the CPU first (PyTorch: x.cpu())")
        array = plain_array(data) if speaks_numpy or device is None else np.from_dlpack(data)
    except InvalidInputError:
        raise
    except (TypeError, ValueError, RuntimeError, BufferError) as error:
        if isinstance(data, (list, tuple)):
            raise InvalidInputError("points must be an (n, 3) array; its rows differ in length") from None
        why = " ".join(str(error).split())
        raise InvalidInputError(f"{kind} does not give its numbers: {why}") from None
    if array.ndim == 0 and array.dtype == object:
        raise InvalidInputError(f"points must be an (n, 3) array, or a cloud of another library, not {kind}")
    return array
