"""`Library`: models in one file, prepared to be found."""

from __future__ import annotations

import io
import sqlite3
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import closing, contextmanager
from datetime import datetime, timezone
from os import PathLike, fspath
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.field import FieldSignatures
from surfsig.files.options import UNITS
from surfsig.finding.model import Model, model_of
from surfsig.point_cloud import PointCloud

_MARK = 0x53534C42
"""SQLite's application id of such a file: "SSLB"."""
_VERSION = 3
"""Models of version 1 had signatures of one radius: they are prepared again when they are looked for. Those
of version 2 have no brief part: they are read as a whole in its place."""
_MODELS = """
CREATE TABLE models (
    name TEXT PRIMARY KEY, added TEXT NOT NULL, unit TEXT, points INTEGER NOT NULL, radius REAL NOT NULL,
    spacing REAL NOT NULL, sided INTEGER NOT NULL, size INTEGER NOT NULL, arrays BLOB NOT NULL
)
"""
_BRIEFS = "CREATE TABLE IF NOT EXISTS briefs (name TEXT PRIMARY KEY, arrays BLOB NOT NULL)"
"""What tells whether a model may be in a scene is read of every model: so it is apart, and not compressed."""
_SIGNATURES = ("points", "vectors", "axes", "tangents", "phases", "count", "status")
_LARGEST = 1 << 32
"""Bytes that a model may take."""


class LibraryEntry(NamedTuple):
    """What a library says about a model."""

    name: str
    added: str
    """When, in UTC: ISO 8601."""
    unit: str | None
    """Of its coordinates, as somebody said."""
    points: int
    radius: float
    """Of the smallest patches that it is described by."""
    spacing: float
    """Between its points."""


class Library:
    """Models in one SQLite file, each with its points and field signatures: `find_instances` opens it.

    A change is made as a whole or not at all, also when the process ends in between; several processes may
    read while one writes.

    Parameters
    ----------
    path
        The file; it is made by the first `add`.

    Raises
    ------
    FileFormatError
        If there is a file that is no library, or one of a newer version.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = Path(fspath(path))
        if self.path.exists():
            with self._opened():
                pass

    def __repr__(self) -> str:
        return f"Library({str(self.path)!r}, {len(self)} models)"

    def __len__(self) -> int:
        """Return the number of models."""
        return len(self.names())

    def add(
        self,
        name: str,
        model: PointCloud | ArrayLike,
        *,
        unit: str | None = None,
        replace: bool = False,
        threads: int | None = None,
    ) -> LibraryEntry:
        """Prepare a model and keep it.

        Parameters
        ----------
        name
            One line of text.
        model
            As `find_instances` takes it.
        unit
            Of its coordinates ("m", "mm", ...), for people: nothing is scaled.
        replace
            Whether it may take the place of one of this name.
        threads
            Number of threads; all cores by default.

        Returns
        -------
        LibraryEntry

        Raises
        ------
        InvalidInputError
            If the name is taken or no line of text, the unit unknown, or the model has no points.
        FileFormatError
            If the file is no library.
        """
        if not isinstance(name, str) or not name.strip() or not name.isprintable():
            raise InvalidInputError("a model's name must be a line of text")
        if unit is not None and unit not in UNITS:
            raise InvalidInputError(f"unit must be one of {', '.join(UNITS)}, not {unit!r:.40}")
        if not replace and name in self.names():
            raise self._taken(name)
        prepared = model_of(model, threads=threads)
        added = datetime.now(timezone.utc).isoformat(timespec="seconds")
        whole, brief = _stored(prepared), _stored(prepared.brief())
        entry = LibraryEntry(name, added, unit, len(prepared.points), prepared.radius, prepared.spacing)
        with self._opened(create=True) as store:
            verb = "INSERT OR REPLACE" if replace else "INSERT"
            row = (*entry, prepared.is_sided, len(whole), zlib.compress(whole, 1))
            try:
                store.execute(f"{verb} INTO models VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", row)
                store.execute("INSERT OR REPLACE INTO briefs VALUES (?, ?)", (name, brief))
            except sqlite3.IntegrityError:
                raise self._taken(name) from None
        return entry

    def list(self) -> list[LibraryEntry]:
        """Tell what is in it, by name.

        Returns
        -------
        list of LibraryEntry
            Empty where the file does not exist.

        Raises
        ------
        FileFormatError
            If the file is damaged.
        """
        if not self.path.exists():
            return []
        with self._opened() as store:
            rows = store.execute(
                "SELECT name, added, unit, points, radius, spacing FROM models ORDER BY name"
            )
            return [LibraryEntry(*row) for row in rows]

    def names(self) -> tuple[str, ...]:
        """Give the models' names.

        Returns
        -------
        Sorted.
        """
        return tuple(entry.name for entry in self.list())

    def remove(self, name: str) -> None:
        """Take a model out.

        Parameters
        ----------
        name
            The model's.

        Raises
        ------
        InvalidInputError
            If there is none of this name.
        """
        if not self.path.exists():
            raise self._missing(name)
        with self._opened() as store:
            if not store.execute("DELETE FROM models WHERE name = ?", (name,)).rowcount:
                raise self._missing(name)
            if _has_briefs(store):
                store.execute("DELETE FROM briefs WHERE name = ?", (name,))

    def get(self, name: str) -> PointCloud:
        """Give a model's points.

        Parameters
        ----------
        name
            The model's.

        Returns
        -------
        PointCloud
            The finite ones, in the coordinates that they were added in.

        Raises
        ------
        InvalidInputError
            If there is none of this name.
        FileFormatError
            If the file is damaged.
        """
        model = stored_model(self, name)
        return PointCloud(model.points, origin=model.center)

    @contextmanager
    def _opened(self, create: bool = False) -> Iterator[sqlite3.Connection]:
        """Open the file for one transaction."""
        if not create and not self.path.exists():
            raise FileFormatError(f"{self.path}: no such library")
        try:
            with closing(sqlite3.connect(self.path, timeout=30.0)) as store, store:
                mark, version = (
                    store.execute(f"PRAGMA {what}").fetchone()[0]
                    for what in ("application_id", "user_version")
                )
                tables = store.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
                if create and not tables and mark == 0:
                    store.execute(_MODELS)
                    store.execute(_BRIEFS)
                    store.execute(f"PRAGMA application_id = {_MARK}")
                    store.execute(f"PRAGMA user_version = {_VERSION}")
                elif mark != _MARK:
                    raise FileFormatError(f"{self.path}: not a library of models")
                elif create and version < _VERSION:
                    # What older versions cannot read is about to be written.
                    store.execute(_BRIEFS)
                    store.execute(f"PRAGMA user_version = {_VERSION}")
                elif version > _VERSION:
                    raise FileFormatError(
                        f"{self.path}: a library of version {version}; this knows {_VERSION}"
                    )
                yield store
        except sqlite3.IntegrityError:
            raise
        except sqlite3.DatabaseError as error:
            raise FileFormatError(f"{self.path}: not a library of models, or damaged: {error}") from None

    def _taken(self, name: str) -> InvalidInputError:
        return InvalidInputError(f"{self.path}: there is a model {name!r} already")

    def _missing(self, name: str) -> InvalidInputError:
        return InvalidInputError(f"{self.path}: there is no model {name!r}")


def stored_model(library: Library, name: str, is_brief: bool = False) -> Model:
    """Give a model as `find_instances` takes it, or what `Model.brief` has; errors as of `Library.get`."""
    rows: list[tuple[Any, ...]] = []
    briefs: list[tuple[bytes]] = []
    if library.path.exists():
        with library._opened() as store:
            if is_brief and _has_briefs(store):
                briefs = store.execute("SELECT arrays FROM briefs WHERE name = ?", (name,)).fetchall()
            columns = "radius, spacing, sided" if briefs else "radius, spacing, sided, size, arrays"
            rows = store.execute(f"SELECT {columns} FROM models WHERE name = ?", (name,)).fetchall()
    if not rows:
        raise library._missing(name)
    try:
        radius, spacing, is_sided, *packed = rows[0]
        content = briefs[0][0] if briefs else _decompressed(*packed)
        return _model(content, radius, spacing, bool(is_sided))
    except (ValueError, KeyError, TypeError, zlib.error, zipfile.BadZipFile):
        raise FileFormatError(f"{library.path}: the model {name!r} is damaged") from None


def _has_briefs(store: sqlite3.Connection) -> bool:
    query = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = 'briefs'"
    return bool(store.execute(query).fetchone()[0])


def _stored(model: Model) -> bytes:
    arrays: dict[str, NDArray[Any]] = {
        "points": model.points,
        "middle": model.center,
        "places": model.samples,
        "normals": model.normals,
    }
    for number, signatures in enumerate((model.signatures, *model.larger_signatures)):
        arrays[f"radius_{number}"] = np.array(signatures.radius)
        arrays |= {f"signature_{number}_{name}": getattr(signatures, name) for name in _SIGNATURES}
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays)
    return file.getvalue()


def _decompressed(size: int, packed: bytes) -> bytes:
    if not 0 < size <= min(_LARGEST, 1100 * len(packed)):
        raise ValueError("a size that the data cannot have")
    content = zlib.decompressobj().decompress(packed, size)
    if len(content) != size:
        raise ValueError("shorter than it was")
    return content


def _model(content: bytes, radius: float, spacing: float, is_sided: bool) -> Model:
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        whole = (arrays[name] for name in ("points", "middle", "places", "normals"))
        points, center, samples, normals = whole
        if "radius_0" not in arrays:
            return model_of(PointCloud(points, origin=center))
        signatures: list[FieldSignatures] = []
        while f"radius_{len(signatures)}" in arrays:
            number = len(signatures)
            known = {name: arrays[f"signature_{number}_{name}"] for name in _SIGNATURES}
            own = float(arrays[f"radius_{number}"])
            signatures.append(FieldSignatures(radius=own, oriented=True, indices=None, **known))
    first, *larger = signatures
    return Model(points, center, spacing, radius, samples, normals, first, tuple(larger), is_sided)
