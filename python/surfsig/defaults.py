"""The one home of each default."""

from typing import Literal

from surfsig import _surfsig

Axes = Literal["surface", "sensor"]
"""In which axes a paraboloid is fitted."""

AXES: Axes = "surface"
"""The surface's own: results turn with the object."""

Fit = Literal["paraboloid", "quadric", "auto"]
"""Which surface is fitted."""

FIT: Fit = "paraboloid"
"""The paper's; it has the smallest spread, and the frame's atoms are such."""

RADIUS = 0.02
"""Half the side of the paper's patch, in metres; where `surfsig compare` is given none."""

SIGNATURE_BLOCK = 65_536
"""Signatures that a stream makes at a time: 60 MB."""

OUTLIER_NEIGHBORS = 20
"""Nearest points that `surfsig.remove_outliers` measures the distance to."""

OUTLIER_STD_RATIO = 2.0
"""Standard deviations above the mean from which on it calls a point an outlier; Open3D's examples use it."""

PAPER_SEEDS = 5
"""Draws of noise and poses in the paper's reproduction: an odd number, so that one is in the middle."""

DEPTH_SCALE = 1000.0
"""Units of a depth image per unit of length: millimetres to metres."""

SAMPLING_SEED = 0
"""Of the points that are spread over a mesh."""

INTERVAL = 0.95
"""Probability with which the interval of a fitted radius holds the true one."""

RECURRENCE_POINTS = 100
"""Fewest points of a piece that is compared with others; with less, little speaks against a match."""

RECURRENCE_SCORE = 0.2
"""Score of a match, at least; of two kinds in simulated scenes few reach 0.16."""

RECURRENCE_CONFIDENCE = 0.99
"""Of the tests whether surfaces differ in size."""

KEYPOINTS = 1000
"""Places that `surfsig.find_keypoints` chooses, where neither number nor distance is asked for."""

INSTANCE_SCORE = _surfsig.INSTANCE_SCORE
"""Probability that a model is where it is found, at least: it is rather right than wrong."""
