/** What a report says: its title, its table, and the slider between before and after. */

import type { Report } from "../report_data.js";
import type { State } from "../state.js";
import type { Actions, Panel } from "./actions.js";
import { h, section } from "./dom.js";
import { chosenBy, dot, markChosen } from "./surfaces.js";

export function reportPanel(
  report: Report,
  state: State,
  actions: Actions,
  setStage: (share: number) => void,
): Panel {
  const staged = report.layers.some(({ stage, transform }) => stage !== null || transform !== null);
  const slider = h("input", {
    type: "range",
    id: "stage",
    min: 0,
    max: 1,
    step: 0.01,
    value: 1,
    "aria-label": "From before to after",
    oninput: () => setStage(Number(slider.value)),
  });
  const table = h("div", { class: "table" });
  if (report.rows.length > 0) table.append(tableOf(report, actions));
  const element = section(
    "report",
    report.title,
    h("p", { class: "note" }, report.text),
    staged ? h("div", { class: "row stage" }, h("span", {}, "before"), slider, h("span", {}, "after")) : null,
    table,
  );
  return {
    element,
    update(): void {
      markChosen(table, state.chosen);
    },
  };
}

function tableOf(report: Report, actions: Actions): HTMLTableElement {
  const labelled = new Set<number>();
  for (const { labels } of report.layers)
    if (labels !== null) for (const label of labels) labelled.add(label);
  // Numbers stand on the right, words on the left.
  const isNumber = report.header.map(
    (_, c) => report.rows.every((row) => !/[a-z]{3,}/i.test(row[c] ?? "")) && c > 0,
  );
  const rows = report.rows.map((words, number) => {
    const cells = words.map((word, c) => h("td", { class: isNumber[c] ? "number" : undefined }, word));
    const row = h("tr", {}, ...cells);
    if (!labelled.has(number)) return row;
    cells[0].prepend(dot(number), " ");
    return chosenBy(row, number, actions);
  });
  const head = report.header.some((word) => word !== "")
    ? h(
        "thead",
        {},
        h(
          "tr",
          {},
          ...report.header.map((word, c) =>
            h("th", { scope: "col", class: isNumber[c] ? "number" : undefined }, word),
          ),
        ),
      )
    : null;
  return h("table", { id: "report-table" }, head, h("tbody", {}, ...rows));
}
