/** The surfaces as rows: for the page's table, and for CSV and JSON. */

import type { Surface } from "./engine/surfsig.js";
import { studentT, text } from "./numbers.js";

/** Ends of the radius's 95 % interval; null where it has none. */
export function interval(surface: Surface): [number, number] | null {
  const reach = studentT(surface.freedom) * surface.radiusStd;
  return Number.isFinite(reach) && Number.isFinite(surface.radius)
    ? [surface.radius - reach, surface.radius + reach]
    : null;
}

/** What a row says about the size: the radius with its 95 % interval. */
export function sizeText(surface: Surface): { radius: string; range: string } {
  const ends = interval(surface);
  if (ends === null)
    return { radius: Number.isFinite(surface.radius) ? text(surface.radius) : "", range: "" };
  const half = ends[1] - surface.radius;
  const decimals = half > 0 ? Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(half)))) : 4;
  return { radius: surface.radius.toFixed(decimals), range: `± ${half.toFixed(decimals)}` };
}

function values(surface: Surface, number: number): Record<string, string | number | number[] | null> {
  const known = (value: number): number | null => (Number.isFinite(value) ? value : null);
  const ends = interval(surface);
  return {
    number,
    kind: surface.kind,
    radius: known(surface.radius),
    radius_std: known(surface.radiusStd),
    radius_low: ends === null ? null : ends[0],
    radius_high: ends === null ? null : ends[1],
    major_radius: known(surface.majorRadius),
    major_radius_std: known(surface.majorRadiusStd),
    half_angle: known(surface.halfAngle),
    half_angle_std: known(surface.halfAngleStd),
    point: surface.point,
    axis: surface.axis.every(Number.isFinite) ? surface.axis : null,
    rms: known(surface.deviation),
    points: surface.count,
  };
}

export function surfacesJson(surfaces: Surface[], source: string): string {
  return JSON.stringify({ source, surfaces: surfaces.map(values) }, null, 1);
}

export function surfacesCsv(surfaces: Surface[]): string {
  const rows = surfaces.map((surface, number) => {
    const { point, axis, ...rest } = values(surface, number);
    const vector = (name: string, three: unknown): [string, number | string][] =>
      ["x", "y", "z"].map((letter, i) => [
        `${name}_${letter}`,
        Array.isArray(three) ? (three[i] as number) : "",
      ]);
    return Object.fromEntries([...Object.entries(rest), ...vector("point", point), ...vector("axis", axis)]);
  });
  const header = Object.keys(rows[0] ?? { number: 0 });
  const lines = rows.map((row) => header.map((name) => row[name] ?? "").join(","));
  return [header.join(","), ...lines].join("\n") + "\n";
}
