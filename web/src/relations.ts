/** Distance and angle between two surfaces. */

import type { Surface } from "./engine/surfsig.js";
import type { Vector } from "./files/cloud.js";

export interface Relation {
  /** In degrees, 0 to 90; null where one of them has no direction. */
  angle: number | null;
  /** In the cloud's unit; null where it has no meaning, as between planes that cross. */
  distance: number | null;
  /** Between what the distance is. */
  told: string;
}

/** Degrees within which planes and axes count as parallel. */
const PARALLEL = 5;

const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a: Vector, b: Vector): Vector => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const norm = (a: Vector): number => Math.sqrt(dot(a, a));

/** Angle between two lines, in degrees, 0 to 90. */
const between = (a: Vector, b: Vector): number =>
  (Math.atan2(norm(cross(a, b)), Math.abs(dot(a, b))) * 180) / Math.PI;

const fromLine = (point: Vector, on: Vector, axis: Vector): number => norm(cross(minus(point, on), axis));

export function relation(a: Surface, b: Surface): Relation {
  const [first, second] = [a, b].map((surface) =>
    surface.kind === "plane" ? "plane" : surface.kind === "sphere" ? "centre" : "axis",
  );
  if (first === second) {
    if (first === "centre")
      return { angle: null, distance: norm(minus(b.point, a.point)), told: "between the centres" };
    const angle = between(a.axis, b.axis);
    if (first === "plane") {
      const parallel = angle <= PARALLEL;
      const apart = minus(b.point, a.point);
      // The mean of what either plane says, for neither is exactly parallel.
      const distance = 0.5 * (Math.abs(dot(apart, a.axis)) + Math.abs(dot(apart, b.axis)));
      return { angle, distance: parallel ? distance : null, told: "between the planes" };
    }
    if (angle <= PARALLEL)
      return { angle, distance: fromLine(b.point, a.point, a.axis), told: "between the axes" };
    const normal = cross(a.axis, b.axis);
    const distance = Math.abs(dot(minus(b.point, a.point), normal)) / norm(normal);
    return { angle, distance, told: "between the axes, where they are nearest" };
  }
  const [one, other] = first === "plane" || second === "centre" ? [a, b] : [b, a];
  if (one.kind === "plane") {
    const distance = Math.abs(dot(minus(other.point, one.point), one.axis));
    if (other.kind === "sphere") return { angle: null, distance, told: "from the centre to the plane" };
    const angle = 90 - between(one.axis, other.axis);
    return { angle, distance: angle <= PARALLEL ? distance : null, told: "from the axis to the plane" };
  }
  return {
    angle: null,
    distance: fromLine(other.point, one.point, one.axis),
    told: "from the centre to the axis",
  };
}
