"""Decoding LAZ in a process of its own, which a damaged file may end.

lazrs reads the times of point formats before 6 by calling itself, in a damaged file so often that the stack
overflows, which no caller can catch. Run as a program, this file decodes what comes in on stdin.
"""

from __future__ import annotations

import contextlib
import os
import struct
import subprocess
import sys
from collections.abc import Iterator, Sequence

TYPE_CHECKING = False
if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# Of a job: bytes of the record, bytes of points to make, chunks; then points and bytes of each chunk.
JOB, CHUNK = struct.Struct("<QQQ"), struct.Struct("<QQ")


class Decoder:
    """A process that decodes one piece after the other.

    Parameters
    ----------
    program
        Its standard input and output are the pipes.
    """

    def __init__(self, program: subprocess.Popen[bytes]) -> None:
        self._program = program

    def decode(
        self,
        parts: Sequence[bytes],
        record: bytes,
        points: NDArray[np.uint8],
        table: Sequence[tuple[int, int]],
    ) -> None:
        """Fill `points` (bytes) from compressed chunks.

        Parameters
        ----------
        parts
            The chunks' bytes.
        record
            The description of the compression.
        points
            Room for the decoded records, (m,) uint8.
        table
            Points and bytes of each chunk.

        Raises
        ------
        ValueError
            With lazrs' words, or saying that the process ended.
        """
        send, receive = self._program.stdin, self._program.stdout
        assert send is not None
        assert receive is not None
        with contextlib.suppress(BrokenPipeError):
            send.write(JOB.pack(len(record), points.nbytes, len(table)))
            send.write(b"".join(CHUNK.pack(*entry) for entry in table))
            for part in (record, *parts):
                send.write(part)
            send.flush()
        (length,) = struct.unpack("<Q", receive.read(8) or bytes(8))
        if length:
            raise ValueError(receive.read(length).decode(errors="replace"))
        # Nothing came where the process has ended.
        if receive.readinto(points.data) != points.nbytes:  # type: ignore[attr-defined]
            raise ValueError("lazrs crashed")


@contextlib.contextmanager
def decoder() -> Iterator[Decoder]:
    """Start the process; it ends with the block."""
    with subprocess.Popen(
        [sys.executable, "-I", __file__, *sys.path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as program:
        try:
            yield Decoder(program)
        finally:
            program.kill()


def is_possible() -> bool:
    """Tell whether a process can be started: in a program that has Python inside, nothing may be known."""
    return os.path.basename(sys.executable or "").lower().startswith(("python", "pypy"))


def _main() -> None:
    sys.path[:] = sys.argv[1:]
    import lazrs

    receive, send = sys.stdin.buffer, sys.stdout.buffer
    while head := receive.read(JOB.size):
        record_bytes, room, count = JOB.unpack(head)
        table = [CHUNK.unpack(receive.read(CHUNK.size)) for _ in range(count)]
        record = receive.read(record_bytes)
        data = receive.read(sum(size for _, size in table))
        points = bytearray(room)
        error = b""
        try:
            lazrs.decompress_points_with_chunk_table(data, record, points, table)
        # A panic in Rust is no `Exception`.
        except BaseException as failed:
            error = str(failed).encode() or b"broken"
        send.write(struct.pack("<Q", len(error)))
        send.write(error or points)
        send.flush()


if __name__ == "__main__":
    _main()
