"""What there is to be cut into tiles: files, with what tells whether they are still the same."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from surfsig.files.options import box_array
from surfsig.files.paths import Paths, files_meant
from surfsig.files.read_file import ReadOptions


@dataclass(frozen=True)
class Source:
    """The files of one cloud.

    Attributes
    ----------
    files
        In the order in which `surfsig.read` joins them.
    options
        How they are read.
    """

    files: tuple[Path, ...]
    options: ReadOptions = field(default_factory=ReadOptions)

    @classmethod
    def of(cls, paths: Paths, options: ReadOptions | None = None) -> Source:
        """Find the files that a path, a folder, a pattern or several of them mean.

        Raises
        ------
        OSError, FileFormatError, InvalidInputError
            As `surfsig.read`.
        """
        files = files_meant(paths)
        if files is None:
            files = [Path(paths)]  # type: ignore[arg-type]
        return cls(tuple(file.absolute() for file in files), options or ReadOptions())

    @property
    def size(self) -> int:
        """Bytes of all files."""
        return sum(file.stat().st_size for file in self.files)

    def fingerprint(self) -> dict[str, Any]:
        """Tell names, sizes and times of the files, and how they are read, for JSON."""
        stats = [(file, file.stat()) for file in self.files]
        box = self.options.box
        return {
            "files": [
                {"path": str(file), "bytes": stat.st_size, "modified_ns": stat.st_mtime_ns}
                for file, stat in stats
            ],
            "unit": self.options.unit,
            "box": None if box is None else box_array(box).tolist(),
            **self.options.of_formats(),
        }
