/** What the page and the worker tell each other. */

import type { CloudData } from "../files/cloud.js";
import type { Curvature, Surfaces } from "./surfsig.js";

/** A piece of work for the worker, each with a number that its answers carry. */
export type Request =
  | { kind: "start"; engine: ArrayBuffer }
  | { kind: "read"; name: string; bytes: ArrayBuffer }
  | { kind: "load"; positions: Float32Array; origin: number[]; viewpoint: number[] | null }
  | { kind: "extract"; radius: number | "auto"; indices: Uint32Array | null }
  | { kind: "similarities"; query: number }
  | { kind: "surfaces" };

/** What each request gives. */
export interface Results {
  start: null;
  read: CloudData;
  load: { spacing: number };
  extract: Curvature;
  similarities: Float32Array<ArrayBuffer>;
  surfaces: Surfaces;
}

export type Answer =
  | { id: number; progress: number }
  | { id: number; result: Results[keyof Results] }
  | { id: number; error: string };
