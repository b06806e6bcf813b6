/** From the page's text back to a run: base64, checksum, inflate, records (docs/file_formats.md, replay.bin). */

export class DamagedReport extends Error {}

const crcTable = Uint32Array.from({length: 256}, (_, n) => {
  for (let k = 0; k < 8; ++k) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n >>> 0;
});

/** @param {Uint8Array} bytes @returns {number} CRC-32 as zlib computes it */
export function crc32(bytes) {
  let crc = 0xffffffff;
  for (let i = 0; i < bytes.length; ++i) crc = crcTable[(crc ^ bytes[i]) & 255] ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}

/** Reads LEB128 and fixed numbers. */
export class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }
  get done() {
    return this.at >= this.bytes.length;
  }
  take(count) {
    if (this.at + count > this.bytes.length) throw new DamagedReport('its data end too early');
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }
  u32() {
    const b = this.take(4);
    return (b[0] | (b[1] << 8) | (b[2] << 16) | (b[3] << 24)) >>> 0;
  }
  varint() {
    let value = 0;
    for (let scale = 1; ; scale *= 128) {
      if (this.at >= this.bytes.length) throw new DamagedReport('its data end too early');
      const part = this.bytes[this.at++];
      value += (part & 127) * scale;
      if (part < 128) return value;
    }
  }
  signed() {
    const bits = this.varint();
    return bits % 2 ? -(bits + 1) / 2 : bits / 2;
  }
  /** Sorted cells, kept as steps. */
  cells() {
    const cells = new Array(this.varint());
    let last = 0;
    for (let i = 0; i < cells.length; ++i) cells[i] = last += this.varint();
    return cells;
  }
}

/** @param {string} text base64 @param {{bytes: number, crc: number}} expected @returns {Promise<Uint8Array>} */
export async function unpack(text, expected) {
  if (crc32(new TextEncoder().encode(text)) !== expected.crc) {
    throw new DamagedReport('the checksum of its data differs');
  }
  const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  const plain = new Uint8Array(await new Response(stream).arrayBuffer());
  if (plain.length !== expected.bytes) throw new DamagedReport('its data are not as long as they should be');
  return plain;
}

function readTracks(bytes, uavs) {
  const reader = new Reader(bytes);
  const tracks = [];
  for (let id = 0; id < uavs; ++id) {
    const count = reader.varint();
    const columns = Array.from({length: 5}, () => new Float32Array(count));
    const last = [0, 0, 0, 0, 0];
    for (let k = 0; k < count; ++k) {
      for (let c = 0; c < 5; ++c) columns[c][k] = (last[c] += reader.signed()) / 1e3;
    }
    const [t, x, y, z, yaw] = columns;
    tracks.push({t, x, y, z, yaw});
  }
  return tracks;
}

function readPlan(reader) {
  const plan = {time: reader.varint() / 1e3, uav: reader.varint(), start: reader.varint() / 1e3, duration: reader.varint() / 1e3};
  const count = reader.varint();
  plan.points = new Float32Array(3 * count);
  const last = [0, 0, 0];
  for (let i = 0; i < 3 * count; ++i) plan.points[i] = (last[i % 3] += reader.signed()) / 100;
  return plan;
}

const asJson = bytes => JSON.parse(new TextDecoder().decode(bytes));

/**
 * @param {Uint8Array} plain what `unpack` gives
 * @returns {object} about, header, tracks, changes (of voxels), known, frontiers, plans (per UAV), wrong, missed, openSides, storeys
 */
export function parseRun(plain) {
  const whole = new Reader(plain);
  const about = asJson(whole.take(whole.u32()));
  const trackBytes = whole.take(about.tracks_bytes);
  const run = {about, header: null, tracks: [], changes: [], known: [], frontiers: [], plans: [], wrong: [], missed: [], openSides: null, storeys: []};
  while (!whole.done) {
    const kind = String.fromCharCode(whole.take(1)[0]);
    const payload = whole.take(whole.varint());
    const reader = new Reader(payload);
    if (kind === 'H') {
      run.header = asJson(payload);
      run.plans = Array.from({length: run.header.uavs}, () => []);
    } else if (kind === 'V') {
      run.changes.push({time: reader.varint() / 1e3, uav: reader.varint(), on: reader.cells(), off: reader.cells()});
    } else if (kind === 'K') {
      run.known.push({time: reader.varint() / 1e3, counts: run.plans.map(() => reader.varint())});
    } else if (kind === 'F') {
      run.frontiers.push({time: reader.varint() / 1e3, whole: reader.varint() === 1, on: reader.cells(), off: reader.cells()});
    } else if (kind === 'P') {
      const plan = readPlan(reader);
      run.plans[plan.uav].push(plan);
    } else if (kind === 'D') {
      run.wrong = reader.cells();
      run.missed = reader.cells();
    } else if (kind === 'O') {
      run.openSides = reader.take(reader.varint());
    } else if (kind === 'S') {
      run.storeys = asJson(payload).map(([floor, ceiling]) => ({floor, ceiling}));
    }
  }
  if (!run.header) throw new DamagedReport('its data have no header');
  run.tracks = readTracks(trackBytes, run.header.uavs);
  run.duration = Math.max(0.1, ...run.tracks.map(track => track.t[track.t.length - 1] || 0));
  return run;
}
