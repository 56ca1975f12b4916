"""What recurs: groups of pieces with poses, and of equal surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from surfsig.alignment.free_directions import FreeDirection
from surfsig.recurrences.equal_surfaces import EqualSurfaces
from surfsig.recurrences.occurrence import MEASURES, Occurrence

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Piece:
    """A part of a scan that hangs together: an object, or what is seen of it."""

    scan: int
    """Which scan it is in."""
    points: NDArray[np.int64]
    """The numbers of its points, ascending."""
    surfaces: list[int]
    """The numbers of the surfaces that it has points of."""
    center: Array
    """(3,), mean of its points."""

    def __repr__(self) -> str:
        surfaces = f", surfaces {self.surfaces}" if self.surfaces else ", free-form"
        return f"Piece(scan {self.scan}, {len(self.points)} points{surfaces})"


@dataclass(frozen=True, eq=False, repr=False)
class Recurrence:
    """Pieces that show the same object."""

    members: list[Occurrence]
    """Each piece with its pose on the first one, and how sure that is; the first one first."""
    free_directions: list[FreeDirection]
    """Motions along which the first piece slips over itself, its rims left aside: there, poses rest on rims
    alone, or on nothing. Those of each member are what it and the first one leave open together."""

    @property
    def pieces(self) -> list[int]:
        """The numbers of the pieces, the first ones first."""
        return [member.piece for member in self.members]

    @property
    def poses(self) -> Array:
        """T_member_first, (m, 4, 4): what brings the first piece onto each; the identity for itself."""
        return np.stack([member.T_member_first for member in self.members])

    @property
    def scores(self) -> Array:
        """(m,): how well each agrees with the one that its pose was found by, 0 to 1; 1 for the first."""
        return np.array([member.score for member in self.members])

    def __len__(self) -> int:
        """Return the number of members."""
        return len(self.members)

    def __repr__(self) -> str:
        free = "; ".join(str(direction) for direction in self.free_directions) or "no free direction"
        trusted = sum(member.trusted for member in self.members[1:])
        return (
            f"Recurrence({len(self)} pieces {self.pieces}, score {self.scores.mean():.2f}, "
            f"{trusted} of {len(self) - 1} poses trusted, {free})"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Recurrences:
    """What occurs more than once in a scan, or in several; a sequence of `Recurrence`."""

    groups: list[Recurrence]
    """Pieces that recur, by their first ones."""
    pieces: list[Piece]
    """All pieces of all scans."""
    equal_surfaces: list[EqualSurfaces]
    """Surfaces of one kind and size."""
    labels: list[NDArray[np.int32]]
    """Of each scan the number of each point's piece, (n,); -1 for supports and what is too small."""
    scores: Array
    """(pieces, pieces), how well each two agree, 0 to 1."""

    @property
    def group_labels(self) -> list[NDArray[np.int32]]:
        """Of each scan the number of each point's group, (n,); -1 for what does not recur."""
        group_of = np.full(len(self.pieces) + 1, -1, np.int32)
        for number, group in enumerate(self.groups):
            group_of[group.pieces] = number
        return [group_of[label] for label in self.labels]

    def __len__(self) -> int:
        """Return the number of groups."""
        return len(self.groups)

    def __getitem__(self, number: int) -> Recurrence:
        return self.groups[number]

    def __repr__(self) -> str:
        lines = [
            f"Recurrences({self.summary()})",
            *(f"  {number}: {group!r}" for number, group in enumerate(self.groups)),
            *(f"  {surfaces!r}" for surfaces in self.equal_surfaces),
        ]
        return "\n".join(lines)

    def summary(self) -> str:
        """Say in words how much recurs.

        Returns
        -------
        str
            For instance "28 of 30 pieces in 8 groups, 5 sizes of equal surfaces".
        """
        recurring = sum(len(group) for group in self.groups)
        return (
            f"{recurring} of {len(self.pieces)} pieces in {len(self.groups)} groups, "
            f"{len(self.equal_surfaces)} sizes of equal surfaces"
        )

    def table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Describe groups of pieces, and then of equal surfaces, for people.

        Returns
        -------
        The names of the columns, and a row for each group: its number, what recurs, how often, the numbers of
        the pieces or surfaces, the mean score or the size with its standard error, the free directions, and
        how many poses on the first piece are trusted.
        """
        several = len(self.labels) > 1
        rows = []
        for number, group in enumerate(self.groups):
            members = [(self.pieces[piece].scan, piece) for piece in group.pieces]
            score = f"score {group.scores[1:].mean():.2f}"
            trusted = f"{sum(member.trusted for member in group.members[1:])} of {len(group) - 1}"
            rows.append((f"{number}", "piece", members, score, group.free_directions, trusted))
        for surfaces in self.equal_surfaces:
            size = ", ".join(
                f"{name.replace('_', ' ')} {value:.4g} ± {surfaces.size_std[name]:.1g}"
                for name, value in surfaces.size.items()
            )
            rows.append(("", surfaces.kind, surfaces.members, size, surfaces.free_directions, ""))
        header = ("", "what", "times", "which", "how alike", "free directions", "trusted")
        return header, [
            (
                label,
                what,
                str(len(members)),
                " ".join(f"{scan}:{which}" if several else f"{which}" for scan, which in members),
                alike,
                "; ".join(map(str, free)) or "none",
                trusted,
            )
            for label, what, members, alike, free, trusted in rows
        ]

    def values(self) -> dict[str, Any]:
        """Give groups with members, poses and free directions as plain numbers, lists and dictionaries.

        Returns
        -------
        dict
            pieces (number, scan, points, surfaces, center); groups (members with what `Occurrence.values`
            gives; free_directions); equal_surfaces (kind, size, size_std, members
            with scan, surface and pose; free_directions).
        """
        return {
            "pieces": [
                {
                    "number": number,
                    "scan": piece.scan,
                    "points": len(piece.points),
                    "surfaces": piece.surfaces,
                    "center": piece.center.tolist(),
                }
                for number, piece in enumerate(self.pieces)
            ],
            "groups": [
                {
                    "members": [member.values() for member in group.members],
                    "free_directions": [direction.values() for direction in group.free_directions],
                }
                for group in self.groups
            ],
            "equal_surfaces": [
                {
                    "kind": surfaces.kind,
                    "size": surfaces.size,
                    "size_std": surfaces.size_std,
                    "members": [
                        {"scan": scan, "surface": number, "pose": pose.tolist()}
                        for (scan, number), pose in zip(surfaces.members, surfaces.poses, strict=True)
                    ],
                    "free_directions": [direction.values() for direction in surfaces.free_directions],
                }
                for surfaces in self.equal_surfaces
            ],
        }

    def to_pandas(self) -> pd.DataFrame:
        """Give the pieces that recur as a pandas DataFrame, a row each; the index has the pieces' numbers.

        Returns
        -------
        pandas.DataFrame
            group, scan, points, x, y, z (its mean), score, qx, qy, qz, qw, tx, ty, tz (T_member_first: unit
            quaternion, translation), free (the free directions in words), alternatives (their number), scale,
            scale_standard_error, overlap, explained, free_space, trusted, reasons.

        Raises
        ------
        InvalidInputError
            If pandas is not installed.
        """
        from scipy.spatial.transform import Rotation

        from surfsig.convert.libraries import library

        pandas = library("pandas", "pandas", "pandas")
        rows: list[dict[str, Any]] = []
        for number, group in enumerate(self.groups):
            for member in group.members:
                piece, pose = self.pieces[member.piece], member.T_member_first
                row: dict[str, Any] = {"piece": member.piece, "group": number, "scan": piece.scan}
                row["points"] = len(piece.points)
                row |= dict(zip("xyz", piece.center, strict=True)) | {"score": member.score}
                rotation = Rotation.from_matrix(pose[:3, :3]).as_quat()
                row |= dict(zip(("qx", "qy", "qz", "qw"), rotation, strict=True))
                row |= dict(zip(("tx", "ty", "tz"), pose[:3, 3], strict=True))
                row["free"] = "; ".join(map(str, member.free_directions))
                row["alternatives"] = len(member.alternatives)
                row |= {name: getattr(member, name) for name in MEASURES}
                rows.append(row | {"trusted": member.trusted, "reasons": "; ".join(member.reasons)})
        names = ["piece", "group", "scan", "points", "x", "y", "z", "score"]
        names += ["qx", "qy", "qz", "qw", "tx", "ty", "tz", "free", "alternatives"]
        names += [*MEASURES, "trusted", "reasons"]
        return pandas.DataFrame(rows, columns=names).set_index("piece")
