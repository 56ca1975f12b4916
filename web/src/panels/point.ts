/** What is known of the clicked points, and how similar two of them are. */

import { count, text, unitText, withError } from "../numbers.js";
import { column, similarityClass } from "../quantities.js";
import type { State } from "../state.js";
import type { Layer } from "../view/layer.js";
import type { Actions, Panel } from "./actions.js";
import { button, facts, h, section } from "./dom.js";

/** Standard errors within which a curvature is as good as 0. */
const SIGNIFICANT = 2.576;

const STATUSES = [
  "",
  "not finite",
  "too few points in the neighbourhood",
  "the points are nearly on a line",
  "the fit does not converge",
  "more curved than the vocabulary",
  "at a border: all points on one side",
  "coordinates too coarse for the radius",
];

export function pointPanel(state: State, actions: Actions): Panel {
  const body = h("div", { "aria-live": "polite" });
  const clear = button("Clear", () => actions.clearPoints(), { class: "link", title: "Esc" });
  const element = section("point", "Point", body, clear);
  return {
    element,
    update(): void {
      const { layer, first, second } = state;
      element.hidden = layer === null;
      if (layer === null) return;
      clear.hidden = first === null;
      if (first === null) {
        const more = state.computedRadius !== null ? " and see where else its surface occurs" : "";
        body.replaceChildren(
          h(
            "p",
            { class: "note" },
            `Click a point to read its values${more}. Shift-click a second one to compare.`,
          ),
        );
        return;
      }
      const parts: Node[] = [
        h("h3", {}, h("b", { class: "mark" }, "A"), placeText(layer, first, state.spacing)),
        valuesOf(state, layer, first),
      ];
      if (second !== null) {
        const zeta = column(layer, "zeta")[second] ?? NaN;
        parts.push(
          h("h3", {}, h("b", { class: "mark second" }, "B"), placeText(layer, second, state.spacing)),
          valuesOf(state, layer, second),
        );
        const told = Number.isNaN(zeta) ? "not known" : `${zeta.toFixed(3)} (${similarityClass(zeta)})`;
        parts.push(
          h("p", { class: "result", id: "zeta" }, h("span", {}, "zeta of A and B"), h("strong", {}, told)),
        );
        const apart = [0, 1, 2].map(
          (axis) => layer.positions[3 * first + axis] - layer.positions[3 * second + axis],
        );
        parts.push(facts([["Distance", `${text(Math.hypot(...apart))} ${unitText(state.unit, 1)}`]]));
      } else if (layer.columns.has("zeta")) {
        const zeta = column(layer, "zeta");
        let alike = 0;
        for (const value of zeta) if (value >= 0.9) alike++;
        const share = ((100 * alike) / zeta.length).toFixed(alike < 0.1 * zeta.length ? 1 : 0);
        parts.push(
          h(
            "p",
            { class: "note", id: "alike" },
            `${share} % of the points have an optimally similar surface (zeta of 0.9 and above).`,
          ),
        );
      }
      body.replaceChildren(...parts);
    },
  };
}

/** Coordinates to a tenth of the spacing. */
function placeText(layer: Layer, point: number, spacing: number): string {
  const place = [0, 1, 2].map((axis) => layer.positions[3 * point + axis] + layer.origin[axis]);
  const decimals = spacing > 0 ? Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(spacing)))) : 4;
  return place.map((c) => c.toFixed(decimals).replace("-", "−")).join(", ");
}

/** All that is known of a point, with standard errors. */
function valuesOf(state: State, layer: Layer, i: number): HTMLElement {
  const value = (name: string): number => column(layer, name)[i] ?? NaN;
  const rows: [string, string][] = [];
  if (layer.columns.has("k1")) {
    const [per, square] = [unitText(state.unit, -1), unitText(state.unit, -2)];
    const [k1, k2, s1, s2] = ["k1", "k2", "k1_std", "k2_std"].map(value);
    rows.push(["k1", `${withError(k1, s1)} ${per}`], ["k2", `${withError(k2, s2)} ${per}`]);
    rows.push(["H", `${withError((k1 + k2) / 2, value("mean_curvature_std"))} ${per}`]);
    rows.push(["K", `${withError(k1 * k2, Math.hypot(k2 * s1, k1 * s2))} ${square}`]);
    rows.push(["Radii of curvature", radii(k1, s1, k2, s2, unitText(state.unit, 1))]);
    if (layer.columns.has("count")) rows.push(["Points in the ball", count(value("count"))]);
    if (layer.columns.has("radius"))
      rows.push(["Radius of the ball", `${text(value("radius"))} ${unitText(state.unit, 1)}`]);
    const status = STATUSES[value("status")] ?? "";
    if (status !== "") rows.push(["Status", status]);
  }
  if (layer.normals !== null) {
    rows.push(["Normal", [0, 1, 2].map((axis) => text(layer.normals?.[3 * i + axis] ?? NaN, 3)).join(", ")]);
  }
  if (layer.labels !== null)
    rows.push([layer.labelName, layer.labels[i] >= 0 ? String(layer.labels[i]) : "none"]);
  const told = new Set([
    "k1",
    "k2",
    "k1_std",
    "k2_std",
    "mean_curvature",
    "mean_curvature_std",
    "gaussian_curvature",
  ]);
  for (const name of ["count", "radius", "status", "zeta", "residual"]) told.add(name);
  for (const name of layer.columns.keys()) {
    if (!told.has(name) && rows.length < 16) rows.push([name.replaceAll("_", " "), text(value(name), 5)]);
  }
  return facts(rows);
}

/** Both radii of curvature, with their unit. */
function radii(k1: number, s1: number, k2: number, s2: number, unit: string): string {
  const [one, two] = [radius(k1, s1), radius(k2, s2)];
  const both = one === two && one === FLAT ? "flat within the error" : `${one}, ${two}`;
  return /\d/.test(both) ? `${both} ${unit}` : both;
}

const FLAT = "flat";

/** A radius of curvature with its error; "flat" where the curvature is within its error. */
function radius(k: number, error: number): string {
  if (Number.isNaN(k)) return "–";
  if (Math.abs(k) < SIGNIFICANT * error) return FLAT;
  return withError(1 / k, error / (k * k));
}
