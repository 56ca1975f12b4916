"""An extraction while it runs: progress, exceptions, Ctrl-C, threads and processes."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_points import Array, rough_surface

from surfsig import extract

LONG = """
import signal
import numpy as np
import surfsig
# Whoever started the tests may ignore it, and children do as their parents.
signal.signal(signal.SIGINT, signal.default_int_handler)
points = np.random.default_rng(0).uniform(-1, 1, (200_000, 3)).astype(np.float32)
print("ready", flush=True)
surfsig.extract(points, 0.5, neighbors=100_000, threads=1)
print("finished")
"""


class Enough(Exception):
    """What a callback raises."""


@pytest.fixture(scope="module")
def volume() -> Array:
    """Points of which a ball of radius 0.5 holds about 6 %: half a minute's work."""
    return np.random.default_rng(51).uniform(-1, 1, (200_000, 3))


def test_progress_rises_to_the_total(volume: Array) -> None:
    seen: list[tuple[int, int]] = []
    extract(volume, 0.12, threads=1, progress=lambda done, total: seen.append((done, total)))
    done = [d for d, _ in seen]
    assert {total for _, total in seen} == {200_000}
    assert done == sorted(done)
    assert done[-1] == 200_000
    # One report at the end, and one at least on the way, which takes several times their interval.
    assert len(seen) >= 2


def test_progress_of_nothing() -> None:
    seen: list[tuple[int, int]] = []
    extract(np.zeros((0, 3)), 1.0, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(0, 0)]


def test_an_exception_of_the_callback_reaches_the_caller_and_ends_the_work(volume: Array) -> None:
    def stop(done: int, total: int) -> None:
        raise Enough(f"{done} of {total}")

    with pytest.raises(Enough, match="of 200000") as caught:
        extract(volume, 0.5, progress=stop)
    # The first report came on the way, and the work ended there.
    assert not str(caught.value).startswith("200000")
    # And nothing is left in a bad state.
    assert len(extract(volume, 0.05, at=[1, 2])) == 2


def test_an_exception_of_the_last_call_is_not_lost() -> None:
    def stop(done: int, total: int) -> None:
        if done == total:
            raise Enough

    with pytest.raises(Enough):
        extract(np.zeros((10, 3)), 1.0, progress=stop)


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT for one process alone")
def test_ctrl_c_ends_a_long_extraction() -> None:
    command, pipe = [sys.executable, "-c", LONG], subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.4)
        process.send_signal(signal.SIGINT)
        shown, errors = process.communicate()
    # It ended before its work did.
    assert shown == ""
    assert errors.rstrip().endswith("KeyboardInterrupt")
    assert process.returncode != 0


def test_other_threads_run_on_meanwhile(volume: Array) -> None:
    """The interpreter is released: a Python thread gets its turns while the core works."""
    ticks = 0
    over = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not over.wait(0.005):
            ticks += 1

    ticker = threading.Thread(target=tick)
    ticker.start()
    extract(volume, 0.15, at=np.arange(40_000), threads=1)
    over.set()
    ticker.join()
    assert ticks > 3


def test_extractions_from_several_threads_do_not_mix() -> None:
    clouds = [rough_surface(seed, count=800) for seed in (52, 53, 54, 55)]
    expected = [extract(cloud, 0.3).k1 for cloud in clouds]
    found: dict[int, NDArray[np.float32]] = {}

    def work(number: int) -> None:
        found[number] = extract(clouds[number], 0.3).k1

    workers = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    for number, k1 in enumerate(expected):
        np.testing.assert_array_equal(found[number], k1)


@pytest.mark.skipif(not hasattr(signal, "alarm"), reason="no fork here")
def test_a_forked_child_can_extract_too() -> None:
    """As multiprocessing does by default on Linux before Python 3.14, and PyTorch's data loaders still."""
    script = """
import os, signal
import numpy as np, surfsig
points = np.random.default_rng(0).uniform(-1, 1, (100, 3))
surfsig.extract(points, 0.5)
child = os.fork()
if child == 0:
    signal.alarm(3)
    surfsig.extract(points, 0.5).signatures()
    os._exit(0)
print(os.waitpid(child, 0)[1])
"""
    command = [sys.executable, "-W", "ignore", "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == "0\n"
