"""Text in the encodings that Windows programs write: UTF-8 with a mark, UTF-16 and 32, a code page."""

from __future__ import annotations

import codecs
import io
from typing import BinaryIO

_UTF32_MARKS = (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)
WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE, *_UTF32_MARKS)


def decoded(file: BinaryIO) -> BinaryIO:
    """Skip a byte order mark; turn UTF-16 and UTF-32 into bytes of one per digit."""
    mark = file.read(len(codecs.BOM_UTF32_LE))
    if mark.startswith(WIDE_MARKS):
        file.seek(0)
        encoding = "utf-32" if mark in _UTF32_MARKS else "utf-16"
        return io.BytesIO(file.read().decode(encoding, errors="replace").encode())
    file.seek(len(codecs.BOM_UTF8) if mark.startswith(codecs.BOM_UTF8) else 0)
    return file


def decoded_head(head: bytes) -> bytes:
    """Do the same with the first bytes of a file."""
    return decoded(io.BytesIO(head)).read()


def names_decoded(head: bytes) -> str:
    """Decode the beginning of a text: UTF-8, or else what Excel writes in Western Europe."""
    try:
        # The last letter may be cut off.
        return codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return head.decode("cp1252", errors="replace")
