"""The compiled core: what it offers to the package."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, BinaryIO, ClassVar, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "COARSEST_STEP",
    "FEWEST_SURFACE_POINTS",
    "GOOD",
    "INSTRUCTION_SET",
    "KIND_PARAMETERS",
    "OPTIMAL",
    "STATUS_NAMES",
    "DepthImage",
    "E57Reader",
    "Frame",
    "Odometry",
    "Primitive",
    "SurfaceIndex",
    "SurfacePlaces",
    "__version__",
    "coordinate_steps",
    "extract",
    "field_distinctiveness",
    "field_signatures",
    "find_surfaces",
    "fit_primitive",
    "voxel_representatives",
    "write_e57",
]

__version__: str
STATUS_NAMES: list[str]
KIND_PARAMETERS: dict[str, int]
FEWEST_SURFACE_POINTS: int
INSTRUCTION_SET: str
COARSEST_STEP: float
OPTIMAL: float
GOOD: float

def coordinate_steps(points: NDArray[np.floating], *, origin: Sequence[float]) -> tuple[float, float]: ...
def extract(
    points: NDArray[np.floating],
    *,
    origin: Sequence[float],
    radius: float | Sequence[float] | str | None,
    axes: str,
    fit: str,
    neighbors: int | None = None,
    at: NDArray[np.uint32] | NDArray[np.float64] | None = None,
    viewpoint: Sequence[float] | None = None,
    directions: NDArray[np.float32] | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[dict[str, NDArray[Any]]]: ...
def field_signatures(
    points: NDArray[np.floating],
    *,
    origin: Sequence[float],
    radius: float,
    at: NDArray[np.uint32] | NDArray[np.float64] | None = None,
    viewpoint: Sequence[float] | None = None,
    directions: NDArray[np.float32] | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
    pools: bool = False,
) -> dict[str, NDArray[Any]]: ...
def field_distinctiveness(
    vectors: NDArray[np.float32],
    places: NDArray[np.float64],
    *,
    radius: float,
    threads: int | None = None,
) -> NDArray[np.float32]: ...
def find_surfaces(
    points: NDArray[np.floating],
    *,
    origin: Sequence[float],
    kinds: Sequence[str],
    min_points: int | None = None,
    noise: float | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[NDArray[np.int32], list[dict[str, Any]]]: ...
def fit_primitive(
    points: NDArray[np.float64], kind: str, start: Primitive | None = None
) -> Primitive | None: ...
def voxel_representatives(
    points: NDArray[np.floating], *, origin: Sequence[float], voxel: float
) -> NDArray[np.uint32]: ...
def write_e57(
    file: BinaryIO,
    *,
    guid: str,
    description: str | None,
    extensions: Sequence[tuple[str, str]],
    records: Sequence[tuple[str, str, int, int]],
    scans: Iterable[tuple[str, Sequence[float] | None, Iterable[Sequence[NDArray[Any]]]]],
) -> None: ...

@final
class SurfacePlaces:
    def __new__(cls, places: NDArray[np.float32], normals: NDArray[np.float32]) -> SurfacePlaces: ...

@final
class SurfaceIndex:
    def __new__(cls, places: SurfacePlaces, cell: float) -> SurfaceIndex: ...
    def partners(
        self, poses: NDArray[np.float64], places: SurfacePlaces, reach: float
    ) -> NDArray[np.int64]: ...
    def settle(
        self,
        poses: NDArray[np.float64],
        places: SurfacePlaces,
        reaches: NDArray[np.float32],
        threads: int | None = None,
    ) -> NDArray[np.float64]: ...

@final
class DepthImage:
    def __new__(
        cls,
        points: SurfacePlaces,
        own: NDArray[np.bool_],
        *,
        eye: Sequence[float],
        spacing: float,
        reach: float,
        floors: SurfacePlaces,
        second: Sequence[float] | None = None,
    ) -> DepthImage: ...
    def judge(
        self, poses: NDArray[np.float64], places: SurfacePlaces, most: int, tolerance: float
    ) -> NDArray[np.float32]: ...
    def correspondences(
        self, pose: NDArray[np.float64], places: SurfacePlaces, most: int, tolerance: float
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]: ...

@final
class E57Reader:
    def __new__(cls, file: BinaryIO, source: str, progress: Callable[[int], object]) -> E57Reader: ...
    def __len__(self) -> int: ...
    def scan(self, number: int) -> tuple[dict[str, NDArray[Any]], tuple[list[float], list[float]] | None]: ...

@final
class Frame:
    def __new__(
        cls,
        *,
        quadratic: tuple[float, int] | None = None,
        slope: tuple[float, int] | None = None,
        mixed: tuple[float, int] | None = None,
        offset: tuple[float, int] | None = None,
        as_printed: bool = False,
    ) -> Frame: ...
    @staticmethod
    def default() -> Frame: ...
    @staticmethod
    def reproduction() -> Frame: ...
    def __len__(self) -> int: ...
    @property
    def hash(self) -> str: ...
    @property
    def as_printed(self) -> bool: ...
    @property
    def atoms(self) -> NDArray[np.float64]: ...
    @property
    def singular_values(self) -> NDArray[np.float64]: ...
    def smallest_eigenvalue(self, side: float) -> float: ...
    def curvature_fields(self, surface: Sequence[float]) -> NDArray[np.float64]: ...
    def coefficients(self, surface: Sequence[float]) -> NDArray[np.float64]: ...
    def signatures_of_curvatures(
        self, k1: NDArray[np.float32], k2: NDArray[np.float32], *, side: float
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]: ...
    def signatures_of_surfaces(
        self, surfaces: NDArray[np.float32], *, side: float
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]: ...

@final
class Odometry:
    STATUS_NAMES: ClassVar[list[str]]
    def __new__(
        cls,
        *,
        voxel: float | None = None,
        max_correspondence_distance: float | None = None,
        map_range: float | None = None,
        threads: int | None = None,
    ) -> Odometry: ...
    def push(
        self,
        points: NDArray[np.floating],
        *,
        origin: Sequence[float],
        viewpoint: Sequence[float] | None = None,
    ) -> None: ...
    def __len__(self) -> int: ...
    @property
    def voxel(self) -> float | None: ...
    def arrays(self) -> dict[str, NDArray[Any]]: ...

@final
class Primitive:
    @property
    def point(self) -> NDArray[np.float64]: ...
    @property
    def axis(self) -> NDArray[np.float64]: ...
    @property
    def radius(self) -> float: ...
    def distances(self, points: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def uncertainty(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]: ...
    def independent_error(self, points: NDArray[np.float64]) -> float: ...
