/** The application: what happens when somebody drops a file, moves a slider, clicks. */

import { Cancelled, type Engine } from "./engine/client.js";
import type { CloudData } from "./files/cloud.js";
import { computeCurvature, layerOf, unitOf } from "./curvature.js";
import { type Frame, frame } from "./frame.js";
import { type Linked, linkOf, readLink } from "./link.js";
import type { Actions, SaveKind } from "./panels/actions.js";
import { save } from "./panels/dom.js";
import { quantitiesOf } from "./quantities.js";
import type { Report } from "./report_data.js";
import { SAMPLES } from "./samples.js";
import { initialState, suggestedRadius } from "./state.js";
import { surfacesCsv, surfacesJson } from "./surface_table.js";
import { writePly } from "./files/write_ply.js";
import { Painter } from "./painter.js";
import type { Layer } from "./view/layer.js";
import { PointLayer } from "./view/points.js";
import { drawnTrajectory } from "./view/trajectory.js";
import { Viewer } from "./view/viewer.js";

/** Diameter of a drawn point, in spacings, with which surfaces look closed. */
const CLOSED = 3.8;

/** Points up to which curvature is computed as soon as a file is there. */
const MOST_AT_ONCE = 1_500_000;

/** Milliseconds that the first picture may keep all else waiting. */
const FIRST_PICTURE = 1500;

export class Application implements Actions {
  private readonly state = initialState();
  private readonly frame: Frame;
  private readonly viewer: Viewer;
  private readonly painter: Painter;
  private drawn: PointLayer | null = null;
  private linked: Linked | null = null;
  /** Counts the files, so that what an earlier one asked for is dropped. */
  private generation = 0;

  constructor(
    root: HTMLElement,
    private readonly engine: Promise<Engine>,
  ) {
    this.frame = frame(root, this.state, this);
    this.viewer = new Viewer(this.frame.canvas);
    this.painter = new Painter(this.viewer, this.frame, this.state);
    this.frame.listen(this.viewer, this);
    engine.catch((error: Error) => this.frame.tell(`The engine cannot start: ${error.message}`));
    this.update();
  }

  /** Opens what the page's link says. */
  openLink(): void {
    this.linked = readLink();
    const { sample, file } = this.linked ?? { sample: null, file: null };
    if (sample !== null) this.openSample(sample);
    else if (file !== null) this.frame.tell(`Drop ${file} here to see the linked view.`);
  }

  openSample(id: string): void {
    const sample = SAMPLES.find((one) => one.id === id);
    if (sample === undefined) this.frame.tell(`There is no sample "${id}".`);
    else void this.show(sample.make(), id);
  }

  openFile(file: File): void {
    void this.open(file.name, () => file.arrayBuffer());
  }

  async openSource({ url, name }: { url: string; name: string }): Promise<void> {
    this.linked = readLink();
    await this.open(name, async () => {
      const answer = await fetch(url);
      if (!answer.ok) throw new Error(`${name}: the server says ${answer.status}`);
      return answer.arrayBuffer();
    });
  }

  private async open(name: string, bytes: () => Promise<ArrayBuffer>): Promise<void> {
    this.cancel();
    await this.run(`Reading ${name}`, async (engine) => {
      const data = await bytes();
      await this.show(await engine.ask({ kind: "read", name, bytes: data }, undefined, [data]), null);
    });
  }

  /** Shows a cloud, and computes its curvature. */
  private async show(cloud: CloudData, sample: string | null): Promise<void> {
    if (this.linked !== null && this.linked.sample !== sample) this.linked = null;
    this.cancel();
    this.begin(layerOf(cloud));
    const { state, viewer } = this;
    Object.assign(state, {
      sample,
      format: sample === null ? cloud.format : "",
      leftOut: cloud.left_out,
      unit: unitOf(cloud, sample),
    });
    this.update();
    viewer.fit();
    this.setQuantity(cloud.colours === null ? "height" : "file");
    const generation = this.generation;
    await this.run("Measuring the spacing", async (engine) => {
      // On few processors the engine would else be ahead of the first picture.
      await viewer.drawn(FIRST_PICTURE);
      if (generation !== this.generation) return;
      const { positions, origin, viewpoint } = cloud;
      const { spacing } = await engine.ask({ kind: "load", positions, origin, viewpoint });
      if (generation !== this.generation) return;
      state.spacing = spacing;
      const extent = this.drawn?.box.getSize(viewer.camera.position.clone()).length() ?? 0;
      viewer.setPointSize(CLOSED * Math.max(spacing, 1e-4 * extent));
      this.follow(this.linked);
      const own = SAMPLES.find(({ id }) => id === sample)?.radius;
      if (state.radius <= 0) state.radius = own ?? suggestedRadius(spacing);
    });
    if (generation !== this.generation || state.spacing <= 0) return;
    if (cloud.count <= MOST_AT_ONCE) await this.compute();
    const point = this.linked?.point ?? null;
    if (point !== null && point < cloud.count && generation === this.generation)
      await this.choosePoint(point, false);
    this.linked = null;
  }

  private follow(linked: Linked | null): void {
    if (linked === null) return;
    Object.assign(this.state, {
      unit: linked.unit,
      auto: linked.radius === "auto",
      radius: linked.radius === "auto" ? 0 : linked.radius,
    });
    this.viewer.state = linked.view;
  }

  openReport(report: Report): void {
    const [first] = report.layers;
    this.generation++;
    this.viewer.clear();
    this.viewer.origin = first?.origin ?? [0, 0, 0];
    for (const layer of report.layers) this.viewer.add(new PointLayer(layer, this.viewer.origin));
    if (report.trajectory !== null)
      this.viewer.addOverlay(drawnTrajectory(report.trajectory, this.viewer.origin));
    this.drawn = this.viewer.layers[0] ?? null;
    const total = report.layers.reduce((sum, layer) => sum + layer.total, 0);
    const kept = report.layers.reduce((sum, layer) => sum + layer.count, 0);
    const format =
      kept < total
        ? `report, ${kept.toLocaleString("en")} of ${total.toLocaleString("en")} points`
        : "report";
    Object.assign(this.state, initialState(), { layer: first ?? null, format, unit: report.unit });
    this.frame.addReport(report, (share) => this.painter.setStage(share));
    this.update();
    this.painter.setStage(1);
    this.viewer.fit();
    if (this.drawn !== null) {
      this.viewer.setPointSize(this.drawn.closedDiameter);
      const known = quantitiesOf(this.drawn.layer).some(({ id }) => id === report.quantity);
      this.setQuantity(known ? report.quantity : "plain");
    }
    this.update();
  }

  /** Takes one layer in place of everything. */
  private begin(layer: Layer): void {
    this.generation++;
    const { eyeDome, lit, pointSize } = this.state;
    Object.assign(this.state, initialState(), { layer, eyeDome, lit, pointSize });
    this.viewer.clear();
    this.viewer.origin = layer.origin;
    this.drawn = new PointLayer(layer, layer.origin);
    this.viewer.add(this.drawn);
    // Until the spacing is known.
    this.viewer.setPointSize(this.drawn.closedDiameter);
    this.painter.reset();
  }

  /** Computes curvature, of what is in view first. */
  async compute(): Promise<void> {
    const { state, drawn, viewer } = this;
    if (drawn === null || state.spacing <= 0) return;
    const generation = this.generation;
    await this.run("Computing curvature", async (engine) => {
      const seen = viewer.inView(drawn);
      await computeCurvature(engine, drawn.layer, state, seen, this.progress, (first) => {
        if (generation !== this.generation) return;
        const before = state.computedRadius === null;
        if (drawn.layer.normals !== null) drawn.setNormals(drawn.layer.normals);
        const wanted = this.linked?.quantity ?? "mean_curvature";
        const listed = quantitiesOf(drawn.layer).some(({ id }) => id === wanted);
        this.setQuantity(before && first ? (listed ? wanted : "mean_curvature") : state.quantity);
      });
      if (generation !== this.generation) return;
      state.computedRadius = state.auto ? "auto" : state.radius;
    });
    if (generation === this.generation && state.first !== null) await this.choosePoint(state.first, false);
  }

  private readonly progress = (share: number): void => this.frame.showProgress(share);

  /** Does some work in the engine, and tells what went wrong. */
  private async run(what: string, work: (engine: Engine) => Promise<void>): Promise<void> {
    this.state.running = what;
    this.frame.tell("");
    this.update();
    this.frame.showProgress(0);
    const generation = this.generation;
    try {
      await work(await this.engine);
    } catch (error) {
      if (!(error instanceof Cancelled))
        this.frame.tell(error instanceof Error ? error.message : String(error));
    } finally {
      if (this.state.running === what || generation === this.generation) this.state.running = null;
      this.update();
    }
  }

  cancel(): void {
    void this.engine.then((engine) => engine.cancel());
  }

  async findSurfacesNow(): Promise<void> {
    const { state } = this;
    if (state.layer === null || state.running !== null) return;
    await this.run("Finding surfaces", async (engine) => {
      const found = await engine.ask({ kind: "surfaces" }, this.progress);
      if (state.layer === null) return;
      state.found = found;
      state.layer.labels = found.labels;
      state.chosen = [];
      this.setQuantity("surface");
    });
  }

  findSurfaces(): void {
    void this.findSurfacesNow();
  }

  /** Reads a point, or compares a second one with it. */
  async choosePoint(point: number, second: boolean): Promise<void> {
    const { state } = this;
    const { layer } = state;
    if (layer === null) return;
    if (second && state.first !== null) state.second = point;
    else {
      [state.first, state.second] = [point, null];
      if (state.computedRadius !== null) {
        await this.run("Comparing with all points", async (engine) => {
          layer.columns.set("zeta", await engine.ask({ kind: "similarities", query: point }));
          this.setQuantity(state.quantity === "zeta_class" ? "zeta_class" : "zeta");
        });
      }
    }
    this.update();
  }

  /** A click into the view. */
  click(x: number, y: number, second: boolean): void {
    const picked = this.viewer.pick(x, y);
    if (picked === null) {
      if (!second) this.choose(-1, false);
      return;
    }
    const { state } = this;
    const label = picked.layer.layer.labels?.[picked.point] ?? -1;
    if (state.quantity === "surface" || state.computedRadius === null) {
      if (picked.layer.layer.labels !== null) this.choose(label, second);
    }
    if (picked.layer !== this.drawn) return;
    if (state.quantity === "surface") {
      [state.first, state.second] =
        second && state.first !== null ? [state.first, picked.point] : [picked.point, null];
      this.update();
    } else void this.choosePoint(picked.point, second);
  }

  choose(row: number, second: boolean): void {
    const { state } = this;
    if (row < 0) state.chosen = [];
    else if (second && state.chosen.length > 0 && state.chosen[0] !== row)
      state.chosen = [state.chosen[0], row];
    else state.chosen = state.chosen.length === 1 && state.chosen[0] === row ? [] : [row];
    this.painter.paint();
    this.update();
  }

  clearPoints(): void {
    [this.state.first, this.state.second] = [null, null];
    if (this.state.quantity.startsWith("zeta")) {
      this.state.layer?.columns.delete("zeta");
      this.setQuantity("mean_curvature");
    }
    this.update();
  }

  setQuantity(id: string): void {
    this.state.quantity = id;
    this.painter.paint();
    this.update();
  }

  setUnit(unit: typeof this.state.unit): void {
    this.state.unit = unit;
    this.painter.paint();
    this.update();
  }

  setRadius(radius: number): void {
    Object.assign(this.state, { radius, auto: false });
    this.recompute();
  }

  setAuto(auto: boolean): void {
    this.state.auto = auto;
    this.recompute();
  }

  private recompute(): void {
    if (this.state.running === "Computing curvature") this.cancel();
    this.update();
    void this.compute();
  }

  setShading(eyeDome: boolean, lit: boolean): void {
    Object.assign(this.state, { eyeDome, lit });
    this.viewer.setShading(eyeDome, lit);
  }

  setPointSize(factor: number): void {
    this.state.pointSize = factor;
    this.painter.setPointSize(factor);
  }

  fit(): void {
    this.viewer.fit();
  }

  save(kind: SaveKind): void {
    const { layer, found } = this.state;
    if (layer === null) return;
    const name = layer.name.replace(/\.\w+$/, "").replace(/\s+/g, "_");
    if (kind === "ply") save(`${name}_curvature.ply`, writePly(layer));
    else if (kind === "csv")
      save(`${name}_surfaces.csv`, new Blob([surfacesCsv(found?.surfaces ?? [])], { type: "text/csv" }));
    else if (kind === "json") {
      save(
        `${name}_surfaces.json`,
        new Blob([surfacesJson(found?.surfaces ?? [], layer.name)], { type: "application/json" }),
      );
    } else if (kind === "picture") void this.viewer.picture().then((picture) => save(`${name}.png`, picture));
    else this.frame.copy(linkOf(this.state, this.viewer.state));
  }

  private update(): void {
    this.frame.update();
    this.painter.placeMarks();
  }
}
