"""The report as rows: `tables.csv`."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from typing import Any, Final

from .printed import SIMILARITIES

COLUMNS: Final = (
    "table", "row", "quantity", "printed", "median", "min", "max", "jittered_median", "jittered_min",
    "jittered_max",
)  # fmt: skip

SPREAD: Final = ("median", "min", "max")


def csv_text(report: Mapping[str, Any]) -> str:
    """Write every table, one number or spread a row, printed and ours; "median" holds single numbers too."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(_rows(report))
    return text.getvalue()


def _rows(report: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    tables = report["tables"]
    for row in tables["I"]:
        for quantity in ("K", "H"):
            values = row[quantity]
            name = {"table": "I", "row": row["surface"]}
            yield {**name, "quantity": quantity, "printed": values["formula"], "median": values["value"]}
            for key, value in values.items():
                if key.startswith("eq"):
                    yield {**name, "quantity": f"{quantity} {key}", "median": value}
            yield {**name, "quantity": f"{quantity} scanned", **row[f"{quantity}_scanned"]}
    for row in tables["II"]:
        for quantity, printed, ours in zip(("minimum", "maximum"), row["printed"], row["ours"], strict=True):
            names = {"table": "II", "row": row["parameter"], "quantity": quantity}
            yield {**names, "printed": printed, "median": ours}
    for row in tables["III"]:
        for quantity in ("points", "k1", "k2", "signature_length"):
            yield {"table": "III", "row": row["acquisition"], "quantity": quantity, **row[quantity]}
    for table in SIMILARITIES:
        for row in tables[table.name]["rows"]:
            jittered = {f"jittered_{key}": row["jittered"][key] for key in SPREAD}
            names = {"table": table.name, "row": row["acquisition"], "quantity": "zeta"}
            yield {**names, "printed": row["printed"], **row["stated"], **jittered}
    for frame in report["decisions_by_frame"]:
        name = {"table": "frame", "row": frame["frame"]}
        eigenvalue = frame["smallest_eigenvalue"]
        yield {
            **name,
            "quantity": "smallest eigenvalue",
            "printed": eigenvalue["printed"],
            "median": eigenvalue["ours"],
        }
        for quantity in ("positives", "negatives"):
            jittered = {f"jittered_{key}": frame["jittered"]["all_seeds"][quantity][key] for key in SPREAD}
            printed = frame["stated"]["median_seed"][f"of_{quantity}"]
            ours = frame["stated"]["all_seeds"][quantity]
            yield {**name, "quantity": quantity, "printed": printed, **ours, **jittered}
    for way in report["random_poses"]:
        for kind, share in way["self_similarity"].items():
            quantity = f"share of pairs at 0.9 or above with itself, {kind}"
            yield {"table": "random poses", "row": way["way"], "quantity": quantity, "median": share}
        yield {
            "table": "random poses",
            "row": way["way"],
            "quantity": "largest share of false matches",
            "median": way["false_matches"]["largest_share"],
        }
