// Quads against the plain definition, on random fields and moments.
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {meshField} from '../../src/mesher.js';
import {layerDistances, potentialAt} from '../../src/potential.js';
import {VoxelField, cellToVoxel, voxelHistory} from '../../src/voxels.js';

/** A small repeatable generator (mulberry32). */
function randomNumbers(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

function randomRun(seed, size, share) {
  const random = randomNumbers(seed);
  const cells = [];
  for (let cell = 0; cell < size[0] * size[1] * size[2]; ++cell) if (random() < share) cells.push(cell);
  const changes = [];
  for (const cell of cells) {
    const time = Math.floor(10 * random());
    changes.push({time, uav: Math.floor(3 * random()), on: [cell], off: []});
    if (random() < 0.2) changes.push({time: time + 3, uav: 0, on: [], off: [cell]});
  }
  changes.sort((a, b) => a.time - b.time);
  return {header: {size, first_cell: [-3, 4, 0], resolution_m: 0.1, uavs: 3}, duration: 12, changes, wrong: cells.slice(0, 3), openSides: null};
}

/** Unit faces (direction, layer, u, v) of all quads, with how often each is covered. */
function unitFaces(field) {
  const faces = new Map();
  for (const {open, closed} of meshField(field)) {
    for (const {positions, directions} of [open, closed]) {
      directions.forEach((direction, q) => {
        const corners = [0, 1, 2, 3].map(i => positions.slice(12 * q + 3 * i, 12 * q + 3 * i + 3));
        const lo = [0, 1, 2].map(a => Math.min(...corners.map(c => c[a])));
        const hi = [0, 1, 2].map(a => Math.max(...corners.map(c => c[a])));
        const axis = direction >> 1;
        assert.equal(lo[axis], hi[axis]);
        const [ua, va] = [(axis + 1) % 3, (axis + 2) % 3];
        for (let u = lo[ua]; u < hi[ua]; ++u) {
          for (let v = lo[va]; v < hi[va]; ++v) {
            const cell = [0, 0, 0];
            cell[axis] = lo[axis] - (direction % 2);
            cell[ua] = u;
            cell[va] = v;
            const key = [direction, ...cell].join();
            faces.set(key, (faces.get(key) ?? 0) + 1);
          }
        }
      });
    }
  }
  return faces;
}

test('every face that is ever to be seen is in one quad, and quads hold voxels alone', () => {
  for (const [seed, size, share] of [[1, [9, 7, 5], 0.3], [2, [70, 5, 6], 0.6], [3, [6, 6, 66], 0.9]]) {
    const field = new VoxelField(randomRun(seed, size, share));
    const faces = unitFaces(field);
    for (const count of faces.values()) assert.equal(count, 1);
    const steps = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];
    for (let time = 0; time <= 12; time += 0.5) {
      const [birth, death] = [field.birthCode(time), field.deathCode(time)];
      const [nx, ny, nz] = field.size;
      for (let z = 1; z < nz - 1; ++z) for (let y = 1; y < ny - 1; ++y) for (let x = 1; x < nx - 1; ++x) {
        if (!field.alive(field.at(x, y, z), birth, death)) continue;
        steps.forEach(([dx, dy, dz], direction) => {
          if (field.alive(field.at(x + dx, y + dy, z + dz), birth, death)) return;
          assert.ok(faces.has([direction, x, y, z].join()), `face ${direction} of ${x},${y},${z} at ${time} s`);
        });
      }
    }
  }
});

test('a solid block is six quads a chunk side', () => {
  const on = [];
  for (let cell = 0; cell < 4 * 5 * 6; ++cell) on.push(cell);
  const run = {header: {size: [4, 5, 6], first_cell: [0, 0, 0], resolution_m: 0.1, uavs: 1}, duration: 1, changes: [{time: 0, uav: 0, on, off: []}], wrong: [], openSides: null};
  const quads = meshField(new VoxelField(run)).reduce((n, {open, closed}) => n + open.directions.length + closed.directions.length, 0);
  assert.equal(quads, 6);
});

test('the field holds the voxels of the records, at every moment', () => {
  const size = [9, 7, 5];
  const run = randomRun(5, size, 0.4);
  const field = new VoxelField(run);
  for (let time = 0.25; time < 12; time += 0.5) {
    const wanted = new Set();
    for (const {time: at, on, off} of run.changes) {
      if (at > time) break;
      on.forEach(cell => wanted.add(cell));
      off.forEach(cell => wanted.delete(cell));
    }
    let seen = 0;
    for (const cell of wanted) {
      const [x, y, z] = cellToVoxel(cell, size).map((c, a) => c - field.offset[a]);
      assert.ok(field.alive(field.at(x, y, z), field.birthCode(time), field.deathCode(time)), `cell ${cell} at ${time}`);
      ++seen;
    }
    assert.equal(field.visible(time, 0, field.size[2]), seen);
    let alive = 0;
    for (let at = 0; at < field.sides.length; ++at) alive += field.alive(at, field.birthCode(time), field.deathCode(time)) ? 1 : 0;
    assert.equal(alive, seen, 'what was freed is gone');
  }
  assert.equal(voxelHistory(run).filter(voxel => voxel.wrong).length, 3);
});

test('a voxel that is occupied again stays, with who saw it first', () => {
  const change = (time, uav, on, off) => ({time, uav, on, off});
  const changes = [change(1, 2, [5], []), change(2, 1, [], [5]), change(3, 0, [5], []), change(4, 0, [7], []), change(5, 0, [], [7])];
  const [first, second] = voxelHistory({changes, wrong: [], openSides: Uint8Array.of(9)});
  assert.deepEqual([first.birth, first.death, first.uav, first.sides], [1, Infinity, 2, 9]);
  assert.equal(second.death, 5);
});

test('runs that are too large for a texture are shown in larger voxels', () => {
  const on = [0, 1000 * 2 * 2 - 1];
  const run = {header: {size: [1000, 2, 2], first_cell: [0, 0, 0], resolution_m: 0.1, uavs: 1}, duration: 1, changes: [{time: 0, uav: 0, on, off: []}], wrong: [], openSides: null};
  const field = new VoxelField(run, 256);
  assert.equal(field.factor, 4);
  assert.ok(Math.max(...field.size) <= 256);
  assert.equal(field.visible(1, 0, field.size[2]), 2);
});

test('distances of a layer are the nearest voxels, by trying all', () => {
  const random = randomNumbers(9);
  const size = [17, 13, 9];
  const voxels = [];
  for (let i = 0; i < 25; ++i) voxels.push(size.map(n => Math.floor(n * random())));
  const solid = new Set(voxels.map(v => v.join()));
  const d = layerDistances(size, 4, 20, (x, y, z) => solid.has([x, y, z].join()));
  for (let y = 0; y < size[1]; ++y) for (let x = 0; x < size[0]; ++x) {
    const wanted = Math.min(...voxels.map(([a, b, c]) => (a - x) ** 2 + (b - y) ** 2 + (c - 4) ** 2));
    assert.equal(d[y * size[0] + x], wanted);
  }
});

test('the potential is that of docs/potential.md', () => {
  const bump = d => (1 / (0.3 * Math.sqrt(2 * Math.PI))) * Math.exp(-((d / 0.3) ** 2) / 2);
  assert.equal(potentialAt([0, 0, 0], 9, [3, 4, 0], []), 5);
  assert.ok(Math.abs(potentialAt([0, 0, 0], 0.2, [3, 4, 0], []) - 5 - bump(0.2)) < 1e-12);
  assert.equal(potentialAt([0, 0, 0], 1, null, [[2, 0, 0]]), 0);
});
