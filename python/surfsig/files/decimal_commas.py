"""Numbers whose commas can be read in several ways: as decimal commas, by thousands, between values."""

from __future__ import annotations

import re
from collections.abc import Sequence

from surfsig.errors import FileFormatError
from surfsig.files.number_words import has_decimal_comma, has_decimal_point, may_be_thousands

_NUMBERS_BY_BLANKS = re.compile(r"[-+.\d][-+.\deE]*(?:\s+[-+.\d][-+.\deE]*)+")
# Numbers with decimal commas, and commas with blanks between them: 1,5, 2,5, 3,5.
_PAIRS = re.compile(r"\s*[-+]?\d+,\d+(?:,\s+[-+]?\d+,\d+){2,}\s*$")


def refuse_blanks_and_commas(cells: list[str], source: str, line: int) -> None:
    """Refuse rows such as 1,2,3 4,5,6, which may be read in several ways."""
    for cell in cells:
        if _NUMBERS_BY_BLANKS.fullmatch(cell):
            raise FileFormatError(
                f"{source}: line {line + 1}: both commas (or semicolons) and blanks stand between numbers "
                f"({cell[:40]!r}): write one of them between the values, and decimal points"
            )


def decimal_comma_of(rows: list[list[str]], source: str) -> bool:
    """Tell whether numbers are written with a decimal comma; refuse what may be something else."""
    commas = [cell for row in rows for cell in row if has_decimal_comma(cell)]
    if not commas:
        return False
    point = next((cell for row in rows for cell in row if has_decimal_point(cell)), None)
    if point is not None:
        raise FileFormatError(
            f"{source}: has numbers with a decimal comma ({commas[0]!r}) and with a point ({point!r})"
        )
    if all(map(may_be_thousands, commas)):
        whole, _, thousandths = commas[0].partition(",")
        raise FileFormatError(
            f"{source}: {commas[0]!r} may be {whole}{thousandths}, by thousands, or {whole}.{thousandths}, "
            "with a decimal comma: write decimal points"
        )
    return True


def refuse_cut_numbers(
    rows: list[list[str]], lines: Sequence[str], first: int, names: int, source: str
) -> None:
    """Refuse rows with commas between values that have decimal commas too, as in 1,25,-3,5,0,75.

    Parameters
    ----------
    rows
        The cells between the commas.
    lines
        The rows as they are.
    first
        Lines above them.
    names
        How many columns a header or the caller names; 0 without them.
    source
        The file's name.
    """
    shown = f"line {first + 1}: commas"
    line = f"({lines[0].strip()[:40]!r})"
    if all(map(_PAIRS.match, lines)):
        raise FileFormatError(
            f"{source}: {shown} with and without a blank stand between numbers {line}: write decimal points, "
            "if these are decimal commas"
        )
    width = len(rows[0])
    whole = all(cell.lstrip("+-").isdecimal() for row in rows for cell in row)
    if not whole or width < 6 or width % 2:
        return
    behind = [cell for row in rows for cell in row[1::2]]
    # Only what stands behind a decimal comma begins with 0, and only what stands before it has a sign.
    digits = all(map(str.isdecimal, behind)) and any(cell.startswith("0") and cell != "0" for cell in behind)
    if 2 * names == width or (not names and digits):
        raise FileFormatError(
            f"{source}: {shown} stand between numbers and, as it seems, within them {line}: write decimal "
            "points, or semicolons between the values"
        )
