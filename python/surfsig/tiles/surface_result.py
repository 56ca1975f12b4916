"""The surfaces of a cloud in tiles: which there are, and the parts that say which points are whose."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from surfsig.errors import InvalidInputError
from surfsig.files.atomic import replacing
from surfsig.files.json_text import json_text
from surfsig.point_cloud import PointCloud
from surfsig.shapes.surface import PARAMETERS
from surfsig.surfaces.pipe_runs import find_pipe_runs
from surfsig.surfaces.surface_list import SurfaceList
from surfsig.surfaces.table import table_columns, write_csv
from surfsig.surfaces.wording import summary_of
from surfsig.tiles.dataset import TileDataset
from surfsig.tiles.manifest import TABLES
from surfsig.tiles.surface_parts import TileSurface, surface_of

if TYPE_CHECKING:
    pass


class TileSurfaces(SurfaceList[TileSurface]):
    """The surfaces that `find_surfaces_tiles` found, the one with most points first; a sequence of `Surface`.

    Parameters
    ----------
    folder
        With ``surfaces.json``.

    Attributes
    ----------
    tiles
        The parts, whose points have the columns that `Surfaces.columns` names.
    surfaces
        The surfaces, in the order of their numbers. Of each, ``tiles`` are the numbers of the tiles that have
        some of its points; its members' numbers are not known.

    Raises
    ------
    InvalidInputError
        If there are no surfaces of tiles.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        path = Path(folder) / TABLES[0]
        try:
            values = json.loads(path.read_text())
            self.surfaces: list[TileSurface] = [_from_json(one) for one in values["surfaces"]]
        except FileNotFoundError:
            raise InvalidInputError(f"{folder}: holds no {path.name}") from None
        except (ValueError, KeyError, TypeError):
            raise InvalidInputError(f"{path}: is no table of surfaces of this version") from None
        self.tiles = TileDataset(folder)

    def __repr__(self) -> str:
        return f"TileSurfaces({self.summary()})"

    def summary(self) -> str:
        """Say in words how many surfaces of each kind there are.

        Returns
        -------
        str
            For instance "7 surfaces: 6 planes, 1 sphere; 98.2 % of 12,000 points".
        """
        return _summary(self.surfaces, len(self.tiles))

    def read(self, box: ArrayLike | None = None) -> PointCloud:
        """Read the points in a box with all columns, as `TileDataset.read` does.

        Parameters
        ----------
        box
            (2, 3), its lowest and its highest corner; all points by default.

        Returns
        -------
        PointCloud

        Raises
        ------
        OSError, FileFormatError
            If a part that has points there is missing or broken.
        """
        return self.tiles.read(box)


def write_tables(out: Path, values: Sequence[Mapping[str, Any]], points: int) -> None:
    """Write the tables of the surfaces of a folder of parts.

    Parameters
    ----------
    out
        The folder.
    values
        Of the surfaces, as `surface_of` takes them.
    points
        Of all parts.
    """
    surfaces = [surface_of(one) for one in values]
    write_csv(surfaces, out / TABLES[1])
    _write_parquet(surfaces, out / TABLES[2])
    text = {
        "summary": _summary(surfaces, points),
        "points": points,
        "surfaces": [_to_json(number, surface) for number, surface in enumerate(surfaces)],
        "pipe_runs": [run.to_dict() for run in find_pipe_runs(surfaces)],
    }
    # The last, for it tells that all is written.
    with replacing(out / TABLES[0]) as file:
        file.write(json_text(text, indent=1).encode() + b"\n")


def _write_parquet(surfaces: Sequence[TileSurface], path: Path) -> None:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError:
        return
    columns = {"number": np.arange(len(surfaces)), **table_columns(surfaces)}
    with replacing(path) as file:
        pq.write_table(pa.table(columns), file)


def _to_json(number: int, surface: TileSurface) -> dict[str, Any]:
    more = {"fitted_radius": surface.fitted_radius, "tiles": list(surface.tiles)}
    return {"number": number, **surface.to_dict(), **more}


def _from_json(values: Mapping[str, Any]) -> TileSurface:
    """Take a surface back; what the file does not have, its kind has not."""
    names = [name for name in TileSurface.__dataclass_fields__ if name not in ("members", "points", "tiles")]
    found = {name: np.nan if values.get(name) is None else values[name] for name in names}
    parameters = len(PARAMETERS[values["kind"]])
    shapes = {"axis": (3,), "across": (2, 3), "covariance": (parameters, parameters)}
    for name, shape in shapes.items():
        found[name] = np.broadcast_to(np.array(found[name], np.float64), shape).tolist()
    return surface_of({**found, "points": values["count"], "tiles": values["tiles"]})


def _summary(surfaces: Sequence[TileSurface], points: int) -> str:
    if not surfaces:
        return f"no surface found in {points:,} points"
    share = sum(surface.count for surface in surfaces) / max(points, 1)
    return summary_of(surfaces, share, points)
