"""Clouds of any size: cut into tiles, and worked on tile by tile, here or on a cluster.

Files are looked at once (`survey`, `cell_counts`), cut into half-open boxes of equally many points (`plan`)
and binned into a store (`binning`, `store`, `rows`). A task reads its tile with a halo, works and writes its
part (`task`); parts and records are the state to go on from (`manifest`). `run` gives tasks to this process
or to Dask; `dataset` reads what came of them.
"""

from surfsig.tiles.dataset import FileDataset, TileDataset, TilePart, open
from surfsig.tiles.extraction import extract_tiles
from surfsig.tiles.job import TileProgress, TilesFailedError
from surfsig.tiles.mapping import map_tiles
from surfsig.tiles.surface_parts import TileSurface
from surfsig.tiles.surface_result import TileSurfaces
from surfsig.tiles.surfaces import find_surfaces_tiles

__all__ = [
    "FileDataset",
    "TileDataset",
    "TilePart",
    "TileProgress",
    "TileSurface",
    "TileSurfaces",
    "TilesFailedError",
    "extract_tiles",
    "find_surfaces_tiles",
    "map_tiles",
    "open",
]
