/** The points of a layer in blocks, of each of which as many are drawn as its size on the screen asks for. */

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  type Camera,
  Frustum,
  Group,
  Matrix4,
  Points,
  Quaternion,
  ShaderMaterial,
  Sphere,
  Vector3,
} from "three";
import type { Vector } from "../files/cloud.js";
import { boundsOf, type Layer } from "./layer.js";
import { POINT_FRAGMENT, POINT_VERTEX } from "./shaders.js";

/** Points of a block: few enough that blocks out of view save much, many enough that calls are few. */
const BLOCK_POINTS = 40_000;

/** Most points of a block: software renderers draw nothing of more. */
const MOST_BLOCK_POINTS = 65_535;

/** Most blocks along an axis. */
const MOST_CELLS = 24;

/** Diameter of a drawn point, in diagonals of the box over the root of the number of points. */
const CLOSED_BY_BOX = 1.6;

interface Block {
  points: Points;
  sphere: Sphere;
  count: number;
}

export class PointLayer {
  readonly group = new Group();
  readonly material: ShaderMaterial;
  readonly box: Box3;
  private readonly blocks: Block[] = [];
  /** The point that stands at each place of the blocks' arrays. */
  private readonly order: Uint32Array;
  private readonly rgba: Uint8Array;
  private readonly directions: Int8Array;

  /** `sceneOrigin`: where the view's 0 is. */
  constructor(
    readonly layer: Layer,
    private readonly sceneOrigin: Vector,
  ) {
    const { low, high } = boundsOf(layer);
    this.box = new Box3(new Vector3(...low), new Vector3(...high));
    this.material = new ShaderMaterial({
      vertexShader: POINT_VERTEX,
      fragmentShader: POINT_FRAGMENT,
      uniforms: {
        pixelsPerUnit: { value: 1 },
        diameter: { value: 1 },
        leastSize: { value: 1.5 },
        shading: { value: 1 },
      },
    });
    const { order, starts } = blockOrder(layer, low, high);
    this.order = order;
    this.rgba = new Uint8Array(4 * layer.count);
    this.directions = new Int8Array(3 * layer.count);
    const positions = new Float32Array(3 * layer.count);
    for (let place = 0; place < order.length; place++) {
      const i = 3 * order[place];
      positions[3 * place] = layer.positions[i];
      positions[3 * place + 1] = layer.positions[i + 1];
      positions[3 * place + 2] = layer.positions[i + 2];
    }
    for (let b = 0; b + 1 < starts.length; b++) this.addBlock(positions, starts[b], starts[b + 1]);
    this.place(1);
    if (layer.normals !== null) this.setNormals(layer.normals);
  }

  private addBlock(positions: Float32Array, start: number, end: number): void {
    if (end - start > MOST_BLOCK_POINTS) {
      this.addBlock(positions, start, start + MOST_BLOCK_POINTS);
      this.addBlock(positions, start + MOST_BLOCK_POINTS, end);
      return;
    }
    if (end === start) return;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions.subarray(3 * start, 3 * end), 3));
    geometry.setAttribute("rgba", new BufferAttribute(this.rgba.subarray(4 * start, 4 * end), 4, true));
    geometry.setAttribute(
      "direction",
      new BufferAttribute(this.directions.subarray(3 * start, 3 * end), 3, true),
    );
    geometry.computeBoundingSphere();
    const points = new Points(geometry, this.material);
    points.frustumCulled = false;
    this.group.add(points);
    this.blocks.push({ points, sphere: geometry.boundingSphere as Sphere, count: end - start });
  }

  /** Moves the points to where they are at a share of the way from before to after. */
  place(share: number): void {
    const { origin, transform } = this.layer;
    const matrix = new Matrix4();
    const offset = new Vector3(...(origin.map((o, axis) => o - this.sceneOrigin[axis]) as Vector));
    matrix.makeTranslation(offset);
    if (transform !== null) {
      const t = transform;
      // R (offset + origin) + t, with the origins taken off in float64.
      const moved = [0, 1, 2].map(
        (r) =>
          t[4 * r] * origin[0] +
          t[4 * r + 1] * origin[1] +
          t[4 * r + 2] * origin[2] +
          t[4 * r + 3] -
          this.sceneOrigin[r],
      );
      const rotation = new Matrix4().set(
        ...([t[0], t[1], t[2], 0, t[4], t[5], t[6], 0, t[8], t[9], t[10], 0, 0, 0, 0, 1] as Sixteen),
      );
      const centre = this.box.getCenter(new Vector3());
      const turned = new Quaternion().slerp(new Quaternion().setFromRotationMatrix(rotation), share);
      // The centre moves along a straight line, and the points turn about it.
      const from = centre.clone().add(offset);
      const to = centre
        .clone()
        .applyMatrix4(rotation)
        .add(new Vector3(...(moved as Vector)));
      const at = from.lerp(to, share);
      matrix.makeRotationFromQuaternion(turned);
      matrix.setPosition(at.sub(centre.applyQuaternion(turned)));
    }
    this.group.matrixAutoUpdate = false;
    this.group.matrix.copy(matrix);
    this.group.matrixWorldNeedsUpdate = true;
    this.group.updateMatrixWorld(true);
  }

  /** Gives each point a colour, (n, 3), and says which are chosen, (n); null for none. */
  setColours(colours: Uint8Array, chosen: Uint8Array | null): void {
    for (let place = 0; place < this.order.length; place++) {
      const i = this.order[place];
      this.rgba[4 * place] = colours[3 * i];
      this.rgba[4 * place + 1] = colours[3 * i + 1];
      this.rgba[4 * place + 2] = colours[3 * i + 2];
      this.rgba[4 * place + 3] = chosen === null ? 0 : 255 * chosen[i];
    }
    for (const block of this.blocks) block.points.geometry.attributes.rgba.needsUpdate = true;
  }

  setNormals(normals: Float32Array): void {
    for (let place = 0; place < this.order.length; place++) {
      for (let axis = 0; axis < 3; axis++) {
        const component = normals[3 * this.order[place] + axis];
        this.directions[3 * place + axis] = Number.isNaN(component) ? 0 : Math.round(127 * component);
      }
    }
    for (const block of this.blocks) block.points.geometry.attributes.direction.needsUpdate = true;
  }

  /** Diameter of points with which a surface looks closed, as far as the box tells: a spacing needs a search. */
  get closedDiameter(): number {
    const [, middle, largest] = this.box
      .getSize(new Vector3())
      .toArray()
      .sort((a, b) => a - b);
    return (CLOSED_BY_BOX * Math.hypot(middle, largest)) / Math.sqrt(Math.max(1, this.layer.count));
  }

  /** How many points each block should have: by the area on the screen, at most all. Points per block, 0 if hidden. */
  wanted(camera: Camera, pixelsPerUnit: number): number[] {
    const projection = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    const frustum = new Frustum().setFromProjectionMatrix(projection);
    const eye = camera.position;
    return this.blocks.map(({ sphere, count }) => {
      const there = sphere.clone().applyMatrix4(this.group.matrixWorld);
      if (!frustum.intersectsSphere(there)) return 0;
      const distance = Math.max(there.center.distanceTo(eye) - there.radius, 1e-6 * there.radius);
      const pixels = (there.radius * pixelsPerUnit) / distance;
      // More than two points a pixel show nothing new.
      return Math.min(count, Math.ceil(2 * Math.PI * pixels * pixels) + 1);
    });
  }

  /** Draws what is between two shares of what the blocks want; returns how many points that are. */
  draw(wanted: number[], from: number, to: number): number {
    let drawn = 0;
    this.blocks.forEach(({ points }, b) => {
      const start = Math.ceil(wanted[b] * from);
      const count = Math.ceil(wanted[b] * to) - start;
      points.visible = count > 0;
      points.geometry.setDrawRange(start, count);
      drawn += count;
    });
    return drawn;
  }

  dispose(): void {
    for (const block of this.blocks) block.points.geometry.dispose();
    this.material.dispose();
  }
}

type Sixteen = Parameters<Matrix4["set"]>;

/** Sorts points into cells, in each of which they stand by chance, so that the first of them are spread evenly. */
function blockOrder(layer: Layer, low: Vector, high: Vector): { order: Uint32Array; starts: Uint32Array } {
  const { count, positions } = layer;
  const extents = low.map((corner, axis) => high[axis] - corner);
  const largest = Math.max(...extents, 1e-30);
  // Points are on surfaces: as many cells as blocks, along the two larger axes.
  const cells = Math.min(MOST_CELLS, Math.max(1, Math.round(Math.sqrt(count / BLOCK_POINTS))));
  const size = largest / cells;
  const counts = extents.map((extent) => Math.max(1, Math.min(cells, Math.ceil(extent / size))));
  const [countX, countY, countZ] = counts;
  const at = (offset: number, most: number): number => Math.min(most - 1, Math.floor(offset / size));
  const starts = new Uint32Array(countX * countY * countZ + 1);
  const cellNumbers = new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    const x = at(positions[3 * i] - low[0], countX);
    const y = at(positions[3 * i + 1] - low[1], countY);
    const z = at(positions[3 * i + 2] - low[2], countZ);
    const cell = (x * countY + y) * countZ + z;
    cellNumbers[i] = cell;
    starts[cell + 1]++;
  }
  for (let cell = 1; cell < starts.length; cell++) starts[cell] += starts[cell - 1];
  const next = starts.slice();
  const order = new Uint32Array(count);
  for (let i = 0; i < count; i++) order[next[cellNumbers[i]]++] = i;
  for (let cell = 0; cell + 1 < starts.length; cell++)
    shuffle(order.subarray(starts[cell], starts[cell + 1]));
  return { order, starts };
}

/** Fisher and Yates' shuffle, with numbers that are always the same. */
function shuffle(numbers: Uint32Array): void {
  let state = 0x9e3779b9;
  for (let i = numbers.length - 1; i > 0; i--) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    const k = Math.floor((state / 2 ** 32) * (i + 1));
    const number = numbers[i];
    numbers[i] = numbers[k];
    numbers[k] = number;
  }
}
