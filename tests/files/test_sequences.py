"""Sequences of scans: the order of files, timestamps, and ROS bags that rosbags itself writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import FileFormatError, InvalidInputError, PointCloud
from surfsig.files.ros_bag import BagTopic, cloud_of

rosbag1 = pytest.importorskip("rosbags.rosbag1")
rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")

MESSAGE = "sensor_msgs/msg/PointCloud2"
ROWS = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring", "rgb"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<u4"],
        "offsets": [0, 4, 8, 16, 20, 24],
        "itemsize": 32,
    }
)
FIELDS = (("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 16, 7), ("ring", 20, 4), ("rgb", 24, 7))


def write_scans(folder: Path, names: list[str]) -> None:
    """Write a file for each name, whose points' x is the place in the list."""
    for number, name in enumerate(names):
        surfsig.write(folder / name, PointCloud(np.full((3, 3), number, np.float32)))


def order(paths: Any) -> list[int]:
    return [int(scan.cloud.points[0, 0]) for scan in surfsig.open_scan_sequence(paths)]


def timestamps(paths: Any) -> list[float]:
    return [scan.timestamp for scan in surfsig.open_scan_sequence(paths)]


def rows(number: int) -> NDArray[Any]:
    rng = np.random.default_rng(number)
    table = np.zeros(20, ROWS)
    for axis in "xyz":
        table[axis] = rng.normal(size=20)
    table["intensity"], table["ring"] = rng.random(20), np.arange(20)
    table["rgb"] = 0x00102030 + number
    return table


def message(store: Any, number: int, height: int = 1) -> Any:
    types = store.types
    numbered = {"seq": number} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    stamp = types["builtin_interfaces/msg/Time"](sec=1700000000 + number, nanosec=250_000_000)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="lidar", **numbered)
    field = types["sensor_msgs/msg/PointField"]
    return types[MESSAGE](
        header=header,
        height=height,
        width=20 // height,
        fields=[field(name=n, offset=o, datatype=t, count=1) for n, o, t in FIELDS],
        is_bigendian=False,
        point_step=32,
        row_step=32 * 20 // height,
        data=rows(number).view(np.uint8),
        is_dense=True,
    )


def write_bag(path: Path, kind: str, topics: tuple[str, ...] = ("/points",), count: int = 3) -> Path:
    """Write a bag with clouds under the topics, and text under another."""
    first = kind == "ros1"
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if first else typesys.Stores.ROS2_HUMBLE)
    if first:
        writer = rosbag1.Writer(path)
    else:
        plugin = rosbag2.StoragePlugin.MCAP if kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
        writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
    serialize = store.serialize_ros1 if first else store.serialize_cdr
    with writer:
        text = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        said = store.types["std_msgs/msg/String"](data="hello")
        writer.write(text, 1, serialize(said, "std_msgs/msg/String"))
        for topic in topics:
            connection = writer.add_connection(topic, MESSAGE, typestore=store)
            for number in range(count):
                writer.write(connection, number + 2, serialize(message(store, number), MESSAGE))
    return path


def test_files_are_taken_in_natural_order(tmp_path: Path) -> None:
    write_scans(tmp_path, ["a1.ply", "a2.ply", "a10.ply", "a10b3.ply", "b1.ply"])
    (tmp_path / ".hidden").write_text("no scan")
    assert order(tmp_path) == [0, 1, 2, 3, 4]
    # As a shell's * gives them.
    assert order(sorted(tmp_path.glob("*.ply"))) == [0, 1, 2, 3, 4]


def test_names_that_are_numbers_are_timestamps(tmp_path: Path) -> None:
    seconds, nano, words, equal = (tmp_path / name for name in ("seconds", "nano", "words", "equal"))
    for folder in (seconds, nano, words, equal):
        folder.mkdir()
    write_scans(seconds, ["9.25.ply", "10.5.ply", "000011.ply"])
    write_scans(nano, ["1403636579763555584.ply", "1403636579863555584.ply"])
    write_scans(words, ["7.ply", "scan8.ply"])
    write_scans(equal, ["7.ply", "07.ply"])
    assert timestamps(seconds) == [9.25, 10.5, 11.0]
    assert timestamps(nano) == [1403636579763555584 / 1e9, 1403636579863555584 / 1e9]
    assert timestamps(words) == [0.0, 1.0]
    assert timestamps(equal) == [0.0, 1.0]


def test_whole_numbers_of_micro_and_milliseconds_were_taken_for_nanoseconds(tmp_path: Path) -> None:
    """Oxford's RobotCar names scans in microseconds: 16 digits."""
    for digits, names in (
        (16, ["1403636579763555.ply", "1403636579863555.ply"]),
        (13, ["1403636579763.ply", "1403636579863.ply"]),
    ):
        folder = tmp_path / str(digits)
        folder.mkdir()
        write_scans(folder, names)
        first, second = timestamps(folder)
        assert first == pytest.approx(1403636579.763555, abs=1e-3)
        assert second - first == pytest.approx(0.1, abs=1e-5)


def test_poses_and_times_beside_the_scans_were_taken_for_scans(tmp_path: Path) -> None:
    write_scans(tmp_path, ["0.ply", "1.ply"])
    (tmp_path / "times.txt").write_text("0.0\n0.1\n")
    with pytest.warns(UserWarning, match=r"1 files that are not '\.ply' are left out"):
        sequence = surfsig.open_scan_sequence(tmp_path)
    assert [len(scan.cloud) for scan in sequence] == [3, 3]


def test_a_file_that_vanishes_ended_the_whole_way(tmp_path: Path) -> None:
    write_scans(tmp_path, ["1.ply", "2.ply", "3.ply"])
    sequence = surfsig.open_scan_sequence(tmp_path)
    (tmp_path / "2.ply").unlink()
    with pytest.warns(
        UserWarning, match=r"2\.ply: No such file or directory; taken as a scan without points"
    ):
        clouds = [scan.cloud for scan in sequence]
    assert [len(cloud) for cloud in clouds] == [3, 0, 3]


def test_a_broken_file_is_a_scan_without_points(tmp_path: Path) -> None:
    write_scans(tmp_path, ["1.ply", "3.ply"])
    (tmp_path / "2.ply").write_bytes(b"")
    with pytest.warns(UserWarning, match=r"2\.ply: the file is empty; taken as a scan without points"):
        clouds = [scan.cloud for scan in surfsig.open_scan_sequence(tmp_path)]
    assert [len(cloud) for cloud in clouds] == [3, 0, 3]


def test_mistakes_are_told_before_anything_is_read(tmp_path: Path) -> None:
    write_scans(tmp_path, ["1.ply"])
    with pytest.raises(FileNotFoundError):
        surfsig.open_scan_sequence([tmp_path / "1.ply", tmp_path / "none.ply"])
    with pytest.raises(InvalidInputError, match="there are no scans"):
        surfsig.open_scan_sequence([])
    with pytest.raises(InvalidInputError, match=r"1\.ply: is no ROS bag, and so has no topic '/points'"):
        surfsig.open_scan_sequence([tmp_path / "1.ply"], topic="/points")
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileFormatError, match="holds no files"):
        surfsig.open_scan_sequence(tmp_path / "empty")
    (tmp_path / "alone.mcap").write_bytes(b"")
    with pytest.raises(FileFormatError, match=r"metadata\.yaml is missing"):
        surfsig.open_scan_sequence(tmp_path / "alone.mcap")


@pytest.mark.parametrize(("kind", "name"), [("ros1", "a.bag"), ("sqlite3", "a"), ("mcap", "a")])
def test_the_clouds_of_a_bag(tmp_path: Path, kind: str, name: str) -> None:
    sequence = surfsig.open_scan_sequence(write_bag(tmp_path / name, kind))
    assert len(sequence) == 3
    # As often as they are asked for.
    for _ in range(2):
        scans = list(sequence)
        assert [scan.timestamp for scan in scans] == [1700000000.25 + number for number in range(3)]
    for number, scan in enumerate(scans):
        cloud = scan.cloud
        table = rows(number)
        expected = np.column_stack([table[axis] for axis in "xyz"])
        np.testing.assert_array_equal(cloud.points, expected)
        np.testing.assert_array_equal(cloud.fields["intensity"], table["intensity"])
        np.testing.assert_array_equal(cloud.fields["ring"], table["ring"])
        colours = [int(cloud.fields[colour][0]) for colour in ("red", "green", "blue")]
        assert colours == [0x10, 0x20, 0x30 + number]
        assert cloud.viewpoint is not None
        assert cloud.viewpoint.tolist() == [0, 0, 0]


def test_a_file_of_a_ros2_bag_stands_for_it(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", "sqlite3")
    assert len(surfsig.open_scan_sequence(next(bag.glob("*.db3")))) == 3


def test_of_several_topics_one_must_be_named(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "two.bag", "ros1", ("/front", "/rear"))
    with pytest.raises(InvalidInputError, match=r"two\.bag: several topics .* name one of /front, /rear"):
        surfsig.open_scan_sequence(bag)
    assert len(surfsig.open_scan_sequence(bag, topic="/rear")) == 3
    with pytest.raises(InvalidInputError, match="under the topic '/chatter', only under /front, /rear"):
        surfsig.open_scan_sequence(bag, topic="/chatter")
    with pytest.raises(InvalidInputError, match="'unit' means nothing for a ROS bag"):
        surfsig.open_scan_sequence(bag, topic="/rear", unit="mm")
    silent = write_bag(tmp_path / "silent.bag", "ros1", ())
    with pytest.raises(FileFormatError, match=r"silent\.bag: holds no sensor_msgs"):
        surfsig.open_scan_sequence(silent)


@pytest.mark.parametrize("kind", ["ros1", "sqlite3", "mcap"])
def test_a_damaged_bag_is_refused_in_a_line(tmp_path: Path, kind: str) -> None:
    """Cut off, and with bytes changed: an error that names it, or clouds, and nothing else."""
    bag = write_bag(tmp_path / ("whole.bag" if kind == "ros1" else "whole"), kind)
    file = bag if kind == "ros1" else next(path for path in bag.iterdir() if path.suffix != ".yaml")
    whole = file.read_bytes()
    rng = np.random.default_rng(4)
    told: list[str] = []
    for trial in range(60):
        damaged = bytearray(whole[: rng.integers(len(whole))] if trial % 2 else whole)
        for place in rng.integers(max(len(damaged), 1), size=8):
            damaged[place : place + 1] = rng.bytes(1)
        file.write_bytes(damaged)
        try:
            list(BagTopic(bag, None))
        except FileFormatError as error:
            told.append(str(error))
    assert len(told) > 20
    assert all(line.startswith(str(bag)) for line in told)


def test_lengths_that_mcap_promises_take_no_memory(tmp_path: Path) -> None:
    """rosbags asks for what a record promises; nothing that the file does not hold is ever touched."""
    resource = pytest.importorskip("resource")
    bag = write_bag(tmp_path / "a", "mcap")
    file = next(bag.glob("*.mcap"))
    whole = file.read_bytes()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    place = 8
    told: list[str] = []
    while place < len(whole) - 8:
        size = int.from_bytes(whole[place + 1 : place + 9], "little")
        for promised in (1 << 32, 1 << 40, 1 << 62):
            file.write_bytes(whole[: place + 1] + promised.to_bytes(8, "little") + whole[place + 9 :])
            try:
                list(BagTopic(bag, None))
            except FileFormatError as error:
                told.append(str(error))
        place += 9 + size
    assert len(told) > 10
    assert all(line.startswith(str(bag)) for line in told)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000


def test_a_bag_that_is_broken_in_its_middle_ends_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(message: Any, source: str) -> PointCloud:
        if message.header.stamp.sec == 1700000002:
            raise FileFormatError(f"{source}: broken")
        return cloud_of(message, source)

    bag = write_bag(tmp_path / "a.bag", "ros1")
    monkeypatch.setattr("surfsig.files.ros_bag.cloud_of", broken)
    with pytest.warns(UserWarning, match=r"a\.bag: broken; its scans end there"):
        assert len(list(surfsig.open_scan_sequence(bag))) == 2


def test_organised_and_big_endian_clouds() -> None:
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    cloud = cloud_of(message(store, 1, height=4), "a")
    assert cloud.grid == (4, 5)
    np.testing.assert_array_equal(cloud.points[:, 1], rows(1)["y"])
    turned = message(store, 1)
    turned.is_bigendian = True
    turned.data = rows(1).astype(ROWS.newbyteorder(">")).view(np.uint8)
    other = cloud_of(turned, "a")
    np.testing.assert_array_equal(other.points, cloud.points)
    assert int(other.fields["red"][0]) == 0x10
    assert int(other.fields["blue"][0]) == 0x31


def test_rows_may_be_padded() -> None:
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    padded = message(store, 2, height=4)
    padded.row_step = 5 * 32 + 7
    data = np.zeros((4, padded.row_step), np.uint8)
    data[:, : 5 * 32] = rows(2).view(np.uint8).reshape(4, -1)
    padded.data = data.reshape(-1)
    np.testing.assert_array_equal(cloud_of(padded, "a").points[:, 0], rows(2)["x"])


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"width": 2_000_000_000}, "promises"),
        ({"row_step": 8}, "promises"),
        ({"point_step": 16}, "promises|make no sense"),
        ({"fields": []}, "no column 'x'"),
    ],
)
def test_a_message_that_makes_no_sense_is_refused(change: dict[str, Any], told: str) -> None:
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    wrong = message(store, 0)
    for name, value in change.items():
        setattr(wrong, name, value)
    with pytest.raises(FileFormatError, match=told):
        cloud_of(wrong, "a.bag")
