/** Colours of the points, marks of the clicked ones, and what is shown before and after. */

import type { Frame } from "./frame.js";
import { quantitiesOf } from "./quantities.js";
import type { State } from "./state.js";
import type { Layer } from "./view/layer.js";
import type { PointLayer } from "./view/points.js";
import type { Viewer } from "./view/viewer.js";

/** Share of a point's own colour that is left where others are chosen. */
const FADED = 0.28;

/** What the rest is filled up with: between the light and the dark background. */
const FADE_TO = 168;

export class Painter {
  private stage = 1;

  constructor(
    private readonly viewer: Viewer,
    private readonly frame: Frame,
    private readonly state: State,
  ) {
    viewer.onDrawn = (drawn, total) => {
      frame.showDrawn(drawn, total);
      this.placeMarks();
    };
  }

  reset(): void {
    this.stage = 1;
    this.viewer.setShading(this.state.eyeDome, this.state.lit);
  }

  /** Colours all layers by the chosen quantity; a layer without it by the first that it has. */
  paint(): void {
    for (const drawn of this.viewer.layers) {
      const quantities = quantitiesOf(drawn.layer);
      const quantity =
        quantities.find(({ id }) => id === this.state.quantity) ?? quantities[quantities.length - 1];
      const coloured = quantity.colour(drawn.layer);
      const chosen = this.chosenOf(drawn.layer);
      if (chosen !== null) fade(coloured.colours, chosen);
      drawn.setColours(coloured.colours, chosen);
      if (drawn.layer === this.state.layer) this.frame.legend.show(quantity, coloured, this.state.unit);
    }
    this.viewer.setShading(this.state.eyeDome, this.state.lit);
  }

  /** Which points belong to the chosen rows; null where no row is chosen. */
  private chosenOf(layer: Layer): Uint8Array | null {
    const { labels } = layer;
    const { chosen } = this.state;
    if (chosen.length === 0) return null;
    if (labels === null) return new Uint8Array(layer.count);
    return Uint8Array.from(labels, (label) => (chosen.includes(label) ? 1 : 0));
  }

  setPointSize(factor: number): void {
    this.viewer.scalePoints(factor);
  }

  /** Shows what is between before (0) and after (1). */
  setStage(share: number): void {
    this.stage = share;
    for (const drawn of this.viewer.layers) {
      drawn.place(share);
      drawn.group.visible = this.isShown(drawn);
    }
    this.viewer.render();
  }

  private isShown({ layer }: PointLayer): boolean {
    if (layer.stage === null) return true;
    return layer.stage === "before" ? this.stage < 0.5 : this.stage >= 0.5;
  }

  /** Puts the marks where the clicked points are on the screen. */
  placeMarks(): void {
    const drawn = this.viewer.layers.find(({ layer }) => layer === this.state.layer);
    const { first, second } = this.state;
    const at = (point: number | null): [number, number] | null =>
      point === null || drawn === undefined ? null : this.viewer.onScreen(drawn, point);
    this.frame.placeMarks([at(first), at(second)]);
  }
}

function fade(colours: Uint8Array, chosen: Uint8Array): void {
  for (let i = 0; i < colours.length; i++) {
    if (chosen[Math.floor(i / 3)] === 0) colours[i] = FADED * colours[i] + (1 - FADED) * FADE_TO;
  }
}
