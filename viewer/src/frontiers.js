/** Frontier cells over time, as points. */
import * as THREE from 'three';
import {lastAt} from './fleet.js';
import {cellToVoxel} from './voxels.js';

export class FrontierView {
  constructor(run, colour, clipping) {
    const {size, first_cell: first, resolution_m: res, frontier_cell: factor, uavs} = run.header;
    this.frames = run.frontiers;
    this.size = size.map(n => Math.ceil(n / factor));
    this.toMetres = cell => cellToVoxel(cell, this.size).map((c, a) => (first[a] + (c + 0.5) * factor) * res);
    this.cells = new Set();
    this.shown = -1;
    this.points = new THREE.Points(
      new THREE.BufferGeometry(),
      new THREE.PointsMaterial({color: colour, size: factor * res * 0.55, transparent: true, opacity: 0.9, clippingPlanes: clipping}),
    );
    this.points.frustumCulled = false;
    this.uavs = uavs;
  }

  /** Going back starts again from the last whole frame. */
  update(time, wanted) {
    this.points.visible = wanted;
    const frame = lastAt(this.frames, time, f => f.time);
    if (frame === this.shown) return;
    if (frame < this.shown) {
      this.cells.clear();
      this.shown = -1;
      for (let k = frame; k >= 0; --k) if (this.frames[k].whole) { this.shown = k - 1; break; }
    }
    for (let k = this.shown + 1; k <= frame; ++k) {
      const {whole, on, off} = this.frames[k];
      if (whole) this.cells.clear();
      for (const cell of on) this.cells.add(cell);
      for (const cell of off) this.cells.delete(cell);
    }
    this.shown = frame;
    const positions = new Float32Array(3 * this.cells.size);
    let at = 0;
    for (const cell of this.cells) {
      positions.set(this.toMetres(cell), at);
      at += 3;
    }
    this.points.geometry.dispose();
    this.points.geometry = new THREE.BufferGeometry();
    this.points.geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  }
}
