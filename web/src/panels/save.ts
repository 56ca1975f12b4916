/** What can be taken along: files, a picture, a link. */

import type { State } from "../state.js";
import type { Actions, Panel, SaveKind } from "./actions.js";
import { button, h, section } from "./dom.js";

const KINDS: [SaveKind, string, string][] = [
  ["ply", "Points (PLY)", "The points with all columns, for any other program"],
  ["csv", "Surfaces (CSV)", "The table of the surfaces"],
  ["json", "Surfaces (JSON)", "The surfaces with positions and axes"],
  ["picture", "Picture", "The view as PNG"],
  ["link", "Link", "Copies a link that opens this view"],
];

export function savePanel(state: State, actions: Actions): Panel {
  const buttons = KINDS.map(([kind, name, title]) =>
    button(name, () => actions.save(kind), { id: `save-${kind}`, title }),
  );
  const element = section("save", "Save", h("div", { class: "buttons" }, ...buttons));
  return {
    element,
    update(): void {
      element.hidden = state.layer === null;
      const none = state.found === null || state.found.surfaces.length === 0;
      for (const [i, [kind]] of KINDS.entries())
        buttons[i].hidden = none && (kind === "csv" || kind === "json");
    },
  };
}
