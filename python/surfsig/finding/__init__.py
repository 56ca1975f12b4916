"""Where instances of models are in a scene: `find_instances`; models of files, and in one file: `Library`."""

from surfsig.finding.instances import Instance, Instances
from surfsig.finding.library import Library, LibraryEntry
from surfsig.finding.model_files import read_model, read_models
from surfsig.finding.search import find_instances

__all__ = [
    "Instance",
    "Instances",
    "Library",
    "LibraryEntry",
    "find_instances",
    "read_model",
    "read_models",
]
