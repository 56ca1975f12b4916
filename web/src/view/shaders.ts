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

/** Eye-dome lighting (Boucheny 2009): a pixel is darker the more of its neighbours are nearer, on a log scale. */
export const EYE_DOME_FRAGMENT = /* glsl */ `
varying vec2 where;
uniform sampler2D colours;
uniform sampler2D depths;
uniform vec2 pixel;
uniform float near;
uniform float far;
uniform float strength;
uniform vec3 background;

const float NOTHING = 1e6;

float logDepth(vec2 at) {
  float depth = texture2D(depths, at).x;
  if (depth >= 1.0) return NOTHING;
  float z = 2.0 * depth - 1.0;
  return log2(2.0 * near * far / (far + near - z * (far - near)));
}

void main() {
  float own = logDepth(where);
  float sum = 0.0;
  float weight = 0.0;
  if (own == NOTHING) {
    gl_FragColor = vec4(background, 1.0);
    return;
  }
  for (int ring = 1; ring <= 2; ring++) {
    for (int i = 0; i < 8; i++) {
      float angle = 0.7853981634 * float(i) + 0.39 * float(ring - 1);
      float depth = logDepth(where + 1.4 * float(ring) * pixel * vec2(cos(angle), sin(angle)));
      weight += 1.0;
      // Edges before the background are no darker than others: the sum of one pixel is limited.
      if (depth < NOTHING) sum += min(max(0.0, own - depth), 0.06);
    }
  }
  float shade = exp(-strength * sum / weight);
  gl_FragColor = vec4(texture2D(colours, where).rgb * shade, 1.0);
}
`;
