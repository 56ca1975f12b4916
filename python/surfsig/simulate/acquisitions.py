"""The paper's twenty acquisitions (its table III), as simulated scans with stated poses.

Why these poses
---------------
The paper prints radii, normals and which acquisitions show the same object, but no positions. They were fixed
by the reasoning below, before any similarity was computed, and must not be changed to please a result.

- Everything stands in the middle of the scanned field. What the paper calls horizontal, or can only lie on
  the table, lies on the table (z = 0): plates at their thickness, spheres and cylinders at the height of
  their radius.
- A patch is centred on the sample of the object nearest the *stated point*: the middle of a plate or of the
  irregular surface, the apex (the point nearest the scanner) of a cylinder's middle or of a sphere.
- Planes 4-7 are one plate, its middle at 45 mm above the table, turned the shortest way from the horizontal
  to the printed normal. Plane 4 is steep (68 degrees). With the camera on the +y side it would be seen almost
  edge on (83 degrees); since the paper measured it, the camera stands on the -y side (57 degrees), as
  :class:`Scanner` has it.
- The cylinders lie across the laser line, along the sweep (y): so each profile is an arc, and the camera,
  which looks along the sweep, sees both flanks.
- Spheres 5 and 6 were scanned together (the paper's figure 7): they lie 50 mm apart along the laser line, so
  that neither stands in the camera's view of the other. The repeats 18 and 19 are this pair after one rigid
  displacement: a turn of 40 degrees about the vertical and a shift of (5, -8) mm. The repeat 16 is sphere 2
  shifted by (18, -12) mm.
- The irregular surface is a :class:`HeightField` of 12 waves of 30-80 mm with an rms height of 2.5 mm
  (curvatures of the order of the other objects'), seed 20, the acquisition's number.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from ..errors import InvalidInputError
from ..geometry import transform_points
from ..point_cloud import PointCloud
from .height_field import HeightField
from .poses import UP, Array, facing, pose, turn, unit
from .scanner import Scanner
from .scene import Placed, Scene
from .surfaces import Cylinder, Rectangle, Sphere, Surface

Vector = tuple[float, float, float]
Kind = Literal["plane", "cylinder", "sphere", "irregular"]
Poses = Literal["stated", "jittered", "random"]

_KINDS: dict[type[Surface], Kind] = {
    Rectangle: "plane",
    Cylinder: "cylinder",
    Sphere: "sphere",
    HeightField: "irregular",
}
_PLATE = Rectangle((0.080, 0.080))
_IRREGULAR = HeightField.random(20, size=(0.080, 0.080), rms=0.0025, wavelengths=(0.030, 0.080))
_TABLE = Placed(Rectangle((0.160, 0.160)), pose((0.0, 0.0, 0.0), facing(UP)), "table")


def _cylinder(radius_mm: float) -> Surface:
    return Cylinder(radius_mm / 1000.0, 0.100)


def _sphere(radius_mm: float) -> Surface:
    return Sphere(radius_mm / 1000.0)


class _Row(NamedTuple):
    """One acquisition; lengths in millimetres, scanner axes (heights along negative z)."""

    number: int
    name: str
    surface: Surface
    position: Vector  # of the object's origin: a plate's middle, a sphere's or cylinder's centre
    axis: Vector  # where the object's own +z points: a plate's normal, a cylinder's axis
    stated: float  # z of the stated point, which has the origin's x and y
    beside: tuple[int, ...] = ()  # acquisitions whose object stands in the same scene

    @property
    def kind(self) -> Kind:
        return _KINDS[type(self.surface)]


_Y: Vector = (0.0, 1.0, 0.0)
_N4: Vector = (0.781, -0.499, -0.375)
_N5: Vector = (-0.507, -0.028, -0.862)
_N6: Vector = (-0.381, -0.334, -0.862)
_N7: Vector = (-0.435, 0.268, -0.860)

# fmt: off
_TABLE_III = (
    #    no  object               surface           origin, mm               own +z stated z, mm
    _Row( 1, "plane, plastic",    _PLATE,           (  0.00,   0.00,  -5.00), UP,   -5.00),
    _Row( 2, "plane, aluminium",  _PLATE,           (  0.00,   0.00, -10.00), UP,  -10.00),
    _Row( 3, "plane, aluminium",  _PLATE,           (  0.00,   0.00, -20.00), UP,  -20.00),
    _Row( 4, "tilted plane 1",    _PLATE,           (  0.00,   0.00, -45.00), _N4, -45.00),
    _Row( 5, "tilted plane 2",    _PLATE,           (  0.00,   0.00, -45.00), _N5, -45.00),
    _Row( 6, "tilted plane 3",    _PLATE,           (  0.00,   0.00, -45.00), _N6, -45.00),
    _Row( 7, "tilted plane 4",    _PLATE,           (  0.00,   0.00, -45.00), _N7, -45.00),
    _Row( 8, "cylinder 1",        _cylinder(24.27), (  0.00,   0.00, -24.27), _Y,  -48.54),
    _Row( 9, "cylinder 2",        _cylinder(38.27), (  0.00,   0.00, -38.27), _Y,  -76.54),
    _Row(10, "sphere 1",          _sphere(18.85),   (  0.00,   0.00, -18.85), UP,  -37.70),
    _Row(11, "sphere 2",          _sphere(34.42),   (  0.00,   0.00, -34.42), UP,  -68.84),
    _Row(12, "sphere 3",          _sphere(29.70),   (  0.00,   0.00, -29.70), UP,  -59.40),
    _Row(13, "sphere 4",          _sphere(27.25),   (  0.00,   0.00, -27.25), UP,  -54.50),
    _Row(14, "sphere 5",          _sphere(14.15),   (-25.00,   0.00, -14.15), UP,  -28.30, (15,)),
    _Row(15, "sphere 6",          _sphere(20.50),   ( 25.00,   0.00, -20.50), UP,  -41.00, (14,)),
    _Row(16, "sphere 2",          _sphere(34.42),   ( 18.00, -12.00, -34.42), UP,  -68.84),
    _Row(17, "sphere 7",          _sphere(35.12),   (  0.00,   0.00, -35.12), UP,  -70.24),
    _Row(18, "sphere 6",          _sphere(20.50),   ( 24.15,   8.07, -20.50), UP,  -41.00, (19,)),
    _Row(19, "sphere 5",          _sphere(14.15),   (-14.15, -24.07, -14.15), UP,  -28.30, (18,)),
    _Row(20, "irregular surface", _IRREGULAR,       (  0.00,   0.00, -20.00), UP,  -20.00),
)
# fmt: on


@dataclass(frozen=True, kw_only=True)
class Jitter:
    """How far a hand that repeats an acquisition misses the stated pose; each error is uniform.

    Parameters
    ----------
    turn : float
        Largest turn about the vertical through the stated point, either way, in radians.
    shift : float
        Largest shift along x and along y, either way, in metres. Heights stay, so what lies on the table
        does.
    pick : float
        Largest error of the stated point along x and along y, either way, in metres: the patch moves on the
        object.
    """

    turn: float = np.radians(3.0)
    shift: float = 0.005
    pick: float = 0.002


#: Tilt of the patch's normal away from the scanner in random poses, in radians. Its middle is still seen
#: under at most 40 + 25 degrees by the camera, 10 degrees from where spots are lost, so that no patch is a
#: mere sliver.
RANDOM_TILT = float(np.radians(40.0))


@dataclass(frozen=True, eq=False)
class Acquisition:
    """One of table III's acquisitions, scanned.

    Attributes
    ----------
    number : int
        1 to 20, as in the paper.
    name : str
        The object, as in the paper; repeats have the name of the object that they repeat.
    kind : str
        "plane", "cylinder", "sphere" or "irregular".
    radius : float or None
        Metres; infinite for a plane, None for the irregular surface.
    cloud : PointCloud
        See :meth:`Scanner.scan`; the acquisition's object has `surface` 0.
    center_index : int
        The sample on which the patch is centred: of this object, no outlier, nearest the stated point.
    scene : Scene
        What was scanned.
    """

    number: int
    name: str
    kind: Kind
    radius: float | None
    cloud: PointCloud
    center_index: int
    scene: Scene

    @property
    def center(self) -> Array:
        """The patch's centre, (3,) metres."""
        return np.asarray(self.cloud.points[self.center_index], dtype=np.float64)


def paper_acquisitions(
    seed: int,
    *,
    poses: Poses = "stated",
    jitter: Jitter | None = None,
    scanner: Scanner | None = None,
    truth: bool = False,
) -> Iterator[Acquisition]:
    """Scan the twenty acquisitions of the paper's table III, one after the other.

    Parameters
    ----------
    seed : int
        Of noise, outliers and poses. Each acquisition has its own stream.
    poses : {"stated", "jittered", "random"}
        Stated: the frozen table in this module. Jittered: each scene missed by a little (`jitter`), in the
        stated kind of pose. Random: the object alone, turned about every axis, the patch anywhere on it; see
        :func:`paper_acquisition`.
    jitter : Jitter, optional
        For jittered poses; its defaults otherwise.
    scanner : Scanner, optional
        Its defaults otherwise.
    truth : bool
        Add true normals and curvatures; see :meth:`Scanner.scan`.

    Yields
    ------
    Acquisition
        In the order of their numbers.
    """
    for row in _TABLE_III:
        yield paper_acquisition(row.number, seed, poses=poses, jitter=jitter, scanner=scanner, truth=truth)


def paper_acquisition(
    number: int,
    seed: int,
    *,
    poses: Poses = "stated",
    jitter: Jitter | None = None,
    scanner: Scanner | None = None,
    truth: bool = False,
) -> Acquisition:
    """Scan one acquisition of table III; the same bits as from :func:`paper_acquisitions`.

    In a random pose the object is held in the air, without table or neighbours. The patch's point is drawn on
    it (at least 20 mm from the edge of a plate or of the irregular surface and from the ends of a cylinder),
    its normal anywhere within :data:`RANDOM_TILT` of the scanner, uniform on the sphere, and the object
    turned about that normal by any angle. The point comes to lie within 5 mm of the field's middle, 35-55 mm
    above the table.

    Parameters
    ----------
    number : int
        1 to 20.
    seed, poses, jitter, scanner, truth
        See :func:`paper_acquisitions`.

    Returns
    -------
    Acquisition

    Raises
    ------
    InvalidInputError
        If there is no such acquisition or kind of poses, or the scanner does not see the object.
    """
    if number not in range(1, len(_TABLE_III) + 1):
        raise InvalidInputError(f"table III has acquisitions 1 to {len(_TABLE_III)}, not {number!r}")
    if poses not in ("stated", "jittered", "random"):
        raise InvalidInputError(f'poses are "stated", "jittered" or "random", not {poses!r}')
    row = _TABLE_III[number - 1]
    scanner = scanner or Scanner()
    of_pose, of_noise = np.random.SeedSequence([seed, number]).spawn(2)
    rng = np.random.default_rng(of_pose)
    if poses == "random":
        scene, stated = _random_scene(row, rng)
        # Only the patch is needed: a 20 mm ball about the point fits this part of the field at every height.
        scanner = replace(
            scanner,
            field_width=min(scanner.field_width, 0.072),
            scan_length=min(scanner.scan_length, 0.060),
        )
    else:
        scene, stated = _stated_scene(row)
        if poses == "jittered":
            scene, stated = _jittered(scene, stated, rng, jitter or Jitter())
    cloud = scanner.scan(scene, of_noise, truth=truth)
    own = np.flatnonzero((cloud.fields["surface"] == 0) & (cloud.fields["outlier"] == 0))
    if not len(own):
        raise InvalidInputError(f"the scanner does not see the object of acquisition {number}")
    nearest = own[np.linalg.norm(cloud.points[own] - stated, axis=1).argmin()]
    radius = {"plane": np.inf, "irregular": None}.get(row.kind, getattr(row.surface, "radius", None))
    return Acquisition(row.number, row.name, row.kind, radius, cloud, int(nearest), scene)


def _placed(row: _Row) -> Placed:
    return Placed(row.surface, pose(np.array(row.position) / 1000.0, facing(row.axis)), row.name)


def _stated_scene(row: _Row) -> tuple[Scene, Array]:
    """Scene (the object first, the table last) and stated point, (3,) metres."""
    beside = [_placed(_TABLE_III[number - 1]) for number in row.beside]
    return Scene([_placed(row), *beside, _TABLE]), np.array([*row.position[:2], row.stated]) / 1000.0


def _jittered(scene: Scene, stated: Array, rng: np.random.Generator, jitter: Jitter) -> tuple[Scene, Array]:
    """Everything but the table turned and shifted, and the stated point missed."""
    rotation = turn(UP, rng.uniform(-jitter.turn, jitter.turn))
    shift = np.append(rng.uniform(-jitter.shift, jitter.shift, 2), 0.0)
    motion = pose(stated + shift - rotation @ stated, rotation)
    moved = [placed.moved(motion) for placed in scene.objects[:-1]]
    missed = np.append(rng.uniform(-jitter.pick, jitter.pick, 2), 0.0)
    return Scene([*moved, scene.objects[-1]]), transform_points(motion, stated) + missed


def _random_scene(row: _Row, rng: np.random.Generator) -> tuple[Scene, Array]:
    """Turn a random point of the object towards the scanner, within the tilt; scene and that point."""
    point = _random_point(row.surface, rng)
    normal = row.surface.normals(point[None])[0]
    height = rng.uniform(np.cos(RANDOM_TILT), 1.0)
    heading = rng.uniform(0.0, 2 * np.pi)
    across = np.sqrt(1.0 - height**2)
    towards = np.array([across * np.cos(heading), across * np.sin(heading), -height])
    rotation = facing(towards) @ turn((0.0, 0.0, 1.0), rng.uniform(0.0, 2 * np.pi)) @ facing(normal).T
    stated = np.append(rng.uniform(-0.005, 0.005, 2), rng.uniform(-0.055, -0.035))
    return Scene([Placed(row.surface, pose(stated - rotation @ point, rotation), row.name)]), stated


def _random_point(surface: Surface, rng: np.random.Generator) -> Array:
    """Draw a point (3,) of the object, in its own axes, 20 mm from its edges."""
    margin = 0.020
    if isinstance(surface, Sphere):
        return surface.radius * unit(rng.normal(size=3))
    if isinstance(surface, Cylinder):
        reach, angle = surface.length / 2 - margin, rng.uniform(0.0, 2 * np.pi)
        around = surface.radius * np.array([np.cos(angle), np.sin(angle)])
        return np.append(around, rng.uniform(-reach, reach))
    if isinstance(surface, Rectangle | HeightField):
        half = np.array(surface.size) / 2 - margin
        xy = rng.uniform(-half, half)
        height = surface.heights(xy[None])[0] if isinstance(surface, HeightField) else 0.0
        return np.append(xy, height)
    raise InvalidInputError(f"no random point on a {type(surface).__name__}")
