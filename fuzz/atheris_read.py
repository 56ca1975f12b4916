"""Fuzz one format, guided by which lines of surfsig a file reaches; needs `pip install atheris` (Linux).

    python fuzz/atheris_read.py PLY -max_total_time=60

What follows the format (PLY, PCD, text, NPY, NPZ, ...) goes to libFuzzer; inputs that reach new lines are
collected in fuzz/found/inputs. It sees the readers that are written in Python; mutate.py has the others too.
"""

from __future__ import annotations

import contextlib
import sys
import tempfile
import warnings
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["surfsig"]):
    import surfsig

from corpus import Seed, seeds

INPUTS = Path(__file__).parent / "found" / "inputs"


def read_one(content: bytes, path: Path, whole: Seed) -> None:
    """Read a file; any other error than those of `surfsig.read` goes to libFuzzer, which keeps the file."""
    path.write_bytes(content)
    with contextlib.suppress(surfsig.SurfsigError):
        surfsig.read(path, **whole.options)


def main() -> None:
    """Hand the format's whole files to libFuzzer and let it run."""
    corpus = (
        [whole for whole in seeds() if whole.format.lower() == sys.argv[1].lower()] if sys.argv[1:] else []
    )
    if not corpus:
        sys.exit("name a format: " + ", ".join(sorted({whole.format for whole in seeds()})))
    inputs = INPUTS / corpus[0].format
    inputs.mkdir(parents=True, exist_ok=True)
    for whole in corpus:
        (inputs / whole.name).write_bytes(whole.content)
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{Path(corpus[0].name).suffix}"
        libfuzzer = [sys.argv[0], *sys.argv[2:], f"-artifact_prefix={INPUTS.parent}/", str(inputs)]
        atheris.Setup(libfuzzer, lambda content: read_one(content, path, corpus[0]))
        atheris.Fuzz()


if __name__ == "__main__":
    main()
