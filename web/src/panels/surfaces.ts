/** The surfaces that were found, in a table, and how two chosen ones lie to each other. */

import { count, text, unitText } from "../numbers.js";
import { relation } from "../relations.js";
import type { State } from "../state.js";
import { sizeText } from "../surface_table.js";
import { css, distinctColour } from "../view/colour_scales.js";
import type { Actions, Panel } from "./actions.js";
import { button, facts, h, section } from "./dom.js";

export function surfacesPanel(state: State, actions: Actions): Panel {
  const find = button("Find surfaces", () => actions.findSurfaces(), { id: "find", class: "primary" });
  const told = h("p", { class: "note" });
  const table = h("div", { class: "table" });
  const between = h("div", { "aria-live": "polite" });
  const element = section("surfaces", "Surfaces", find, told, table, between);
  let shown: unknown = null;
  return {
    element,
    update(): void {
      element.hidden = state.layer === null;
      find.disabled = state.running !== null;
      const { found, layer } = state;
      told.hidden = found !== null && found.surfaces.length === 0 ? false : found === null;
      find.hidden = found !== null && found.surfaces.length > 0;
      if (found === null || layer === null) {
        shown = null;
        table.replaceChildren();
        between.replaceChildren();
        return;
      }
      if (shown !== found) {
        shown = found;
        table.replaceChildren(rowsOf(state, actions));
        let inside = 0;
        for (const label of found.labels) if (label >= 0) inside++;
        const share = ((100 * inside) / Math.max(1, layer.count)).toFixed(1);
        told.textContent =
          found.surfaces.length === 0
            ? "No surface found: the points are too few, or the surface is of no known kind."
            : `${found.surfaces.length} surfaces; ${share} % of the points. Click one, shift-click a second.`;
      }
      markChosen(table, state.chosen);
      const [a, b] = state.chosen.map((number) => found.surfaces[number]);
      between.replaceChildren();
      if (a !== undefined && b !== undefined) {
        const { angle, distance, told: what } = relation(a, b);
        const rows: [string, string][] = [];
        if (angle !== null) rows.push(["Angle", `${text(angle, 4)}°`]);
        if (distance !== null)
          rows.push(["Distance", `${text(distance, 4)} ${unitText(state.unit, 1)} ${what}`]);
        between.replaceChildren(
          h("h3", {}, `Surfaces ${state.chosen[0]} and ${state.chosen[1]}`),
          facts(rows),
        );
      }
    },
  };
}

/** Marks the chosen rows of a table, and brings the last into view. */
export function markChosen(table: HTMLElement, chosen: number[]): void {
  table.querySelectorAll<HTMLElement>("tbody tr").forEach((row) => {
    const number = Number(row.dataset.row);
    const is = chosen.includes(number);
    if (is && row.getAttribute("aria-selected") !== "true") row.scrollIntoView({ block: "nearest" });
    row.setAttribute("aria-selected", String(is));
  });
}

/** A row that can be chosen by the pointer and by the keyboard. */
export function chosenBy(row: HTMLTableRowElement, number: number, actions: Actions): HTMLTableRowElement {
  row.dataset.row = String(number);
  row.tabIndex = 0;
  row.setAttribute("aria-selected", "false");
  row.addEventListener("click", (event) => actions.choose(number, event.shiftKey));
  row.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    actions.choose(number, event.shiftKey);
  });
  return row;
}

export function dot(number: number): HTMLElement {
  const mark = h("i", { "aria-hidden": "true" });
  mark.style.background = css(distinctColour(number));
  return mark;
}

function rowsOf(state: State, actions: Actions): HTMLTableElement {
  const unit = state.unit === "unit" ? "" : `, ${unitText(state.unit, 1)}`;
  const head = ["", "Kind", `Radius${unit}`, "95 %", "Points"];
  const rows = (state.found?.surfaces ?? []).map((surface, number) => {
    const { radius, range } = sizeText(surface);
    const cells = [surface.kind, radius, range, count(surface.count)].map((words, c) =>
      h("td", { class: c > 0 ? "number" : undefined }, words),
    );
    return chosenBy(h("tr", {}, h("td", {}, dot(number), String(number)), ...cells), number, actions);
  });
  return h(
    "table",
    { id: "surface-table" },
    h(
      "thead",
      {},
      h(
        "tr",
        {},
        ...head.map((words, c) => h("th", { scope: "col", class: c > 1 ? "number" : undefined }, words)),
      ),
    ),
    h("tbody", {}, ...rows),
  );
}
