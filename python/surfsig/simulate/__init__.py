"""Simulated scenes and sensors, to test pipelines on scans whose truth is known.

A :class:`Scene` is made of analytic surfaces, each placed by a rigid pose; a :class:`Scanner` sweeps a laser
sheet over it and measures what the laser lights *and* the camera sees, with noise, rounding and outliers.
A :class:`Lidar` or a :class:`DepthCamera` looks around from one place of a room, a corridor, a hall, a forest
(:func:`scan`; :mod:`surfsig.simulate.places`), and a :class:`StereoCamera` has the errors of real depth
cameras. Metres throughout; a :class:`Scanner`'s heights grow along negative z
(:mod:`surfsig.simulate.scanner` draws the axes).

>>> from surfsig import simulate
>>> ball = simulate.Placed(simulate.Sphere(0.02), simulate.pose((0, 0, -0.02)), "ball")
>>> flat = simulate.pose((0, 0, 0), simulate.facing(simulate.UP))
>>> table = simulate.Placed(simulate.Rectangle((0.2, 0.2)), flat, "table")
>>> cloud = simulate.Scanner(noise=5e-5).scan(simulate.Scene([ball, table]), seed=1)
"""

from ..geometry import inverse, transform_points
from .acquisitions import RANDOM_TILT, Acquisition, Jitter, paper_acquisition, paper_acquisitions
from .ellipsoid import Ellipsoid
from .height_field import HeightField
from .machined_part import PART_SCANNER, part, part_scene
from .places import block, corridor, forest, hall, pipes, plane, room, storey, tunnel, upright_pose
from .poses import UP, facing, pose, turn
from .round_trip import circuit, circuit_poses
from .scanner import Scanner
from .scene import Hits, Placed, Scene
from .sensors import Calibration, DepthCamera, Lidar, bent_calibration, distorted, scan, scan_moving
from .stereo_camera import StereoCamera
from .surfaces import Box, Cone, Cylinder, Plane, Rectangle, Sphere, Surface

__all__ = [
    "PART_SCANNER",
    "RANDOM_TILT",
    "UP",
    "Acquisition",
    "Box",
    "Calibration",
    "Cone",
    "Cylinder",
    "DepthCamera",
    "Ellipsoid",
    "HeightField",
    "Hits",
    "Jitter",
    "Lidar",
    "Placed",
    "Plane",
    "Rectangle",
    "Scanner",
    "Scene",
    "Sphere",
    "StereoCamera",
    "Surface",
    "bent_calibration",
    "block",
    "circuit",
    "circuit_poses",
    "corridor",
    "distorted",
    "facing",
    "forest",
    "hall",
    "inverse",
    "paper_acquisition",
    "paper_acquisitions",
    "part",
    "part_scene",
    "pipes",
    "plane",
    "pose",
    "room",
    "scan",
    "scan_moving",
    "storey",
    "transform_points",
    "tunnel",
    "turn",
    "upright_pose",
]
