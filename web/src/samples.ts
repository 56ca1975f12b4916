/** Three small scans that the page makes itself, always the same. */

import type { CloudData, Vector } from "./files/cloud.js";

export interface Sample {
  id: string;
  title: string;
  told: string;
  /** Of the neighbourhood, in metres, at which its shapes are seen well. */
  radius: number;
  make(): CloudData;
}

/** Uniform numbers from 0 to 1 that are always the same (mulberry32), and normal ones. */
class Draws {
  constructor(private state: number) {}

  uniform(): number {
    this.state = (this.state + 0x6d2b79f5) | 0;
    let t = Math.imul(this.state ^ (this.state >>> 15), 1 | this.state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  }

  normal(): number {
    return Math.sqrt(-2 * Math.log(1 - this.uniform())) * Math.cos(2 * Math.PI * this.uniform());
  }
}

/** Gives the point of a surface and its unit normal for two numbers from 0 to 1. */
type Surface = (u: number, v: number) => { point: Vector; normal: Vector };

/** Draws points of surfaces that a viewpoint sees the front of, with noise along the normals. */
function scan(
  name: string,
  viewpoint: Vector,
  noise: number,
  parts: { surface: Surface; points: number; seen?: (point: Vector) => boolean }[],
): CloudData {
  const draws = new Draws(20240601);
  const rows: number[] = [];
  for (const { surface, points, seen } of parts) {
    for (let i = 0; i < points; i++) {
      const { point, normal } = surface(draws.uniform(), draws.uniform());
      const facing = point.reduce((sum, c, axis) => sum + (viewpoint[axis] - c) * normal[axis], 0);
      const offset = noise * draws.normal();
      if (facing <= 0 || seen?.(point) === false) continue;
      rows.push(...point.map((c, axis) => c + offset * normal[axis]));
    }
  }
  const positions = Float32Array.from(rows);
  return {
    name,
    format: "sample",
    count: positions.length / 3,
    positions,
    origin: [0, 0, 0],
    colours: null,
    fields: {},
    viewpoint,
    left_out: 0,
  };
}

const rectangle =
  (corner: Vector, along: Vector, across: Vector, normal: Vector): Surface =>
  (u, v) => ({ point: corner.map((c, i) => c + u * along[i] + v * across[i]) as Vector, normal });

const ball =
  (centre: Vector, radius: number): Surface =>
  (u, v) => {
    const z = 2 * u - 1;
    const side = Math.sqrt(1 - z * z);
    const normal: Vector = [side * Math.cos(2 * Math.PI * v), side * Math.sin(2 * Math.PI * v), z];
    return { point: normal.map((c, i) => centre[i] + radius * c) as Vector, normal };
  };

/** A tube about the line from a point along an axis (x, y or z). */
const tube =
  (start: Vector, axis: number, length: number, radius: number): Surface =>
  (u, v) => {
    const [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    const normal: Vector = [0, 0, 0];
    normal[a] = Math.cos(2 * Math.PI * u);
    normal[b] = Math.sin(2 * Math.PI * u);
    const point = normal.map((c, i) => start[i] + radius * c) as Vector;
    point[axis] += v * length;
    return { point, normal };
  };

/** A quarter of a torus about a vertical axis, from the angle `from` on. */
const bend =
  (centre: Vector, major: number, minor: number, from: number): Surface =>
  (u, v) => {
    const [around, along] = [2 * Math.PI * u, from + (v * Math.PI) / 2];
    const normal: Vector = [
      Math.cos(around) * Math.cos(along),
      Math.cos(around) * Math.sin(along),
      Math.sin(around),
    ];
    const middle: Vector = [
      centre[0] + major * Math.cos(along),
      centre[1] + major * Math.sin(along),
      centre[2],
    ];
    return { point: middle.map((c, i) => c + minor * normal[i]) as Vector, normal };
  };

function parts(): CloudData {
  const [table, outside]: [number, (p: Vector) => boolean] = [
    0.4,
    ([x, y]) => {
      const under = [
        [-0.11, -0.06, 0.06],
        [0.1, 0.07, 0.045],
        [0.11, -0.09, 0.045],
      ];
      return (
        under.every(([cx, cy, r]) => (x - cx) ** 2 + (y - cy) ** 2 > (0.85 * r) ** 2) &&
        !(Math.abs(x + 0.07) < 0.05 && y > 0.07 && y < 0.15)
      );
    },
  ];
  const box: [Vector, Vector, Vector, Vector][] = [
    [
      [-0.12, 0.07, 0.05],
      [0.1, 0, 0],
      [0, 0.08, 0],
      [0, 0, 1],
    ],
    [
      [-0.12, 0.07, 0],
      [0.1, 0, 0],
      [0, 0, 0.05],
      [0, -1, 0],
    ],
    [
      [-0.02, 0.07, 0],
      [0, 0.08, 0],
      [0, 0, 0.05],
      [1, 0, 0],
    ],
  ];
  const above = ([, , z]: Vector): boolean => z > 0.0005;
  return scan("Parts on a table", [0.25, -0.6, 0.7], 0.00015, [
    {
      surface: rectangle([-table / 2, -table / 2, 0], [table, 0, 0], [0, table, 0], [0, 0, 1]),
      points: 42000,
      seen: outside,
    },
    { surface: ball([-0.11, -0.06, 0.04], 0.06), points: 26000, seen: above },
    { surface: ball([0.1, 0.07, 0.03], 0.045), points: 16000, seen: above },
    { surface: tube([0.11, -0.16, 0.03], 1, 0.14, 0.03), points: 16000, seen: above },
    { surface: tube([0.0, -0.15, 0.015], 0, 0.07, 0.015), points: 5000, seen: above },
    ...box.map(([corner, along, across, normal]) => ({
      surface: rectangle(corner, along, across, normal),
      points: 6000,
    })),
  ]);
}

function pipes(): CloudData {
  return scan("Pipes at a wall", [1.5, -4, 2.6], 0.0015, [
    { surface: rectangle([-2, 1, 0], [4, 0, 0], [0, 0, 2.4], [0, -1, 0]), points: 30000 },
    { surface: rectangle([-2, -1, 0], [4, 0, 0], [0, 2, 0], [0, 0, 1]), points: 22000 },
    { surface: tube([-1.9, 0.6, 1.8], 0, 2.7, 0.11), points: 24000 },
    { surface: bend([0.8, 0.3, 1.8], 0.3, 0.11, 0), points: 6000 },
    { surface: tube([1.1, -0.9, 1.8], 1, 1.2, 0.11), points: 11000 },
    { surface: tube([-1.9, 0.72, 1.2], 0, 3.6, 0.055), points: 16000 },
    { surface: tube([-1.2, 0.2, 0], 2, 1.69, 0.08), points: 15000 },
    { surface: ball([0.2, -0.1, 0.35], 0.35), points: 20000, seen: ([, , z]) => z > 0.005 },
  ]);
}

/** Hills and hollows of two wavelengths: all classes of curvature. */
function waves(): CloudData {
  const surface: Surface = (u, v) => {
    const [x, y] = [4 * u - 2, 4 * v - 2];
    const height = 0.22 * Math.sin(2.2 * x) * Math.cos(1.9 * y) + 0.1 * Math.sin(0.9 * x + 1.7 * y);
    const dx = 0.484 * Math.cos(2.2 * x) * Math.cos(1.9 * y) + 0.09 * Math.cos(0.9 * x + 1.7 * y);
    const dy = -0.418 * Math.sin(2.2 * x) * Math.sin(1.9 * y) + 0.17 * Math.cos(0.9 * x + 1.7 * y);
    const length = Math.hypot(dx, dy, 1);
    return { point: [x, y, height], normal: [-dx / length, -dy / length, 1 / length] };
  };
  return scan("Hills and hollows", [0, 0, 8], 0.001, [{ surface, points: 90000 }]);
}

export const SAMPLES: Sample[] = [
  {
    id: "parts",
    title: "Parts on a table",
    told: "balls, rods and a box, from a scanner of 0.15 mm",
    radius: 0.012,
    make: parts,
  },
  {
    id: "pipes",
    title: "Pipes at a wall",
    told: "pipes, an elbow and a tank, from a lidar of 1.5 mm",
    radius: 0.08,
    make: pipes,
  },
  {
    id: "waves",
    title: "Hills and hollows",
    told: "all kinds of curvature, on one surface",
    radius: 0.2,
    make: waves,
  },
];
