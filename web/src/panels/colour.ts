/** What the points are coloured by, how they are shaded, and the legend over the view. */

import { text, unitText } from "../numbers.js";
import { type Coloured, quantitiesOf, type Quantity } from "../quantities.js";
import type { State } from "../state.js";
import { gradient } from "../view/colour_scales.js";
import type { Actions, Panel } from "./actions.js";
import { h, section } from "./dom.js";

export function colourPanel(state: State, actions: Actions): Panel {
  const chooser = h("select", { id: "quantity", onchange: () => actions.setQuantity(chooser.value) });
  const eyeDome = h("input", { type: "checkbox", id: "eye-dome", onchange: () => shade() });
  const lit = h("input", { type: "checkbox", id: "lit", onchange: () => shade() });
  const size = h("input", {
    type: "range",
    id: "point-size",
    min: -2,
    max: 2,
    step: 0.1,
    oninput: () => actions.setPointSize(2 ** Number(size.value)),
  });
  const shade = (): void => actions.setShading(eyeDome.checked, lit.checked);
  const element = section(
    "colour",
    "Colour",
    h("label", { class: "row" }, "By", chooser),
    h("label", { class: "row" }, "Point size", size),
    h(
      "div",
      { class: "row" },
      h("label", { class: "check" }, eyeDome, "eye-dome lighting"),
      h("label", { class: "check" }, lit, "light by normals"),
    ),
  );
  let listed = "";
  return {
    element,
    update(): void {
      element.hidden = state.layer === null;
      if (state.layer === null) return;
      const quantities = quantitiesOf(state.layer);
      const key = quantities.map(({ id }) => id).join(" ");
      if (key !== listed) {
        listed = key;
        chooser.replaceChildren(...quantities.map(({ id, name }) => h("option", { value: id }, name)));
      }
      chooser.value = state.quantity;
      eyeDome.checked = state.eyeDome;
      lit.checked = state.lit;
      size.value = String(Math.log2(state.pointSize));
    },
  };
}

/** The legend: a scale with its ends and unit, or the classes' colours. */
export class Legend {
  readonly element = h("figure", { id: "legend", "aria-live": "polite" });

  show(quantity: Quantity, { scale, entries }: Coloured, unit: string): void {
    const inUnit = unitText(unit, quantity.power);
    const title = inUnit === "" ? quantity.name : `${quantity.name}, ${inUnit}`;
    const children: Node[] = [h("figcaption", {}, title)];
    if (scale !== null && Number.isFinite(scale.low)) {
      const bar = h("div", { class: "bar" });
      bar.style.background = gradient(scale.kind);
      const ends =
        scale.kind === "diverging"
          ? [scale.low, 0, scale.high]
          : [scale.low, (scale.low + scale.high) / 2, scale.high];
      children.push(bar, h("div", { class: "ends" }, ...ends.map((end) => h("span", {}, text(end, 3)))));
    }
    for (const { colour, text: words } of entries) {
      const dot = h("i", { "aria-hidden": "true" });
      dot.style.background = colour;
      children.push(h("div", { class: "entry" }, dot, words));
    }
    this.element.replaceChildren(...children);
    this.element.hidden = scale === null && entries.length === 0;
  }
}
