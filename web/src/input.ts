/** Pointer, keys, and dropped files. */

import { quantitiesOf } from "./quantities.js";
import type { Actions } from "./panels/actions.js";
import type { State } from "./state.js";
import type { Viewer } from "./view/viewer.js";

/** What takes the clicks into the view. */
export interface Target {
  click(x: number, y: number, second: boolean): void;
}

/** Pixels that the pointer may move in a click. */
const STILL = 5;

/** Radians of an arrow key, and the factor of plus and minus. */
const [STEP, ZOOM] = [0.12, 0.85];

export function listen(
  area: HTMLElement,
  canvas: HTMLCanvasElement,
  viewer: Viewer,
  target: Target,
  state: State,
  actions: Actions,
  help: () => void,
): void {
  let pressed: { x: number; y: number } | null = null;
  canvas.addEventListener("pointerdown", (event) => {
    pressed = event.isPrimary && event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
  });
  canvas.addEventListener("pointerup", (event) => {
    if (pressed === null || Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > STILL) return;
    const box = canvas.getBoundingClientRect();
    target.click(event.clientX - box.left, event.clientY - box.top, event.shiftKey);
  });

  area.addEventListener("dragover", (event) => {
    event.preventDefault();
    area.classList.add("dropping");
  });
  area.addEventListener("dragleave", () => area.classList.remove("dropping"));
  area.addEventListener("drop", (event) => {
    event.preventDefault();
    area.classList.remove("dropping");
    const file = event.dataTransfer?.files[0];
    if (file !== undefined) actions.openFile(file);
  });

  const keys: Record<string, () => void> = {
    "+": () => viewer.turn(0, 0, ZOOM),
    "=": () => viewer.turn(0, 0, ZOOM),
    "-": () => viewer.turn(0, 0, 1 / ZOOM),
    f: () => actions.fit(),
    s: () => actions.findSurfaces(),
    p: () => actions.save("picture"),
    "?": help,
    Escape: () => {
      if (state.running !== null) actions.cancel();
      else {
        actions.clearPoints();
        actions.choose(-1, false);
      }
    },
  };
  const arrows: Record<string, [number, number]> = {
    ArrowLeft: [-STEP, 0],
    ArrowRight: [STEP, 0],
    ArrowUp: [0, STEP],
    ArrowDown: [0, -STEP],
  };
  document.addEventListener("keydown", (event) => {
    const { tagName } = event.target as HTMLElement;
    if (
      event.ctrlKey ||
      event.metaKey ||
      event.altKey ||
      tagName === "SELECT" ||
      document.querySelector("dialog[open]")
    )
      return;
    const isRange = tagName === "INPUT";
    const arrow = arrows[event.key];
    if (arrow !== undefined && !isRange && tagName !== "TR") {
      event.preventDefault();
      viewer.turn(...arrow);
    } else if (/^[1-9]$/.test(event.key) && state.layer !== null) {
      const quantity = quantitiesOf(state.layer)[Number(event.key) - 1];
      if (quantity !== undefined) actions.setQuantity(quantity.id);
    } else if (state.layer !== null || event.key === "?") keys[event.key]?.();
  });
}
