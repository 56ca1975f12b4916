"""What occurs more than once in scans, without a model: `recurrences`."""

from surfsig.alignment.free_directions import FreeDirection
from surfsig.recurrences.equal_surfaces import EqualSurfaces
from surfsig.recurrences.result import Piece, Recurrence, Recurrences
from surfsig.recurrences.search import recurrences

__all__ = ["EqualSurfaces", "FreeDirection", "Piece", "Recurrence", "Recurrences", "recurrences"]
