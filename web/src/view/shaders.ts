/** The programs of the graphics processor: points, and eye-dome lighting. */

export const POINT_VERTEX = /* glsl */ `
attribute vec4 rgba;
attribute vec3 direction;
uniform float pixelsPerUnit;
uniform float diameter;
uniform float leastSize;
uniform float shading;
varying vec3 colour;
varying float size;

void main() {
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * place;
  // Alpha says how much larger a chosen point is drawn.
  float factor = 1.0 + 1.2 * rgba.a;
  size = clamp(factor * diameter * pixelsPerUnit / max(-place.z, 1e-9), factor * leastSize, 48.0);
  gl_PointSize = size;
  vec3 seen = normalMatrix * direction;
  float length2 = dot(seen, seen);
  // A light over the viewer's left shoulder, the same for both sides of a surface; none where no normal is known.
  float lit = length2 > 0.25 ? abs(dot(seen * inversesqrt(length2), normalize(vec3(-0.35, 0.45, 0.82)))) : 1.0;
  colour = rgba.rgb * mix(1.0, 0.4 + 0.65 * lit, shading);
}
`;

export const POINT_FRAGMENT = /* glsl */ `
varying vec3 colour;
varying float size;

void main() {
  vec2 from = gl_PointCoord - 0.5;
  if (size > 2.5 && dot(from, from) > 0.25) discard;
  gl_FragColor = vec4(min(colour, 1.0), 1.0);
}
`;

export const SCREEN_VERTEX = /* glsl */ `
varying vec2 where;

void main() {
  where = 0.5 * position.xy + 0.5;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}
`;

/** Rings of eight places around a pixel that eye-dome lighting looks at: all, and where time is short. */
export const [RINGS, FEW_RINGS] = [2, 1];

/** Pixels between two rings. */
const RING_STEP = 1.4;

/** The sum over the places of a ring. Written out: software renderers are slow at indexed constants. */
const RING_SUM = Array.from({ length: 8 }, (_, i) => (Math.PI / 4) * i)
  .map((angle) => `shadow(own, turn * vec2(${Math.cos(angle).toFixed(6)}, ${Math.sin(angle).toFixed(6)}))`)
  .join(" +\n      ");

/** Eye-dome lighting (Boucheny 2009): a pixel is darker the more of its neighbours are nearer, on a log scale. */
export const EYE_DOME_FRAGMENT = /* glsl */ `
varying vec2 where;
uniform sampler2D colours;
uniform sampler2D depths;
uniform vec2 pixel;
uniform float near;
uniform float far;
uniform float strength;
uniform int rings;
uniform vec3 background;

// The logarithm of 2 near far over the distance.
float logNearness(float depth) {
  return log2(far + near - (2.0 * depth - 1.0) * (far - near));
}

// Edges before the background are no darker than others: the sum of one pixel is limited.
float shadow(float own, vec2 at) {
  float depth = texture2D(depths, where + pixel * at).x;
  return depth < 1.0 ? clamp(logNearness(depth) - own, 0.0, 0.06) : 0.0;
}

void main() {
  float depth = texture2D(depths, where).x;
  float own = logNearness(depth);
  float sum = 0.0;
  // Software renderers compute all branches, and leave loops early: the background has none to go through.
  int count = depth < 1.0 ? rings : 0;
  for (int ring = 1; ring <= count; ring++) {
    float angle = 0.39 * float(ring - 1);
    mat2 turn = ${RING_STEP} * float(ring) * mat2(cos(angle), sin(angle), -sin(angle), cos(angle));
    sum += ${RING_SUM};
  }
  float shade = exp(-strength * sum / (8.0 * float(max(rings, 1))));
  gl_FragColor = vec4(depth < 1.0 ? texture2D(colours, where).rgb * shade : background, 1.0);
}
`;
