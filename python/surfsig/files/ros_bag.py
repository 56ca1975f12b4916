"""ROS bags: the point clouds of a topic, message by message.

Through rosbags (Apache-2.0, pure Python; no ROS is needed), an optional dependency (``surfsig[ros]``).
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.convert.libraries import library
from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.columns import cloud_from_columns, columns_of
from surfsig.files.pcd_header import MAX_NUMBERS, PACKED_COLOURS
from surfsig.point_cloud import PointCloud

ROS1_SUFFIX = ".bag"
ROS2_SUFFIXES = (".db3", ".mcap")
METADATA = "metadata.yaml"

_MESSAGE = "sensor_msgs/msg/PointCloud2"
# sensor_msgs/PointField: the numbers of its types.
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def bag_of(path: Path) -> Path | None:
    """Give what rosbags opens for a path: a ROS 1 file, or a ROS 2 folder; None if it is no bag."""
    if path.is_dir():
        return path if (path / METADATA).is_file() else None
    suffix = path.suffix.lower()
    if suffix in ROS2_SUFFIXES:
        if not (path.parent / METADATA).is_file():
            raise FileFormatError(f"{path}: {METADATA} is missing beside it (ros2 bag reindex makes it)")
        return path.parent
    return path if suffix == ROS1_SUFFIX else None


class BagTopic:
    """The point clouds of one topic of a bag.

    Parameters
    ----------
    path
        From `bag_of`.
    topic
        Its name; None where the bag has one such topic only.

    Raises
    ------
    FileFormatError
        If the bag is broken, or holds no point clouds.
    InvalidInputError
        If the topic has none, several have some and none is named, or rosbags is not installed.
    """

    def __init__(self, path: Path, topic: str | None) -> None:
        self.path = path
        with self._opened() as reader:
            counts: dict[str, int] = {}
            for connection in reader.connections:
                if connection.msgtype == _MESSAGE:
                    counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
        known = ", ".join(counts)
        if not counts:
            raise FileFormatError(f"{path}: holds no {_MESSAGE}")
        if topic is None and len(counts) > 1:
            raise InvalidInputError(f"{path}: several topics hold point clouds; name one of {known}")
        self.topic = next(iter(counts)) if topic is None else topic
        if self.topic not in counts:
            raise InvalidInputError(f"{path}: no point clouds under the topic '{topic}', only under {known}")
        self._count = counts[self.topic]

    def __len__(self) -> int:
        """Return the number of messages."""
        return self._count

    def __iter__(self) -> Iterator[tuple[float, PointCloud]]:
        """Read message by message: the time in its header, in seconds, and the cloud."""
        with self._opened() as reader:
            chosen = [c for c in reader.connections if (c.topic, c.msgtype) == (self.topic, _MESSAGE)]
            for connection, _, raw in reader.messages(connections=chosen):
                message = reader.deserialize(raw, connection.msgtype)
                stamp = message.header.stamp
                yield stamp.sec + stamp.nanosec * 1e-9, cloud_of(message, str(self.path))

    @contextlib.contextmanager
    def _opened(self) -> Iterator[Any]:
        highlevel = library("rosbags.highlevel", "rosbags", "'surfsig[ros]'")
        typesys = library("rosbags.typesys", "rosbags", "'surfsig[ros]'")
        store = typesys.get_typestore(typesys.Stores.LATEST)
        try:
            with highlevel.AnyReader([self.path], default_typestore=store) as reader:
                yield reader
        except (FileFormatError, FileNotFoundError, PermissionError):
            raise
        except Exception as error:
            # What a damaged bag makes of rosbags and the libraries below it is of many kinds, MemoryError
            # among them.
            told = " ".join(str(error).split())[:100] or type(error).__name__
            raise FileFormatError(f"{self.path}: the bag is cut off or broken ({told})") from None


def cloud_of(message: Any, source: str) -> PointCloud:
    """Take a PointCloud2 message; packed colours are unpacked, and the sensor is at (0, 0, 0).

    Raises
    ------
    FileFormatError
        If its fields make no sense, or it promises more than it holds.
    """
    names: list[str] = []
    kinds: list[np.dtype[Any]] = []
    offsets: list[int] = []
    order = ">" if message.is_bigendian else "<"
    for field in message.fields:
        if field.datatype not in _TYPES or not 0 < field.count <= MAX_NUMBERS or field.name in names:
            raise FileFormatError(f"{source}: the field '{field.name}' of a point cloud makes no sense")
        kind = np.dtype(order + _TYPES[field.datatype])
        if field.name in PACKED_COLOURS and kind.itemsize == 4:
            for colour, byte in PACKED_COLOURS[field.name].items():
                names.append(colour)
                kinds.append(np.dtype("u1"))
                offsets.append(field.offset + (3 - byte if message.is_bigendian else byte))
            continue
        names.append(field.name)
        kinds.append(kind if field.count == 1 else np.dtype((kind, (field.count,))))
        offsets.append(field.offset)
    height, width, row, step = message.height, message.width, message.row_step, message.point_step
    # Rows may be padded, and some drivers say nothing of the row's length.
    row = row or width * step
    if row < width * step or height * row > len(message.data):
        raise FileFormatError(
            f"{source}: a message promises {height} x {width} points of {step} bytes, "
            f"{len(message.data)} bytes are there"
        )
    try:
        dtype = np.dtype({"names": names, "formats": kinds, "offsets": offsets, "itemsize": step})
    except (ValueError, TypeError) as error:
        raise FileFormatError(f"{source}: the fields of a point cloud make no sense: {error}") from None
    data = np.ascontiguousarray(message.data, np.uint8)[: height * row].reshape(height, row)
    rows: NDArray[Any] = np.ascontiguousarray(data[:, : width * step]).reshape(-1).view(dtype)
    cloud = cloud_from_columns(columns_of(rows), source=source, grid=(height, width) if height > 1 else None)
    cloud.viewpoint = np.zeros(3)
    return cloud
