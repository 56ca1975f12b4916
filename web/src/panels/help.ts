/** The keys, and what the page does, in a dialog. */

import { button, h } from "./dom.js";

const KEYS: [string, string][] = [
  ["Drag", "turn the view"],
  ["Right drag, or two fingers", "move it"],
  ["Wheel, or pinch", "come nearer"],
  ["Click", "read a point; colour all points by their similarity with it"],
  ["Shift-click", "compare a second point, or a second surface"],
  ["Arrow keys", "turn the view"],
  ["+ and −", "come nearer, go farther"],
  ["F", "see all points"],
  ["1 to 9", "colour by the first to the ninth quantity"],
  ["S", "find surfaces"],
  ["P", "save a picture"],
  ["Esc", "stop what runs; else clear the chosen points and surfaces"],
  ["?", "this help"],
];

export function helpDialog(): HTMLDialogElement {
  const dialog = h(
    "dialog",
    { id: "help", "aria-labelledby": "help-title" },
    h("h2", { id: "help-title" }, "Keys and clicks"),
    h(
      "dl",
      { class: "facts" },
      ...KEYS.flatMap(([key, what]) => [h("dt", {}, h("kbd", {}, key)), h("dd", {}, what)]),
    ),
    h(
      "p",
      { class: "note" },
      "zeta is the similarity of two surfaces by their fields of curvature: 0.9 and above is optimal, 0.5 and above good. Standard errors follow the noise of each neighbourhood.",
    ),
    button("Close", () => dialog.close(), { class: "primary" }),
  );
  return dialog;
}
