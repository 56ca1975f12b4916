"""The coordinate system that a file says its coordinates are in, and the unit in which they measure."""

from __future__ import annotations

import base64
import binascii
import struct
from dataclasses import dataclass
from typing import Any

from surfsig.wkt import describe

# Metres per unit of length, by the names that messages use.
_LENGTHS = {"metre": 1.0, "foot": 0.3048, "US survey foot": 1200 / 3937}
# Radians per unit of angle.
_ANGLES = {"degree": 0.017453292519943295, "grad": 0.015707963267948967, "radian": 1.0}
SAME_UNIT = 1e-6
"""Units are the same whose sizes differ by no more, relatively: the two feet differ by two millionths."""

# Keys of GeoTIFF, and what they say where they say nothing.
_MODEL, _GEOGRAPHIC_TYPE, _ANGULAR_UNIT = 1024, 2048, 2054
_PROJECTED_TYPE, _LINEAR_UNIT, _LINEAR_SIZE, _VERTICAL_TYPE, _VERTICAL_UNIT = 3072, 3076, 3077, 4096, 4099
_CITATIONS = (3073, 1026, 2049)
_GEOGRAPHIC = 2
_UNDEFINED = (0, 32767)
_DOUBLES, _TEXT = 34736, 34737
_UNITS_BY_CODE = {
    9001: "metre", 9002: "foot", 9003: "US survey foot", 9101: "radian", 9102: "degree", 9105: "grad",
}  # fmt: skip
# Codes of UTM zones, all of them in metres: WGS 84 north and south, ETRS89, NAD83, NAD27.
_UTM = (
    range(32601, 32661),
    range(32701, 32761),
    range(25828, 25839),
    range(26901, 26924),
    range(26701, 26723),
)

_TEXT_MARK = "GeoTIFF:"


@dataclass(frozen=True)
class GeoKeys:
    """The three records of GeoTIFF keys, as they stand in a file.

    Attributes
    ----------
    directory
        Whole numbers of 16 bits: how many keys there are, then each key and its value, or where that is.
    doubles
        Numbers that keys refer to.
    text
        Words that keys refer to.
    """

    directory: bytes
    doubles: bytes = b""
    text: bytes = b""

    @property
    def is_empty(self) -> bool:
        """Tell whether there is no key."""
        return not self._entries()

    def numbers(self) -> dict[int, int]:
        """Give the keys whose value is a whole number.

        Returns
        -------
        dict
            Values by keys.
        """
        return {key: value for key, where, _, value in self._entries() if where == 0}

    def double(self, key: int) -> float | None:
        """Give the value of a key that is a number in `doubles`.

        Parameters
        ----------
        key
            Its number in GeoTIFF.

        Returns
        -------
        float or None
            None if there is none.
        """
        for found, where, _, place in self._entries():
            if found == key and where == _DOUBLES and 8 * (place + 1) <= len(self.doubles):
                return float(struct.unpack_from("<d", self.doubles, 8 * place)[0])
        return None

    def words(self, key: int) -> str | None:
        """Give the value of a key that is a part of `text`.

        Parameters
        ----------
        key
            Its number in GeoTIFF.

        Returns
        -------
        str or None
            None if there is none, or it is empty.
        """
        for found, where, length, place in self._entries():
            if found == key and where == _TEXT:
                part = self.text[place : place + length].partition(b"\0")[0]
                return " ".join(part.decode("latin-1").rstrip("|").split()) or None
        return None

    def _entries(self) -> list[tuple[int, int, int, int]]:
        count = struct.unpack_from("<4H", self.directory)[3] if len(self.directory) >= 8 else 0
        whole = self.directory[8 : 8 + 8 * min(count, (len(self.directory) - 8) // 8)]
        return list(struct.iter_unpack("<4H", whole))


@dataclass(frozen=True)
class CoordinateSystem:
    """What a file says about the frame and the unit of its coordinates.

    Attributes
    ----------
    name
        As the file calls it, or its number ("EPSG:32618"); None where it has none.
    unit
        Of the horizontal axes: "metre", "foot", "US survey foot", "degree", or what the file calls another
        one; None where it does not say.
    metres_per_unit
        Of a unit of length; None for angles, and where the unit is not known.
    vertical_unit
        Of heights; None where the file does not say, which mostly means that of the other axes.
    is_geographic
        The coordinates are angles on the earth: longitude and latitude.
    wkt
        The system as well-known text, where the file has it so.
    geo_keys
        The GeoTIFF keys, where the file has it so.
    """

    name: str | None
    unit: str | None
    metres_per_unit: float | None
    vertical_unit: str | None
    is_geographic: bool
    wkt: str | None = None
    geo_keys: GeoKeys | None = None

    @classmethod
    def from_wkt(cls, text: str) -> CoordinateSystem:
        """Take a system from well-known text, version 1 or 2.

        Parameters
        ----------
        text
            The text; a broken one has no name and no unit.

        Returns
        -------
        CoordinateSystem
        """
        told = describe(text)
        angles = told.is_geographic
        unit = _named(told.horizontal, _ANGLES if angles else _LENGTHS)
        metres = None if angles or told.horizontal is None else told.horizontal[1]
        vertical = _named(told.vertical, _LENGTHS)
        return cls(told.name, unit, metres, vertical, angles, wkt=text)

    @classmethod
    def from_geo_keys(cls, keys: GeoKeys) -> CoordinateSystem:
        """Take a system from GeoTIFF keys.

        The unit that belongs to the number of a system and is not said beside it is known for UTM, and for
        all others where pyproj is installed.

        Parameters
        ----------
        keys
            The records of a file.

        Returns
        -------
        CoordinateSystem
        """
        numbers = keys.numbers()
        code = _code(numbers)
        model = numbers.get(_MODEL)
        is_geographic = model == _GEOGRAPHIC or (
            model is None and code is not None and _PROJECTED_TYPE not in numbers
        )
        citations = _CITATIONS[1:] if is_geographic else _CITATIONS[:2]
        name = next((words for key in citations if (words := keys.words(key))), None)
        metres: float | None = None
        if is_geographic:
            unit = _UNITS_BY_CODE.get(numbers.get(_ANGULAR_UNIT, 9102))
        else:
            unit = _UNITS_BY_CODE.get(numbers.get(_LINEAR_UNIT, 0))
            size = keys.double(_LINEAR_SIZE)
            if unit is None and size is not None:
                unit = _named((f"{size:g} metres", size), _LENGTHS)
            if unit is None and _LINEAR_UNIT not in numbers and code is not None:
                unit = "metre" if any(code in zones for zones in _UTM) else _unit_of_code(code)
            metres = _LENGTHS.get(unit or "", size)
        return cls(
            name or (None if code is None else f"EPSG:{code}"),
            unit,
            metres,
            _UNITS_BY_CODE.get(numbers.get(_VERTICAL_UNIT, 0)),
            is_geographic,
            geo_keys=keys,
        )

    @classmethod
    def from_text(cls, text: str) -> CoordinateSystem | None:
        """Take a system from a line of text.

        Parameters
        ----------
        text
            What `to_text` wrote, or well-known text.

        Returns
        -------
        CoordinateSystem or None
            None if it is neither.
        """
        if not text.startswith(_TEXT_MARK):
            found = cls.from_wkt(text)
            return found if found.name is not None else None
        try:
            parts = [
                base64.b64decode(part, validate=True) for part in text[len(_TEXT_MARK) :].strip().split(":")
            ]
        except (ValueError, binascii.Error):
            return None
        return cls.from_geo_keys(GeoKeys(*parts)) if len(parts) == 3 else None

    def to_text(self) -> str:
        """Write the system in a line, for the comments of other formats.

        Returns
        -------
        The WKT, or the GeoTIFF keys in base64.
        """
        if self.wkt is not None:
            return " ".join(self.wkt.split())
        keys = self.geo_keys or GeoKeys(b"")
        parts = (keys.directory, keys.doubles, keys.text)
        return _TEXT_MARK + ":".join(base64.b64encode(part).decode() for part in parts)

    def to_wkt(self) -> str | None:
        """Give the system as well-known text, version 1.

        Returns
        -------
        str or None
            The file's own text; otherwise, where pyproj is installed and knows the number of the system with
            the same units, what it makes of that; None where there is none.
        """
        if self.wkt is not None or self.geo_keys is None:
            return self.wkt
        numbers = self.geo_keys.numbers()
        text = _wkt_of_codes(_code(numbers), _defined(numbers.get(_VERTICAL_TYPE)))
        if text is None:
            return None
        same = CoordinateSystem.from_wkt(text)
        vertical = {self.vertical_unit, same.vertical_unit} - {None}
        return text if same.unit == self.unit and len(vertical) <= 1 else None


def _named(unit: tuple[str, float] | None, known: dict[str, float]) -> str | None:
    """Give a unit the name that messages use, by its size."""
    if unit is None:
        return None
    name, size = unit
    return next((usual for usual, other in known.items() if abs(size - other) <= SAME_UNIT * other), name)


def _defined(code: int | None) -> int | None:
    return None if code is None or code in _UNDEFINED else code


def _code(numbers: dict[int, int]) -> int | None:
    """Give the EPSG number of the horizontal system."""
    return _defined(numbers.get(_PROJECTED_TYPE)) or _defined(numbers.get(_GEOGRAPHIC_TYPE))


def _unit_of_code(code: int) -> str | None:
    text = _wkt_of_codes(code, None)
    return None if text is None else CoordinateSystem.from_wkt(text).unit


def _wkt_of_codes(code: int | None, vertical: int | None) -> str | None:
    """Look EPSG numbers up with pyproj; None if it is not installed, or does not know them."""
    if code is None:
        return None
    try:
        import pyproj
        from pyproj.crs import CompoundCRS
        from pyproj.exceptions import CRSError
    except ImportError:
        return None
    try:
        system: Any = pyproj.CRS.from_epsg(code)
        if vertical is not None:
            height = pyproj.CRS.from_epsg(vertical)
            system = CompoundCRS(f"{system.name} + {height.name}", [system, height])
        text: str = system.to_wkt("WKT1_GDAL")
    except CRSError:
        return None
    return text
