"""Where instances of models are in a scene: `find_instances`; and models in a file: `Library`."""

from surfsig.finding.instances import Instance, Instances
from surfsig.finding.library import Library, LibraryEntry
from surfsig.finding.search import find_instances

__all__ = ["Instance", "Instances", "Library", "LibraryEntry", "find_instances"]
