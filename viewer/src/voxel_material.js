/** Draws the quads of mesher.js and the cut through the voxels: what is there at a moment, lit and coloured. */
import * as THREE from 'three';

export const COLOURS = ['height', 'uav', 'age', 'difference'];

const LOOKUP = /* glsl */ `
  precision highp usampler3D;
  uniform usampler3D voxels;
  uniform ivec3 size;
  uniform uint birthNow;
  uniform uint deathNow;
  uniform int lowLayer;
  uniform int cutLayer;

  uvec4 texel(ivec3 c) {
    bool outside = any(lessThan(c, ivec3(0))) || any(greaterThanEqual(c, size));
    return outside ? uvec4(0u) : texelFetch(voxels, c, 0);
  }
  uint birthOf(uvec4 t) { return t.r | (t.g << 8); }
  bool alive(uvec4 t) {
    uint birth = birthOf(t);
    return birth != 0u && birth <= birthNow && (t.a == 0u || t.a > deathNow);
  }
  bool solid(ivec3 c) { return c.z >= lowLayer && c.z < cutLayer && alive(texel(c)); }
`;

const COLOUR = /* glsl */ `
  uniform int mode;
  uniform sampler2D ramp;
  uniform vec3 uavColours[8];
  uniform vec3 plain;
  uniform vec3 wrongColour;
  uniform vec2 heights;
  uniform float ageSpan;
  uniform float fresh;

  vec3 colourOf(uvec4 t, float z) {
    float age = float(birthNow) - float(birthOf(t));
    vec3 colour;
    if (mode == 1) colour = uavColours[int(t.b & 63u) % 8];
    else if (mode == 2) colour = texture(ramp, vec2(1.0 - clamp(age / ageSpan, 0.0, 1.0), 0.75)).rgb;
    else if (mode == 3) colour = (t.b & 64u) != 0u ? wrongColour : plain;
    else colour = texture(ramp, vec2(clamp((z - heights.x) / (heights.y - heights.x), 0.0, 1.0), 0.25)).rgb;
    return mix(colour, vec3(1.0), 0.55 * clamp(1.0 - age / max(fresh, 1.0), 0.0, 1.0) * step(1.0, fresh));
  }
`;

// Corners are drawn a little outside (no gaps between quads of different length) and looked up a little inside (so that
// rounding names no voxel beyond the quad).
const FACE_VERTEX = /* glsl */ `
  in float direction;
  centroid out vec3 place;
  flat out int side;
  void main() {
    side = int(direction + 0.5);
    int axis = side / 2;
    int corner = gl_VertexID % 4;
    int ahead = side % 2 == 1 ? 1 : 3;
    vec3 inwards = vec3(0.0);
    inwards[(axis + 1) % 3] = corner == 0 || corner == 4 - ahead ? 1.0 : -1.0;
    inwards[(axis + 2) % 3] = corner == 0 || corner == ahead ? 1.0 : -1.0;
    place = position + 0.002 * inwards;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position - 0.006 * inwards, 1.0);
  }
`;

const FACE_FRAGMENT = /* glsl */ `
  ${LOOKUP}
  ${COLOUR}
  centroid in vec3 place;
  flat in int side;
  out vec4 colour;

  float corner(bool a, bool b, bool c) { return a && b ? 0.45 : 1.0 - 0.2 * float(int(a) + int(b) + int(c)); }

  // Light at the corners of the voxel's face by its open neighbours, bilinear in between.
  float occlusion(ivec3 above, ivec3 u, ivec3 v, vec2 f) {
    bool l = solid(above - u), r = solid(above + u), d = solid(above - v), t = solid(above + v);
    float ld = corner(l, d, solid(above - u - v)), rd = corner(r, d, solid(above + u - v));
    float lt = corner(l, t, solid(above - u + v)), rt = corner(r, t, solid(above + u + v));
    return mix(mix(ld, rd, f.x), mix(lt, rt, f.x), f.y);
  }

  void main() {
    int axis = side / 2;
    ivec3 n = ivec3(0), u = ivec3(0), v = ivec3(0);
    n[axis] = side % 2 == 1 ? 1 : -1;
    u[(axis + 1) % 3] = 1;
    v[(axis + 2) % 3] = 1;
    ivec3 cell = ivec3(floor(place - 0.5 * vec3(n)));
    uvec4 own = texel(cell);
    if (!solid(cell) || solid(cell + n)) discard;
    vec2 f = vec2(fract(place[(axis + 1) % 3]), fract(place[(axis + 2) % 3]));
    float light = side == 5 ? 1.0 : side == 4 ? 0.55 : axis == 0 ? (side == 1 ? 0.86 : 0.74) : (side == 3 ? 0.80 : 0.68);
    light *= occlusion(cell + n, u, v, f);
    float width = max(fwidth(place[(axis + 1) % 3]), fwidth(place[(axis + 2) % 3]));
    vec2 rim = smoothstep(0.0, 1.2, min(f, 1.0 - f) / max(width, 1e-4));
    light *= mix(1.0, mix(0.86, 1.0, min(rim.x, rim.y)), clamp(1.0 - 6.0 * width, 0.0, 1.0));
    colour = vec4(colourOf(own, float(cell.z)) * light, 1.0);
  }
`;

const CAP_VERTEX = /* glsl */ `
  out vec3 place;
  void main() {
    place = position;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }
`;

// What the cut goes through: the voxels right below it that go on above it.
const CAP_FRAGMENT = /* glsl */ `
  ${LOOKUP}
  ${COLOUR}
  in vec3 place;
  out vec4 colour;
  void main() {
    ivec3 cell = ivec3(floor(place.xy), cutLayer - 1);
    uvec4 own = texel(cell);
    if (cutLayer - 1 < lowLayer || !alive(own) || !alive(texel(cell + ivec3(0, 0, 1)))) discard;
    colour = vec4(colourOf(own, float(cell.z)) * 0.42, 1.0);
  }
`;

/** Stops of perceptually even ramps: heights (viridis) and ages (a warm one). */
const RAMPS = [
  [[0x3b, 0x2a, 0x6e], [0x3a, 0x52, 0x8b], [0x2f, 0x7f, 0x8e], [0x3d, 0xa8, 0x7f], [0x92, 0xc8, 0x52], [0xf2, 0xdf, 0x4a]],
  [[0x3d, 0x3f, 0x5c], [0x5f, 0x4b, 0x7d], [0x9a, 0x55, 0x83], [0xd4, 0x68, 0x6d], [0xf3, 0x9a, 0x55], [0xfd, 0xe0, 0x8a]],
];

function rampTexture() {
  const width = 128;
  const pixels = new Uint8Array(4 * width * 2);
  RAMPS.forEach((stops, row) => {
    for (let i = 0; i < width; ++i) {
      const at = (i / (width - 1)) * (stops.length - 1);
      const k = Math.min(stops.length - 2, Math.floor(at));
      for (let c = 0; c < 3; ++c) pixels[4 * (row * width + i) + c] = stops[k][c] + (stops[k + 1][c] - stops[k][c]) * (at - k);
      pixels[4 * (row * width + i) + 3] = 255;
    }
  });
  const texture = new THREE.DataTexture(pixels, width, 2);
  texture.magFilter = texture.minFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

/** A CSS gradient of a ramp, for legends. */
export function rampCss(mode) {
  const stops = RAMPS[mode === 'age' ? 1 : 0].map(([r, g, b]) => `rgb(${r},${g},${b})`);
  return `linear-gradient(90deg,${stops.join(',')})`;
}

/** @returns the materials of faces and cut, which share their uniforms */
export function voxelMaterials(field) {
  const texture = new THREE.Data3DTexture(field.texels, ...field.size);
  texture.format = THREE.RGBAIntegerFormat;
  texture.type = THREE.UnsignedByteType;
  texture.internalFormat = 'RGBA8UI';
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  const uniforms = {
    voxels: {value: texture},
    size: {value: new THREE.Vector3(...field.size)},
    birthNow: {value: 0},
    deathNow: {value: 0},
    lowLayer: {value: 0},
    cutLayer: {value: field.size[2]},
    mode: {value: 0},
    ramp: {value: rampTexture()},
    uavColours: {value: Array.from({length: 8}, () => new THREE.Vector3())},
    plain: {value: new THREE.Vector3(0.72, 0.74, 0.77)},
    wrongColour: {value: new THREE.Vector3(0.9, 0.33, 0.1)},
    heights: {value: new THREE.Vector2(0, Math.max(1, field.size[2] - 2))},
    ageSpan: {value: 65000},
    fresh: {value: 0},
  };
  const common = {uniforms, glslVersion: THREE.GLSL3};
  return {
    uniforms,
    faces: new THREE.ShaderMaterial({...common, vertexShader: FACE_VERTEX, fragmentShader: FACE_FRAGMENT}),
    cap: new THREE.ShaderMaterial({...common, vertexShader: CAP_VERTEX, fragmentShader: CAP_FRAGMENT}),
  };
}

/** A mesh of one group of quads. */
export function quadMesh({positions, directions}, material) {
  const geometry = new THREE.BufferGeometry();
  const quads = directions.length;
  const sides = new Uint8Array(4 * quads);
  const index = new Uint32Array(6 * quads);
  for (let q = 0; q < quads; ++q) {
    sides.fill(directions[q], 4 * q, 4 * q + 4);
    index.set([0, 1, 2, 0, 2, 3].map(i => 4 * q + i), 6 * q);
  }
  geometry.setAttribute('position', new THREE.BufferAttribute(new Uint16Array(positions), 3));
  geometry.setAttribute('direction', new THREE.BufferAttribute(sides, 1));
  geometry.setIndex(new THREE.BufferAttribute(index, 1));
  return new THREE.Mesh(geometry, material);
}
