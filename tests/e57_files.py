"""E57 files made byte by byte, without the writer: what the tests say of the reader hangs on nothing else."""

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

PAGE, DATA = 1024, 1020
_TABLE = [0] * 256
for _byte in range(256):
    _rest = _byte
    for _ in range(8):
        _rest = (_rest >> 1) ^ (0x82F63B78 if _rest & 1 else 0)
    _TABLE[_byte] = _rest


def checksum(page: bytes) -> bytes:
    """The CRC-32C of a page, as E57 stores it: big-endian."""
    value = 0xFFFFFFFF
    for byte in page:
        value = _TABLE[(value ^ byte) & 255] ^ (value >> 8)
    return struct.pack(">I", value ^ 0xFFFFFFFF)


def paged(logical: bytes) -> bytes:
    """Cut into pages, each with its checksum; the last one is filled with zeros."""
    pages = [logical[at : at + DATA].ljust(DATA, b"\0") for at in range(0, len(logical), DATA)]
    return b"".join(page + checksum(page) for page in pages)


def physical(logical: int) -> int:
    return logical // DATA * PAGE + logical % DATA


def with_xml(xml: str, body: bytes = b"") -> bytes:
    """A whole file: the head, sections of points, the XML."""
    text = xml.encode()
    start = 48 + len(body)
    length = -(-(start + len(text)) // DATA) * PAGE
    head = struct.pack("<8sIIQQQQ", b"ASTM-E57", 1, 0, length, physical(start), len(text), PAGE)
    return paged(head + body + text)


def root(scans: str, names: str = "") -> str:
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<e57Root type="Structure" {names}'
        ' xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0">\n'
        '<formatName type="String"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>\n'
        '<guid type="String"><![CDATA[{test}]]></guid>\n<versionMajor type="Integer">1</versionMajor>\n'
        f'<versionMinor type="Integer"/>\n<data3D type="Vector">{scans}</data3D>\n</e57Root>\n'
    )


def scan_xml(records: str, count: int, offset: int = 48, pose: str = "") -> str:
    return (
        f'<vectorChild type="Structure"><guid type="String">{{scan}}</guid>{pose}<points type='
        f'"CompressedVector" fileOffset="{physical(offset)}" recordCount="{count}">'
        f'<prototype type="Structure">{records}</prototype></points></vectorChild>\n'
    )


def pose_xml(quaternion: Sequence[float], translation: Sequence[float]) -> str:
    turn = "".join(f'<{a} type="Float">{v!r}</{a}>' for a, v in zip("wxyz", quaternion, strict=True))
    shift = "".join(f'<{a} type="Float">{v!r}</{a}>' for a, v in zip("xyz", translation, strict=True))
    return (
        f'<pose type="Structure"><rotation type="Structure">{turn}</rotation>'
        f'<translation type="Structure">{shift}</translation></pose>'
    )


def section(streams: Sequence[bytes], offset: int = 48) -> bytes:
    """A section of one packet, which stands `offset` logical bytes from the file's beginning."""
    sizes = b"".join(struct.pack("<H", len(stream)) for stream in streams)
    packet = sizes + b"".join(streams)
    packet += b"\0" * (-(len(packet) + 6) % 4)
    packet = struct.pack("<BBHH", 1, 0, len(packet) + 5, len(streams)) + packet
    return struct.pack("<B7xQQQ", 1, 32 + len(packet), physical(offset + 32), 0) + packet


class Scan:
    """Columns (float32, float64, or whole numbers of 0 to 255) by their tag, and a pose."""

    def __init__(self, columns: dict[str, NDArray[np.generic]], pose: str = "") -> None:
        self.columns = columns
        self.pose = pose

    def records(self) -> str:
        kinds = {
            "f4": 'type="Float" precision="single"',
            "f8": 'type="Float"',
            "u1": 'type="Integer" minimum="0" maximum="255"',
        }
        return "".join(f"<{tag} {kinds[values.dtype.str[1:]]}/>" for tag, values in self.columns.items())


def made_of(*scans: Scan, names: str = "") -> bytes:
    """A file of these scans; each must fit into one packet."""
    body, xml = b"", ""
    for scan in scans:
        offset = 48 + len(body)
        count = len(next(iter(scan.columns.values())))
        xml += scan_xml(scan.records(), count, offset, scan.pose)
        body += section([values.tobytes() for values in scan.columns.values()], offset)
    return with_xml(root(xml, names), body)
