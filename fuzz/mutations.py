"""Random damage to files, each reproducible from its number."""

from __future__ import annotations

import random
import re
import struct
from typing import Literal

from checksums import repaired
from corpus import Seed

INTERESTING = (
    0,
    1,
    -1,
    2,
    3,
    4,
    127,
    128,
    255,
    256,
    32767,
    32768,
    65535,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**63 - 1,
)
NUMBERS = (
    b"0",
    b"-1",
    b"1",
    b"3",
    b"97",
    b"4294967296",
    b"99999999999",
    b"9" * 30,
    b"1e9",
    b"nan",
    b"0.5",
    b"",
)
HEAD = 1200
"""Bytes in which headers stand; half of all damage is done there."""

_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")


def place(rng: random.Random, content: bytearray) -> int:
    """Choose an offset: in the head, in the tail, or anywhere."""
    size = len(content)
    where = rng.random()
    if where < 0.5:
        return rng.randrange(min(size, HEAD))
    return rng.randrange(max(0, size - HEAD), size) if where < 0.65 else rng.randrange(size)


def flip_bits(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Flip one to eight bits."""
    for _ in range(rng.randint(1, 8)):
        content[place(rng, content)] ^= 1 << rng.randrange(8)


def run_of_bytes(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Overwrite a run with one value or with noise."""
    start, length = place(rng, content), rng.choice((1, 2, 4, 8, 40, 200))
    length = min(length, len(content) - start)
    content[start : start + length] = (
        rng.randbytes(length) if rng.random() < 0.5 else bytes([rng.choice((0, 255, 32, 48))]) * length
    )


def truncate(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Cut the end off."""
    del content[place(rng, content) :]


def delete_block(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Take a block out."""
    start = place(rng, content)
    del content[start : start + rng.choice((1, 2, 3, 4, 8, 16, 100, 1000))]


def duplicate_block(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Put a block in twice, or somewhere else."""
    start, length = place(rng, content), rng.choice((1, 2, 4, 8, 16, 100, 1000))
    to = start if rng.random() < 0.5 else place(rng, content)
    content[to:to] = content[start : start + length]


def splice(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Go on with the rest of another file of the format, or put a block of it in."""
    theirs = bytearray(other)
    start, source = place(rng, content), place(rng, theirs)
    if rng.random() < 0.5:
        content[start:] = theirs[source:]
    else:
        length = rng.choice((4, 16, 100, 1000))
        content[start : start + length] = theirs[source : source + length]


def integer(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Write a number at a limit of its type, in either byte order, or add a little to what is there."""
    width = rng.choice((1, 2, 4, 8))
    start = place(rng, content)
    if start + width > len(content):
        return
    order: Literal["little", "big"] = rng.choice(("little", "big"))
    value = rng.choice(INTERESTING)
    if rng.random() < 0.3:
        value = int.from_bytes(content[start : start + width], order) + rng.randint(-3, 3)
    content[start : start + width] = (value % (1 << 8 * width)).to_bytes(width, order)


def floating(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Write a floating number that is no ordinary one."""
    value = rng.choice((float("nan"), float("inf"), -1e300, 1e300, 5e-324, 0.0, 1e38))
    packed = struct.pack("<d", value)
    start = place(rng, content)
    if start + 8 <= len(content):
        content[start : start + 8] = packed


def written_number(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Change a number that a text header (or XML) spells out."""
    found = (
        list(_NUMBER.finditer(content, 0, HEAD)) if rng.random() < 0.7 else list(_NUMBER.finditer(content))
    )
    if found:
        match = rng.choice(found)
        content[match.start() : match.end()] = rng.choice(NUMBERS)


def swap_words(rng: random.Random, content: bytearray, other: bytes) -> None:
    """Put one word of the head in another's place: names, types, keywords."""
    words = list(re.finditer(rb"[A-Za-z_]{1,40}", content[:HEAD]))
    if len(words) > 1:
        to, source = rng.sample(words, 2)
        content[to.start() : to.end()] = source.group()


MUTATIONS = (
    flip_bits, run_of_bytes, truncate, delete_block, duplicate_block, splice, integer, integer, floating,
    written_number, swap_words,
)  # fmt: skip


def mutant(corpus: list[Seed], seed: int, index: int) -> tuple[Seed, bytes]:
    """Return the file number `index` of the campaign `seed`, and the whole file it was made from.

    Formats take turns, so each gets its share whatever the number of its seeds.
    """
    names = sorted({whole.format for whole in corpus})
    rng = random.Random(f"{seed}/{index}")
    of_format = [whole for whole in corpus if whole.format == names[index % len(names)]]
    whole, other = rng.choice(of_format), rng.choice(of_format)
    content = bytearray(whole.content)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        rng.choice(MUTATIONS)(rng, content, other.content)
        if not content:
            break
    # A reader that checks sums sees through any damage; mostly they are made right again.
    return whole, repaired(bytes(content)) if rng.random() < 0.8 else bytes(content)
