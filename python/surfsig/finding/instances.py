"""What `find_instances` gives: instances of models, each with its pose."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import NDArray

from surfsig.alignment.free_directions import FreeDirection
from surfsig.cloud_transforms import transform_cloud
from surfsig.digits import finite_rows, position_text, rounded
from surfsig.files.atomic import replacing
from surfsig.page import NOTEBOOK_POINTS, Layer, notebook_html, page_html, write_page
from surfsig.page.packing import MOST_POINTS
from surfsig.point_cloud import PointCloud

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Instance:
    """A model that is in a scene."""

    name: str
    """The model's; "model" where only one was looked for."""
    T_scene_model: Array
    """(4, 4): a point p of the model is at R p + t of the scene."""
    covariance: Array
    """(6, 6), of the small motion (rotation vector in radians, then translation) in the scene's axes, about
    `center`, that brings the given pose onto the true one."""
    center: Array
    """Middle of what touches the scene's points, (3,), in the scene's coordinates."""
    score: float
    """Probability that the pose is right, within a tenth of the model's diameter; as learnt on simulated
    scenes."""
    measures: dict[str, float]
    """What it was computed from, by name: shares of the model that are confirmed, contradicted, mismatched or
    missing, over the most of it that can be seen at once; how well what lies on the scene agrees with it; and
    so on."""
    visible: float
    """Share of the surface facing the sensor that is seen, 0 to 1; of all of it where the sensor's place is
    not known."""
    overlap: float
    """Share of the model's whole surface that lies on the scene's, 0 to 1."""
    rms: float
    """Root mean square of the distances there, in the clouds' unit."""
    free_directions: list[FreeDirection]
    """Motions, in the scene's coordinates, in which what is seen does not hold the model."""
    alternatives: list[Array]
    """Other poses T_scene_model, (4, 4) each, that explain as much of what is seen, as of a box that looks
    the same after half a turn."""
    scale: float
    """How many times as large as the model the instance is, by a similarity transform; NaN where what is seen
    does not determine it. The pose itself is rigid."""
    scale_standard_error: float
    """Of `scale`."""
    doubts: list[str]
    """Names of the tests that the pose has not survived: free_directions, ambiguous, scale; empty where it is
    trusted."""
    reasons: list[str]
    """The same in words."""
    indices: NDArray[np.int64]
    """Numbers of the scene's points that are the instance's, ascending."""

    @property
    def trusted(self) -> bool:
        """Whether the pose was tried to be refuted, and was not.

        It is the only one that explains as much, all of it is determined, and the instance is as large as the
        model.
        """
        return not self.doubts

    def __repr__(self) -> str:
        """Say what it is."""
        free = "".join(f", {direction}" for direction in self.free_directions)
        why = "".join(f"; {reason}" for reason in self.reasons)
        return (
            f"Instance({self.name}: score {self.score:.2f}, {self.visible:.0%} visible, "
            f"{len(self.indices)} points, rms {self.rms:.3g}{free}{why})"
        )

    def values(self) -> dict[str, Any]:
        """Give everything as plain numbers, lists and dictionaries; of the points their number.

        Returns
        -------
        By the names of the attributes; matrices row by row.
        """
        return {
            "name": self.name,
            "T_scene_model": self.T_scene_model.tolist(),
            "position": self.T_scene_model[:3, 3].tolist(),
            "quaternion": _quaternion(self.T_scene_model),
            "covariance": finite_rows(self.covariance),
            "center": self.center.tolist(),
            "score": self.score,
            "measures": self.measures,
            "visible": self.visible,
            "overlap": self.overlap,
            "rms": self.rms,
            "free_directions": [free.values() for free in self.free_directions],
            "alternatives": [pose.tolist() for pose in self.alternatives],
            "scale": self.scale if np.isfinite(self.scale) else None,
            "scale_standard_error": self.scale_standard_error if np.isfinite(self.scale) else None,
            "trusted": self.trusted,
            "reasons": self.reasons,
            "points": len(self.indices),
        }


@dataclass(frozen=True, eq=False, repr=False)
class Instances:
    """All instances in a scene, the best first; a sequence of `Instance`."""

    instances: list[Instance]
    """The best first."""
    cloud: PointCloud
    """The scene."""
    models: dict[str, PointCloud]
    """Those that were found, by name."""
    sought: int = 1
    """Number of models that were looked for."""

    def __len__(self) -> int:
        """Return the number of instances."""
        return len(self.instances)

    def __getitem__(self, number: int) -> Instance:
        return self.instances[number]

    def __iter__(self) -> Iterator[Instance]:
        return iter(self.instances)

    def __repr__(self) -> str:
        lines = (f"  {number}: {instance!r}" for number, instance in enumerate(self.instances))
        return "\n".join([f"Instances({self.summary()})", *lines])

    @property
    def labels(self) -> NDArray[np.int32]:
        """Of each point of the scene the number of its instance, (n,); -1 for none."""
        labels = np.full(len(self.cloud), -1, np.int32)
        for number, instance in enumerate(self.instances):
            labels[instance.indices] = number
        return labels

    def summary(self) -> str:
        """Say in words how many there are.

        Returns
        -------
        As "5 instances (3 of cup, 2 of plate)", or "not there".
        """
        if not self.instances:
            return "not there"
        counts = Counter(instance.name for instance in self.instances)
        what = ", ".join(f"{count} of {name}" for name, count in sorted(counts.items()))
        return f"{len(self)} instance{'s' if len(self) > 1 else ''} ({what})"

    def placed(self, number: int) -> PointCloud:
        """Give an instance's model where it is in the scene.

        Parameters
        ----------
        number
            The instance's.

        Returns
        -------
        The model's finite points, in the scene's coordinates.
        """
        instance = self.instances[number]
        return transform_cloud(instance.T_scene_model, self.models[instance.name])

    def write_report(self, path: str | Path, *, title: str = "Instances") -> None:
        """Write one HTML page: the scene before, and after with the models in colours, and a table.

        The page needs no network. Of more than a million points a million are drawn.

        Parameters
        ----------
        path
            Where to write.
        title
            The page's.
        """
        write_page(path, self.to_html(title=title))

    def to_html(self, *, title: str = "Instances") -> str:
        """Make the page that `write_report` writes.

        Parameters
        ----------
        title
            The page's.

        Returns
        -------
        The document, which needs no network.
        """
        return self._page(title, MOST_POINTS)

    def _repr_html_(self) -> str:
        """Show the page in a notebook, with at most 100,000 points."""
        return notebook_html(self._page("Instances", NOTEBOOK_POINTS), "Instances")

    def _page(self, title: str, most_points: int) -> str:
        header, rows = self.table()
        layers = [Layer("scene", self.cloud.points, labels=self.labels, label_name="Instance")]
        for number, instance in enumerate(self.instances):
            points = self.placed(number).points
            labels = np.full(len(points), number)
            layers.append(
                Layer(
                    f"{number} {instance.name}", points, labels=labels, label_name="Instance", stage="after"
                )
            )
        text = f"{self.summary()}. A click on a point or a row shows the instance."
        return page_html(
            title, text, layers, header=header, rows=rows, quantity="surface", most_points=most_points
        )

    def table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Describe the instances for people.

        Returns
        -------
        The names of the columns, and a row for each: its number, the model's name, score, visible share,
        where the model's origin is, its rotation as a vector in degrees, rms, points, free directions.
        """
        header = (
            "",
            "model",
            "score",
            "visible",
            "at",
            "turned, degrees",
            "rms",
            "points",
            "free directions",
        )
        rows: list[tuple[str, ...]] = []
        for number, instance in enumerate(self.instances):
            rotation = scipy.spatial.transform.Rotation.from_matrix(instance.T_scene_model[:3, :3])
            rows.append(
                (
                    f"{number}",
                    instance.name,
                    f"{instance.score:.2f}",
                    f"{instance.visible:.0%}",
                    _with_digits(instance),
                    " ".join(f"{value:.1f}" for value in rotation.as_rotvec(degrees=True)),
                    f"{instance.rms:.2g}",
                    f"{len(instance.indices)}",
                    "; ".join(map(str, instance.free_directions)) or "none",
                )
            )
        return header, rows

    def values(self) -> dict[str, Any]:
        """Give all as plain numbers, lists and dictionaries, for JSON.

        Returns
        -------
        "summary", "models" (how many were looked for), and "instances", each as `Instance.values` with its
        number.
        """
        return {
            "summary": self.summary(),
            "models": self.sought,
            "instances": [{"number": n, **instance.values()} for n, instance in enumerate(self.instances)],
        }

    def write_bop(
        self,
        path: str | Path,
        *,
        scene_id: int = 0,
        image_id: int = 0,
        millimetres: float = 1000.0,
        seconds: float = -1.0,
    ) -> None:
        """Write the poses as the BOP benchmark reads them: a CSV file with a row for each instance.

        The columns are scene_id, im_id, obj_id (the number at the end of the model's name, or its rank among
        the found models' sorted names, from 1), score, R (row by row) and t (in millimetres) of
        T_scene_model, and time.

        Parameters
        ----------
        path
            Where to write.
        scene_id, image_id
            Numbers of the scene and the image, as the benchmark counts them.
        millimetres
            Of the clouds' unit: 1000 for metres.
        seconds
            What all instances of the image took; -1 where it is not known.
        """
        order = sorted(self.models)
        lines = ["scene_id,im_id,obj_id,score,R,t,time"]
        for instance in self.instances:
            digits = re.search(r"(\d+)$", instance.name)
            number = int(digits[1]) if digits else order.index(instance.name) + 1
            rotation = " ".join(f"{value:.9g}" for value in instance.T_scene_model[:3, :3].ravel())
            position = " ".join(f"{millimetres * value:.9g}" for value in instance.T_scene_model[:3, 3])
            first = f"{scene_id},{image_id},{number},{instance.score:.6f}"
            lines.append(f"{first},{rotation},{position},{seconds:g}")
        with replacing(Path(path)) as file:
            file.write("\n".join(lines).encode() + b"\n")

    def to_pandas(self) -> pd.DataFrame:
        """Give the instances as a pandas DataFrame, a row each.

        Returns
        -------
        pandas.DataFrame
            name, score, visible, overlap, rms, points, qx, qy, qz, qw, tx, ty, tz (T_scene_model: unit
            quaternion, shift), free (the free directions in words).

        Raises
        ------
        InvalidInputError
            If pandas is not installed.
        """
        from surfsig.convert.libraries import library

        pandas = library("pandas", "pandas", "pandas")
        rows = []
        for instance in self.instances:
            row: dict[str, Any] = {"name": instance.name, "score": instance.score}
            row |= {"visible": instance.visible, "overlap": instance.overlap, "rms": instance.rms}
            row["points"] = len(instance.indices)
            row |= dict(zip(("qx", "qy", "qz", "qw"), _quaternion(instance.T_scene_model), strict=True))
            row |= dict(zip(("tx", "ty", "tz"), instance.T_scene_model[:3, 3], strict=True))
            row["free"] = "; ".join(str(direction) for direction in instance.free_directions)
            rows.append(row)
        names = ["name", "score", "visible", "overlap", "rms", "points"]
        names += ["qx", "qy", "qz", "qw", "tx", "ty", "tz", "free"]
        return pandas.DataFrame(rows, columns=names)


def _quaternion(pose: Array) -> list[float]:
    """Give a pose's rotation as x, y, z, w, as ROS has it."""
    return [float(value) for value in scipy.spatial.transform.Rotation.from_matrix(pose[:3, :3]).as_quat()]


def _with_digits(instance: Instance) -> str:
    """Write where the model's origin is, with the digits of the standard errors where these are known."""
    errors = np.sqrt(np.diag(instance.covariance)[3:])
    position = instance.T_scene_model[:3, 3]
    if not (np.isfinite(errors) & (errors > 0.0)).all():
        return position_text(position, " ")
    return " ".join(rounded(value, error) for value, error in zip(position, errors, strict=True))
