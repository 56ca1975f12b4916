r"""A laser triangulation scanner: a laser sheet swept over a scene, and a camera beside it.

Axes (metres)
-------------
The scanner looks along ``+z``. z = 0 is the reference plane (the table); heights grow towards the scanner,
along *negative* z, so a bump towards the scanner has f_xx > 0 and a positive mean curvature. x runs along the
laser line, y along the sweep. Laser and camera move together, in steps of `sheet_step`, as on a linear stage.

At sheet position s the laser sheet is the plane y = s. The camera stands at (0, s - baseline, -camera height)
and its axis meets the sheet at the reference point (0, s, 0), under the triangulation angle::

            laser (0, s, -baseline / (sin angle cos angle))
              |                                      height of the camera: baseline / tan(angle)
    camera    |
         \    |
          \   |
           \  |  angle
            \ |
    ---------\|------------ table, z = 0        y -->

The laser's centre lies in the camera's principal plane; a pixel column therefore sees exactly one ray of the
sheet, for all heights. The camera measures the row at which that ray's spot appears,

    row = focal * z sin(angle) / (distance + z cos(angle)),   distance = baseline / sin(angle)

and the point is where the row's and the column's rays meet the sheet. So errors of the row (noise, rounding
to a fraction of a pixel, outliers) move a point along its laser ray, and leave it in its sheet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import InvalidInputError
from ..point_cloud import PointCloud
from .poses import Array
from .scene import Hits, Scene

Seed = int | Sequence[int] | np.random.SeedSequence | np.random.Generator


@dataclass(frozen=True, kw_only=True)
class Scanner:
    """A triangulation scanner; the defaults suit objects of 40-100 mm with patches of 40 mm.

    Parameters
    ----------
    baseline : float
        Distance from the laser sheet to the camera, in metres.
    triangulation_angle : float
        Between the sheet and the camera's axis, in radians. A larger one measures heights more finely and
        sees less of steep surfaces.
    pixel : float
        Size of a pixel at the reference point, in metres.
    column_step : int
        Use every such column; the spacing of points in x on the reference plane is `column_step` * `pixel`.
    row_step : float
        The row is rounded to multiples of this, in pixels (1 for whole pixels, 1/8 for an eighth); 0 for no
        rounding.
    sheet_step : float
        Distance between sheet positions, in metres.
    field_width, scan_length : float
        Extent in x (on the reference plane) and y of the scanned field about the origin, in metres.
    depth_range : (float, float)
        Depth of field: nearest and farthest z that are measured, in metres (the nearest is the more
        negative).
    max_incidence : float
        A spot is lost where the surface is hit, or seen, under a larger angle from its normal, in radians.
    noise : float
        Standard deviation of a measured height on the reference plane, in metres. Gaussian in the camera's
        row, so it grows slowly with the distance. Rounding adds to it.
    outlier_rate : float
        Share of points with a gross error.
    outlier_height : float
        Largest gross error of z in metres, drawn uniformly to both sides.
    """

    baseline: float = 0.12
    triangulation_angle: float = np.radians(25.0)
    pixel: float = 1e-4
    column_step: int = 5
    row_step: float = 1 / 8
    sheet_step: float = 5e-4
    field_width: float = 0.12
    scan_length: float = 0.12
    depth_range: tuple[float, float] = (-0.12, 0.02)
    max_incidence: float = np.radians(75.0)
    noise: float = 1e-4
    outlier_rate: float = 0.002
    outlier_height: float = 5e-3

    def __post_init__(self) -> None:
        for name in ("baseline", "pixel", "column_step", "sheet_step", "field_width", "scan_length"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise InvalidInputError(f"Scanner: {name} must be positive, got {getattr(self, name)!r}")
        for name in ("row_step", "noise", "outlier_height"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise InvalidInputError(f"Scanner: {name} must not be negative, got {getattr(self, name)!r}")
        for name in ("triangulation_angle", "max_incidence"):
            if not 0.0 < getattr(self, name) < np.pi / 2:
                raise InvalidInputError(
                    f"Scanner: {name} must lie between 0 and pi/2, got {getattr(self, name)!r}"
                )
        if not 0.0 <= self.outlier_rate <= 1.0:
            raise InvalidInputError(f"Scanner: outlier_rate must lie in [0, 1], got {self.outlier_rate!r}")
        near, far = self.depth_range
        if not -self.baseline / np.tan(self.triangulation_angle) < near < far < np.inf:
            raise InvalidInputError("Scanner: depth_range must be (near, far), beyond the camera")

    @property
    def camera_distance(self) -> float:
        """From the camera to the reference point, in metres."""
        return float(self.baseline / np.sin(self.triangulation_angle))

    @property
    def laser_height(self) -> float:
        """Of the laser's centre above the reference plane, in metres (its z is minus this)."""
        return float(self.camera_distance / np.cos(self.triangulation_angle))

    @property
    def height_per_row(self) -> float:
        """Change of z on the reference plane for one pixel row, in metres."""
        return float(self.pixel / np.sin(self.triangulation_angle))

    @property
    def viewpoint(self) -> Array:
        """The laser's centre in the middle of the sweep, (3,) metres; normals are oriented towards it."""
        return np.array([0.0, 0.0, -self.laser_height])

    def laser_at(self, y: Array) -> Array:
        """Laser centres, (n, 3), for sheet positions y, (n,)."""
        return np.stack([np.zeros_like(y), y, np.full_like(y, -self.laser_height)], axis=1)

    def camera_at(self, y: Array) -> Array:
        """Camera centres, (n, 3), for sheet positions y, (n,)."""
        height = self.baseline / np.tan(self.triangulation_angle)
        return np.stack([np.zeros_like(y), y - self.baseline, np.full_like(y, -height)], axis=1)

    def row_of(self, z: Array) -> Array:
        """Camera row, in pixels from the axis, of spots at z in metres."""
        focal = self.camera_distance / self.pixel
        sine, cosine = np.sin(self.triangulation_angle), np.cos(self.triangulation_angle)
        return np.asarray(focal * z * sine / (self.camera_distance + z * cosine))

    def z_of(self, row: Array) -> Array:
        """Inverse of :meth:`row_of`: z in metres of spots in camera rows."""
        focal = self.camera_distance / self.pixel
        sine, cosine = np.sin(self.triangulation_angle), np.cos(self.triangulation_angle)
        return np.asarray(row * self.camera_distance / (focal * sine - row * cosine))

    def laser_rays(self) -> tuple[Array, Array]:
        """Rays of all sheets and used columns: centres (n, 3) and directions (n, 3) with z component 1.

        Sheet by sheet along y, and along x in each.
        """
        sheets = int(np.floor(self.scan_length / self.sheet_step / 2.0 + 1e-9))
        columns = int(np.floor(self.field_width / (self.pixel * self.column_step) / 2.0 + 1e-9))
        y = np.arange(-sheets, sheets + 1, dtype=np.float64) * self.sheet_step
        x = np.arange(-columns, columns + 1, dtype=np.float64) * (self.pixel * self.column_step)
        directions = np.zeros((len(y), len(x), 3))
        directions[..., 0] = x / self.laser_height
        directions[..., 2] = 1.0
        return np.repeat(self.laser_at(y), len(x), axis=0), directions.reshape(-1, 3)

    def lit_and_seen(self, scene: Scene) -> tuple[Array, Hits]:
        """Find the true spots that the camera can measure, before any error of measurement.

        Parameters
        ----------
        scene : Scene
            In the scanner's axes.

        Returns
        -------
        origins : (n, 3) ndarray
            The laser's centre for each spot.
        hits : Hits
            The spots: first surface on the laser's ray, in the depth of field, not too oblique to laser or
            camera, with a free line of sight to the camera.
        """
        origins, directions = self.laser_rays()
        hits = scene.cast(origins, directions)
        near, far = self.depth_range
        kept = np.flatnonzero((hits.points[:, 2] >= near) & (hits.points[:, 2] <= far))
        cameras = self.camera_at(origins[:, 1])
        for eye in (origins, cameras):
            sight = eye[kept] - hits.points[kept]
            cosine = np.einsum("ij,ij->i", sight, hits.normals[kept]) / np.linalg.norm(sight, axis=1)
            kept = kept[cosine >= np.cos(self.max_incidence)]
        kept = kept[~scene.hidden(cameras[kept], hits.points[kept])]
        chosen = Hits(
            hits.t[kept], hits.surface[kept], hits.points[kept], hits.normals[kept], hits.curvatures[kept]
        )
        return origins[kept], chosen

    def scan(self, scene: Scene, seed: Seed, *, truth: bool = False) -> PointCloud:
        """Scan a scene.

        Parameters
        ----------
        scene : Scene
            In the scanner's axes; ``scene.moved(...)`` gives another view.
        seed : int, sequence of int, SeedSequence or Generator
            Of the noise and the outliers; the same seed gives the same bits.
        truth : bool
            Add the true normal and curvatures of the spot behind each point.

        Returns
        -------
        PointCloud
            In metres, scanner axes, sheet by sheet; with the :attr:`viewpoint`, and the fields `surface`
            (int32, index of the true surface in the scene) and `outlier` (uint8, 1 for a gross error). With
            `truth` also `true_nx`, `true_ny`, `true_nz` (towards the laser), `true_k1` and `true_k2` (per
            metre, a bump seen from the scanner positive).
        """
        rng = np.random.default_rng(seed)
        origins, hits = self.lit_and_seen(scene)
        count = len(origins)
        outlier = rng.random(count) < self.outlier_rate
        gross = rng.uniform(-self.outlier_height, self.outlier_height, count)
        row_noise = rng.normal(0.0, self.noise / self.height_per_row, count)
        row = self.row_of(hits.points[:, 2] + np.where(outlier, gross, 0.0)) + row_noise
        if self.row_step > 0.0:
            row = np.round(row / self.row_step) * self.row_step
        z = self.z_of(row)
        # Along the laser's ray: x is proportional to the distance from the laser.
        stretch = (z + self.laser_height) / (hits.points[:, 2] + self.laser_height)
        points = np.stack([hits.points[:, 0] * stretch, hits.points[:, 1], z], axis=1)

        fields: dict[str, npt.NDArray[np.generic]] = {
            "surface": hits.surface,
            "outlier": outlier.astype(np.uint8),
        }
        if truth:
            for axis, name in enumerate(("true_nx", "true_ny", "true_nz")):
                fields[name] = np.ascontiguousarray(hits.normals[:, axis])
            for column, name in enumerate(("true_k1", "true_k2")):
                fields[name] = np.ascontiguousarray(hits.curvatures[:, column])
        return PointCloud(offsets=points, viewpoint=self.viewpoint, fields=fields)
