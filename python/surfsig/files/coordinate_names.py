"""Which columns are the coordinates, by their names: x y z, X [m], Points:0, pos_x, Easting Northing."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from dataclasses import dataclass

from surfsig.errors import FileFormatError, SurfsigError
from surfsig.files.options import UNITS

# As programs write units, and as `surfsig.read` calls them. "m" and the like in brackets is the usual case.
_UNITS = {
    "mm": "mm", "millimeter": "mm", "millimetre": "mm", "millimeters": "mm", "millimetres": "mm",
    "cm": "cm", "centimeter": "cm", "centimetre": "cm", "centimeters": "cm", "centimetres": "cm",
    "m": "m", "meter": "m", "metre": "m", "meters": "m", "metres": "m",
    "km": "km", "kilometer": "km", "kilometre": "km", "kilometers": "km", "kilometres": "km",
    "in": "in", "inch": "in", "inches": "in",
    "ft": "ft", "feet": "ft", "foot": "ft",
    "us-ft": "us-ft", "usft": "us-ft", "us ft": "us-ft", "ftus": "us-ft",
    "um": "µm", "µm": "µm", "μm": "µm", "micron": "µm", "microns": "µm", "nm": "nm",
}  # fmt: skip
_DEGREES = frozenset({"deg", "degree", "degrees", "°", "dd"})
# What else stands in a line of units.
_OTHER_UNITS = frozenset(
    {
        "", "-", "s", "sec", "ms", "us", "ns", "rad", "%", "m/s", "db", "dbm", "counts", "dn", "a.u.", "au",
        "unitless",
    }
)  # fmt: skip
_BRACKETED = re.compile(r"\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\{([^}]*)\}|<([^>]*)>)\s*$")
_BEHIND_SLASH = re.compile(r"\s*(?:/|\bin\b)\s*([a-z°][a-z° -]*)$")
_BEHIND_BLANK = re.compile(r"[ _]([a-z]+)$")
_SEPARATORS = re.compile(r"[\s_.:,/\-]+")
# Ouster writes X1, Y1, Z1, and X2, Y2, Z2 for the second return.
_NUMBERED_AXIS = re.compile(r"([xyz])(\d{1,2})")

_EAST = frozenset({"easting", "eastings", "east", "rechtswert", "ostwert"})
_NORTH = frozenset({"northing", "northings", "north", "hochwert", "nordwert"})
_HEIGHT = frozenset(
    {
        "elevation", "elev", "ele", "height", "altitude", "alt", "h", "up", "u", "level", "hoehe", "höhe",
        "ellipsoidal height", "ellipsoid height", "orthometric height",
    }
)  # fmt: skip
_LONGITUDE = frozenset({"longitude", "lon", "long", "lng"})
_LATITUDE = frozenset({"latitude", "lat"})
# Words beside an axis that say no more than that it is a coordinate.
_PLACE_WORDS = frozenset(
    {
        "pos", "position", "coord", "coords", "coordinate", "coordinates", "point", "points", "pt", "p",
        "loc", "location", "place", "vertex", "cartesian", "xyz", "utm", "world", "global", "local", "map",
        "geometry", "center", "centre", "centroid", "pose",
    }
)  # fmt: skip
_AXES = {"x": 0, "y": 1, "z": 2}
_NUMBERS = {"0": 0, "1": 1, "2": 2}

# Which kinds of names win over others: x, y, z whatever else is there; degrees only if nothing else is.
_EXACT, _NAMED_AXES, _PLACES, _LETTERS, _ANGLES = range(5)


@dataclass(frozen=True)
class Coordinates:
    """The columns that are the coordinates.

    Attributes
    ----------
    names
        Of x, y and z, as the columns are called.
    unit
        The unit that their names give, as `surfsig.read` calls it; None if they give none.
    degrees
        They are longitude and latitude.
    """

    names: tuple[str, str, str]
    unit: str | None = None
    degrees: bool = False


def coordinates_of(
    names: Iterable[str], source: str, error: type[SurfsigError] = FileFormatError
) -> Coordinates | None:
    """Find the coordinates among columns by their names, in any case.

    Names x, y and z win; then those with a unit behind (X [mm], x(m)) or with a height for z; then words of
    place beside an axis (pos_x, x_coord, Points:0) or directions (Easting); then E, N; then longitude and
    latitude.

    Returns
    -------
    Coordinates or None
        None if no three names are coordinates.

    Raises
    ------
    error
        If several columns may be the same coordinate, or the coordinates differ in their unit.
    """
    found: dict[tuple[int, str], tuple[list[str], list[str], list[str]]] = {}
    units: dict[str, str | None] = {}
    for name in names:
        plain, units[name] = _without_unit(name)
        for rank, family, axis in _readings(name, plain):
            found.setdefault((rank, family), ([], [], []))[axis].append(name)
    if all(found.get((_NAMED_AXES, ""), ([],))):
        # Beside x, y and z, a height is another column.
        found.pop((_NAMED_AXES, "axes and height"), None)
    whole = {key: axes for key, axes in found.items() if all(axes)}
    if not whole:
        return None
    best = min(rank for rank, _ in whole)
    families = [axes for (rank, _), axes in whole.items() if rank == best]
    # Of equal names the first counts, as everywhere; of different ones nobody can say which is meant.
    several = [axes for axes in families if any(len(candidates) > 1 for candidates in axes)]
    if len(families) > 1 or (several and best != _EXACT):
        candidates = dict.fromkeys(name for axes in families for axis in axes for name in axis)
        raise error(
            f"{source}: several columns may be the coordinates ({', '.join(candidates)}): three of them must "
            "be called x, y and z (for text, by columns=)"
        )
    chosen = tuple(candidates[0] for candidates in families[0])
    lengths = chosen if best != _ANGLES else chosen[2:]
    said = {unit for name in lengths if (unit := units[name]) is not None}
    if len(said) > 1:
        raise error(f"{source}: the coordinates have several units by their names ({', '.join(chosen)})")
    return Coordinates((chosen[0], chosen[1], chosen[2]), next(iter(said), None), best == _ANGLES)


def warn_of_units(coordinates: Coordinates, source: str, asked: str | None = None) -> None:
    """Warn where coordinates are no lengths in metres by their names.

    Parameters
    ----------
    coordinates
        The columns.
    source
        The file's name.
    asked
        The unit that the caller says they have.

    Warns
    -----
    UserWarning
        If they are in degrees, or in another unit than metres and the one that the caller says.
    """
    if coordinates.degrees:
        longitude, latitude, _ = coordinates.names
        warnings.warn(
            f"{source}: x and y are '{longitude}' and '{latitude}' in degrees, which are no lengths: project "
            "them to metres first",
            stacklevel=3,
        )
    elif coordinates.unit not in (None, asked) and (asked is not None or coordinates.unit != "m"):
        done = "are kept so" if asked is None else f"are taken as {asked}"
        hint = f': unit="{coordinates.unit}" gives metres' if coordinates.unit in UNITS else ""
        warnings.warn(
            f"{source}: the coordinates are in {coordinates.unit} by their names ('{coordinates.names[0]}') "
            f"and {done}{hint}",
            stacklevel=3,
        )


def with_unit(name: str, word: str) -> str:
    """Put a unit of length from a line below the names behind a name that gives none."""
    unit = word.strip().strip("[](){}<>").strip().lower()
    return f"{name} [{unit}]" if unit in _UNITS and _without_unit(name)[1] is None else name


def is_unit(word: str) -> bool:
    """Tell whether a word is no more than a unit of a column: m, [mm], (s), deg, -, or nothing."""
    plain = word.strip().strip("[](){}<>").strip().lower()
    return plain in _UNITS or plain in _DEGREES or plain in _OTHER_UNITS


def _without_unit(name: str) -> tuple[str, str | None]:
    """Cut a unit off a name in lower case; None if there is none, or one that is no length."""
    # rostopic puts "field." before each name of a message.
    plain = name.strip().strip("\"'").strip().lower().removeprefix("field.")
    bracketed = _BRACKETED.search(plain)
    if bracketed is not None and bracketed.start():
        unit = next(group for group in bracketed.groups() if group is not None).strip()
        return plain[: bracketed.start()].strip(), _UNITS.get(unit)
    for pattern in (_BEHIND_SLASH, _BEHIND_BLANK):
        behind = pattern.search(plain)
        if behind is not None and behind.start():
            unit = behind[1].strip()
            if unit in _UNITS or unit in _DEGREES:
                return plain[: behind.start()].strip(), _UNITS.get(unit)
    return plain, None


def _readings(name: str, plain: str) -> Iterable[tuple[int, str, int]]:
    """Give the ways to read a name as a coordinate: rank, family and axis."""
    exact = name.strip().lower()
    if exact in _AXES:
        yield _EXACT, "", _AXES[exact]
    words = [word for word in _SEPARATORS.split(plain) if word]
    joined = " ".join(words)
    if plain in _AXES:
        yield _NAMED_AXES, "", _AXES[plain]
    for family, rank, sets in (
        ("directions", _PLACES, (_EAST, _NORTH, _HEIGHT | {"z"})),
        ("letters", _LETTERS, ({"e"}, {"n"}, _HEIGHT | {"z"})),
        ("angles", _ANGLES, (_LONGITUDE, _LATITUDE, _HEIGHT | {"z"})),
        ("axes and height", _NAMED_AXES, ({"x"}, {"y"}, _HEIGHT)),
    ):
        for axis, known in enumerate(sets):
            if joined in known:
                yield rank, family, axis
    for place, axis_word in ((words[:-1], words[-1:]), (words[1:], words[:1])):
        if place and set(place) <= _PLACE_WORDS and axis_word[0] in _AXES:
            yield _PLACES, " ".join(place), _AXES[axis_word[0]]
            break
    else:
        if len(words) > 1 and words[0] in _PLACE_WORDS and words[-1] in _NUMBERS:
            # VeloView's Points_m_XYZ:0 has its unit between.
            if set(words[1:-1]) - _UNITS.keys() <= _PLACE_WORDS:
                yield _PLACES, " ".join(words[:-1]) + " by number", _NUMBERS[words[-1]]
        elif len(words) == 1:
            word = words[0]
            numbered = _NUMBERED_AXIS.fullmatch(word)
            if numbered is not None:
                yield _PLACES, "return " + numbered[2], _AXES[numbered[1]]
            if word[1:] in _PLACE_WORDS - {"p"} and word[0] in _AXES:
                yield _PLACES, word[1:], _AXES[word[0]]
            elif word[:-1] in _PLACE_WORDS and word[-1] in _AXES:
                yield _PLACES, word[:-1], _AXES[word[-1]]
