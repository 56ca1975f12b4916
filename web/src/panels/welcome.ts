/** What is seen before there is a scan. */

import { ENDINGS } from "../files/read.js";
import { SAMPLES } from "../samples.js";
import type { Actions } from "./actions.js";
import { button, h } from "./dom.js";

export function fileChooser(actions: Actions): HTMLInputElement {
  const chooser = h("input", {
    type: "file",
    id: "file",
    class: "hidden",
    accept: ENDINGS.join(","),
    "aria-label": "Point cloud file",
    onchange: () => {
      const file = chooser.files?.[0];
      if (file !== undefined) actions.openFile(file);
      chooser.value = "";
    },
  });
  return chooser;
}

export function welcome(actions: Actions, choose: () => void): HTMLElement {
  return h(
    "div",
    { id: "welcome" },
    h("h1", {}, "What is this surface?"),
    h(
      "p",
      {},
      "Drop a 3D scan here. See its curvature, click a point and see where else that surface occurs, find its planes, pipes and balls with their radii and errors.",
    ),
    h("div", { class: "actions" }, button("Choose a file", choose, { class: "primary" })),
    h("p", { class: "note" }, "PLY, PCD, LAS, LAZ, OBJ, XYZ, CSV. Or a sample:"),
    h(
      "div",
      { class: "samples" },
      ...SAMPLES.map(({ id, title, told }) =>
        h(
          "button",
          { type: "button", "data-sample": id, onclick: () => actions.openSample(id) },
          h("strong", {}, title),
          h("span", {}, told),
        ),
      ),
    ),
    h("p", { class: "note" }, "Everything is computed in this page. Nothing leaves this machine."),
  );
}
