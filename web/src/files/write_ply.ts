/** Binary PLY of a layer: coordinates, curvature and whatever is known of its points. */

import type { Layer } from "../view/layer.js";

/** Names of columns as surfsig's files have them: letters, digits and underscores. */
const propertyName = (name: string): string => name.replace(/\W+/g, "_");

interface Written {
  type: "float" | "double" | "int" | "uchar";
  name: string;
  value(i: number): number;
}

const SIZES = { float: 4, double: 8, int: 4, uchar: 1 };

export function writePly(layer: Layer): Blob {
  const { positions, origin, normals, colours, labels, columns, count, viewpoint } = layer;
  const far = origin.some((c) => c !== 0);
  const properties: Written[] = ["x", "y", "z"].map((name, axis) => ({
    type: far ? "double" : "float",
    name,
    value: (i) => positions[3 * i + axis] + origin[axis],
  }));
  if (normals !== null) {
    ["nx", "ny", "nz"].forEach((name, axis) => {
      properties.push({ type: "float", name, value: (i) => normals[3 * i + axis] });
    });
  }
  if (colours !== null) {
    ["red", "green", "blue"].forEach((name, c) => {
      properties.push({ type: "uchar", name, value: (i) => colours[3 * i + c] });
    });
  }
  for (const [name, values] of columns) {
    properties.push({ type: "float", name: propertyName(name), value: (i) => values[i] });
  }
  if (labels !== null) properties.push({ type: "int", name: "surface", value: (i) => labels[i] });
  const header = [
    "ply",
    "format binary_little_endian 1.0",
    "comment written by the page of surfsig",
    ...(viewpoint === null ? [] : [`comment surfsig viewpoint ${viewpoint.join(" ")}`]),
    `element vertex ${count}`,
    ...properties.map(({ type, name }) => `property ${type} ${name}`),
    "end_header\n",
  ].join("\n");
  const stride = properties.reduce((sum, { type }) => sum + SIZES[type], 0);
  const view = new DataView(new ArrayBuffer(stride * count));
  let at = 0;
  for (let i = 0; i < count; i++) {
    for (const { type, value } of properties) {
      if (type === "float") view.setFloat32(at, value(i), true);
      else if (type === "double") view.setFloat64(at, value(i), true);
      else if (type === "int") view.setInt32(at, value(i), true);
      else view.setUint8(at, value(i));
      at += SIZES[type];
    }
  }
  return new Blob([header, view.buffer], { type: "application/octet-stream" });
}
