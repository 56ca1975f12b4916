/** The view: a camera that turns about the points, eye-dome lighting, and as many points as are drawn smoothly. */

import { Box3, type Object3D, PerspectiveCamera, Scene, Sphere, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Vector } from "../files/cloud.js";
import { MOST, Pace } from "./pace.js";
import { inView, pick, type Picked, projector } from "./pick.js";
import { onePoint } from "./layer.js";
import { PointLayer } from "./points.js";
import { Screen } from "./screen.js";

/** Width of the view, in widths of what it shows. */
const MARGIN = 1.06;
/** Milliseconds without a motion after which all are drawn. */
const REST = 180;
/** Milliseconds after the page's start when the points' programs are compiled: when the page is there to be seen. */
const PREPARATION = 100;
/** Least share of the points by which the others are drawn larger. */
const LEAST_SHARE = 0.05;

/** A picture, which is drawn out of sight, some points at a time, and then shown. */
interface Picture {
  /** Of each layer, how many points each block should have. */
  wanted: number[][];
  /** How many that are together. */
  total: number;
  /** Share of these that is drawn in the end. */
  share: number;
  /** Share of these, and points, that have been drawn. */
  drawn: number;
  points: number;
}

/** What a link keeps of the view. */
export interface ViewState {
  position: Vector;
  target: Vector;
}

export class Viewer {
  readonly camera = new PerspectiveCamera(45, 1, 0.01, 1000);
  readonly layers: PointLayer[] = [];
  /** Where the view's 0 is, in the coordinates of the file. */
  origin: Vector = [0, 0, 0];
  onDrawn: (drawn: number, total: number) => void = () => undefined;
  private readonly screen: Screen;
  private readonly controls: OrbitControls;
  private readonly scene = new Scene();
  private readonly overlays: Object3D[] = [];
  private readonly pace: Pace;
  private sphere = new Sphere(new Vector3(), 1);
  private lastMotion = -Infinity;
  private requested = false;
  /** Whether what is shown is out of date. */
  private stale = true;
  private refinement: Picture | null = null;
  /** Who waits until a picture has been drawn. */
  private readonly afterwards: (() => void)[] = [];
  /** Kept, as programs go with the last material that uses them. */
  private readonly firstPoint = new PointLayer(onePoint(), [0, 0, 0]);
  private diameter = 1;
  private sizeFactor = 1;

  constructor(canvas: HTMLCanvasElement) {
    this.screen = new Screen(canvas);
    this.pace = new Pace(this.screen.context);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", () => this.moved());
    new ResizeObserver(() => this.resized()).observe(canvas);
    this.resized();
    setTimeout(() => this.prepare(), PREPARATION);
  }

  /** Draws a point out of sight, so that the programs are there before a file is: that takes up to half a second. */
  private prepare(): void {
    if (this.layers.length > 0) return;
    this.scene.add(this.firstPoint.group);
    this.screen.draw(this.scene, this.camera);
    this.scene.remove(this.firstPoint.group);
  }

  private resized(): void {
    this.screen.resize();
    const { width, height } = this.screen.size;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.render();
  }

  setBackground(css: string): void {
    this.screen.setBackground(css);
    this.render();
  }

  /** Takes everything away. */
  clear(): void {
    for (const layer of this.layers) {
      this.scene.remove(layer.group);
      layer.dispose();
    }
    this.layers.length = 0;
    for (const overlay of this.overlays) this.scene.remove(overlay);
    this.overlays.length = 0;
  }

  add(layer: PointLayer): void {
    this.layers.push(layer);
    this.scene.add(layer.group);
  }

  addOverlay(object: Object3D): void {
    this.overlays.push(object);
    this.scene.add(object);
  }

  /** Diameter of a point where it is large, in the cloud's unit. */
  setPointSize(diameter: number): void {
    this.diameter = diameter;
    this.render();
  }

  /** Draws points larger or smaller by a factor. */
  scalePoints(factor: number): void {
    this.sizeFactor = factor;
    this.render();
  }

  setShading(eyeDome: boolean, normals: boolean): void {
    this.screen.setEyeDome(eyeDome);
    for (const { material } of this.layers) material.uniforms.shading.value = normals ? 1 : 0;
    this.render();
  }

  /** Shows all points, from in front and above, or from a direction. */
  fit(from: Vector = [0.45, -1, 0.62]): void {
    this.resized();
    const box = new Box3();
    for (const layer of this.layers) box.union(layer.box.clone().applyMatrix4(layer.group.matrixWorld));
    for (const overlay of this.overlays) box.expandByObject(overlay);
    if (box.isEmpty()) return;
    this.sphere = box.getBoundingSphere(new Sphere());
    const distance = this.distanceFor(box, new Vector3(...from).normalize());
    this.controls.target.copy(this.sphere.center);
    this.camera.position
      .set(...from)
      .normalize()
      .multiplyScalar(distance)
      .add(this.sphere.center);
    this.controls.maxDistance = 20 * this.sphere.radius;
    this.controls.minDistance = 1e-4 * this.sphere.radius;
    this.controls.update();
    this.moved();
  }

  /** How far away in a direction from the middle of a box all of its corners are in view. */
  private distanceFor(box: Box3, towards: Vector3): number {
    const up = Math.tan((this.camera.fov * Math.PI) / 360);
    const right = new Vector3().crossVectors(this.camera.up, towards).normalize();
    const above = new Vector3().crossVectors(towards, right);
    const half = box.getSize(new Vector3()).multiplyScalar(0.5);
    let distance = 1e-6;
    for (let corner = 0; corner < 8; corner++) {
      const at = new Vector3(
        ...[1, 2, 4].map((bit, axis) => (corner & bit ? 1 : -1) * half.getComponent(axis)),
      );
      const across = Math.max(
        Math.abs(at.dot(right)) / (up * this.camera.aspect),
        Math.abs(at.dot(above)) / up,
      );
      distance = Math.max(distance, at.dot(towards) + MARGIN * across);
    }
    return distance;
  }

  get state(): ViewState {
    return { position: this.camera.position.toArray(), target: this.controls.target.toArray() };
  }

  set state({ position, target }: ViewState) {
    this.camera.position.set(...position);
    this.controls.target.set(...target);
    this.controls.update();
    this.moved();
  }

  /** Turns about what is looked at, by angles in radians, and comes nearer by a factor. */
  turn(azimuth: number, elevation: number, factor = 1): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const length = offset.length() * factor;
    const up = Math.min(Math.max(Math.asin(offset.z / offset.length()) + elevation, -1.55), 1.55);
    const around = Math.atan2(offset.y, offset.x) + azimuth;
    offset.set(Math.cos(up) * Math.cos(around), Math.cos(up) * Math.sin(around), Math.sin(up));
    this.camera.position.copy(this.controls.target).addScaledVector(offset, length);
    this.controls.update();
    this.moved();
  }

  pick(x: number, y: number): Picked | null {
    const { width, height } = this.screen.size;
    return pick(this.visible, this.camera, width, height, x, y);
  }

  inView(layer: PointLayer): Uint32Array<ArrayBuffer> {
    const { width, height } = this.screen.size;
    return inView(layer, this.camera, width, height);
  }

  /** Where a point is on the screen, in pixels; null behind the viewer. */
  onScreen(layer: PointLayer, point: number): [number, number] | null {
    const { width, height } = this.screen.size;
    const seen = projector(layer, this.camera, width, height)(point, new Vector3());
    return seen.z > 0 ? [seen.x, seen.y] : null;
  }

  private get visible(): PointLayer[] {
    return this.layers.filter((layer) => layer.group.visible);
  }

  private moved(): void {
    this.lastMotion = performance.now();
    this.render();
  }

  /** Draws soon. */
  render(): void {
    this.stale = true;
    this.schedule();
  }

  private schedule(): void {
    if (this.requested || this.pace.busy) return;
    this.requested = true;
    requestAnimationFrame((now) => {
      this.requested = false;
      if (this.stale) this.drawQuickly(now);
      else if (this.refinement !== null) this.refine(this.refinement);
    });
  }

  /** Waits until a picture has been drawn, or for some time: a page out of sight draws none. */
  drawn(patience: number): Promise<void> {
    return new Promise((resolve) => {
      this.afterwards.push(resolve);
      setTimeout(resolve, patience);
    });
  }

  private next(points: number, begun: number): void {
    this.pace.follow(points, begun, () => {
      for (const resolve of this.afterwards.splice(0)) resolve();
      if (this.stale || this.refinement !== null) this.schedule();
    });
  }

  /** Shows as many points as are drawn at once; where that are not all, all are drawn when nothing moves. */
  private drawQuickly(now: number): void {
    this.stale = false;
    const begun = performance.now();
    const whole = this.newPicture();
    const share = Math.min(whole.share, this.pace.budget / whole.total);
    this.begin(share);
    const drawn = this.drawPart({ ...whole }, share);
    const isWhole = share === whole.share;
    this.show(drawn, isWhole);
    const moving = now - this.lastMotion < REST;
    this.refinement = isWhole || moving ? null : whole;
    if (!isWhole && moving) {
      setTimeout(() => {
        const still = performance.now() - this.lastMotion >= REST;
        if (still && !this.stale && this.refinement === null) {
          this.refinement = this.newPicture();
          this.schedule();
        }
      }, REST + 10);
    }
    this.next(drawn, begun);
  }

  /** Draws some points more of the picture that comes next, and shows it when it is whole. */
  private refine(picture: Picture): void {
    const begun = performance.now();
    if (picture.drawn === 0) this.begin(picture.share);
    const until = Math.min(picture.share, picture.drawn + this.pace.budget / picture.total);
    const points = this.drawPart(picture, until);
    if (until === picture.share) {
      this.show(picture.points, true);
      this.refinement = null;
    }
    this.next(points, begun);
  }

  private newPicture(): Picture {
    this.setDepthRange();
    this.camera.updateMatrixWorld();
    const wanted = this.visible.map((layer) => layer.wanted(this.camera, this.pixelsPerUnit));
    const total = Math.max(
      1,
      wanted.flat().reduce((sum, count) => sum + count, 0),
    );
    return { wanted, total, share: Math.min(1, MOST / total), drawn: 0, points: 0 };
  }

  private get pixelsPerUnit(): number {
    const height = this.screen.size.height * this.screen.pixelRatio;
    return height / (2 * Math.tan((this.camera.fov * Math.PI) / 360));
  }

  /** Begins a picture that has a share of the points. */
  private begin(share: number): void {
    for (const { material } of this.visible) {
      material.uniforms.pixelsPerUnit.value = this.pixelsPerUnit;
      // Fewer points are drawn larger, so that surfaces stay closed.
      material.uniforms.diameter.value =
        (this.diameter * this.sizeFactor) / Math.sqrt(Math.max(share, LEAST_SHARE));
      material.uniforms.leastSize.value = Math.max(
        1,
        1.4 * this.screen.pixelRatio * Math.min(this.sizeFactor, 3),
      );
    }
    this.screen.begin();
  }

  /** Draws the next points into the picture that was begun, until it has a share of them; returns how many. */
  private drawPart(picture: Picture, until: number): number {
    let points = 0;
    this.visible.forEach((layer, i) => {
      points += layer.draw(picture.wanted[i], picture.drawn, until);
    });
    picture.drawn = until;
    picture.points += points;
    this.screen.draw(this.scene, this.camera);
    return points;
  }

  /** Shows the picture that was drawn. */
  private show(points: number, isWhole: boolean): void {
    this.screen.show(this.camera, isWhole);
    this.onDrawn(
      points,
      this.visible.reduce((sum, { layer }) => sum + layer.count, 0),
    );
  }

  /** Near and far planes that hold everything, close together. */
  private setDepthRange(): void {
    const distance = this.camera.position.distanceTo(this.sphere.center);
    const far = distance + 1.5 * this.sphere.radius;
    const near = Math.max(
      distance - 1.5 * this.sphere.radius,
      2e-3 * this.camera.position.distanceTo(this.controls.target),
      1e-5 * far,
    );
    this.camera.near = near;
    this.camera.far = far;
    this.camera.updateProjectionMatrix();
  }

  /** The picture as a PNG file. */
  picture(): Promise<Blob> {
    const whole = this.newPicture();
    // What was begun out of sight is gone.
    this.refinement = null;
    this.begin(whole.share);
    this.show(this.drawPart(whole, whole.share), true);
    return this.screen.picture();
  }
}
