"""How programs write numbers: what stands for a missing one, infinities, decimal commas."""

from __future__ import annotations

import contextlib
import re

# NaN as C, C++, Java, Python and Windows' runtime write it. The last cuts "1.#QNAN" and "1.#IND" off where
# few digits are asked for, and rounds the letters: 1.#QNB, 1.#IO, 1.#J, 1.$.
_NAN = r"[-+]?(?:nan(?:\(\w*\))?|[qs]nan|nan[qs]|1[.,](?:#[a-z]+0*|\$))"
# What stands in a cell without a value: databases, Python, R, spreadsheets, pandas.
_MISSING = r"null|\(null\)|\\n|none|nil|n/a|n\.a\.|na|<na>|missing|nodata|undefined"
# A spreadsheet's formula without a value: #N/A, #NUM!, #DIV/0!, #NAME?, in German #NV, #WERT!.
_FORMULA = r"#(?:n/a|nv|[a-z]+(?:/0)?[!?])"
_INFINITY = r"1[.,]#inf0*|infinity|inf"
_ENDS = "(?=$|[\t\n{blank}])"
_BEGINS = "(?:(?<=[\t\n{blank}])|^)"

_NOT_A_VALUE = re.compile(rf"(?:{_NAN}|{_MISSING}|{_FORMULA})", re.IGNORECASE)
BEGINS_WITH_FORMULA = re.compile(rf"{_FORMULA}(?=$|[\s,;])", re.IGNORECASE)
_INFINITE = re.compile(rf"([-+]?)(?:{_INFINITY})", re.IGNORECASE)
_COMMA_NUMBER = re.compile(r"[-+]?(?:\d+,\d*|,\d+)(?:[eE][-+]?\d+)?")
_POINT_NUMBER = re.compile(r"[-+]?(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?")
# Fortran's double precision: 1.5D+00.
_FORTRAN = re.compile(r"([-+]?(?:\d+\.\d*|\.\d+))[dD]([-+]?\d{1,3})(?!\S)")
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")
_SEVERAL_THOUSANDS = re.compile(r"[-+]?\d{1,3}(?:,\d{3}){2,}(?:\.\d*)?|[-+]?\d{1,3}(?:,\d{3})+\.\d*")


def _spelled(words: str, blank: str) -> re.Pattern[str]:
    begins, ends = (part.format(blank=blank) for part in (_BEGINS, _ENDS))
    return re.compile(rf"{begins}(?:{words}){ends}", re.IGNORECASE)


_IN_TABS = (_spelled(rf"(?:{_NAN}|{_MISSING}|{_FORMULA})?", ""), _spelled(rf"([-+]?)(?:{_INFINITY})", ""))
_IN_BLANKS = (_spelled(rf"(?:{_NAN}|{_MISSING}|{_FORMULA})", " "), _spelled(rf"([-+]?)(?:{_INFINITY})", " "))


def in_one_spelling(text: str, tabs: bool) -> str:
    """Write what stands for NaN and infinity as nan and inf, and Fortran's exponents with an e.

    Parameters
    ----------
    text
        Lines, none of them empty.
    tabs
        Tabs stand between the values, so that nothing between two of them is a missing value; otherwise
        white space.
    """
    missing, infinite = _IN_TABS if tabs else _IN_BLANKS
    return _FORTRAN.sub(r"\1e\2", missing.sub("nan", infinite.sub(r"\1inf", text)))


def is_missing(cell: str) -> bool:
    """Tell whether a cell is empty, or says that there is no value."""
    return not cell or _NOT_A_VALUE.fullmatch(cell) is not None


def is_number(cell: str, decimal_comma: bool = False) -> bool:
    """Tell whether a cell is a number; NaN in any spelling and infinity are."""
    if decimal_comma:
        if _POINT_NUMBER.fullmatch(cell):
            return False
        cell = cell.replace(",", ".", 1)
    try:
        float(cell)
    except ValueError:
        return any(known.fullmatch(cell) for known in (_NOT_A_VALUE, _INFINITE, _FORTRAN))
    # Python takes 1_000 for a number; no program that writes points does.
    return "_" not in cell


def has_decimal_comma(cell: str) -> bool:
    """Tell whether a cell is a number with one comma, as in 1,25."""
    return _COMMA_NUMBER.fullmatch(cell) is not None


def has_decimal_point(cell: str) -> bool:
    """Tell whether a cell is a number with a point, as in 1.25."""
    return _POINT_NUMBER.fullmatch(cell) is not None


def may_be_thousands(cell: str) -> bool:
    """Tell whether the comma of a number may stand between thousands, as in 12,345."""
    return _THOUSANDS.fullmatch(cell) is not None


def has_thousands(cell: str) -> bool:
    """Tell whether commas can only stand between thousands, as in 1,234,567 and 1,234.5."""
    return _SEVERAL_THOUSANDS.fullmatch(cell) is not None


def why_no_number(cell: str, decimal_comma: bool = False) -> str:
    """Say what is wrong with a cell that is no number."""
    # The rows are read as bytes, a letter each.
    with contextlib.suppress(UnicodeError):
        cell = cell.encode("latin-1").decode()
    shown = f"{cell[:40]!r} is not a number"
    if decimal_comma and has_decimal_point(cell):
        return f"{shown} with a decimal comma, as the others are"
    if has_thousands(cell):
        return f"{shown} (write it without commas between thousands)"
    if has_decimal_comma(cell):
        return f"{shown} (write a decimal point, not a comma)"
    return shown
