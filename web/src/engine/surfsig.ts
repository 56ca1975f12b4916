/** What the page asks of the core: spacing, curvature, similarities and surfaces of one cloud. */

import { EngineError, type EngineModule, type Progress } from "./module.js";

/** Curvature at some points of the cloud; NaN where there is none. Curvatures are per unit of length. */
export interface Curvature {
  k1: Float32Array<ArrayBuffer>;
  k2: Float32Array<ArrayBuffer>;
  k1Std: Float32Array<ArrayBuffer>;
  k2Std: Float32Array<ArrayBuffer>;
  meanStd: Float32Array<ArrayBuffer>;
  residual: Float32Array<ArrayBuffer>;
  count: Int32Array<ArrayBuffer>;
  status: Uint8Array<ArrayBuffer>;
  /** (n, 3), row by row, towards the viewpoint where that is known. */
  normals: Float32Array<ArrayBuffer>;
  /** Radius of each ball where points chose it; empty where all have one. */
  radii: Float32Array<ArrayBuffer>;
  oriented: boolean;
}

export const KINDS = ["plane", "sphere", "cylinder", "cone", "torus"] as const;

/** A surface that was found; lengths in the cloud's unit, NaN for what its kind has not. */
export interface Surface {
  kind: (typeof KINDS)[number];
  point: [number, number, number];
  axis: [number, number, number];
  radius: number;
  radiusStd: number;
  majorRadius: number;
  majorRadiusStd: number;
  halfAngle: number;
  halfAngleStd: number;
  /** Root mean square of the points' distances. */
  deviation: number;
  count: number;
  /** Degrees of freedom of the standard errors, for Student's t. */
  freedom: number;
}

export interface Surfaces {
  surfaces: Surface[];
  /** The number of each point's surface; -1 for none. */
  labels: Int32Array<ArrayBuffer>;
}

/** A cloud inside the engine. Coordinates are offsets from `origin`. */
export class EngineCloud {
  private readonly cloud: number;
  /** The last extraction of all points, which similarities are taken of. */
  private extraction = 0;

  constructor(
    private readonly engine: EngineModule,
    positions: Float32Array,
    origin: readonly number[],
    private readonly viewpoint: readonly number[] | null,
  ) {
    const points = engine.put(positions);
    const base = engine.put(Float64Array.from(origin));
    this.cloud = engine.make("surfsig_cloud_new_f32", points.pointer, positions.length / 3, 12, base.pointer);
    engine.release(base);
  }

  spacing(): number {
    return this.engine.value("surfsig_cloud_spacing", this.cloud);
  }

  /** Curvature at all points (`indices` null), or at some. Radius "auto": each point chooses its own. */
  extract(radius: number | "auto", indices: Uint32Array | null, progress: Progress): Curvature {
    const { engine } = this;
    const options = engine.value("surfsig_options_new");
    const chosen = indices === null ? null : engine.put(indices);
    const viewpoint = this.viewpoint === null ? null : engine.put(Float64Array.from(this.viewpoint));
    let made = 0;
    try {
      engine.call("surfsig_options_set_progress", options, engine.progressPointer, 0);
      if (viewpoint !== null) engine.call("surfsig_options_set_viewpoint", options, viewpoint.pointer);
      if (chosen !== null) {
        engine.call("surfsig_options_set_indices", options, chosen.pointer, chosen.bytes / 4);
      }
      made = engine.watched(progress, () =>
        radius === "auto"
          ? engine.make("surfsig_extract_auto_radius", this.cloud, options)
          : engine.make("surfsig_extract", this.cloud, radius, options),
      );
      const curvature = this.columns(made);
      if (indices === null) {
        if (this.extraction !== 0) engine.value("surfsig_extraction_free", this.extraction);
        this.extraction = made;
        made = 0;
      }
      return curvature;
    } finally {
      if (made !== 0) engine.value("surfsig_extraction_free", made);
      if (chosen !== null) engine.release(chosen);
      if (viewpoint !== null) engine.release(viewpoint);
      engine.value("surfsig_options_free", options);
    }
  }

  private columns(extraction: number): Curvature {
    const { engine } = this;
    const n = engine.value("surfsig_extraction_size", extraction);
    const pointer = (name: string): number => engine.value(`surfsig_extraction_${name}`, extraction);
    const floats = (name: string, width = 1): Float32Array<ArrayBuffer> =>
      pointer(name) === 0 ? new Float32Array(0) : engine.floats(pointer(name), n * width);
    return {
      k1: floats("k1"),
      k2: floats("k2"),
      k1Std: floats("k1_std"),
      k2Std: floats("k2_std"),
      meanStd: floats("mean_curvature_std"),
      residual: floats("residual"),
      count: engine.integers(pointer("count"), n),
      status: engine.bytes(pointer("status"), n),
      normals: floats("normals", 3),
      radii: floats("radii"),
      oriented: pointer("oriented") === 1,
    };
  }

  /** zeta of all points with one of them; curvature of all must have been extracted. */
  similarities(query: number): Float32Array<ArrayBuffer> {
    const { engine, extraction } = this;
    if (extraction === 0) throw new EngineError("curvature has not been computed yet");
    const n = engine.value("surfsig_extraction_size", extraction);
    const flat = engine.value("surfsig_flat_atom_length", extraction);
    const zeta = engine.allocate(4 * n);
    try {
      engine.call("surfsig_similarities", extraction, query, flat, zeta.pointer);
      return engine.floats(zeta.pointer, n);
    } finally {
      engine.release(zeta);
    }
  }

  findSurfaces(progress: Progress): Surfaces {
    const { engine } = this;
    const options = engine.value("surfsig_surface_options_new");
    let found = 0;
    try {
      engine.call("surfsig_surface_options_set_progress", options, engine.progressPointer, 0);
      found = engine.watched(progress, () => engine.make("surfsig_find_surfaces", this.cloud, options));
      const n = engine.value("surfsig_surfaces_size", found);
      const pointer = (name: string): number => engine.value(`surfsig_surfaces_${name}`, found);
      const doubles = (name: string, width = 1): Float64Array =>
        n === 0 ? new Float64Array(0) : engine.doubles(pointer(name), n * width);
      const kinds = n === 0 ? new Uint8Array(0) : engine.bytes(pointer("kind"), n);
      const counts = n === 0 ? new Int32Array(0) : engine.integers(pointer("count"), n);
      const [points, axes] = [doubles("point", 3), doubles("axis", 3)];
      const columns = {
        radius: doubles("radius"),
        radiusStd: doubles("radius_std"),
        majorRadius: doubles("major_radius"),
        majorRadiusStd: doubles("major_radius_std"),
        halfAngle: doubles("half_angle"),
        halfAngleStd: doubles("half_angle_std"),
        deviation: doubles("deviation"),
        freedom: doubles("freedom"),
      };
      const vector = (rows: Float64Array, i: number): [number, number, number] => [
        rows[3 * i],
        rows[3 * i + 1],
        rows[3 * i + 2],
      ];
      const surfaces = Array.from(kinds, (kind, i): Surface => {
        const values = Object.entries(columns).map(([name, column]) => [name, column[i]]);
        return {
          kind: KINDS[kind],
          point: vector(points, i),
          axis: vector(axes, i),
          count: counts[i],
          ...(Object.fromEntries(values) as Record<keyof typeof columns, number>),
        };
      });
      const labels = engine.integers(pointer("labels"), engine.value("surfsig_surfaces_label_count", found));
      return { surfaces, labels };
    } finally {
      if (found !== 0) engine.value("surfsig_surfaces_free", found);
      engine.value("surfsig_surface_options_free", options);
    }
  }
}
