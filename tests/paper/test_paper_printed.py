"""The paper's tables, transcribed: against themselves, against the text, and against the simulator."""

import numpy as np
import pytest

from surfsig import simulate as sim
from surfsig.paper.printed import SIMILARITIES, TABLE_I, TABLE_II, TABLE_III

IV, V, VI = SIMILARITIES


def test_the_bold_values_are_the_positives() -> None:
    positives = {
        table.name: [n for n, zeta in zip(table.others, table.zeta, strict=True) if zeta >= 0.5]
        for table in SIMILARITIES
    }
    assert positives == {"IV": [1, 2, 3, 4, 6, 7], "V": [9], "VI": [19]}
    assert [table.reference for table in SIMILARITIES] == [5, 8, 14]
    for table in SIMILARITIES:
        assert len(table.values) == 20
        assert table.values[table.reference - 1] is None


def test_sums_of_the_printed_values() -> None:
    # Added up from the printed page, column by column.
    assert IV.zeta.sum() == pytest.approx(6.4043 + 1.1135)
    assert V.zeta.sum() == pytest.approx(2.55684 + 0.2104)
    assert VI.zeta.sum() == pytest.approx(0.3538 + 1.3131)


def test_what_two_tables_print_for_one_pair_agrees() -> None:
    assert IV.values[8 - 1] == pytest.approx(V.values[5 - 1], abs=1e-4)
    assert IV.values[14 - 1] == VI.values[5 - 1] == 0.0174
    assert V.values[14 - 1] == pytest.approx(VI.values[8 - 1], abs=5e-4)


def test_tables_one_to_three() -> None:
    assert TABLE_I == (("Plane", "0", "0"), ("Cylinder", "0", "1/2r"), ("Sphere", "1/r^2", "1/r"))
    assert TABLE_II["f"] == (-0.02, 0.02)
    assert TABLE_II["e"] == TABLE_II["a"] == (-100.0, 100.0)
    # The repeats show the same objects.
    for first, again in ((11, 16), (15, 18), (14, 19)):
        assert TABLE_III[first - 1] == TABLE_III[again - 1]


@pytest.mark.parametrize("number", range(1, 21))
def test_the_simulator_scans_table_three(number: int) -> None:
    coarse = sim.Scanner(column_step=40, sheet_step=4e-3)
    scanned = sim.paper_acquisition(number, 0, scanner=coarse)
    row = TABLE_III[number - 1]
    assert scanned.kind == row.kind
    assert np.array_equal(
        scanned.radius if scanned.radius is not None else np.nan, row.radius, equal_nan=True
    )
