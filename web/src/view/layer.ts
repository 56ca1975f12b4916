/** What is drawn: points that belong together, with all that is known of each. */

import type { Vector } from "../files/cloud.js";

/** Whether something is shown before or after what was computed; both where it is null. */
export type Stage = "before" | "after" | null;

export type Rgb = [number, number, number];

export interface Layer {
  name: string;
  count: number;
  /** Offsets from `origin`, (n, 3), row by row. */
  positions: Float32Array<ArrayBuffer>;
  origin: Vector;
  normals: Float32Array<ArrayBuffer> | null;
  /** Of each point, 0 to 255, (n, 3). */
  colours: Uint8Array<ArrayBuffer> | null;
  /** Of all points, where a report gives one. */
  colour: Rgb | null;
  /** Numbers of each point, by name. */
  columns: Map<string, Float32Array<ArrayBuffer>>;
  /** Of each point the number of its row in the table; -1 for none. */
  labels: Int32Array<ArrayBuffer> | null;
  /** What a label is: "Surface", "Instance". */
  labelName: string;
  viewpoint: Vector | null;
  stage: Stage;
  /** T_target_source, row by row, that the points are moved by between before and after. */
  transform: number[] | null;
}

/** A layer of one point at 0. */
export function onePoint(): Layer {
  return {
    name: "",
    count: 1,
    positions: new Float32Array(3),
    origin: [0, 0, 0],
    normals: null,
    colours: null,
    colour: null,
    columns: new Map(),
    labels: null,
    labelName: "",
    viewpoint: null,
    stage: null,
    transform: null,
  };
}

/** Low and high corner of a layer's offsets. */
export function boundsOf(layer: Layer): { low: Vector; high: Vector } {
  const low: Vector = [Infinity, Infinity, Infinity];
  const high: Vector = [-Infinity, -Infinity, -Infinity];
  const { positions } = layer;
  for (let i = 0; i < positions.length; i++) {
    const axis = i % 3;
    if (positions[i] < low[axis]) low[axis] = positions[i];
    if (positions[i] > high[axis]) high[axis] = positions[i];
  }
  return { low, high };
}
