"""What occurs more than once in scans, without a model: `find_recurrences`."""

from surfsig.alignment.free_directions import FreeDirection
from surfsig.recurrences.equal_surfaces import EqualSurfaces
from surfsig.recurrences.occurrence import Occurrence
from surfsig.recurrences.result import Piece, Recurrence, Recurrences
from surfsig.recurrences.search import find_recurrences

__all__ = [
    "EqualSurfaces",
    "FreeDirection",
    "Occurrence",
    "Piece",
    "Recurrence",
    "Recurrences",
    "find_recurrences",
]
