/** The radius: a slider on a logarithmic scale with a suggestion, or one that each point chooses. */

import { text, unitText } from "../numbers.js";
import { FEWEST_SPACINGS, MOST_SPACINGS, type State, suggestedRadius } from "../state.js";
import type { Actions, Panel } from "./actions.js";
import { button, h, section } from "./dom.js";

/** Ends of the slider, in spacings. */
const [LEAST, MOST] = [2, 80];

/** Steps of the slider. */
const STEPS = 400;

export function curvaturePanel(state: State, actions: Actions): Panel {
  const slider = h("input", {
    type: "range",
    id: "radius",
    min: 0,
    max: STEPS,
    step: 1,
    "aria-label": "Radius of the neighbourhood, on a logarithmic scale",
    oninput: () => show(radiusAt(Number(slider.value))),
    onchange: () => actions.setRadius(radiusAt(Number(slider.value))),
  });
  const value = h("output", { for: "radius", id: "radius-value" });
  const band = h("div", { class: "band", "aria-hidden": "true" });
  const auto = h("input", { type: "checkbox", id: "auto", onchange: () => actions.setAuto(auto.checked) });
  const advice = h("p", { class: "note" });
  const suggestion = button("Suggested", () => actions.setRadius(suggestedRadius(state.spacing)), {
    class: "link",
  });
  const element = section(
    "curvature",
    "Curvature",
    h("div", { class: "row" }, h("label", { for: "radius" }, "Radius"), value),
    h("div", { class: "slider" }, band, slider),
    h(
      "div",
      { class: "row" },
      h("label", { class: "check" }, auto, "auto: each point chooses its own"),
      suggestion,
    ),
    advice,
  );

  function radiusAt(step: number): number {
    return state.spacing * LEAST * (MOST / LEAST) ** (step / STEPS);
  }
  function stepOf(radius: number): number {
    return (STEPS * Math.log(radius / (LEAST * state.spacing))) / Math.log(MOST / LEAST);
  }
  function show(radius: number): void {
    const unit = state.unit === "unit" ? "" : ` ${unitText(state.unit, 1)}`;
    value.textContent = state.auto ? "auto" : `${text(radius)}${unit}`;
    slider.setAttribute("aria-valuetext", value.textContent);
  }

  const [from, to] = [FEWEST_SPACINGS, MOST_SPACINGS].map(
    (n) => Math.log(n / LEAST) / Math.log(MOST / LEAST),
  );
  band.style.left = `calc(8px + ${from} * (100% - 16px))`;
  band.style.width = `calc(${to - from} * (100% - 16px))`;
  return {
    element,
    update(): void {
      element.hidden = state.layer === null || state.spacing <= 0;
      if (element.hidden) return;
      auto.checked = state.auto;
      slider.disabled = state.auto;
      suggestion.disabled = state.auto;
      if (document.activeElement !== slider || state.running === null)
        slider.value = String(stepOf(state.radius));
      show(state.radius);
      advice.textContent =
        state.oriented || state.computedRadius === null
          ? "A bump seen from the sensor has positive curvature. The marked range is a good start."
          : "The file says nothing about the sensor’s place, so the sign of curvature is a convention.";
    },
  };
}
