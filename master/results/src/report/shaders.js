// What the graphics card runs. A triangle's number is that of its vertices by three; its value and its
// organ stand in textures, so that another band is another texture and the vertices stay where they are.

// Viridis in nine steps: seen alike by all, and in print.
const COLOURS = ['#440154', '#472d7b', '#3b528b', '#2c728e', '#21918c', '#28ae80', '#5ec962', '#addc30', '#fde725'];

const VERTEX = `#version 300 es
precision highp float;
precision highp usampler2D;
uniform mat4 matrix;
uniform highp sampler2D values;
uniform usampler2D organs;
in vec3 position;
flat out float value;
flat out uint organ;
out vec3 place;
void main() {
  int triangle = gl_VertexID / 3;
  ivec2 cell = ivec2(triangle % 4096, triangle / 4096);
  value = texelFetch(values, cell, 0).r;
  organ = texelFetch(organs, cell, 0).r;
  place = position;
  gl_Position = matrix * vec4(position, 1.0);
}`;

// Values run from 0 to 1, soil from -1 to -2. Organs are numbered from 1, soil is 0.
const COLOUR = `#version 300 es
precision highp float;
uniform vec3 colours[9];
uniform uint picked;
uniform vec3 eye;
flat in float value;
flat in uint organ;
in vec3 place;
out vec4 colour;
void main() {
  vec3 normal = cross(dFdx(place), dFdy(place));
  float size = length(normal);
  float facing = size > 0.0 ? abs(dot(normal / size, eye)) : 1.0;
  if (value < -0.5) {
    colour = vec4(mix(vec3(0.30, 0.27, 0.24), vec3(0.93, 0.90, 0.86), clamp(-value - 1.0, 0.0, 1.0)), 1.0);
    return;
  }
  float t = clamp(value, 0.0, 1.0) * 8.0;
  int k = min(int(t), 7);
  vec3 own = mix(colours[k], colours[k + 1], t - float(k));
  // a little shade shows shapes without passing for less light
  own *= 0.86 + 0.14 * facing;
  if (picked > 0u && organ == picked) own = mix(own, vec3(1.0, 0.25, 0.2), 0.65);
  colour = vec4(own, 1.0);
}`;

const PICK = `#version 300 es
precision highp float;
flat in float value;
flat in uint organ;
in vec3 place;
out vec4 colour;
void main() {
  colour = vec4(float(organ & 255u), float((organ >> 8u) & 255u), float((organ >> 16u) & 255u), 255.0) / 255.0;
}`;

function rgb(hex) {
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);
}
