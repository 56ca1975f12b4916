/** What points can be coloured by: numbers on a scale, or classes. */

import { colourNumbers, css, distinctColour, GREY, quantiles, type ScaleKind } from "./view/colour_scales.js";
import type { Layer, Rgb } from "./view/layer.js";

/** A legend's line: a colour and its meaning. */
export interface Entry {
  colour: string;
  text: string;
}

export interface Coloured {
  colours: Uint8Array<ArrayBuffer>;
  scale: { kind: ScaleKind; low: number; high: number } | null;
  entries: Entry[];
}

export interface Quantity {
  id: string;
  name: string;
  /** Power of the unit of length: -1 for curvature. */
  power: number;
  colour(layer: Layer): Coloured;
}

/** Shares of the values between which a scale runs: a few that are far out would leave all others one colour. */
const SHOWN = [0.025, 0.975];
const SHOWN_OF_SIZES = 0.95;

/** Standard errors from which a curvature differs from 0: 99 % of chance values are below. */
const SIGNIFICANT = 2.576;

const CURVATURE_CLASSES: { name: string; colour: Rgb }[] = [
  { name: "flat within its error", colour: [176, 182, 190] },
  { name: "curved one way (cylinder, cone)", colour: [54, 124, 196] },
  { name: "curved both ways alike (sphere, bump)", colour: [221, 126, 60] },
  { name: "saddle", colour: [130, 92, 184] },
];

const ZETA_CLASSES: { name: string; colour: Rgb }[] = [
  { name: "optimal, zeta 0.9 and above", colour: [33, 130, 92] },
  { name: "good, 0.5 to 0.9", colour: [222, 178, 66] },
  { name: "dissimilar, below 0.5", colour: [196, 202, 208] },
];

/** zeta from which on two surfaces are optimally and well similar, section III of the paper. */
export const [OPTIMAL, GOOD] = [0.9, 0.5];

export function similarityClass(zeta: number): string {
  return zeta >= OPTIMAL ? "optimal" : zeta >= GOOD ? "good" : zeta >= 0 ? "dissimilar" : "not known";
}

/** Ends of a scale that is symmetric about 0. */
function onDivergingScale(values: Float32Array): Coloured {
  const [end] = quantiles(values.map(Math.abs), [SHOWN_OF_SIZES]);
  const high = end > 0 ? end : 1;
  return {
    colours: colourNumbers(values, "diverging", -high, high),
    scale: { kind: "diverging", low: -high, high },
    entries: [],
  };
}

function onSequentialScale(values: Float32Array, ends?: [number, number]): Coloured {
  const [low, high] = ends ?? quantiles(values, SHOWN);
  return {
    colours: colourNumbers(values, "sequential", low, high),
    scale: { kind: "sequential", low, high },
    entries: [],
  };
}

function byClass(numbers: Int8Array | Int32Array, classes: { name: string; colour: Rgb }[]): Coloured {
  const colours = new Uint8Array(3 * numbers.length);
  const present = new Set<number>();
  for (let i = 0; i < numbers.length; i++) {
    present.add(numbers[i]);
    colours.set(classes[numbers[i]]?.colour ?? GREY, 3 * i);
  }
  const entries = classes
    .map(({ name, colour }, i) => ({ number: i, colour: css(colour), text: name }))
    .filter(({ number }) => present.has(number));
  if ([...present].some((number) => classes[number] === undefined)) {
    entries.push({ number: -1, colour: css(GREY), text: "no value" });
  }
  return { colours, scale: null, entries };
}

function plain(count: number, colour: Rgb): Uint8Array<ArrayBuffer> {
  const colours = new Uint8Array(3 * count);
  for (let i = 0; i < count; i++) colours.set(colour, 3 * i);
  return colours;
}

function curvatureClass(layer: Layer): Int8Array {
  const [k1, k2, s1, s2] = ["k1", "k2", "k1_std", "k2_std"].map((name) => column(layer, name));
  return Int8Array.from(k1, (_, i) => {
    if (Number.isNaN(k1[i])) return -1;
    const one = Math.abs(k1[i]) > SIGNIFICANT * s1[i];
    const two = Math.abs(k2[i]) > SIGNIFICANT * s2[i];
    if (!one && !two) return 0;
    return one && two ? (k1[i] * k2[i] > 0 ? 2 : 3) : 1;
  });
}

function byNormal(normals: Float32Array): Coloured {
  const colours = new Uint8Array(normals.length);
  for (let i = 0; i < normals.length; i++) {
    colours[i] = Number.isNaN(normals[i]) ? GREY[0] : Math.round(127.5 + 105 * normals[i]);
  }
  const entries = [
    { colour: "rgb(232, 128, 128)", text: "x of the normal" },
    { colour: "rgb(128, 232, 128)", text: "y" },
    { colour: "rgb(128, 128, 232)", text: "z" },
  ];
  return { colours, scale: null, entries };
}

function bySurface(layer: Layer, labels: Int32Array): Coloured {
  const colours = new Uint8Array(3 * layer.count);
  for (let i = 0; i < layer.count; i++) {
    colours.set(labels[i] >= 0 ? distinctColour(labels[i]) : GREY, 3 * i);
  }
  return { colours, scale: null, entries: [] };
}

export function column(layer: Layer, name: string): Float32Array {
  return layer.columns.get(name) ?? new Float32Array(0);
}

/** Columns of curvature: their names, and what people call them. */
const CURVATURES: [string, string][] = [
  ["mean_curvature", "Mean curvature H"],
  ["gaussian_curvature", "Gaussian curvature K"],
  ["k1", "Larger principal curvature k1"],
  ["k2", "Smaller principal curvature k2"],
];

/** Columns on a sequential scale: name, what people call it, power of the unit. */
const SIZES: [string, string, number][] = [
  ["mean_curvature_std", "Standard error of H", -1],
  ["residual", "Residual of the fit", 1],
  ["radius", "Radius of the neighbourhood", 1],
];

const KNOWN = new Set(
  [...CURVATURES, ...SIZES].map(([name]) => name).concat("k1_std", "k2_std", "zeta", "deviation"),
);

/** What a layer can be coloured by, in the order of the list. */
export function quantitiesOf(layer: Layer): Quantity[] {
  const found: Quantity[] = [];
  const add = (id: string, name: string, power: number, colour: (layer: Layer) => Coloured): void => {
    found.push({ id, name, power, colour });
  };
  const has = (name: string): boolean => layer.columns.has(name);
  for (const [id, name] of CURVATURES) {
    const power = id === "gaussian_curvature" ? -2 : -1;
    if (has(id)) add(id, name, power, (of) => onDivergingScale(column(of, id)));
  }
  if (has("k1_std") && has("k2_std")) {
    add("class", "Class of curvature", 0, (of) => byClass(curvatureClass(of), CURVATURE_CLASSES));
  }
  for (const [id, name, power] of SIZES) {
    if (has(id)) add(id, name, power, (of) => onSequentialScale(column(of, id)));
  }
  if (has("zeta")) {
    add("zeta", "Similarity zeta with point A", 0, (of) => onSequentialScale(column(of, "zeta"), [0, 1]));
    add("zeta_class", "Class of similarity with A", 0, (of) => {
      const classes = Int8Array.from(column(of, "zeta"), (z) =>
        z >= OPTIMAL ? 0 : z >= GOOD ? 1 : z >= 0 ? 2 : -1,
      );
      return byClass(classes, ZETA_CLASSES);
    });
  }
  const { labels, normals, colours, colour } = layer;
  if (labels !== null) add("surface", layer.labelName, 0, (of) => bySurface(of, of.labels ?? labels));
  if (has("deviation")) {
    add("deviation", "Distance from the surface", 1, (of) => onDivergingScale(column(of, "deviation")));
  }
  if (normals !== null) add("normal", "Normal", 0, (of) => byNormal(of.normals ?? normals));
  if (colours !== null) {
    add("file", "The file's own colours", 0, (of) => ({
      colours: of.colours ?? colours,
      scale: null,
      entries: [],
    }));
  }
  for (const id of layer.columns.keys()) {
    if (!KNOWN.has(id))
      add(`column:${id}`, id.replaceAll("_", " "), 0, (of) => onSequentialScale(column(of, id)));
  }
  if (colour === null) {
    const heights = (of: Layer): Coloured => {
      const values = Float32Array.from(
        { length: of.count },
        (_, i) => of.positions[3 * i + 2] + of.origin[2],
      );
      return onSequentialScale(values);
    };
    add("height", "Height z", 1, heights);
  }
  add("plain", "One colour", 0, (of) => ({
    colours: plain(of.count, of.colour ?? [168, 180, 194]),
    scale: null,
    entries: [],
  }));
  return found;
}
