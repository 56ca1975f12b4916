"""The reproduction as plain numbers, for `tables.json` and everything that shows them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .._surfsig import GOOD, OPTIMAL, Frame
from ..signature_similarity import similarity
from ..simulate.poses import Array
from .comparison import (
    OF_NEGATIVES,
    OF_POSITIVES,
    REPRODUCTION,
    VOCABULARIES,
    Decisions,
    Difference,
    Vocabulary,
    decide,
    differences,
    zeta_of,
)
from .printed import SIDE, SIMILARITIES, SMALLEST_EIGENVALUE, TABLE_I, TABLE_II, TABLE_III
from .random_poses import ALLOWED, FAR_APART, LIBRARY, Way, false_matches, self_similarity
from .reproduction import Reproduction
from .scans import OWN_HALF, PAPER, Fits

#: Tilt at which table I tells the two forms of eq. (4) apart.
TILT = np.radians(30.0)


def report(result: Reproduction) -> dict[str, Any]:
    """Everything that was found, as nested dicts and lists of numbers and words.

    Zeta, decisions and frames as in the paper; lengths in metres, curvatures per metre. A "spread" is
    {"median", "min", "max"} over draws.
    """
    matrices = result.zeta[REPRODUCTION]
    middle = decide(matrices["stated"])
    return {
        "seeds": result.seeds,
        "random_draws": result.draws,
        "decisions": _counts(middle),
        "decisions_by_frame": [_by_frame(result, vocabulary) for vocabulary in VOCABULARIES],
        "differences": {
            poses: [_explained(result, d) for d in differences(z)] for poses, z in matrices.items()
        },
        "sweep": [
            {"scale": scale, **_spreads(decisions)} for scale, decisions in result.sweep_decisions.items()
        ],
        "tables": {
            "I": table_one(result),
            "II": table_two(),
            "III": table_three(result),
            **{table.name: _similarities(table.name, matrices) for table in SIMILARITIES},
        },
        "random_poses": [_way(way) for way in result.ways],
    }


def spread(values: npt.NDArray[np.float64] | npt.NDArray[np.int64]) -> dict[str, float]:
    """Median and range."""
    return {
        "median": float(np.median(values)),
        "min": float(np.min(values)),
        "max": float(np.max(values)),
    }


def _counts(decisions: Decisions) -> dict[str, int]:
    draw = decisions.median_draw
    return {
        "positives": int(decisions.positives[draw]),
        "of_positives": OF_POSITIVES,
        "negatives": int(decisions.negatives[draw]),
        "of_negatives": OF_NEGATIVES,
        "median_seed": draw,
    }


def _spreads(decisions: Decisions) -> dict[str, Any]:
    return {
        "draws": len(decisions.positives),
        "positives": spread(decisions.positives),
        "negatives": spread(decisions.negatives),
    }


def _by_frame(result: Reproduction, vocabulary: Vocabulary) -> dict[str, Any]:
    frame = vocabulary.frame
    values = frame.singular_values
    return {
        "frame": vocabulary.label,
        "as_printed": vocabulary.as_printed,
        "offset_levels": vocabulary.offset_levels,
        "atoms": len(frame),
        "smallest_eigenvalue": {"printed": SMALLEST_EIGENVALUE, "ours": frame.smallest_eigenvalue(SIDE)},
        "condition_number": float(values[0] / values[-1]),
        **{
            poses: {"median_seed": _counts(decide(zeta)), "all_seeds": _spreads(decide(zeta))}
            for poses, zeta in result.zeta[vocabulary].items()
        },
    }


def table_one(result: Reproduction) -> list[dict[str, Any]]:
    """Table I's formulas, against eqs. (3) and (4) on a tilted patch, and against scans.

    The tilted patch is the paraboloid that osculates the surface where its normal leans by 30 degrees along
    the first principal direction; K and H there must be the formulas' still.
    """
    rows = []
    for (surface, k_formula, h_formula), number in zip(TABLE_I, (1, 8, 12), strict=True):
        radius = TABLE_III[number - 1].radius
        k1, k2 = 1.0 / radius, (1.0 / radius if surface == "Sphere" else 0.0)
        slope = np.tan(TILT)
        stretch = np.hypot(1.0, slope)
        tilted = [k1 * stretch**3 / 2 * SIDE, k2 * stretch / 2 * SIDE, slope, 0.0, 0.0, 0.0]
        fields = {printed: Frame(as_printed=printed).curvature_fields(tilted) for printed in (False, True)}
        middle = len(fields[False]) // 4
        own = result.stated[OWN_HALF]
        rows.append(
            {
                "surface": surface,
                "radius": radius if np.isfinite(radius) else None,
                "K": {"formula": k_formula, "value": k1 * k2, "eq3_tilted": fields[False][middle] / SIDE**2},
                "H": {
                    "formula": h_formula,
                    "value": (k1 + k2) / 2,
                    "eq4_tilted": fields[False][middle + len(fields[False]) // 2] / SIDE,
                    "eq4_as_printed_tilted": fields[True][middle + len(fields[True]) // 2] / SIDE,
                },
                "acquisition": number,
                "K_scanned": spread((own.k1 * own.k2)[:, number - 1]),
                "H_scanned": spread((own.k1 + own.k2)[:, number - 1] / 2),
            }
        )
    return rows


def table_two() -> list[dict[str, Any]]:
    """Table II: the printed range of each parameter, and that of the frame's atoms, in metres."""
    atoms = REPRODUCTION.frame.atoms
    metres = atoms / np.array([SIDE, SIDE, 1.0, 1.0, SIDE, 1.0 / SIDE])
    return [
        {
            "parameter": name,
            "printed": list(bounds),
            "ours": [float(metres[:, i].min()), float(metres[:, i].max())],
            "levels": len(np.unique(atoms[:, i].round(9))),
        }
        for i, (name, bounds) in enumerate(TABLE_II.items())
    ]


def table_three(result: Reproduction) -> list[dict[str, Any]]:
    """Table III, and what the paper's fit makes of each acquisition: the paraboloid's bias shows."""
    fits = result.stated[PAPER]
    return [
        {
            "acquisition": number,
            "kind": row.name,
            "property": row.property,
            "points": spread(fits.count[:, number - 1]),
            "k1": spread(fits.k1[:, number - 1]),
            "k2": spread(fits.k2[:, number - 1]),
            "true_curvature": None if np.isnan(row.radius) else 1.0 / row.radius,
            "signature_length": spread(
                np.linalg.norm(REPRODUCTION.signatures(fits.surfaces[:, number - 1]), axis=-1)
            ),
        }
        for number, row in enumerate(TABLE_III, start=1)
    ]


def _similarities(name: str, matrices: dict[str, Array]) -> dict[str, Any]:
    table = next(table for table in SIMILARITIES if table.name == name)
    ours = {poses: zeta_of(table, zeta) for poses, zeta in matrices.items()}
    return {
        "reference": table.reference,
        "rows": [
            {
                "acquisition": number,
                "printed": float(table.zeta[i]),
                **{poses: spread(zeta[:, i]) for poses, zeta in ours.items()},
                "printed_decision": bool(table.zeta[i] >= GOOD),
                "our_decision": bool(np.median(ours["stated"][:, i]) >= GOOD),
            }
            for i, number in enumerate(table.others)
        ],
    }


def zeta_with_plane(curvatures: Array, *, sphere: bool, vocabulary: Vocabulary = REPRODUCTION) -> Array:
    """Zeta, without noise, of a plane with cylinders or spheres that face the sensor.

    Parameters
    ----------
    curvatures : (m,) ndarray
        As a paraboloid has them, per metre.
    sphere
        Spheres, or cylinders.
    vocabulary
        The frame.

    Returns
    -------
    (m,) ndarray
    """
    surfaces = np.zeros((len(curvatures) + 1, 6))
    surfaces[1:, 0] = curvatures / 2
    surfaces[1:, 1] = curvatures / 2 if sphere else 0.0
    # A plane's signature has no direction of its own: it is the limit of a nearly flat bump's.
    surfaces[0, :2] = 1e-3
    signatures = vocabulary.signatures(surfaces)
    return np.asarray(similarity(signatures[1:], signatures[0]))


def _explained(result: Reproduction, difference: Difference) -> dict[str, Any]:
    return {
        "table": difference.table.name,
        "reference": difference.table.reference,
        "acquisition": difference.other,
        "printed": difference.printed,
        "median": difference.median,
        "share_of_draws": difference.share,
        "why": _why(result.stated[PAPER], difference),
    }


def _why(fits: Fits, difference: Difference) -> str:
    """Say the reason, with the numbers that show it."""
    pair = (difference.table.reference, difference.other)
    kinds = [TABLE_III[number - 1].kind for number in pair]
    if kinds == ["plane", "plane"]:
        return (
            "A plane's signature is that of its noise. Where the noise's mean curvature happens to be near "
            "0, what is left is noise of K, whose direction is another."
        )
    curved = next((number for number, kind in zip(pair, kinds, strict=True) if kind != "plane"), pair[1])
    fitted = float(np.median(fits.k1[:, curved - 1]))
    row = TABLE_III[curved - 1]
    if "plane" in kinds and row.kind in ("cylinder", "sphere"):
        zeta = zeta_with_plane(np.array([fitted]), sphere=row.kind == "sphere")[0]
        return (
            f"As curvature falls, every signature turns into a plane's. A {row.kind} of r = "
            f"{row.radius * 1000:.2f} mm, fitted with {fitted:.1f} per metre, has zeta {zeta:.2f} with a "
            "plane even without noise, and a more curved one less. The print has zeta rise with curvature "
            "from cylinder 2 (0.10) to cylinder 1 (0.26)."
        )
    if set(kinds) == {"sphere"}:
        return (
            f"The vocabulary ends near 100 per metre. Sphere 5 (1/r = {1 / TABLE_III[13].radius:.0f}) is "
            f"fitted with {np.median(fits.k1[:, 13]):.0f}, so its signature turns within a few per cent of "
            "curvature, and with every millimetre that the patch is off the apex."
        )
    return (
        "Zeta runs across 0.5 with the pose: the signature is made in the sensor's axes, and turns with them."
    )


def _way(way: Way) -> dict[str, Any]:
    false = false_matches(way)
    worst = max(false, key=lambda pair: false[pair])
    return {
        "way": way.label,
        "axes": way.fit.axes,
        "ball_radius": way.fit.radius,
        "flat_atom": way.flat_atom,
        "self_similarity": self_similarity(way),
        "acquisitions": [
            {
                "acquisition": number,
                "kind": row.name,
                "property": row.property,
                "alike_with_itself": way.share_alike(number, number),
                "zeta_with_itself": _quantiles(way.pairs(number, number)),
                "no_signature": way.share_missing(number),
            }
            for number, row in enumerate(TABLE_III, start=1)
        ],
        "false_matches": {
            "radii_apart_by": FAR_APART,
            "optimal_from": OPTIMAL,
            "pairs_of_acquisitions": len(false),
            "pairs_above_allowed": sum(share > ALLOWED for share in false.values()),
            "largest_share": false[worst],
            "largest_share_between": list(worst),
            "largest_zeta": max(float(np.nanmax(way.pairs(*pair))) for pair in false),
        },
        "confusion": {
            "objects": [TABLE_III[number - 1].name for number in LIBRARY] + ["none"],
            "shares": way.confusion().tolist(),
        },
    }


def _quantiles(zeta: Array) -> dict[str, float | None]:
    known = zeta[np.isfinite(zeta)]
    if not len(known):
        return {"p10": None, "median": None}
    return {"p10": float(np.quantile(known, 0.1)), "median": float(np.median(known))}
