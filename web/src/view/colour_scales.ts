/** Scales of colours: diverging about 0, sequential, and colours that tell things apart. */

import type { Rgb } from "./layer.js";

/** A point without a value. */
export const GREY: Rgb = [150, 150, 150];

/** Blue, grey, red, of equal lightness to both sides (after Moreland 2009). */
const DIVERGING: Rgb[] = [
  [38, 66, 160],
  [76, 122, 206],
  [139, 178, 228],
  [221, 221, 219],
  [240, 168, 132],
  [211, 92, 72],
  [153, 18, 38],
];

/** Viridis. */
const SEQUENTIAL: Rgb[] = [
  [68, 1, 84],
  [70, 50, 127],
  [54, 92, 141],
  [39, 127, 142],
  [31, 161, 135],
  [74, 194, 109],
  [159, 218, 58],
  [253, 231, 37],
];

export type ScaleKind = "diverging" | "sequential";

const STOPS: Record<ScaleKind, Rgb[]> = { diverging: DIVERGING, sequential: SEQUENTIAL };

/** Colours of a table, for values from 0 to 255. */
const TABLE_SIZE = 256;

const tables = new Map<ScaleKind, Uint8Array>();

function tableOf(kind: ScaleKind): Uint8Array {
  let table = tables.get(kind);
  if (table === undefined) {
    table = new Uint8Array(3 * TABLE_SIZE);
    for (let i = 0; i < TABLE_SIZE; i++) table.set(between(STOPS[kind], i / (TABLE_SIZE - 1)), 3 * i);
    tables.set(kind, table);
  }
  return table;
}

function between(stops: Rgb[], share: number): Rgb {
  const at = share * (stops.length - 1);
  const below = Math.min(Math.floor(at), stops.length - 2);
  return stops[below].map((c, i) => Math.round(c + (at - below) * (stops[below + 1][i] - c))) as Rgb;
}

/** The scale as a CSS gradient, from low to high. */
export function gradient(kind: ScaleKind): string {
  return `linear-gradient(to right, ${STOPS[kind].map((rgb) => css(rgb)).join(", ")})`;
}

export const css = ([r, g, b]: Rgb): string => `rgb(${r}, ${g}, ${b})`;

/** Colours for numbers between two ends; grey where there is no number. */
export function colourNumbers(
  values: Float32Array,
  kind: ScaleKind,
  low: number,
  high: number,
): Uint8Array<ArrayBuffer> {
  const table = tableOf(kind);
  const colours = new Uint8Array(3 * values.length);
  const factor = high > low ? (TABLE_SIZE - 1) / (high - low) : 0;
  for (let i = 0; i < values.length; i++) {
    const value = values[i];
    if (Number.isNaN(value)) {
      colours[3 * i] = colours[3 * i + 1] = colours[3 * i + 2] = GREY[0];
      continue;
    }
    const middle = factor === 0 ? (TABLE_SIZE - 1) / 2 : (value - low) * factor;
    const at = 3 * Math.min(Math.max(Math.round(middle), 0), TABLE_SIZE - 1);
    colours[3 * i] = table[at];
    colours[3 * i + 1] = table[at + 1];
    colours[3 * i + 2] = table[at + 2];
  }
  return colours;
}

const GOLDEN = (Math.sqrt(5) - 1) / 2;

/** A colour for each number, such that no two of many are alike; as surfsig.colors gives them. */
export function distinctColour(number: number): Rgb {
  const hue = (0.6 + number * GOLDEN) % 1;
  const lightness = [0.45, 0.62, 0.35][number % 3];
  const reach = lightness <= 0.5 ? lightness * 1.75 : lightness + 0.75 - lightness * 0.75;
  const base = 2 * lightness - reach;
  const channel = (shift: number): number => {
    const at = (hue + shift + 1) % 1;
    if (at < 1 / 6) return base + (reach - base) * at * 6;
    if (at < 0.5) return reach;
    if (at < 2 / 3) return base + (reach - base) * (2 / 3 - at) * 6;
    return base;
  };
  return [channel(1 / 3), channel(0), channel(-1 / 3)].map((c) => Math.round(255 * c)) as Rgb;
}

/** Values looked at for the ends of a scale. */
const MOST_SAMPLED = 200_000;

/** Values of numbers below which shares of them lie; those that are not finite do not count. */
export function quantiles(values: Float32Array, shares: number[]): number[] {
  const step = Math.max(1, Math.floor(values.length / MOST_SAMPLED));
  const sampled: number[] = [];
  for (let i = 0; i < values.length; i += step) if (Number.isFinite(values[i])) sampled.push(values[i]);
  const sorted = Float64Array.from(sampled).sort();
  return shares.map((share) => (sorted.length === 0 ? NaN : sorted[Math.round(share * (sorted.length - 1))]));
}
