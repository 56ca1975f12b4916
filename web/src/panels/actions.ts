/** What the panels may ask of the application, and what a panel is. */

import type { Unit } from "../state.js";

export type SaveKind = "ply" | "csv" | "json" | "picture" | "link";

export interface Actions {
  openFile(file: File): void;
  openSample(id: string): void;
  setQuantity(id: string): void;
  setUnit(unit: Unit): void;
  setRadius(radius: number): void;
  setAuto(auto: boolean): void;
  cancel(): void;
  findSurfaces(): void;
  /** Chooses a row of the table, or a second one beside it; -1 for none. */
  choose(row: number, second: boolean): void;
  setShading(eyeDome: boolean, lit: boolean): void;
  setPointSize(factor: number): void;
  clearPoints(): void;
  fit(): void;
  save(kind: SaveKind): void;
}

export interface Panel {
  readonly element: HTMLElement;
  /** Shows what the state says now. */
  update(): void;
}
