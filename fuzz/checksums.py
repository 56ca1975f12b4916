"""Makes the checksums of a damaged file right again, so that the damage gets past them to the reader."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
E57_MAGIC = b"ASTM-E57"
E57_PAGE = 1024
ZIP_MAGIC = b"PK\x03\x04"
ZIP_DEFLATED = 8
LARGEST_MEMBER = 10_000_000
_CRC32C = [0] * 256
for _byte in range(256):
    _rest = _byte
    for _ in range(8):
        _rest = (_rest >> 1) ^ (0x82F63B78 if _rest & 1 else 0)
    _CRC32C[_byte] = _rest


def repaired(content: bytes) -> bytes:
    """Return the file with right checksums, where its format has any that are known here (PNG, E57, ZIP)."""
    makers = {PNG_MAGIC: repaired_png, E57_MAGIC: repaired_e57, ZIP_MAGIC: repaired_zip}
    return next((make(content) for magic, make in makers.items() if content.startswith(magic)), content)


def repaired_png(content: bytes) -> bytes:
    """Write the CRC-32 of each chunk anew, as far as the chunks' lengths make sense."""
    file, start = bytearray(content), len(PNG_MAGIC)
    while start + 12 <= len(file):
        end = start + 8 + int.from_bytes(file[start : start + 4], "big")
        if end + 4 > len(file):
            break
        file[end : end + 4] = struct.pack(">I", zlib.crc32(file[start + 4 : end]))
        start = end + 4
    return bytes(file)


def repaired_e57(content: bytes) -> bytes:
    """Write the CRC-32C of each page anew."""
    file = bytearray(content)
    for start in range(0, len(file) - E57_PAGE + 1, E57_PAGE):
        value = 0xFFFFFFFF
        end = start + E57_PAGE - 4
        for byte in file[start:end]:
            value = _CRC32C[(value ^ byte) & 255] ^ (value >> 8)
        file[end : end + 4] = struct.pack(">I", value ^ 0xFFFFFFFF)
    return bytes(file)


def repaired_zip(content: bytes) -> bytes:
    """Write the CRC-32 of each member anew, as far as its table of contents can be read."""
    file = bytearray(content)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members, entry = archive.infolist(), archive.start_dir
        for member in members:
            name, extra = struct.unpack_from("<HH", file, member.header_offset + 26)
            start = member.header_offset + 30 + name + extra
            data = bytes(file[start : start + member.compress_size])
            if member.compress_type == ZIP_DEFLATED:
                data = zlib.decompressobj(-15).decompress(data, LARGEST_MEMBER)
            name, extra, comment = struct.unpack_from("<HHH", file, entry + 28)
            for place in (member.header_offset + 14, entry + 16):
                struct.pack_into("<I", file, place, zlib.crc32(data))
            entry += 46 + name + extra + comment
    except (zipfile.BadZipFile, struct.error, zlib.error, ValueError, NotImplementedError):
        return content
    return bytes(file)
