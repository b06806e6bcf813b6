/**
 * Greedy quads over every face that is ever to be seen. Time needs no new mesh: a quad spans voxels of any age, and the
 * fragment shader leaves out what is not there at the moment. Colours come from the voxels' texture, so that they do not
 * keep quads apart either.
 */

const CHUNK = 64;
const OPEN = 1; // towards space that the finished map knows to be free
const CLOSED = 2;

/** 0: nobody ever sees this face. */
function faceClass(field, at, neighbour, direction) {
  const {texels, sides} = field;
  const birth = texels[4 * at] | (texels[4 * at + 1] << 8);
  if (birth === 0) return 0;
  const other = texels[4 * neighbour] | (texels[4 * neighbour + 1] << 8);
  const open = (sides[at] >> direction) & 1 ? OPEN : CLOSED;
  if (other === 0) return open;
  return other > birth || texels[4 * neighbour + 3] !== 0 ? CLOSED : 0;
}

/** Marks a rectangle of equal class starting at (u, v) as done. @returns its width and height */
function takeRectangle(mask, width, height, u, v) {
  const kind = mask[v * width + u];
  let w = 1;
  while (u + w < width && mask[v * width + u + w] === kind) ++w;
  let h = 1;
  grow: for (; v + h < height; ++h) {
    for (let i = 0; i < w; ++i) if (mask[(v + h) * width + u + i] !== kind) break grow;
  }
  for (let j = 0; j < h; ++j) mask.fill(0, (v + j) * width + u, (v + j) * width + u + w);
  return [w, h];
}

function pushQuad(quads, axis, positive, layer, u, v, w, h) {
  const [ua, va] = [(axis + 1) % 3, (axis + 2) % 3];
  const corner = (du, dv) => {
    const p = [0, 0, 0];
    p[axis] = layer + (positive ? 1 : 0);
    p[ua] = u + du;
    p[va] = v + dv;
    return p;
  };
  const around = positive ? [[0, 0], [w, 0], [w, h], [0, h]] : [[0, 0], [0, h], [w, h], [w, 0]];
  for (const [du, dv] of around) quads.positions.push(...corner(du, dv));
  quads.directions.push(2 * axis + (positive ? 1 : 0));
}

/** Faces of one direction in one layer of one chunk. */
function meshLayer(field, lo, hi, axis, positive, layer, groups, mask) {
  const [ua, va] = [(axis + 1) % 3, (axis + 2) % 3];
  const width = hi[ua] - lo[ua];
  const height = hi[va] - lo[va];
  const strides = [1, field.size[0], field.size[0] * field.size[1]];
  const step = positive ? strides[axis] : -strides[axis];
  const direction = 2 * axis + (positive ? 1 : 0);
  let any = false;
  for (let v = 0; v < height; ++v) {
    let at = layer * strides[axis] + lo[ua] * strides[ua] + (lo[va] + v) * strides[va];
    for (let u = 0; u < width; ++u, at += strides[ua]) {
      const kind = faceClass(field, at, at + step, direction);
      mask[v * width + u] = kind;
      any ||= kind !== 0;
    }
  }
  if (!any) return;
  for (let v = 0; v < height; ++v) {
    for (let u = 0; u < width; ++u) {
      const kind = mask[v * width + u];
      if (!kind) continue;
      const [w, h] = takeRectangle(mask, width, height, u, v);
      pushQuad(groups[kind - 1], axis, positive, layer, lo[ua] + u, lo[va] + v, w, h);
      u += w - 1;
    }
  }
}

/**
 * @param {import('./voxels.js').VoxelField} field its outermost cells are empty
 * @returns {{open: object, closed: object}[]} per chunk; each has positions (lattice units, four corners a quad) and directions
 */
export function meshField(field) {
  const chunks = [];
  const mask = new Uint8Array(CHUNK * CHUNK);
  const [nx, ny, nz] = field.size;
  for (let z = 1; z < nz - 1; z += CHUNK) {
    for (let y = 1; y < ny - 1; y += CHUNK) {
      for (let x = 1; x < nx - 1; x += CHUNK) {
        const lo = [x, y, z];
        const hi = [Math.min(x + CHUNK, nx - 1), Math.min(y + CHUNK, ny - 1), Math.min(z + CHUNK, nz - 1)];
        const groups = [0, 1].map(() => ({positions: [], directions: []}));
        for (let axis = 0; axis < 3; ++axis) {
          for (let layer = lo[axis]; layer < hi[axis]; ++layer) {
            meshLayer(field, lo, hi, axis, false, layer, groups, mask);
            meshLayer(field, lo, hi, axis, true, layer, groups, mask);
          }
        }
        chunks.push({open: groups[0], closed: groups[1]});
      }
    }
  }
  return chunks;
}
