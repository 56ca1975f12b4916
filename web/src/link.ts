/** The view's state in the link's fragment. */

import type { State } from "./state.js";
import type { ViewState } from "./view/viewer.js";

/** What a link keeps. Points and chosen rows are numbers, which the same file gives again. */
export interface Linked {
  sample: string | null;
  file: string | null;
  view: ViewState;
  quantity: string;
  radius: number | "auto";
  unit: State["unit"];
  point: number | null;
}

const rounded = (numbers: number[]): number[] => numbers.map((c) => Number(c.toPrecision(6)));

export function linkOf(state: State, view: ViewState): string {
  const linked: Linked = {
    sample: state.sample,
    file: state.sample === null ? (state.layer?.name ?? null) : null,
    view: {
      position: rounded(view.position) as ViewState["position"],
      target: rounded(view.target) as ViewState["target"],
    },
    quantity: state.quantity,
    radius: state.auto ? "auto" : state.radius,
    unit: state.unit,
    point: state.first,
  };
  return `${location.href.split("#")[0]}#${encodeURIComponent(JSON.stringify(linked))}`;
}

/** What the link of this page says; null where it says nothing, or something else. */
export function readLink(): Linked | null {
  try {
    const linked = JSON.parse(decodeURIComponent(location.hash.slice(1))) as Linked;
    const vectors = [linked.view.position, linked.view.target];
    return vectors.every((v) => v.length === 3 && v.every(Number.isFinite)) ? linked : null;
  } catch {
    return null;
  }
}
