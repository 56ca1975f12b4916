"""Models from files: meshes become points of their outer surface."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.errors import InvalidInputError
from surfsig.files import read
from surfsig.point_cloud import PointCloud

MODEL_SUFFIXES = (".ply", ".obj", ".stl", ".off", ".glb", ".gltf", ".pcd", ".xyz", ".npz")
"""Names of files of a folder that are models."""
SURFACE_SAMPLES = 20_000
"""Points spread over a mesh: 2 mm apart on an object of 150 mm."""
_VIEWS = 120
"""Directions from which it is tried whether a point can be seen: 20 degrees apart."""
_LEAST_VIEWS = 5
"""Of these, how many see a point of the outer surface at least: chance gaps between points let one or two see
what is inside."""
_NEIGHBOURS = 8
"""Neighbours within a spacing, so that points by chance leave hardly a gap."""
_WIDEST = 0.9
"""Quantile of the points' spacings that counts: inner parts may be denser."""
_ONE_SIDE = 0.5
"""Share by which more is seen of one side of a point than of the other, so that it is the outer one."""
_NORMALS = ("nx", "ny", "nz")


def read_model(path: str | Path, *, samples: int | None = None, **reading: Any) -> PointCloud:
    r"""Read a model for `find_instances` or a `Library`: a mesh becomes points of its outer surface.

    Of a mesh, points are spread over the faces, and those are left out that no sensor sees from anywhere, as
    of parts inside; their normals are on the outer side. A cloud keeps its points.

    Parameters
    ----------
    path
        The file, as `surfsig.read` takes it.
    samples
        Points that are spread over a mesh; 20,000 by default, 2 mm apart on an object of 150 mm. Then a cloud
        is refused.
    **reading
        Other options of `surfsig.read`, such as `unit`.

    Returns
    -------
    PointCloud
        With the fields nx, ny and nz of a mesh.

    Raises
    ------
    OSError, FileFormatError, InvalidInputError
        As `surfsig.read`.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import surfsig
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "corner.obj")
    ...     lines = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1", "f 1 3 2", "f 1 2 4", "f 1 4 3"]
    ...     written = file.write_text("\n".join([*lines, ""]))
    ...     model = surfsig.read_model(file, samples=500)
    >>> sorted(model.fields)
    ['nx', 'ny', 'nz']
    """
    if samples is not None:
        return outer_surface(read(path, samples=samples, **reading))
    try:
        mesh = read(path, samples=SURFACE_SAMPLES, **reading)
    except InvalidInputError:
        # It is no mesh, or one without faces.
        return read(path, **reading)
    return outer_surface(mesh)


def read_models(paths: Iterable[str | Path], **reading: Any) -> Iterator[tuple[str, PointCloud]]:
    """Read the models of files and folders one after the other, each named by its file without the ending.

    Parameters
    ----------
    paths
        Files, and folders, of which each file of a kind that can be a model is one.
    **reading
        Options of `read_model`.

    Yields
    ------
    name, cloud
        The model's name, and its cloud as `read_model` gives it; those of a folder in the order of their
        names.

    Raises
    ------
    InvalidInputError
        If a folder has no model, or two files have one name; before any is read.
    OSError, FileFormatError
        As `surfsig.read`.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import surfsig
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     surfsig.write(Path(folder, "cup.ply"), np.random.default_rng(0).normal(size=(100, 3)))
    ...     models = dict(surfsig.read_models([folder]))
    >>> list(models)
    ['cup']
    """
    files = _model_files(map(Path, paths))
    return ((name, read_model(file, **reading)) for name, file in files.items())


def _model_files(paths: Iterable[Path]) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for path in paths:
        files = [path]
        if path.is_dir():
            files = sorted(file for file in path.iterdir() if file.suffix.lower() in MODEL_SUFFIXES)
            if not files:
                raise InvalidInputError(f"{path}: a folder without models ({', '.join(MODEL_SUFFIXES)})")
        for file in files:
            if file.stem in found:
                raise InvalidInputError(f"{file}: has the same name as {found[file.stem]}")
            found[file.stem] = file
    return found


def outer_surface(cloud: PointCloud) -> PointCloud:
    """Leave out the points of a whole object that no sensor sees from anywhere, as of parts inside.

    A point counts as seen where nothing is before it from a few of many directions that are spread over the
    sphere. Its normal, if it has one, is turned to the side from which it is seen; where that is both, it
    stays.
    """
    finite = cloud.at(np.flatnonzero(cloud.finite))
    if len(finite) == 0:
        return finite
    points = np.ascontiguousarray(finite.points - finite.points.mean(axis=0), np.float64)
    distances = (
        scipy.spatial.cKDTree(points).query(points, k=[_NEIGHBOURS + 1])[0]
        if len(points) > _NEIGHBOURS
        else [0.0]
    )
    spacing = float(np.quantile(distances, _WIDEST))
    if spacing == 0.0:
        return finite
    views = np.zeros(len(points), np.int64)
    towards, total = np.zeros(len(points)), np.zeros(len(points))
    has_normals = all(name in finite.fields for name in _NORMALS)
    normals = np.stack([finite.fields[name] for name in _NORMALS], axis=1) if has_normals else None
    for direction in _directions():
        u = np.cross(direction, [1.0, 0.0, 0.0] if abs(direction[0]) < 0.9 else [0.0, 1.0, 0.0])
        u /= np.linalg.norm(u)
        across = [u.tolist(), np.cross(direction, u).tolist()]
        visible = ~_surfsig.hidden_from(direction.tolist(), across, points, points, spacing)
        views += visible
        if normals is not None:
            cosine = np.where(visible, normals @ direction, 0.0)
            towards += cosine
            total += np.abs(cosine)
    seen = views >= _LEAST_VIEWS
    kept = finite.at(np.flatnonzero(seen))
    if normals is not None:
        side = np.where(towards < -_ONE_SIDE * total, -1.0, 1.0)[seen]
        fields = dict(kept.fields)
        for axis, name in enumerate(_NORMALS):
            fields[name] = (side * normals[seen, axis]).astype(np.float32)
        kept = PointCloud(kept.offsets, origin=kept.origin, fields=fields)
    return kept


def _directions() -> NDArray[np.float64]:
    """Give unit vectors spread over the sphere by the golden angle."""
    number = np.arange(_VIEWS)
    z = 1.0 - (2 * number + 1) / _VIEWS
    angle = np.pi * (3.0 - np.sqrt(5.0)) * number
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
