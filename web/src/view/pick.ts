/** Which point a click means, and which points are in view. */

import { Matrix4, type PerspectiveCamera, Vector3 } from "three";
import type { PointLayer } from "./points.js";

/** Pixels around the click in which points count. */
const REACH = 7;

export interface Picked {
  layer: PointLayer;
  point: number;
}

/** What takes a point of a layer to the screen: pixels, and the depth before the eye. */
export function projector(
  layer: PointLayer,
  camera: PerspectiveCamera,
  width: number,
  height: number,
): (point: number, to: Vector3) => Vector3 {
  const view = new Matrix4().multiplyMatrices(camera.matrixWorldInverse, layer.group.matrixWorld);
  const m = new Matrix4().multiplyMatrices(camera.projectionMatrix, view).elements;
  const { positions } = layer.layer;
  return (point, to) => {
    const [x, y, z] = [positions[3 * point], positions[3 * point + 1], positions[3 * point + 2]];
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    const right = (m[0] * x + m[4] * y + m[8] * z + m[12]) / w;
    const up = (m[1] * x + m[5] * y + m[9] * z + m[13]) / w;
    return to.set((0.5 + 0.5 * right) * width, (0.5 - 0.5 * up) * height, w);
  };
}

/** The nearest point to the viewer of those close to the click; null where there is none. */
export function pick(
  layers: PointLayer[],
  camera: PerspectiveCamera,
  width: number,
  height: number,
  x: number,
  y: number,
): Picked | null {
  let best: Picked | null = null;
  let leastCost = Infinity;
  const seen = new Vector3();
  for (const layer of layers) {
    const project = projector(layer, camera, width, height);
    for (let point = 0; point < layer.layer.count; point++) {
      project(point, seen);
      if (seen.z <= camera.near) continue;
      const square = (seen.x - x) ** 2 + (seen.y - y) ** 2;
      if (square > REACH * REACH) continue;
      // A point in front counts before one behind it that is a little closer to the click.
      const cost = seen.z * (1 + (0.004 * square) / REACH);
      if (cost < leastCost) {
        leastCost = cost;
        best = { layer, point };
      }
    }
  }
  return best;
}

/** Numbers of a layer's points that are on the screen. */
export function inView(
  layer: PointLayer,
  camera: PerspectiveCamera,
  width: number,
  height: number,
): Uint32Array<ArrayBuffer> {
  const project = projector(layer, camera, width, height);
  const numbers = new Uint32Array(layer.layer.count);
  const seen = new Vector3();
  let count = 0;
  for (let point = 0; point < layer.layer.count; point++) {
    project(point, seen);
    if (seen.z > 0 && seen.x >= 0 && seen.x <= width && seen.y >= 0 && seen.y <= height)
      numbers[count++] = point;
  }
  return numbers.slice(0, count);
}
