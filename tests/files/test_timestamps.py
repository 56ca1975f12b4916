"""Times by the names of scans' files."""

import pytest

from surfsig.files.timestamps import times_of_names


@pytest.mark.parametrize(
    ("names", "times"),
    [
        (["0000000001", "0000000002"], [1.0, 2.0]),
        (["10.5", "10.75"], [10.5, 10.75]),
        (["1403636579763", "1403636579863"], [1403636579.763, 1403636579.863]),
        (
            ["cloud_1311868164_363181000", "cloud_1311868164_963181000"],
            [1311868164.363181, 1311868164.963181],
        ),
        # ROS programs write nanoseconds without leading zeros.
        (["cloud_1311868164_63181", "cloud_1311868164_963181000"], [1311868164.000063181, 1311868164.963181]),
        (["1403636579.763555584", "1403636580.013555584"], [1403636579.763555584, 1403636580.013555584]),
        (["1403636579.5", "1403636579.100000000"], [1403636579.000000005, 1403636579.1]),
        (["lidar-1311868164363181000", "lidar-1311868164963181000"], [1311868164.363181, 1311868164.963181]),
        (["os1_1311868164.363181000", "os1_1311868164.963181000"], [1311868164.363181, 1311868164.963181]),
    ],
)
def test_names_that_say_a_time(names: list[str], times: list[float]) -> None:
    assert times_of_names(names) == pytest.approx(times, rel=0, abs=3e-7)


@pytest.mark.parametrize(
    "names",
    [
        ["scan_1", "scan_2"],
        ["a", "b"],
        ["cloud_1311868164_363181000", "cloud_7"],
        ["cloud_1311868165_0", "cloud_1311868164_0"],
        ["20240101_120000", "20240101_120001"],
    ],
)
def test_names_that_say_none(names: list[str]) -> None:
    assert times_of_names(names) is None
