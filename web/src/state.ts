/** What the page knows: one object, which the panels show and the application changes. */

import type { Surfaces } from "./engine/surfsig.js";
import type { Layer } from "./view/layer.js";

export const UNITS = ["unit", "m", "mm", "cm", "ft"] as const;
export type Unit = (typeof UNITS)[number];

export interface State {
  /** The layer that is worked on: the scan, or a report's first layer. */
  layer: Layer | null;
  /** What kind of file it was. */
  format: string;
  leftOut: number;
  unit: Unit;
  /** Median distance to the nearest point; 0 while it is not known. */
  spacing: number;
  /** Of the next computation, and of the last one; null before the first. */
  radius: number;
  auto: boolean;
  computedRadius: number | "auto" | null;
  /** Whether normals and curvature have signs that a viewpoint gives. */
  oriented: boolean;
  /** Number of the sample; null for a file. */
  sample: string | null;
  quantity: string;
  eyeDome: boolean;
  lit: boolean;
  pointSize: number;
  /** Clicked points. */
  first: number | null;
  second: number | null;
  found: Surfaces | null;
  /** Numbers of chosen rows, at most two. */
  chosen: number[];
  /** What runs, in words; null where nothing does. */
  running: string | null;
}

export function initialState(): State {
  return {
    layer: null,
    format: "",
    leftOut: 0,
    unit: "unit",
    spacing: 0,
    radius: 0,
    auto: false,
    computedRadius: null,
    oriented: false,
    sample: null,
    quantity: "height",
    eyeDome: true,
    lit: true,
    pointSize: 1,
    first: null,
    second: null,
    found: null,
    chosen: [],
    running: null,
  };
}

/** A radius of so many spacings is a start, as `surfsig info` says; the larger one has the smaller errors. */
export const [FEWEST_SPACINGS, MOST_SPACINGS] = [5, 10];

export const suggestedRadius = (spacing: number): number => Number((MOST_SPACINGS * spacing).toPrecision(2));
