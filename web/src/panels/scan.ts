/** What the file holds: size, density, unit. */

import { count, text, unitText } from "../numbers.js";
import { type State, type Unit, UNITS } from "../state.js";
import { boundsOf } from "../view/layer.js";
import type { Actions, Panel } from "./actions.js";
import { facts, h, section } from "./dom.js";

const UNIT_NAMES: Record<Unit, string> = {
  unit: "not known",
  m: "metres",
  mm: "millimetres",
  cm: "centimetres",
  ft: "feet",
};

export function scanPanel(state: State, actions: Actions): Panel {
  const body = h("div");
  const chooser = h(
    "select",
    { id: "unit", onchange: () => actions.setUnit(chooser.value as Unit) },
    ...UNITS.map((unit) => h("option", { value: unit }, UNIT_NAMES[unit])),
  );
  const choice = h("label", { class: "row" }, "Unit of the coordinates", chooser);
  const element = section("scan", "Scan", body, choice);
  let shown: unknown = null;
  return {
    element,
    update(): void {
      const { layer } = state;
      element.hidden = layer === null;
      chooser.value = state.unit;
      if (layer === null) return;
      const key = `${layer.name} ${state.spacing} ${state.unit} ${layer.count}`;
      if (shown === key) return;
      shown = key;
      const { low, high } = boundsOf(layer);
      const size = low.map((corner, axis) => text(high[axis] - corner)).join(" × ");
      const unit = unitText(state.unit, 1);
      const rows: [string, string][] = [
        ["Name", layer.name],
        ["Format", state.format],
        [
          "Points",
          count(layer.count) + (state.leftOut > 0 ? `, and ${count(state.leftOut)} not finite` : ""),
        ],
        ["Size", state.unit === "unit" ? size : `${size} ${unit}`],
      ];
      if (state.spacing > 0) {
        // Points at random are apart by sqrt(ln 2 / (pi density)) in the median.
        const density = Math.LN2 / (Math.PI * state.spacing ** 2);
        rows.push([
          "Spacing",
          `${text(state.spacing)}${state.unit === "unit" ? "" : ` ${unit}`} to the nearest point (median)`,
        ]);
        rows.push([
          "Density",
          `about ${text(density, 2)} per ${state.unit === "unit" ? "square unit" : `${unit}²`}`,
        ]);
      }
      body.replaceChildren(facts(rows.filter(([, value]) => value !== "")));
    },
  };
}
