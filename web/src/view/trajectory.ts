/** A trajectory as a line, with the ellipsoids of its positions' covariances. */

import {
  BufferGeometry,
  Float32BufferAttribute,
  Group,
  Line,
  LineBasicMaterial,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
} from "three";
import type { Vector } from "../files/cloud.js";
import type { Trajectory } from "../report_data.js";

/** Standard deviations that an ellipsoid reaches. */
export const ELLIPSOID_DEVIATIONS = 3;

export function drawnTrajectory({ positions, covariances }: Trajectory, origin: Vector): Group {
  const group = new Group();
  const offsets = positions.map((place) => place.map((c, axis) => c - origin[axis]) as Vector);
  const line = new BufferGeometry();
  line.setAttribute("position", new Float32BufferAttribute(offsets.flat(), 3));
  group.add(new Line(line, new LineBasicMaterial({ color: 0xd2492a })));
  const sphere = new SphereGeometry(ELLIPSOID_DEVIATIONS, 20, 14);
  const material = new MeshBasicMaterial({ color: 0xe8894a, wireframe: true });
  for (const { pose, matrix } of covariances) {
    const root = symmetricRoot(matrix);
    const mesh = new Mesh(sphere, material);
    mesh.matrixAutoUpdate = false;
    const [r, at] = [root, offsets[pose]];
    mesh.matrix = new Matrix4().set(
      r[0],
      r[1],
      r[2],
      at[0],
      r[3],
      r[4],
      r[5],
      at[1],
      r[6],
      r[7],
      r[8],
      at[2],
      0,
      0,
      0,
      1,
    );
    group.add(mesh);
  }
  return group;
}

/** The lower Cholesky factor of a covariance, which makes a sphere its ellipsoid. */
function symmetricRoot(c: number[]): number[] {
  const safe = (value: number): number => Math.sqrt(Math.max(value, 0));
  const [a, b] = [safe(c[0]), 1e-12];
  const d = c[3] / Math.max(a, b);
  const e = safe(c[4] - d * d);
  const f = c[6] / Math.max(a, b);
  const g = (c[7] - f * d) / Math.max(e, b);
  return [a, 0, 0, d, e, 0, f, g, safe(c[8] - f * f - g * g)];
}
