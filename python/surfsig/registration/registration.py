"""What `register` gives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import cloud_transforms, geometry
from surfsig.alignment.alternative import Alternative
from surfsig.alignment.free_directions import FreeDirection
from surfsig.digits import finite_or_none, finite_rows, position_text
from surfsig.page import Layer, page_html, write_page
from surfsig.point_cloud import PointCloud, coordinate_array

Array = NDArray[np.float64]

_BLUE, _ORANGE = (31, 119, 180), (255, 127, 14)


@dataclass(frozen=True, eq=False, repr=False)
class Registration:
    """How a source lies in a target, and how sure that is.

    Where nothing was found, the pose and its covariance are NaN.
    """

    T_target_source: Array
    """(4, 4): a point p of the source is at R p + t of the target."""
    covariance: Array
    """(6, 6), of the small twist (rotation vector in radians, then translation) in the target's axes, about
    `center`, that takes the given transform to the true one: T_true = T(center) exp(twist) T(-center)
    T_target_source, where T(c) is the translation by c. Infinite in the entries of free directions; the
    others are the limit as that variance grows."""
    information: Array
    """(6, 6), the inverse of the covariance, which is 0 along free directions."""
    center: Array
    """Middle of what overlaps, (3,), in the target's coordinates."""
    free_directions: list[FreeDirection]
    """Motions of the source, in the target's coordinates, that the overlap does not determine."""
    matches: int
    """Keypoints that were matched; 0 where a start was given."""
    inliers: int
    """Those of them that agree with the transform."""
    overlap: float
    """Share of the source's surface that lies on the target's, 0 to 1."""
    rms: float
    """Root mean square of the distances there, in the clouds' own unit."""
    radius: float
    """Of the patches that were matched; with a start, of the same size."""
    trusted: bool
    """Whether the pose is right, by what was seen: it was tried to be refuted, and was not. False where a
    direction is free, as any pose along it is as good."""
    doubts: list[str]
    """Names of the tests that it has not survived: not_found, few_matches, little_overlap, free_directions,
    free_space, ambiguous, mirrored, scale; empty where it is trusted."""
    reasons: list[str]
    """The same in words."""
    alternatives: list[Alternative]
    """Other transforms that explain as much, as of a box that looks the same after half a turn."""
    explained: float
    """Share of the source that lies on the target's surface, near points counting more, 0 to 1."""
    free_space: float
    """The larger share of one scan's points that lie where the other's sensor looked through, of those that
    it would have measured; NaN where no viewpoint is known from which all was seen."""
    scale: float
    """How many times as large as the target the source is, by a similarity transform fitted to the surface;
    NaN where the overlap does not determine it. The pose itself is rigid."""
    scale_standard_error: float
    """Of `scale`."""

    def __repr__(self) -> str:
        """Say what was found."""
        word = "trusted" if self.trusted else "not trusted"
        free = "".join(f", {direction}" for direction in self.free_directions)
        return (
            f"Registration({word}: {self.inliers} of {self.matches} matches agree, "
            f"overlap {self.overlap:.2f}, rms {self.rms:.3g}{free})"
        )

    def transform_points(self, points: ArrayLike) -> Array:
        """Move points of the source into the target.

        Parameters
        ----------
        points
            (n, 3), in the source's coordinates.

        Returns
        -------
        (n, 3) in the target's; NaN where no pose is known.

        Raises
        ------
        InvalidInputError
            If they are no points.
        """
        return geometry.transform_points(
            self.T_target_source, coordinate_array(points, "points").astype(np.float64)
        )

    def transform_cloud(self, cloud: PointCloud) -> PointCloud:
        """Move a cloud of the source into the target, its viewpoint and normals with it.

        Parameters
        ----------
        cloud
            In the source's coordinates.

        Returns
        -------
        A cloud of its own, with all fields.
        """
        return cloud_transforms.transform_cloud(self.T_target_source, cloud)

    def rows(self) -> list[tuple[str, str]]:
        """Describe the result for people.

        Returns
        -------
        Names and values: the pose, standard deviations, overlap, matches, free directions, trusted.
        """
        if not np.isfinite(self.T_target_source).all():
            return [("pose", f"none found ({self.matches} places look alike)"), ("trusted", "no")]
        rows = [
            ("T_target_source" if not line else "", "  ".join(f"{value: .6f}" for value in row))
            for line, row in enumerate(self.T_target_source)
        ]
        deviations = np.sqrt(np.diag(self.covariance))
        turns, shifts = (
            ", ".join(f"{value:.6g}" for value in values)
            for values in (np.degrees(deviations[:3]), deviations[3:])
        )
        rows += [
            ("standard deviation", f"{turns} degrees about x, y, z"),
            ("", f"{shifts} along them, at {position_text(self.center)}"),
            ("overlap", f"{self.overlap:.0%} of the source, rms {self.rms:.6g}"),
        ]
        if self.matches:
            rows.append(("matches", f"{self.inliers:,} of {self.matches:,} agree"))
        rows += [("free", str(direction)) for direction in self.free_directions]
        rows += [
            (
                "as good" if not number else "",
                "  ".join(f"{value:.6f}" for value in other.T_target_source[line]),
            )
            for number, other in enumerate(self.alternatives)
            for line in range(3)
        ]
        rows.append(("trusted", "yes" if self.trusted else "no"))
        return [
            *rows,
            *(("because" if not number else "", reason) for number, reason in enumerate(self.reasons)),
        ]

    def write_report(
        self, path: str | Path, source: PointCloud, target: PointCloud, *, title: str = "Registration"
    ) -> None:
        """Write one HTML page: both clouds before and after, in a view that turns, and what was found.

        A slider moves the source. The page needs no network. Of more than a million points a million are
        drawn.

        Parameters
        ----------
        path
            Where to write.
        source, target
            The clouds that were registered.
        title
            The page's.
        """
        known = bool(np.isfinite(self.T_target_source).all())
        layers = [
            Layer("target", target.points, color=_BLUE),
            Layer(
                "source",
                source.points,
                color=_ORANGE,
                T_target_source=self.T_target_source if known else None,
            ),
        ]
        trusted = "trusted" if self.trusted else "not trusted"
        text = f"The source (orange) before and after it was moved into the target (blue): {trusted}."
        write_page(path, page_html(title, text, layers, header=("", ""), rows=self.rows()))

    def values(self) -> dict[str, Any]:
        """Give everything as plain numbers, for JSON; None for what is not known.

        Returns
        -------
        By the names of the attributes; matrices row by row.
        """
        known = bool(np.isfinite(self.T_target_source).all())
        return {
            "T_target_source": self.T_target_source.tolist() if known else None,
            "covariance": finite_rows(self.covariance) if known else None,
            "information": self.information.tolist() if known else None,
            "center": self.center.tolist() if known else None,
            "free_directions": [free.values() for free in self.free_directions],
            "matches": self.matches,
            "inliers": self.inliers,
            "overlap": self.overlap,
            "rms": finite_or_none(self.rms),
            "radius": self.radius,
            "trusted": self.trusted,
            "doubts": self.doubts,
            "reasons": self.reasons,
            "alternatives": [other.values() for other in self.alternatives],
            "explained": self.explained,
            "free_space": finite_or_none(self.free_space),
            "scale": finite_or_none(self.scale),
            "scale_standard_error": finite_or_none(self.scale_standard_error),
        }
