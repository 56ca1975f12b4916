"""Text in the encodings that Windows programs write: UTF-8 with a byte order mark, and UTF-16."""

from __future__ import annotations

import codecs
import io
from typing import BinaryIO

UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def decoded(file: BinaryIO) -> BinaryIO:
    """Skip a byte order mark; turn UTF-16 into bytes of one per digit."""
    mark = file.read(len(codecs.BOM_UTF8))
    if mark.startswith(UTF16_MARKS):
        file.seek(0)
        return io.BytesIO(file.read().decode("utf-16", errors="replace").encode())
    file.seek(len(codecs.BOM_UTF8) if mark == codecs.BOM_UTF8 else 0)
    return file


def decoded_head(head: bytes) -> bytes:
    """Do the same with the first bytes of a file."""
    return decoded(io.BytesIO(head)).read()
