"""What headers alone say of a folder: of LAS, LAZ and COPC files, or of tiles by `surfsig extract`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from surfsig.cli.console import number, size_text

Summary = tuple[dict[str, Any], list[tuple[str, str]]]
"""For a program, and for a person."""


def summary_of_many(path: Path) -> Summary | None:
    """Look at the headers of several files; None where the path is one file, or a header does not say enough.

    Raises
    ------
    OSError, FileFormatError
        If a header cannot be read.
    """
    import surfsig
    from surfsig.files.paths import MANIFEST, files_meant

    if (path / MANIFEST).is_file():
        return _of_tiles(surfsig.TileDataset(path))
    files = files_meant(path)
    if files is None or not _all_las(files):
        return None
    return _of_files(surfsig.FileDataset(files))


def _all_las(files: list[Path]) -> bool:
    for file in files:
        if file.is_dir():
            return False
        with file.open("rb") as opened:
            if opened.read(4) != b"LASF":
                return False
    return True


def _of_files(files: Any) -> Summary:
    headers, bounds = files.headers, files.bounds
    size = sum(os.path.getsize(file) for file in files.files)
    common = [name for name in headers[0].fields if all(name in header.fields for header in headers)]
    systems = {
        header.coordinate_system.name or "without a name" for header in headers if header.coordinate_system
    }
    values: dict[str, Any] = {
        "files": len(headers),
        "bytes": size,
        "copc_files": sum(header.is_copc for header in headers),
        "points": files.points,
        "minimum": None if bounds is None else bounds[0],
        "maximum": None if bounds is None else bounds[1],
        "coordinate_systems": sorted(systems),
        "fields": common,
    }
    copc = f", {values['copc_files']} of them COPC" if values["copc_files"] else ""
    rows = [
        ("files", f"{len(headers):,} files{copc}, {size_text(size)}; from their headers alone"),
        ("points", f"{files.points:,}"),
    ]
    if bounds is not None:
        rows += _extent(bounds)
        area = float((bounds[1] - bounds[0])[0] * (bounds[1] - bounds[0])[1])
        if area > 0:
            rows.append(("density", f"{number(files.points / area)} per square unit of the box, at least"))
    rows.append(("coordinate system", ", ".join(sorted(systems)) or "not known"))
    rows.append(("fields", ", ".join(common) or "none"))
    return values, rows


def _of_tiles(tiles: Any) -> Summary:
    manifest, records = tiles.manifest, tiles.manifest["tiles"]
    missing = [part for part in tiles.tiles if part.error is not None]
    status = tiles.status_counts()
    values: dict[str, Any] = {
        "tiles": len(tiles.tiles),
        "missing_tiles": len(missing),
        "points": len(tiles),
        "points_of_input": manifest["points"],
        "bytes": sum(record.get("bytes", 0) for record in records),
        "bounds": manifest["bounds"],
        "arguments": manifest["arguments"],
        "inputs": [file["path"] for file in manifest["inputs"]["files"]],
        "unreadable": manifest["unreadable"],
        "status": status,
    }
    asked = ", ".join(f"{name} {value}" for name, value in manifest["arguments"].items() if value is not None)
    rows = [
        ("tiles", f"{len(tiles.tiles):,} tiles, {size_text(values['bytes'])}"),
        ("points", f"{len(tiles):,} of {manifest['points']:,}"),
        ("extracted with", asked),
        ("inputs", f"{len(values['inputs']):,} files, the first {values['inputs'][0]}"),
    ]
    if missing:
        rows.append(("missing", f"{len(missing):,} tiles: {missing[0].error}"))
    if manifest["bounds"] is not None:
        rows += _extent(manifest["bounds"])
    rows += [(name.replace("_", " "), f"{count:,}") for name, count in status.items()]
    return values, rows


def _extent(bounds: Any) -> list[tuple[str, str]]:
    return [
        (axis, f"{low:.12g} to {high:.12g}")
        for axis, low, high in zip("xyz", bounds[0], bounds[1], strict=True)
    ]
