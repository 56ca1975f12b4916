"""Well-known text (WKT) of coordinate systems, versions 1 and 2: what the axes measure, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

_LONGEST = 1 << 20
_DEEPEST = 64
_TOKEN = re.compile(r'\s*(?:"((?:[^"]|"")*)"|([A-Za-z0-9_.+\-:]+)|([\[\](),]))')

_HORIZONTAL = {
    "PROJCS", "PROJCRS", "PROJECTEDCRS", "DERIVEDPROJCRS", "GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS",
    "GEODETICCRS", "GEOCCS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS",
}  # fmt: skip
_VERTICAL = {"VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"}
_GEOGRAPHIC = {"GEOGCS", "GEOGCRS", "GEOGRAPHICCRS"}
_GEODETIC = {"GEODCRS", "GEODETICCRS"}
_UNITS = {"UNIT", "LENGTHUNIT", "ANGLEUNIT"}
# Around a system: another one it is bound to, or the moment at which it holds.
_AROUND = {"BOUNDCRS": "SOURCECRS", "SOURCECRS": "", "COORDINATEMETADATA": ""}


@dataclass
class Node:
    """A keyword with what stands in its brackets.

    Attributes
    ----------
    keyword
        In upper case.
    words
        Texts and numbers.
    nodes
        Keywords with brackets of their own.
    """

    keyword: str
    words: list[str] = field(default_factory=list)
    nodes: list[Node] = field(default_factory=list)

    def first(self, *keywords: str) -> Node | None:
        """Give the first node inside with one of these keywords."""
        return next((node for node in self.nodes if node.keyword in keywords), None)


@dataclass(frozen=True)
class Described:
    """What a text says.

    Attributes
    ----------
    name
        Of the whole system; None if the text is broken.
    is_geographic
        Its axes are latitude and longitude.
    horizontal, vertical
        Name of the unit and its size in metres or radians; None where the text does not say.
    """

    name: str | None
    is_geographic: bool
    horizontal: tuple[str, float] | None
    vertical: tuple[str, float] | None


def describe(text: str) -> Described:
    """Say what the axes of a coordinate system measure.

    The units are those of the system itself: a projected one has another system inside, in degrees.
    """
    roots = [_unwrapped(root) for root in _roots(text)]
    systems = [part for root in roots for part in _parts(root)]
    level = next((system for system in systems if system.keyword in _HORIZONTAL), None)
    height = next((system for system in systems if system.keyword in _VERTICAL), None)
    name = roots[0].words[0] if roots and roots[0].words else None
    if level is None:
        return Described(name, False, None, None if height is None else _unit(height, 0))
    vertical = _unit(level, 2) if height is None else _unit(height, 0)
    return Described(name, _is_geographic(level), _unit(level, 0), vertical)


def _is_geographic(system: Node) -> bool:
    if system.keyword in _GEOGRAPHIC:
        return True
    # A geodetic system is geocentric where its axes are Cartesian.
    axes = system.first("CS")
    return (
        system.keyword in _GEODETIC
        and axes is not None
        and bool(axes.words)
        and axes.words[0].lower() == "ellipsoidal"
    )


def _unit(system: Node, axis: int) -> tuple[str, float] | None:
    """Give the unit of an axis: its own, or the one of all axes."""
    axes = [node for node in system.nodes if node.keyword == "AXIS"]
    if axis >= len(axes) and axis > 0:
        return None
    for node in ([axes[axis]] if axis < len(axes) else []) + [system]:
        unit = node.first(*_UNITS)
        if unit is not None and len(unit.words) >= 2:
            try:
                return unit.words[0], float(unit.words[1])
            except ValueError:
                return None
    return None


def _parts(system: Node) -> list[Node]:
    """Give the systems that a compound one is made of; any other is itself its only part."""
    if system.keyword in ("COMPD_CS", "COMPOUNDCRS"):
        return [_unwrapped(node) for node in system.nodes]
    return [system]


def _unwrapped(node: Node) -> Node:
    for _ in range(_DEEPEST):
        if node.keyword not in _AROUND:
            break
        wanted = _AROUND[node.keyword]
        inner = node.first(wanted) if wanted else next(iter(node.nodes), None)
        if inner is None:
            break
        node = inner
    return node


def _roots(text: str) -> list[Node]:
    """Read the nodes of a text; none if it is broken, too long or too deep.

    Several nodes side by side, a horizontal and a vertical system, are Esri's way.
    """
    top = Node("")
    path = [top]
    word: str | None = None
    for token, quoted in _tokens(text[:_LONGEST]):
        if token in ("[", "(") and not quoted:
            if word is None or len(path) > _DEEPEST:
                return []
            node = Node(word.upper())
            path[-1].nodes.append(node)
            path.append(node)
            word = None
        elif token in ("]", ")", ",") and not quoted:
            if word is not None:
                path[-1].words.append(word)
            word = None
            if token != ",":
                path.pop()
                if not path:
                    return []
        else:
            word = token
    return top.nodes if len(path) == 1 else []


def _tokens(text: str) -> Iterator[tuple[str, bool]]:
    """Give words, brackets and commas, each with whether it stood in quotes."""
    place = 0
    text = text.rstrip()
    while place < len(text):
        found = _TOKEN.match(text, place)
        if found is None:
            # What is no token makes the brackets not add up.
            yield "]", False
            return
        place = found.end()
        if found[1] is not None:
            yield found[1].replace('""', '"'), True
        else:
            yield found[2] or found[3], False
