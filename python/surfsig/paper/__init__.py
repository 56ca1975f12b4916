"""The paper's tables and figures, from simulated scans: printed beside ours, and what was added.

`reproduce` scans and compares; `write_reproduction` makes the files that `surfsig paper` leaves.
"""

from .reproduction import DRAWS_PER_SEED, Reproduction, reproduce
from .written import write_reproduction

__all__ = ["DRAWS_PER_SEED", "Reproduction", "reproduce", "write_reproduction"]
