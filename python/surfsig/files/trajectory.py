"""Trajectories as text: KITTI's poses, and TUM's."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.atomic import replacing

TrajectoryFormat = Literal["kitti", "tum"]

_COLUMNS = {"kitti": 12, "tum": 8}


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Poses of a file.

    Attributes
    ----------
    timestamps
        In seconds, (n,); of KITTI, which has none, the lines' numbers from 0.
    poses
        T_world_scan, (n, 4, 4); NaN where a line of KITTI says so.
    """

    timestamps: NDArray[np.float64]
    poses: NDArray[np.float64]


def trajectory_format(path: str | os.PathLike[str]) -> TrajectoryFormat:
    """Say in which format a trajectory is written under this name: TUM for ``.tum``, else KITTI.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    "kitti" or "tum".
    """
    return "tum" if Path(path).suffix.lower() == ".tum" else "kitti"


def write_trajectory(
    path: str | os.PathLike[str],
    poses: ArrayLike,
    timestamps: ArrayLike | None = None,
    *,
    format: TrajectoryFormat | None = None,
) -> None:
    """Write poses as text, in all digits; the file appears whole or not at all.

    Parameters
    ----------
    path
        The file.
    poses
        T_world_scan, (n, 4, 4); NaN where there is none.
    timestamps
        In seconds, (n,), for TUM; the poses' numbers by default.
    format
        "kitti": a line for each pose, the first three rows of its matrix, 12 times nan where there is none.
        "tum": lines ``timestamp tx ty tz qx qy qz qw``, and none where there is no pose. By default as
        `trajectory_format` says.

    Raises
    ------
    OSError
        If the file cannot be written.
    InvalidInputError
        If shapes do not fit, or the format is another.
    """
    chosen = trajectory_format(path) if format is None else format
    if chosen not in _COLUMNS:
        raise InvalidInputError(f"format must be kitti or tum, not {chosen!r:.40}")
    matrices = np.asarray(poses, np.float64)
    if matrices.ndim != 3 or matrices.shape[1:] != (4, 4):
        raise InvalidInputError(f"poses must have the shape (n, 4, 4), not {matrices.shape}")
    times = np.asarray(np.arange(len(matrices)) if timestamps is None else timestamps, np.float64)
    if times.shape != (len(matrices),):
        raise InvalidInputError(f"timestamps must be one for each of {len(matrices)} poses")
    if chosen == "kitti":
        rows = matrices[:, :3].reshape(-1, 12)
    else:
        known = np.isfinite(matrices).all(axis=(1, 2))
        kept = matrices[known]
        quaternions = (
            scipy.spatial.transform.Rotation.from_matrix(kept[:, :3, :3]).as_quat()
            if len(kept)
            else np.zeros((0, 4))
        )
        rows = np.column_stack([times[known], kept[:, :3, 3], quaternions])
    _write_rows(path, rows)


def write_covariances(path: str | os.PathLike[str], covariances: ArrayLike) -> None:
    """Write covariances as text, 36 numbers a line, row by row; the file appears whole or not at all.

    Parameters
    ----------
    path
        The file.
    covariances
        (n, 6, 6), as `Odometry.covariances`; NaN where there is none.

    Raises
    ------
    OSError
        If the file cannot be written.
    InvalidInputError
        If the shape is another.
    """
    matrices = np.asarray(covariances, np.float64)
    if matrices.ndim != 3 or matrices.shape[1:] != (6, 6):
        raise InvalidInputError(f"covariances must have the shape (n, 6, 6), not {matrices.shape}")
    _write_rows(path, matrices.reshape(-1, 36))


def _write_rows(path: str | os.PathLike[str], rows: NDArray[np.float64]) -> None:
    with replacing(Path(path)) as file:
        file.writelines(" ".join(map(repr, row)).encode() + b"\n" for row in rows.tolist())


def read_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """Read poses as `write_trajectory` and the benchmarks of KITTI and TUM write them.

    Parameters
    ----------
    path
        The file; how many numbers its lines have says which format it is. Lines that begin with # are left
        out.

    Returns
    -------
    Trajectory

    Raises
    ------
    OSError
        If the file cannot be read.
    FileFormatError
        If a line has neither 12 nor 8 numbers, or not as many as the first.
    """
    path = Path(path)
    rows: list[list[float]] = []
    with path.open("rb") as file:
        for number, line in enumerate(file, 1):
            words = line.split()
            if not words or words[0].startswith(b"#"):
                continue
            try:
                rows.append([float(word) for word in words])
            except ValueError:
                raise FileFormatError(f"{path}: line {number} holds something other than numbers") from None
            if len(words) not in _COLUMNS.values() or len(words) != len(rows[0]):
                raise FileFormatError(
                    f"{path}: line {number} has {len(words)} numbers, not 12 (KITTI) or 8 (TUM) as all"
                )
    table = np.array(rows).reshape(len(rows), -1 if rows else 12)
    poses = np.tile(np.eye(4), (len(table), 1, 1))
    if table.shape[1] == _COLUMNS["kitti"]:
        poses[:, :3] = table.reshape(-1, 3, 4)
        poses[np.isnan(table).any(axis=1)] = np.nan
        return Trajectory(np.arange(len(table), dtype=np.float64), poses)
    if not (np.isfinite(table).all() and np.linalg.norm(table[:, 4:], axis=1).all()):
        raise FileFormatError(f"{path}: a pose is not finite, or its quaternion is 0")
    poses[:, :3, :3] = scipy.spatial.transform.Rotation.from_quat(table[:, 4:]).as_matrix()
    poses[:, :3, 3] = table[:, 1:4]
    return Trajectory(table[:, 0].copy(), poses)
