/** Curvature of a layer by the engine: what is in view first, then all. */

import type { Engine } from "./engine/client.js";
import type { Curvature } from "./engine/surfsig.js";
import type { CloudData } from "./files/cloud.js";
import type { State, Unit } from "./state.js";
import type { Layer } from "./view/layer.js";

/** Share of the points in view above which all are computed at once. */
const MOST_IN_VIEW = 0.6;

/** Points below which all are computed at once. */
const FEWEST_FOR_PART = 50_000;

export function layerOf(cloud: CloudData): Layer {
  const normalNames = ["nx", "ny", "nz"];
  const own = normalNames.every((name) => name in cloud.fields);
  const normals = own ? new Float32Array(3 * cloud.count) : null;
  normalNames.forEach((name, axis) => {
    for (let i = 0; normals !== null && i < cloud.count; i++) normals[3 * i + axis] = cloud.fields[name][i];
  });
  return {
    name: cloud.name,
    count: cloud.count,
    positions: cloud.positions,
    origin: cloud.origin,
    normals,
    colours: cloud.colours,
    colour: null,
    columns: new Map(Object.entries(cloud.fields).filter(([name]) => !normalNames.includes(name))),
    labels: null,
    labelName: "Surface",
    viewpoint: cloud.viewpoint,
    stage: null,
    transform: null,
  };
}

/** The unit that is known: of the samples, which are in metres, and of LAS files, which are nearly always. */
export function unitOf(cloud: CloudData, sample: string | null): Unit {
  return sample !== null || /^LA[SZ]/.test(cloud.format) ? "m" : "unit";
}

/** Computes, and calls `shown` whenever the layer's columns have new values: first with `true`. */
export async function computeCurvature(
  engine: Engine,
  layer: Layer,
  state: State,
  inView: Uint32Array<ArrayBuffer>,
  progress: (share: number) => void,
  shown: (first: boolean) => void,
): Promise<void> {
  const radius = state.auto ? "auto" : state.radius;
  let first = true;
  if (layer.count > FEWEST_FOR_PART && inView.length > 0 && inView.length < MOST_IN_VIEW * layer.count) {
    const part = await engine.ask({ kind: "extract", radius, indices: inView }, progress);
    setColumns(layer, part, inView, state);
    shown(first);
    first = false;
  }
  const all = await engine.ask({ kind: "extract", radius, indices: null }, progress);
  setColumns(layer, all, null, state);
  shown(first);
}

/** Puts values into the layer's columns, of some points or of all. */
function setColumns(layer: Layer, curvature: Curvature, indices: Uint32Array | null, state: State): void {
  const { k1, k2, count, status, radii } = curvature;
  const values: Record<string, ArrayLike<number>> = {
    mean_curvature: k1.map((k, i) => (k + k2[i]) / 2),
    gaussian_curvature: k1.map((k, i) => k * k2[i]),
    k1,
    k2,
    k1_std: curvature.k1Std,
    k2_std: curvature.k2Std,
    mean_curvature_std: curvature.meanStd,
    residual: curvature.residual,
    count,
    status,
  };
  if (radii.length > 0) values.radius = radii;
  else layer.columns.delete("radius");
  state.oriented = curvature.oriented;
  layer.columns.delete("zeta");
  for (const [name, column] of Object.entries(values)) {
    layer.columns.set(name, merged(layer.columns.get(name), column, indices, layer.count, 1));
  }
  layer.normals = merged(layer.normals ?? undefined, curvature.normals, indices, layer.count, 3);
}

function merged(
  before: Float32Array<ArrayBuffer> | undefined,
  values: ArrayLike<number>,
  indices: Uint32Array | null,
  count: number,
  width: number,
): Float32Array<ArrayBuffer> {
  if (indices === null) return Float32Array.from(values);
  const all = before ?? new Float32Array(width * count).fill(NaN);
  for (let i = 0; i < indices.length; i++) {
    for (let k = 0; k < width; k++) all[width * indices[i] + k] = values[width * i + k];
  }
  return all;
}
