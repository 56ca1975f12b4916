"""What a file's format is recognised by: its first bytes, its size and its name."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

HEAD_BYTES = 4096


@dataclass(frozen=True)
class Opening:
    """What can be seen of a file at once.

    Attributes
    ----------
    head
        Its first `HEAD_BYTES` bytes.
    size
        Number of its bytes.
    extension
        In lower case, with the dot; for the few formats whose content says nothing.
    """

    head: bytes
    size: int
    extension: str

    @classmethod
    def of(cls, path: Path, file: BinaryIO) -> Opening:
        """Look into an open file, and go back to its beginning."""
        head = file.read(HEAD_BYTES)
        file.seek(0)
        return cls(head, os.fstat(file.fileno()).st_size, path.suffix.lower())

    @property
    def is_text(self) -> bool:
        """Whether the first bytes are text of whatever kind."""
        # UTF-16 begins with its mark; any other text has no zero and hardly a control character.
        if self.head.startswith((b"\xff\xfe", b"\xfe\xff")):
            return True
        controls = sum(byte < 9 or 13 < byte < 32 for byte in self.head)
        return 0 not in self.head and controls * 50 <= len(self.head)


Recogniser = Callable[[Opening], bool]


def begins(*marks: bytes) -> Recogniser:
    """Recognise files that begin with one of these bytes."""
    return lambda opening: opening.head.startswith(marks)


def matches(pattern: re.Pattern[bytes]) -> Recogniser:
    """Recognise files whose first bytes match a pattern."""
    return lambda opening: pattern.match(opening.head) is not None
