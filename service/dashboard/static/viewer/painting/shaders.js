// The shaders: a picture with one pixel per lens from the atlas of views, and the enlargement of that picture.
// Textures contain sRGB and are read as linear light. Row 0 of a texture is the top of the picture. Views are read
// texel by texel, so that no view shows the border of its neighbour.
import { UNKNOWN_MM } from "../depth/guide.js";

export const EVERYWHERE = `#version 300 es
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
uniform ivec2 size; // the size of a view in px
out vec4 light;
`;

// The weighted mean of four views; or for each of two eyes, with its shares of the colours.
export const BLEND = `${HEAD}
uniform sampler2D atlas;
uniform int eyes;
uniform ivec2 cell[8];
uniform float share[8];
uniform mat3 colours[2];
void main() {
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4 * eyes; k++) {
    sum += share[k] * colours[k / 4] * texelFetch(atlas, cell[k] * size + ivec2(gl_FragCoord.xy), 0).rgb;
  }
  light = vec4(sum, 1.0);
}`;

// The same along the depth of the eye: each view is read where it shows the surface that the eye sees, interpolated
// linearly, and does not count where something else is in front of that surface. Layers 0 to 7 have the depths of the
// views, and the last two those of the eyes.
export const GUIDED = `${HEAD}
precision highp sampler2DArray;
uniform sampler2D atlas;
uniform sampler2DArray depths; // mm
uniform int eyes;
uniform ivec2 cell[8];
uniform vec2 away[8]; // from the eye to the view, in views
uniform float share[8];
uniform mat3 colours[2];
uniform vec2 lensesPerMm;
const float UNKNOWN = ${(UNKNOWN_MM / 2).toFixed(1)}; // and less
const float HIDDEN = 0.001; // The weight of a view that does not show the surface; it counts where none does.
const float SAME = 0.6; // Surfaces that move by no more px from view to view are one.
ivec2 inside(ivec2 place) {
  return clamp(place, ivec2(0), size - 1);
}
float depthAt(vec2 place, int layer) {
  return texelFetch(depths, ivec3(inside(ivec2(floor(place + 0.5))), layer), 0).r;
}
vec3 at(ivec2 from, ivec2 place) {
  return texelFetch(atlas, from + inside(place), 0).rgb;
}
vec3 linearly(ivec2 from, vec2 place) {
  ivec2 first = ivec2(floor(place));
  vec2 part = place - vec2(first);
  vec3 upper = mix(at(from, first), at(from, first + ivec2(1, 0)), part.x);
  vec3 lower = mix(at(from, first + ivec2(0, 1)), at(from, first + ivec2(1, 1)), part.x);
  return mix(upper, lower, part.y);
}
void main() {
  vec2 here = floor(gl_FragCoord.xy);
  vec3 mixed = vec3(0.0);
  for (int eye = 0; eye < eyes; eye++) {
    float depth = depthAt(here, 8 + eye);
    vec4 sum = vec4(0.0);
    for (int k = 4 * eye; k < 4 * eye + 4; k++) {
      vec2 there = depth < UNKNOWN ? here : here - depth * lensesPerMm * away[k];
      float found = depthAt(there, k);
      float apart = length((found - depth) * lensesPerMm);
      float weight = share[k] * (apart < SAME ? 1.0 : HIDDEN);
      if (weight > 0.0) sum += weight * vec4(linearly(cell[k] * size, there), 1.0);
    }
    mixed += colours[eye] * sum.rgb / sum.a;
  }
  light = vec4(mixed, 1.0);
}`;

// The mean of all views, each shifted against the eye and interpolated linearly. Pixels from beyond the array do not
// count, as in lippmann/lightfield/refocus. Shifts are rounded slightly, since integer ones need no interpolation.
export const REFOCUS = `${HEAD}
uniform sampler2D atlas;
uniform sampler2D present; // for every cell, whether it contains a view
uniform ivec2 grid; // the number of views
uniform vec2 movement; // the shift from one view to the next in px
vec3 at(ivec2 place) {
  return texelFetch(atlas, place, 0).rgb;
}
void main() {
  vec4 sum = vec4(0.0);
  for (int v = 0; v < grid.y; v++) {
    for (int u = 0; u < grid.x; u++) {
      ivec2 number = ivec2(u, v);
      if (texelFetch(present, number, 0).r < 0.5) continue;
      vec2 shift = floor(0.5 - 4096.0 * movement * (vec2(number) - vec2(grid - 1) / 2.0)) / 4096.0;
      vec2 part = fract(shift);
      ivec2 first = ivec2(gl_FragCoord.xy) + ivec2(floor(shift));
      ivec2 last = first + ivec2(greaterThan(part, vec2(0.0)));
      if (any(lessThan(first, ivec2(0))) || any(greaterThanEqual(last, size))) continue;
      ivec2 from = number * size;
      vec3 upper = mix(at(from + first), at(from + ivec2(last.x, first.y)), part.x);
      vec3 lower = mix(at(from + ivec2(first.x, last.y)), at(from + last), part.x);
      sum += vec4(mix(upper, lower, part.y), 1.0);
    }
  }
  light = vec4(sum.rgb / max(sum.a, 1e-6), 1.0);
}`;

// The enlargement: squares; or smooth, by the cubic filter with B = C = 1/3 (Mitchell, Netravali, SIGGRAPH 1988), or
// linearly while something moves and every millisecond counts.
export const ENLARGE = `${HEAD}
uniform sampler2D picture;
uniform vec4 rect; // left, top, width and height of the picture on the canvas, px
uniform float canvasRows;
uniform int filtering; // 0: squares, 1: linear, 2: cubic
vec3 at(ivec2 place) {
  return texelFetch(picture, clamp(place, ivec2(0), size - 1), 0).rgb;
}
vec3 linearly(vec2 place) {
  ivec2 first = ivec2(floor(place));
  vec2 part = place - vec2(first);
  vec3 upper = mix(at(first), at(first + ivec2(1, 0)), part.x);
  vec3 lower = mix(at(first + ivec2(0, 1)), at(first + ivec2(1, 1)), part.x);
  return mix(upper, lower, part.y);
}
float weight(float x) {
  x = abs(x);
  if (x < 1.0) return (7.0 * x * x * x - 12.0 * x * x + 16.0 / 3.0) / 6.0;
  return x < 2.0 ? (-7.0 / 3.0 * x * x * x + 12.0 * x * x - 20.0 * x + 32.0 / 3.0) / 6.0 : 0.0;
}
vec3 smoothly(vec2 place) {
  ivec2 first = ivec2(floor(place));
  vec3 sum = vec3(0.0);
  for (int row = -1; row < 3; row++) {
    for (int col = -1; col < 3; col++) {
      vec2 away = place - vec2(first + ivec2(col, row));
      sum += weight(away.x) * weight(away.y) * at(first + ivec2(col, row));
    }
  }
  return clamp(sum, 0.0, 1.0);
}
void main() {
  vec2 place = (vec2(gl_FragCoord.x, canvasRows - gl_FragCoord.y) - rect.xy) / rect.zw * vec2(size);
  vec3 linear = filtering == 0 ? at(ivec2(place)) : filtering == 1 ? linearly(place - 0.5) : smoothly(place - 0.5);
  vec3 code = mix(12.92 * linear, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, greaterThan(linear, vec3(0.0031308)));
  light = vec4(code, 1.0);
}`;
