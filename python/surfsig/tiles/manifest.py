"""What a folder of parts says about itself: how it was made, of which files, and which tiles are done.

A tile is done when its record stands beside its part; both appear whole or not at all. So a run that ended in
any manner goes on with the tiles that have no record, and ``manifest.json`` can always be written anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from surfsig.errors import InvalidInputError
from surfsig.files.atomic import replacing
from surfsig.files.paths import MANIFEST

RECORDS, STORE, PIECES = "records", "store", "pieces"
TABLES = ("surfaces.json", "surfaces.csv", "surfaces.parquet")
VERSION = 1

Record = dict[str, Any]
"""What became of a tile: ``tile``, and either ``part``, ``bytes``, ``sha256`` and more, or ``error``."""


def read_manifest(out: Path) -> dict[str, Any] | None:
    """Read the manifest of a folder; None where there is none.

    Raises
    ------
    InvalidInputError
        If it is none of this library's, or of a later version.
    """
    path = out / MANIFEST
    try:
        values: dict[str, Any] = json.loads(path.read_text())
    except FileNotFoundError:
        return None
    except ValueError:
        raise InvalidInputError(f"{path}: is no manifest of surfsig") from None
    if not isinstance(values, dict) or values.get("surfsig_manifest") != VERSION:
        raise InvalidInputError(f"{path}: is no manifest of surfsig that this version can read")
    return values


def write_manifest(out: Path, values: Mapping[str, Any]) -> None:
    """Write the manifest of a folder."""
    with replacing(out / MANIFEST) as file:
        file.write(json.dumps({"surfsig_manifest": VERSION, **values}, indent=1).encode() + b"\n")


def check_output(
    out: Path, arguments: Mapping[str, Any], inputs: Mapping[str, Any], *, restart: bool
) -> None:
    """Make sure that a run may write into a folder: an empty one, or one that the same run began.

    Raises
    ------
    InvalidInputError
        If the folder is a file, has other files in it, or was begun with other arguments or inputs.
    """
    if out.exists() and not out.is_dir():
        raise InvalidInputError(f"{out}: is a file; tiles need a folder")
    manifest = read_manifest(out) if out.is_dir() else None
    if manifest is None:
        others = [file.name for file in out.iterdir() if file.name not in _OWN] if out.is_dir() else []
        if others:
            raise InvalidInputError(f"{out}: holds other files ({sorted(others)[0]}): give an empty folder")
        return
    if restart:
        return
    for name, value in arguments.items():
        before = manifest["arguments"].get(name)
        if before != json.loads(json.dumps(value)):
            raise InvalidInputError(
                f"{out}: was begun with {name} {_shown(before)}, not {_shown(value)}: give another folder, "
                "or begin anew with --restart (restart=True)"
            )
    changed = _changed(manifest["inputs"], json.loads(json.dumps(inputs)))
    if changed:
        raise InvalidInputError(
            f"{out}: {changed} since this run was begun: give another folder, or begin anew with --restart "
            "(restart=True)"
        )


_OWN = {STORE, RECORDS, PIECES, ".lock"}


def _shown(value: Any) -> str:
    return "none" if value is None else str(value)


def _changed(before: Mapping[str, Any], now: Mapping[str, Any]) -> str | None:
    """Say what differs between the inputs of two runs."""
    old = {file["path"]: file for file in before["files"]}
    new = {file["path"]: file for file in now["files"]}
    for path in new:
        if path not in old:
            return f"the input {path} was added"
        if new[path] != old[path]:
            return f"the input {path} changed"
    for path in old:
        if path not in new:
            return f"the input {path} was left out"
    if list(old) != list(new):
        return "the order of the inputs changed"
    different = [name for name in now if name != "files" and now[name] != before.get(name)]
    return f"how the inputs are read ({', '.join(different)}) changed" if different else None


def record_path(out: Path, tile: int) -> Path:
    """Name the file of a tile's record."""
    return out / RECORDS / f"{tile:06d}.json"


def write_record(out: Path, record: Record) -> None:
    """Write a tile's record."""
    with replacing(record_path(out, record["tile"])) as file:
        file.write(json.dumps(record).encode())


def finished_records(out: Path, tiles: Iterable[int]) -> dict[int, Record]:
    """Read the records of those tiles that are done, whose parts are there in their full length."""
    found = {}
    for tile in tiles:
        try:
            record: Record = json.loads(record_path(out, tile).read_text())
            done = record["part"] is None or (out / record["part"]).stat().st_size == record["bytes"]
        except (OSError, ValueError, KeyError):
            continue
        if done:
            found[tile] = record
    return found


def remove_unfinished(out: Path) -> None:
    """Remove what a killed process had begun to write, once all tiles are done."""
    for folder, pattern in ((out, ".tile_*.tmp"), (out / RECORDS, ".*.tmp")):
        for file in folder.glob(pattern):
            file.unlink(missing_ok=True)


def cleared(out: Path) -> None:
    """Remove the parts, records and the manifest of a run, and nothing else."""
    manifest = read_manifest(out)
    records = out / RECORDS
    names = {record["part"] for record in (manifest or {}).get("tiles", []) if record.get("part")}
    if records.is_dir():
        for file in records.glob("*.json"):
            try:
                part = json.loads(file.read_text()).get("part")
            except (OSError, ValueError):
                part = None
            names |= {part} if part else set()
            file.unlink()
    for name in names:
        # A name from a manifest is that of a file in this very folder.
        (out / Path(name).name).unlink(missing_ok=True)
    remove_pieces(out)
    for name in (*TABLES, MANIFEST):
        (out / name).unlink(missing_ok=True)


def remove_records(out: Path) -> None:
    """Remove the records of all parts, which must be written again."""
    for file in (out / RECORDS).glob("*.json"):
        file.unlink()


def is_new(out: Path, name: str, values: Any) -> bool:
    """Tell whether pieces are being made into something else than a run before made of them, and note it."""
    path = out / PIECES / f"{name}.sha256"
    digest = hashlib.sha256(json.dumps(values).encode()).hexdigest()
    try:
        if path.read_text() == digest:
            return False
    except FileNotFoundError:
        pass
    with replacing(path) as file:
        file.write(digest.encode())
    return True


def remove_pieces(out: Path, *stages: str) -> None:
    """Remove what some stages, or all, have found of tiles; nothing else."""
    folder = out / PIECES
    patterns = [f"{stage}_*.npz" for stage in stages] or ["*.npz", "*.sha256", ".*.tmp"]
    for pattern in patterns:
        for file in folder.glob(pattern):
            file.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        folder.rmdir()
