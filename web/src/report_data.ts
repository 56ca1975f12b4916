/** The data inside a report, as surfsig.page writes them. */

import type { Vector } from "./files/cloud.js";
import { fromBase64, gunzip } from "./unpack.js";
import type { Layer, Rgb, Stage } from "./view/layer.js";

/** An array in the packed bytes, which begins at `start`. */
interface Packed {
  /** delta16: differences of 16-bit numbers; float16; log8: logarithms in 8 bits; int8; uint8; int32. All but int8
   * and uint8 as planes of bytes, the lowest first. */
  type: "delta16" | "float16" | "log8" | "int8" | "uint8" | "int32";
  start: number;
  /** Value of a number's 0, and of its 1. */
  low: number;
  step: number;
}

interface PackedLayer {
  name: string;
  count: number;
  /** How many points there were before some were chosen. */
  total: number;
  origin: Vector;
  axes: Packed[];
  /** Two coordinates on an octahedron. */
  normals: Packed[] | null;
  colours: Packed[] | null;
  colour: Rgb | null;
  labels: Packed | null;
  labelName: string;
  columns: { name: string; values: Packed }[];
  stage: Stage;
  transform: number[] | null;
}

/** A path of poses: positions, and standard deviations along the axes of their ellipsoids. */
export interface Trajectory {
  name: string;
  positions: Vector[];
  /** Of some poses: number, and covariance of the position, row by row. */
  covariances: { pose: number; matrix: number[] }[];
}

export interface Report {
  title: string;
  text: string;
  unit: string;
  /** What the points are coloured by at first. */
  quantity: string;
  header: string[];
  rows: string[][];
  trajectory: Trajectory | null;
  layers: (Layer & { total: number })[];
}

interface Written extends Omit<Report, "layers"> {
  layers: PackedLayer[];
  bytes: string;
}

export async function readReport(text: string): Promise<Report> {
  const { layers, bytes, ...rest } = JSON.parse(text) as Written;
  const data = new Uint8Array(await gunzip(fromBase64(bytes)));
  return { ...rest, layers: layers.map((layer) => layerOf(layer, data)) };
}

function layerOf(packed: PackedLayer, data: Uint8Array): Layer & { total: number } {
  const { count } = packed;
  const numbers = (array: Packed): Float32Array<ArrayBuffer> => unpacked(array, count, data);
  const interleaved = (arrays: Packed[]): Float32Array<ArrayBuffer> => {
    const all = new Float32Array(arrays.length * count);
    arrays.map(numbers).forEach((values, k) => {
      for (let i = 0; i < count; i++) all[arrays.length * i + k] = values[i];
    });
    return all;
  };
  return {
    name: packed.name,
    count,
    total: packed.total,
    origin: packed.origin,
    positions: interleaved(packed.axes),
    normals: packed.normals === null ? null : fromOctahedron(interleaved(packed.normals)),
    colours: packed.colours === null ? null : Uint8Array.from(interleaved(packed.colours)),
    colour: packed.colour,
    labels: packed.labels === null ? null : Int32Array.from(numbers(packed.labels)),
    columns: withMeans(new Map(packed.columns.map(({ name, values }) => [name, numbers(values)]))),
    labelName: packed.labelName,
    viewpoint: null,
    stage: packed.stage,
    transform: packed.transform,
  };
}

/** Adds H and K, which k1 and k2 give. */
function withMeans(columns: Layer["columns"]): Layer["columns"] {
  const [k1, k2] = [columns.get("k1"), columns.get("k2")];
  if (k1 !== undefined && k2 !== undefined) {
    columns.set(
      "mean_curvature",
      k1.map((k, i) => (k + k2[i]) / 2),
    );
    columns.set(
      "gaussian_curvature",
      k1.map((k, i) => k * k2[i]),
    );
  }
  return columns;
}

function unpacked(
  { type, start, low, step }: Packed,
  count: number,
  data: Uint8Array,
): Float32Array<ArrayBuffer> {
  const values = new Float32Array(count);
  const plane = (number: number): Uint8Array =>
    data.subarray(start + number * count, start + (number + 1) * count);
  if (type === "delta16") {
    const [below, above] = [plane(0), plane(1)];
    let sum = 0;
    for (let i = 0; i < count; i++) {
      sum = (sum + below[i] + 256 * above[i]) & 0xffff;
      values[i] = low + step * sum;
    }
  } else if (type === "float16") {
    const [below, above, table] = [plane(0), plane(1), halves()];
    for (let i = 0; i < count; i++) values[i] = step * table[below[i] + 256 * above[i]];
  } else if (type === "log8") {
    const logs = plane(0);
    // 255 stands for a number that is not known, 0 for 0.
    for (let i = 0; i < count; i++) {
      values[i] = logs[i] === 255 ? NaN : logs[i] === 0 ? 0 : Math.exp(low + step * logs[i]);
    }
  } else if (type === "int32") {
    const planes = [0, 1, 2, 3].map(plane);
    for (let i = 0; i < count; i++) {
      values[i] = planes[0][i] | (planes[1][i] << 8) | (planes[2][i] << 16) | (planes[3][i] << 24);
    }
  } else {
    const bytes = plane(0);
    for (let i = 0; i < count; i++)
      values[i] = low + step * (type === "int8" ? (bytes[i] << 24) >> 24 : bytes[i]);
  }
  return values;
}

let table: Float32Array | null = null;

/** The values of all half precision numbers. */
function halves(): Float32Array {
  if (table === null) {
    table = Float32Array.from({ length: 65536 }, (_, bits) => {
      const sign = bits & 0x8000 ? -1 : 1;
      const [exponent, fraction] = [(bits >> 10) & 31, bits & 1023];
      if (exponent === 31) return fraction === 0 ? sign * Infinity : NaN;
      return sign * (exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15));
    });
  }
  return table;
}

/** Unit vectors of two coordinates each (Meyer et al. 2010); (-1, -1) beyond the octahedron's corner stands for none. */
function fromOctahedron(flat: Float32Array): Float32Array<ArrayBuffer> {
  const normals = new Float32Array((flat.length / 2) * 3);
  for (let i = 0; 2 * i < flat.length; i++) {
    const [u, v] = [flat[2 * i], flat[2 * i + 1]];
    if (u < -1) {
      normals.fill(NaN, 3 * i, 3 * i + 3);
      continue;
    }
    const z = 1 - Math.abs(u) - Math.abs(v);
    const [x, y] =
      z >= 0 ? [u, v] : [(1 - Math.abs(v)) * Math.sign(u || 1), (1 - Math.abs(u)) * Math.sign(v || 1)];
    const length = Math.hypot(x, y, z);
    normals.set([x / length, y / length, z / length], 3 * i);
  }
  return normals;
}
