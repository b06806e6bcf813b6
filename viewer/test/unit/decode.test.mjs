import assert from 'node:assert/strict';
import {test} from 'node:test';
import {deflateSync} from 'node:zlib';
import {DamagedReport, Reader, crc32, parseRun, unpack} from '../../src/decode.js';
import {goalAt, lastAt, poseAt} from '../../src/fleet.js';

const bytes = text => new TextEncoder().encode(text);

function varint(value) {
  const out = [];
  for (; value >= 128; value = Math.floor(value / 128)) out.push((value % 128) + 128);
  return [...out, value];
}
const signed = value => varint(value < 0 ? -2 * value - 1 : 2 * value);
const record = (kind, payload) => [kind.charCodeAt(0), ...varint(payload.length), ...payload];
const cells = list => [...varint(list.length), ...list.flatMap((cell, i) => varint(cell - (list[i - 1] ?? 0)))];

function sample() {
  const tracks = [...varint(2), ...[0, 1000, -2000, 1500, 3100].flatMap(signed), ...[100, 10, 0, -5, 50].flatMap(signed)];
  const about = bytes(JSON.stringify({name: 'a', tracks_bytes: tracks.length, left_out: []}));
  const header = bytes(JSON.stringify({resolution_m: 0.1, first_cell: [0, 0, 0], size: [4, 4, 4], uavs: 1}));
  const plan = [...varint(500), 0, ...varint(600), ...varint(2000), 2, ...[100, 200, 300, 10, -20, 30].flatMap(signed)];
  const length = new Uint8Array(new Uint32Array([about.length]).buffer);
  return Uint8Array.from([...length, ...about, ...tracks, ...record('H', [...header]), ...record('V', [...varint(200), 0, ...cells([3, 9]), ...cells([])]),
    ...record('F', [...varint(1000), 1, ...cells([1]), ...cells([])]), ...record('P', plan), ...record('D', [...cells([3]), ...cells([7])]),
    ...record('O', [2, 5, 63]), ...record('S', [...bytes('[[0,3]]')]), ...record('?', [1, 2, 3])]);
}

async function packed(plain) {
  const text = deflateSync(plain).toString('base64');
  return [text, {bytes: plain.length, crc: crc32(bytes(text))}];
}

test('CRC-32 has its published check value', () => assert.equal(crc32(bytes('123456789')), 0xcbf43926));

test('numbers are read as they were written', () => {
  for (const value of [0, 1, 127, 128, 16384, 2 ** 31, 2 ** 40 + 5]) {
    assert.equal(new Reader(Uint8Array.from(varint(value))).varint(), value);
    assert.equal(new Reader(Uint8Array.from(signed(-value))).signed(), value === 0 ? 0 : -value);
  }
});

test('a run comes back, and unknown records are passed over', async () => {
  const run = parseRun(await unpack(...(await packed(sample()))));
  assert.deepEqual(run.changes, [{time: 0.2, uav: 0, on: [3, 9], off: []}]);
  assert.deepEqual(run.frontiers, [{time: 1, whole: true, on: [1], off: []}]);
  assert.deepEqual([...run.plans[0][0].points].map(x => x.toFixed(2)), ['1.00', '2.00', '3.00', '1.10', '1.80', '3.30']);
  assert.deepEqual([run.wrong, run.missed], [[3], [7]]);
  assert.deepEqual([...run.openSides], [5, 63]);
  assert.deepEqual(run.storeys, [{floor: 0, ceiling: 3}]);
  assert.ok(Math.abs(run.duration - 0.1) < 1e-6);
});

test('damage is told', async () => {
  const plain = sample();
  const [text, expected] = await packed(plain);
  await assert.rejects(unpack(`${text.slice(0, 20)}A${text.slice(21)}`, expected), DamagedReport);
  await assert.rejects(unpack(text.slice(0, -8), expected), DamagedReport);
  await assert.rejects(unpack(text, {...expected, crc: expected.crc ^ 1}), DamagedReport);
  await assert.rejects(unpack(text, {...expected, bytes: expected.bytes + 1}), DamagedReport);
  for (let length = 0; length < 70; ++length) assert.throws(() => parseRun(plain.slice(0, length)));
});

test('poses lie between their samples, and yaw turns the short way', () => {
  const track = {t: [0, 1], x: [0, 2], y: [0, 0], z: [1, 1], yaw: [3.1, -3.1]};
  const {x, yaw} = poseAt(track, 0.5);
  assert.equal(x, 1);
  assert.ok(Math.abs(Math.cos(yaw) + 1) < 1e-6);
  assert.equal(poseAt(track, -1).x, 0);
  assert.equal(poseAt(track, 9).x, 2);
});

test('last index not above a value', () => {
  assert.deepEqual([-1, 0, 0.5, 2, 9].map(v => lastAt([0, 1, 2], v)), [-1, 0, 0, 2, 2]);
});

test('a goal holds while its UAV travels', () => {
  const goals = [[1, 0, [1, 2, 3]]];
  const states = [[1, 0, 'travel'], [4, 0, 'find_goal']];
  assert.equal(goalAt(goals, states, 0.5), null);
  assert.deepEqual(goalAt(goals, states, 2), [1, 2, 3]);
  assert.equal(goalAt(goals, states, 5), null);
});
