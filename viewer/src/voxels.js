/** The occupied voxels of a run over time, on the box that they fill. */

const MOST_CELLS = 24e6;
const TIME_STEPS = 65000;

/** Cells of the recorder: z fastest, then y. */
export function cellToVoxel(cell, size) {
  const z = cell % size[2];
  const rest = (cell - z) / size[2];
  const y = rest % size[1];
  return [(rest - y) / size[1], y, z];
}

/** When each voxel was first occupied, by whom, and since when it is not any more. */
export function voxelHistory(run) {
  const index = new Map();
  const voxels = [];
  for (const {time, uav, on, off} of run.changes) {
    for (const cell of on) {
      let voxel = index.get(cell);
      if (!voxel) {
        voxel = {cell, birth: time, death: Infinity, uav, sides: 63};
        index.set(cell, voxel);
        voxels.push(voxel);
      }
      voxel.death = Infinity;
    }
    for (const cell of off) {
      const voxel = index.get(cell);
      if (voxel) voxel.death = time;
    }
  }
  if (run.openSides) {
    const left = voxels.filter(voxel => voxel.death === Infinity).sort((a, b) => a.cell - b.cell);
    if (left.length === run.openSides.length) left.forEach((voxel, i) => (voxel.sides = run.openSides[i]));
  }
  for (const cell of run.wrong) {
    const voxel = index.get(cell);
    if (voxel) voxel.wrong = true;
  }
  return voxels;
}

/**
 * A dense lattice around the voxels, one RGBA8UI texel each: birth (16 bit, 0 = never occupied), UAV and "wrong", death
 * (0 = never). Runs that fill too large a box are shown in larger voxels.
 */
export class VoxelField {
  constructor(run, mostPerAxis = 2048) {
    const voxels = voxelHistory(run);
    const {size, first_cell: first, resolution_m: res} = run.header;
    this.duration = run.duration;
    this.count = voxels.length;
    const places = voxels.map(voxel => cellToVoxel(voxel.cell, size));
    const lo = [Infinity, Infinity, Infinity];
    const hi = [-1, -1, -1];
    for (const place of places) {
      for (let a = 0; a < 3; ++a) {
        lo[a] = Math.min(lo[a], place[a]);
        hi[a] = Math.max(hi[a], place[a]);
      }
    }
    if (!voxels.length) for (let a = 0; a < 3; ++a) (lo[a] = 0), (hi[a] = size[a] - 1);
    this.factor = 1;
    const dims = () => lo.map((l, a) => Math.floor(hi[a] / this.factor) - Math.floor(l / this.factor) + 3);
    while (dims().reduce((a, b) => a * b) > MOST_CELLS || Math.max(...dims()) > mostPerAxis) this.factor *= 2;
    this.size = dims();
    this.voxel_m = res * this.factor;
    this.offset = lo.map(l => Math.floor(l / this.factor) - 1);
    this.origin = this.offset.map((o, a) => (first[a] + o * this.factor) * res);
    this.texels = new Uint8Array(4 * this.size[0] * this.size[1] * this.size[2]);
    this.sides = new Uint8Array(this.texels.length / 4);
    this.births = Array.from({length: this.size[2]}, () => []);
    this.deaths = Array.from({length: this.size[2]}, () => []);
    voxels.forEach((voxel, i) => this.put(voxel, places[i]));
    for (const times of [...this.births, ...this.deaths]) times.sort((a, b) => a - b);
  }

  put(voxel, place) {
    const [x, y, z] = place.map((p, a) => Math.floor(p / this.factor) - this.offset[a]);
    const at = this.at(x, y, z);
    this.sides[at] |= voxel.sides;
    const birth = this.birthCode(voxel.birth);
    const before = this.texels[4 * at] | (this.texels[4 * at + 1] << 8);
    if (before && before <= birth) return;
    this.texels[4 * at] = birth & 255;
    this.texels[4 * at + 1] = birth >> 8;
    this.texels[4 * at + 2] = (voxel.uav & 63) | (voxel.wrong ? 64 : 0);
    this.texels[4 * at + 3] = voxel.death === Infinity ? 0 : 1 + Math.floor((voxel.death / this.duration) * 254);
    this.births[z].push(voxel.birth);
    if (voxel.death !== Infinity) this.deaths[z].push(voxel.death);
  }

  at(x, y, z) {
    return (z * this.size[1] + y) * this.size[0] + x;
  }
  birthCode(time) {
    return 1 + Math.min(TIME_STEPS, Math.floor((time / this.duration) * TIME_STEPS));
  }
  deathCode(time) {
    return Math.min(255, 1 + Math.floor((time / this.duration) * 254));
  }
  /** Occupied at this moment? */
  alive(at, birthCode, deathCode) {
    const birth = this.texels[4 * at] | (this.texels[4 * at + 1] << 8);
    const death = this.texels[4 * at + 3];
    return birth !== 0 && birth <= birthCode && (death === 0 || death > deathCode);
  }
  /** Layer whose lower face is nearest to this height. */
  layerAt(z_m) {
    return Math.max(0, Math.min(this.size[2], Math.round((z_m - this.origin[2]) / this.voxel_m)));
  }
  /** Voxels shown at this moment between two layers. */
  visible(time, low, cut) {
    const upTo = times => {
      let a = 0;
      let b = times.length;
      while (a < b) {
        const middle = (a + b) >> 1;
        if (times[middle] <= time) a = middle + 1;
        else b = middle;
      }
      return a;
    };
    let count = 0;
    for (let z = low; z < cut; ++z) count += upTo(this.births[z]) - upTo(this.deaths[z]);
    return count;
  }
}
