"""The one home of each default."""

from typing import Literal

Axes = Literal["surface", "sensor"]
"""In which axes a paraboloid is fitted."""

AXES: Axes = "surface"
"""The surface's own: results turn with the object."""

RADIUS = 0.02
"""Half the side of the paper's patch, in metres; where `surfsig compare` is given none."""

SIGNATURE_BLOCK = 65_536
"""Signatures that a stream makes at a time: 60 MB."""

FLAT_ATOM_NOISES = 8.0
"""Length of the flat atom, in lengths of a signature of pure noise: 99 of 100 pairs of planes then have a zeta of
0.9 or more (simulated; 5.2 for nine of ten)."""

PAPER_SEEDS = 5
"""Draws of noise and poses in the paper's reproduction: an odd number, so that one is in the middle."""
