"""Damage small files at random and read them: whatever is neither a cloud nor an error of one line is found.

    python fuzz/mutate.py --count 100000 --seed 1

Each file follows from the seed and its number. It is read in another process, with a limit of time and of
memory. Files that show something wrong go to fuzz/found/, with what happened and how to repeat it.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Iterator
from multiprocessing.connection import wait
from pathlib import Path

from corpus import Seed, seeds, without_seeds
from mutations import mutant
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from worker import Outcome, work

FOUND = Path(__file__).parent / "found"
TIME_LIMIT = 10.0
START_LIMIT = 60.0


class Worker:
    """A process that reads its share of the files; a new one goes on where it is lost."""

    def __init__(self, corpus: list[Seed], seed: int, indices: range) -> None:
        self.corpus, self.seed, self.indices = corpus, seed, indices
        self.start()

    def start(self) -> None:
        """Start a process on what is left."""
        self.pipe, theirs = multiprocessing.Pipe(duplex=False)
        context = multiprocessing.get_context("spawn")
        arguments = (theirs, self.corpus, self.seed, self.indices)
        self.process = context.Process(target=work, args=arguments, daemon=True)
        self.process.start()
        theirs.close()
        self.ready, self.heard = False, time.monotonic()

    def overdue(self) -> bool:
        """Tell whether the file that is being read takes too long."""
        return time.monotonic() - self.heard > (TIME_LIMIT if self.ready else START_LIMIT)

    def receive(self) -> Outcome | None:
        """Take the next outcome; None if the process only says that it is ready.

        Raises
        ------
        EOFError
            If the process is gone.
        """
        message: Outcome | None = self.pipe.recv()
        self.ready, self.heard = True, time.monotonic()
        return message

    def lost(self, kind: str) -> Outcome:
        """End the process, or what is left of it, and return that as what its file came to."""
        if kind == "hang":
            self.process.kill()
        self.process.join()
        if not self.ready:
            raise RuntimeError(f"a worker did not start (exit code {self.process.exitcode})")
        return Outcome(
            kind, f"no answer in {TIME_LIMIT} s" if kind == "hang" else f"exit code {self.process.exitcode}"
        )


def outcomes(corpus: list[Seed], seed: int, numbers: range, jobs: int) -> Iterator[tuple[int, Outcome]]:
    """Read the files of these numbers in so many processes; give each file's number and outcome."""
    workers = [Worker(corpus, seed, share) for share in (numbers[job::jobs] for job in range(jobs)) if share]
    while workers:
        ready = wait([worker.pipe for worker in workers], timeout=1.0)
        for worker in list(workers):
            result: Outcome | None = None
            if worker.pipe in ready:
                try:
                    result = worker.receive()
                except EOFError:
                    result = worker.lost("crash")
            elif worker.overdue():
                result = worker.lost("hang")
            if result is None:
                continue
            yield worker.indices[0], result
            worker.indices = worker.indices[1:]
            if not worker.indices:
                workers.remove(worker)
            elif result.kind in ("crash", "hang"):
                worker.start()


def keep(corpus: list[Seed], seed: int, number: int, result: Outcome, repeat: str) -> None:
    """Save a file that shows something wrong, and beside it how it came about."""
    FOUND.mkdir(exist_ok=True)
    whole, content = mutant(corpus, seed, number)
    path = FOUND / f"{seed}-{number}{Path(whole.name).suffix}"
    path.write_bytes(content)
    report = {
        "made from": whole.name, "options": whole.options, "what": result.kind, "line": result.line,
        "traceback": result.details.splitlines(), "repeat": repeat,
    }  # fmt: skip
    Path(f"{path}.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def summary(counts: dict[str, Counter[str]]) -> Table:
    """Return the table of what was read, per format."""
    table = Table("format", *(f"{name:>8}" for name in ("files", "read", "refused", "findings")))
    total: Counter[str] = Counter()
    for counter in counts.values():
        total.update(counter)
    for name, counter in (*counts.items(), ("all", total)):
        files, fine = counter.total(), counter["read"] + counter["refused"]
        table.add_row(name, *(f"{n:,}" for n in (files, counter["read"], counter["refused"], files - fine)))
    return table


def read_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=10_000, help="how many files (default: 10000)")
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first, to repeat one (default: 0)"
    )
    parser.add_argument("--seed", type=int, default=1, help="which campaign (default: 1)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default: 2)")
    parser.add_argument("--format", help="this format only, by its name (PLY, text, ...)")
    parser.add_argument("--also", type=Path, help="a folder whose small files are damaged as well")
    arguments = parser.parse_args()
    if arguments.count < 1 or arguments.jobs < 1 or arguments.first < 0:
        parser.error("--count and --jobs start at 1, --first at 0")
    if arguments.also is not None and not arguments.also.is_dir():
        parser.error(f"{arguments.also} is no folder")
    return arguments


def main() -> None:
    """Run a campaign; the exit status is 1 if anything was found."""
    arguments, console = read_arguments(), Console()
    corpus = seeds(arguments.also)
    missing = without_seeds(corpus)
    if arguments.format is not None:
        corpus = [whole for whole in corpus if whole.format.lower() == arguments.format.lower()]
        if not corpus:
            sys.exit(f"there is no file of the format {arguments.format!r} to begin with")
    elif missing:
        console.print(f"no file to begin with: {', '.join(missing)} (give a folder with --also)")
    names = sorted({whole.format for whole in corpus})
    options = "".join(
        f" --{name} {value}" for name in ("format", "also") if (value := getattr(arguments, name))
    )
    console.print(f"seed {arguments.seed}, {len(corpus)} whole files of {len(names)} formats")
    counts: dict[str, Counter[str]] = {name: Counter() for name in names}
    numbers = range(arguments.first, arguments.first + arguments.count)
    begun = time.monotonic()
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("reading", total=len(numbers))
        for number, result in outcomes(corpus, arguments.seed, numbers, arguments.jobs):
            counts[names[number % len(names)]][result.kind] += 1
            progress.advance(task)
            if not result.allowed:
                repeat = f"python fuzz/mutate.py --seed {arguments.seed} --first {number} --count 1{options}"
                keep(corpus, arguments.seed, number, result, repeat)
                console.print(f"{result.kind}: {result.line} [{repeat}]", markup=False, soft_wrap=True)
    seconds = time.monotonic() - begun
    console.print(summary(counts))
    console.print(
        f"{arguments.count:,} files in {seconds:.0f} s ({arguments.count / seconds:.0f} per second)"
    )
    sys.exit(any(kind not in ("read", "refused") for counter in counts.values() for kind in counter))


if __name__ == "__main__":
    main()
