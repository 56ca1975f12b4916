"""What Python's surfsig says about a file that the page saved, as JSON on stdout."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np

import surfsig


def curvature(path: str, radius: str, query: str | None = None) -> dict[str, Any]:
    """Extract the saved points again, and give the largest differences, in units of max(|k|, 1 / radius).

    Without fused multiply-adds a point on a ball's rim can be on its other side: points with such balls are
    counted apart, and so are those at borders, whose fits are determined less well. Those that do not
    converge are left out.
    """
    cloud = surfsig.read(path)
    how: float | Literal["auto"] = "auto" if radius == "auto" else float(radius)
    points = surfsig.PointCloud(cloud.offsets.astype(np.float32), viewpoint=cloud.viewpoint)
    found = surfsig.extract(points, how)
    fields = cloud.fields
    counted_alike = found.count == fields["count"]
    same = counted_alike & (found.status == surfsig.Status.OK)
    one_sided = counted_alike & (found.status == surfsig.Status.ONE_SIDED)
    scale = 1.0 / np.asarray(found.radius)
    result: dict[str, Any] = {"points": len(cloud), "oriented": found.oriented}
    for name in ("k1", "k2", "mean_curvature_std", "k1_std", "k2_std"):
        ours = getattr(found, name)
        missing = (np.isnan(ours) != np.isnan(fields[name])) & same
        differences = np.abs(ours - fields[name]) / np.maximum(np.abs(ours), scale)
        result[name] = None if missing.any() else float(np.nanmax(differences[same]))
        result["one_sided"] = max(
            result.get("one_sided", 0.0), float(np.nanmax(differences[one_sided], initial=0.0))
        )
    normals = np.column_stack([fields[axis] for axis in ("nx", "ny", "nz")])
    result["normals"] = float(np.nanmax(np.abs(normals - found.normals)[same]))
    result["statuses_differ"] = int((found.status != fields["status"]).sum())
    result["counts_differ"] = int((~counted_alike).sum())
    if query is not None:
        signature = found.signatures([int(query)], flat_atom="auto")[0]
        ours = found.similarity_to(signature)
        result["zeta"] = float(np.nanmax(np.abs(ours - fields["zeta"])[same]))
    return result


def surfaces(path: str, table: str) -> dict[str, Any]:
    """Find the saved points' surfaces again, and compare labels and table."""
    cloud = surfsig.read(path)
    found = surfsig.find_surfaces(surfsig.PointCloud(cloud.offsets.astype(np.float32)))
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    with_radius = [(row, s) for row, s in zip(rows, found, strict=False) if row["radius"]]
    return {
        "labels_differ": int((found.labels != cloud.fields["surface"]).sum()),
        "kinds": [row["kind"] for row in rows],
        "python_kinds": [surface.kind for surface in found],
        "radius": max(abs(float(row["radius"]) / s.radius - 1) for row, s in with_radius),
        "interval": max(abs(float(row["radius_high"]) / s.interval[1] - 1) for row, s in with_radius),
        "counts": [int(row["points"]) for row in rows] == [surface.count for surface in found],
    }


def files(folder: str) -> dict[str, Any]:
    """Write one small cloud in each format, and say where its points are."""
    rng = np.random.default_rng(5)
    points = rng.uniform(-1, 1, (400, 3)).astype(np.float32)
    points[:, 2] = 0.3 * points[:, 0] ** 2
    cloud = surfsig.PointCloud(points, viewpoint=np.array([0.0, 0.0, 5.0]))
    made = Path(folder)
    for ending in ("ply", "pcd", "las", "laz", "xyz", "csv"):
        surfsig.write(made / f"cloud.{ending}", cloud)
    text = "\n".join(f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in points.tolist())
    (made / "lines.obj").write_text("".join(f"v {line}\n" for line in text.split("\n")))
    header = "ply\nformat ascii 1.0\nelement vertex 400\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    (made / "ascii.ply").write_text(header + text + "\n")
    pcd = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 400\nHEIGHT 1\n"
    (made / "ascii.pcd").write_text(f"{pcd}VIEWPOINT 0 0 5 1 0 0 0\nPOINTS 400\nDATA ascii\n{text}\n")
    far = surfsig.PointCloud(points + np.array([400_000.0, 5_600_000.0, 300.0]))
    surfsig.write(made / "far.ply", far)
    whole = (made / "cloud.ply").read_bytes()
    broken = {
        "empty.ply": b"",
        "cut.ply": whole[:-100],
        "headless.ply": b"ply\nformat ascii 1.0\n",
        "picture.png": b"\x89PNG\r\n\x1a\n" + bytes(50),
        "scan.e57": b"ASTM-E57" + bytes(60),
        "words.txt": b"this is no point cloud\n",
        "nan.xyz": b"nan nan nan\n" * 9,
        "cut.laz": (made / "cloud.laz").read_bytes()[:300],
    }
    for name, content in broken.items():
        (made / name).write_bytes(content)
    return {"broken": list(broken), "sum": points.sum(0, dtype=np.float64).tolist()}


def saved_points(*paths: str) -> list[dict[str, Any]]:
    """Read saved files back."""
    clouds = [surfsig.read(path) for path in paths]
    return [
        {
            "points": len(cloud),
            "sum": cloud.points.sum(0).tolist(),
            "viewpoint": None if cloud.viewpoint is None else list(cloud.viewpoint),
        }
        for cloud in clouds
    ]


def report(path: str) -> dict[str, Any]:
    """Write the reports of a small registration and of surfaces."""
    rng = np.random.default_rng(3)
    plane = np.column_stack([rng.uniform(0, 1, (4000, 2)), 1e-3 * rng.normal(size=4000)])
    normals = rng.normal(size=(4000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    ball = [0.5, 0.5, 0.4] + 0.2 * normals
    found = surfsig.find_surfaces(np.concatenate([plane, ball]))
    found.write_report(path, title="Plane & <ball>")
    return {"surfaces": len(found), "rows": [list(row) for row in found.table()[1]]}


if __name__ == "__main__":
    command: dict[str, Callable[..., Any]] = {
        "curvature": curvature,
        "surfaces": surfaces,
        "files": files,
        "saved": saved_points,
        "report": report,
    }
    sys.stdout.write(json.dumps(command[sys.argv[1]](*sys.argv[2:])))
