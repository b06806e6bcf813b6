/** The potential of one UAV as a coloured plane with contours, at the height of the cut. */
import * as THREE from 'three';
import {GAINS, layerDistances, potentialAt} from './potential.js';
import {goalAt} from './fleet.js';

const PERIOD_S = 0.25;
const BANDS_PER_UNIT = 1.25; // contours
const LEVELS = [[0x1d, 0x2b, 0x53], [0x1f, 0x6f, 0x8b], [0x58, 0xb0, 0x8f], [0xe9, 0xe2, 0xa0], [0xf0, 0x9a, 0x56], [0xc2, 0x3b, 0x4f]];

function levelColour(f) {
  const at = Math.min(1, Math.max(0, f)) * (LEVELS.length - 1);
  const k = Math.min(LEVELS.length - 2, Math.floor(at));
  return LEVELS[k].map((c, i) => c + (LEVELS[k + 1][i] - c) * (at - k));
}

export class PotentialView {
  constructor(field, run) {
    this.field = field;
    this.states = run.about.states;
    const [nx, ny] = field.size;
    this.pixels = new Uint8Array(4 * nx * ny);
    this.texture = new THREE.DataTexture(this.pixels, nx, ny);
    this.texture.colorSpace = THREE.SRGBColorSpace;
    this.texture.magFilter = THREE.LinearFilter;
    const [width, height] = [nx * field.voxel_m, ny * field.voxel_m];
    this.mesh = new THREE.Mesh(
      new THREE.PlaneGeometry(width, height).translate(width / 2, height / 2, 0),
      new THREE.MeshBasicMaterial({map: this.texture, transparent: true, side: THREE.DoubleSide, depthWrite: false}),
    );
    this.mesh.renderOrder = 1;
    this.key = '';
  }

  update(time, wanted, cutLayer, uav, uavs) {
    this.mesh.visible = wanted;
    if (!wanted) return;
    const key = [Math.round(time / PERIOD_S), cutLayer, uav].join();
    if (key === this.key) return;
    this.key = key;
    this.mesh.position.set(this.field.origin[0], this.field.origin[1], this.field.origin[2] + (cutLayer - 0.5) * this.field.voxel_m);
    this.paint(time, Math.max(0, cutLayer - 1), uavs[uav], uavs.filter((_, id) => id !== uav));
  }

  paint(time, layer, own, others) {
    const {field} = this;
    const [birth, death] = [field.birthCode(time), field.deathCode(time)];
    const reach = Math.ceil(GAINS.reach / field.voxel_m);
    const alive = (x, y, z) => field.alive(field.at(x, y, z), birth, death);
    const squared = layerDistances(field.size, layer, reach, alive);
    const goal = goalAt(own.goals, own.states, time);
    const fellows = others.map(({pose}) => [pose.x, pose.y, pose.z]);
    const values = new Float32Array(squared.length);
    const z = field.origin[2] + (layer + 0.5) * field.voxel_m;
    let least = Infinity;
    let most = -Infinity;
    for (let i = 0; i < values.length; ++i) {
      const at = [field.origin[0] + ((i % field.size[0]) + 0.5) * field.voxel_m, field.origin[1] + (Math.floor(i / field.size[0]) + 0.5) * field.voxel_m, z];
      values[i] = potentialAt(at, Math.sqrt(squared[i]) * field.voxel_m, goal, fellows);
      least = Math.min(least, values[i]);
      most = Math.max(most, values[i]);
    }
    this.colourPixels(values, squared, least, most);
  }

  colourPixels(values, squared, least, most) {
    const [nx] = this.field.size;
    const band = i => Math.floor(values[i] * BANDS_PER_UNIT);
    for (let i = 0; i < values.length; ++i) {
      const f = (values[i] - least) / Math.max(1e-6, most - least);
      const shade = band(i) !== band(Math.min(i + 1, values.length - 1)) || band(i) !== band(Math.min(i + nx, values.length - 1)) ? 0.72 : 1;
      levelColour(f).forEach((c, k) => (this.pixels[4 * i + k] = c * shade));
      this.pixels[4 * i + 3] = squared[i] === 0 ? 0 : 205;
    }
    this.texture.needsUpdate = true;
  }
}
