/** One run on one canvas. */
import * as THREE from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';
import {FleetView} from './fleet.js';
import {FrontierView} from './frontiers.js';
import {meshField} from './mesher.js';
import {PotentialView} from './potential_view.js';
import {COLOURS, quadMesh, voxelMaterials} from './voxel_material.js';
import {VoxelField, cellToVoxel} from './voxels.js';

const FRESH_S = 1.5;
const FOV_DEG = 38;
const RIDING_FOV_DEG = 66;
const AGE_SPAN = 0.5; // of the run

/** Voxels that are free in the map and solid in the world. */
function missedMesh(run, colour, clipping) {
  const {size, first_cell: first, resolution_m: res} = run.header;
  const mesh = new THREE.InstancedMesh(
    new THREE.BoxGeometry(res, res, res),
    new THREE.MeshLambertMaterial({color: colour, clippingPlanes: clipping}),
    Math.max(1, run.missed.length),
  );
  mesh.count = run.missed.length;
  const place = new THREE.Matrix4();
  run.missed.forEach((cell, i) => {
    const [x, y, z] = cellToVoxel(cell, size).map((c, a) => (first[a] + c + 0.5) * res);
    mesh.setMatrixAt(i, place.makeTranslation(x, y, z));
  });
  mesh.frustumCulled = false;
  return mesh;
}

export class Stage {
  /** @param {HTMLCanvasElement} canvas @param {object} run as `parseRun` gives @param {string[]} colours of the UAVs */
  constructor(canvas, run, colours) {
    this.canvas = canvas;
    this.run = run;
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, powerPreference: 'high-performance'});
    this.renderer.localClippingEnabled = true;
    this.field = new VoxelField(run, this.renderer.capabilities.max3DTextureSize || this.limit3d());
    this.scene = new THREE.Scene();
    this.clipping = [new THREE.Plane(new THREE.Vector3(0, 0, -1), 1e6), new THREE.Plane(new THREE.Vector3(0, 0, 1), 1e6)];
    this.addVoxels();
    this.fleet = new FleetView(run, colours, this.clipping);
    this.frontiers = new FrontierView(run, 0xe0a100, this.clipping);
    this.missed = missedMesh(run, 0x2f7de1, this.clipping);
    this.potential = new PotentialView(this.field, run);
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(0.4, 0.3, 1);
    this.scene.add(this.fleet.group, this.frontiers.points, this.missed, this.potential.mesh, new THREE.HemisphereLight(0xffffff, 0x8890a0, 1.9), sun);
    this.materials.uniforms.uavColours.value.forEach((v, i) => {
      const c = new THREE.Color(colours[i % colours.length]).convertLinearToSRGB();
      v.set(c.r, c.g, c.b);
    });
    this.quality = 1; // of the picture's width and height, lower where a computer is slow
    this.follow = null;
    this.riding = false;
    this.ortho = false;
    this.time = 0;
    this.low = 0;
    this.cut = this.field.size[2];
    this.makeCameras();
  }

  limit3d() {
    const gl = this.renderer.getContext();
    return gl.getParameter(gl.MAX_3D_TEXTURE_SIZE);
  }

  addVoxels() {
    this.materials = voxelMaterials(this.field);
    const lattice = new THREE.Group();
    lattice.position.set(...this.field.origin);
    lattice.scale.setScalar(this.field.voxel_m);
    this.closed = new THREE.Group();
    for (const {open, closed} of meshField(this.field)) {
      if (open.directions.length) lattice.add(quadMesh(open, this.materials.faces));
      if (closed.directions.length) this.closed.add(quadMesh(closed, this.materials.faces));
    }
    const [nx, ny] = this.field.size;
    this.cap = new THREE.Mesh(new THREE.PlaneGeometry(nx, ny).translate(nx / 2, ny / 2, 0), this.materials.cap);
    lattice.add(this.closed, this.cap);
    this.scene.add(lattice);
  }

  get box() {
    const min = new THREE.Vector3(...this.field.origin).addScalar(this.field.voxel_m);
    const max = new THREE.Vector3(...this.field.origin.map((o, a) => o + (this.field.size[a] - 1) * this.field.voxel_m));
    return new THREE.Box3(min, max);
  }

  makeCameras() {
    this.perspective = new THREE.PerspectiveCamera(FOV_DEG, 1, 0.05, 2000);
    this.perspective.up.set(0, 0, 1);
    this.flat = new THREE.OrthographicCamera(-1, 1, 1, -1, -2000, 2000);
    this.flat.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.perspective, this.canvas);
    this.pan = new OrbitControls(this.flat, this.canvas);
    for (const controls of [this.orbit, this.pan]) {
      controls.enableDamping = true;
      controls.dampingFactor = 0.12;
      controls.zoomToCursor = true;
      controls.addEventListener('change', () => (this.dirty = true));
      controls.addEventListener('start', () => this.onTouched?.());
    }
    this.orbit.maxPolarAngle = Math.PI * 0.98;
    this.pan.enableRotate = false;
    this.pan.mouseButtons.LEFT = THREE.MOUSE.PAN;
    this.pan.touches.ONE = THREE.TOUCH.PAN;
    this.home();
    this.chooseControls();
  }

  get camera() {
    return this.ortho && !this.riding ? this.flat : this.perspective;
  }

  chooseControls() {
    this.perspective.fov = this.riding ? RIDING_FOV_DEG : FOV_DEG;
    this.perspective.updateProjectionMatrix();
    this.orbit.enabled = !this.riding && !this.ortho;
    this.pan.enabled = !this.riding && this.ortho;
    this.dirty = true;
  }

  /** How far from its centre, in a direction, all of a box is in the picture. */
  fittingDistance(box, away) {
    const centre = box.getCenter(new THREE.Vector3());
    const right = new THREE.Vector3(0, 0, 1).cross(away).normalize();
    const up = away.clone().cross(right);
    const tanUp = Math.tan((FOV_DEG * Math.PI) / 360);
    const tanRight = tanUp * (this.perspective.aspect || 1);
    let distance = 0;
    for (let i = 0; i < 8; ++i) {
      const corner = new THREE.Vector3(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z).sub(centre);
      distance = Math.max(distance, corner.dot(away) + Math.abs(corner.dot(right)) / tanRight, corner.dot(away) + Math.abs(corner.dot(up)) / tanUp);
    }
    return 1.05 * distance;
  }

  /** The whole building, from the south-east or from above. */
  home(fromAbove = false) {
    const box = this.box;
    const centre = box.getCenter(new THREE.Vector3());
    const radius = box.getSize(new THREE.Vector3()).length() / 2;
    const away = (fromAbove ? new THREE.Vector3(0, -0.001, 1) : new THREE.Vector3(0.62, -0.78, 0.72)).normalize();
    this.orbit.target.copy(centre);
    this.perspective.position.copy(centre).addScaledVector(away, this.fittingDistance(box, away));
    this.perspective.far = Math.max(200, 20 * radius);
    this.perspective.updateProjectionMatrix();
    this.pan.target.copy(centre);
    this.flat.position.set(centre.x, centre.y, centre.z + 1);
    this.flat.zoom = 1;
    this.followed = null;
    this.orbit.update();
    this.pan.update();
    this.dirty = true;
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (!width || !height) return;
    const ratio = Math.min(2, window.devicePixelRatio || 1) * this.quality;
    const first = this.width === undefined;
    if (width === this.width && height === this.height && ratio === this.ratio) return;
    Object.assign(this, {width, height, ratio});
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.perspective.aspect = width / height;
    this.perspective.updateProjectionMatrix();
    const size = this.box.getSize(new THREE.Vector3());
    const half = 0.54 * Math.max(size.y, (size.x * height) / width);
    Object.assign(this.flat, {left: (-half * width) / height, right: (half * width) / height, top: half, bottom: -half});
    this.flat.updateProjectionMatrix();
    this.fleet.resize(width, height);
    if (first) this.home();
    this.dirty = true;
  }

  /** Shows what lies between two heights. */
  setCut(low_m, cut_m) {
    this.low = this.field.layerAt(low_m);
    this.cut = Math.max(this.low + 1, this.field.layerAt(cut_m));
    const height = layer => this.field.origin[2] + layer * this.field.voxel_m;
    this.clipping[0].constant = height(this.cut) + (this.cut >= this.field.size[2] - 1 ? 1e3 : 0);
    this.clipping[1].constant = -height(this.low) + (this.low <= 1 ? 1e3 : 0);
    this.dirty = true;
  }

  /** Whether this height lies between the cuts. */
  shows(z) {
    return z <= this.clipping[0].constant && z >= -this.clipping[1].constant;
  }

  followUav(uav, riding = false) {
    this.follow = uav;
    this.riding = uav !== null && riding;
    this.followed = null;
    this.chooseControls();
    this.moveCamera();
  }

  setOrtho(on) {
    this.ortho = on;
    if (on) this.riding = false;
    this.chooseControls();
  }

  /** Turns about this height from now on, and looks at it. */
  lookAtHeight(z) {
    if (this.follow !== null) return;
    this.perspective.position.z += z - this.orbit.target.z;
    this.orbit.target.z = z;
    this.dirty = true;
  }

  /** What the camera does about the UAV it follows. */
  moveCamera() {
    if (this.follow === null) return;
    const {x, y, z, yaw} = this.fleet.uavs[this.follow].pose;
    const at = new THREE.Vector3(x, y, z);
    if (this.riding) {
      const ahead = new THREE.Vector3(Math.cos(yaw), Math.sin(yaw), 0);
      this.perspective.position.copy(at).addScaledVector(ahead, 0.05);
      this.perspective.lookAt(at.clone().add(ahead));
      return;
    }
    if (!this.followed) {
      const back = this.perspective.position.clone().sub(this.orbit.target);
      back.setLength(Math.min(back.length(), 9));
      this.orbit.target.copy(at);
      this.perspective.position.copy(at).add(back);
      this.pan.target.set(x, y, this.pan.target.z);
      this.flat.position.set(x, y, this.flat.position.z);
    } else {
      const step = at.clone().sub(this.followed);
      this.orbit.target.add(step);
      this.perspective.position.add(step);
      step.z = 0;
      this.pan.target.add(step);
      this.flat.position.add(step);
    }
    this.followed = at;
  }

  /** The UAV under a point of the canvas, or null. */
  pick(x, y) {
    let best = null;
    let nearest = 26;
    this.fleet.uavs.forEach((uav, id) => {
      const [px, py, visible] = this.project(uav.body.position);
      const distance = Math.hypot(px - x, py - y);
      if (visible && distance < nearest) [best, nearest] = [id, distance];
    });
    return best;
  }

  /** A point of the world in pixels of the canvas, and whether it lies before the camera. */
  project(point) {
    this.camera.updateMatrixWorld();
    const p = point.clone().project(this.camera);
    return [((p.x + 1) / 2) * this.width, ((1 - p.y) / 2) * this.height, Math.abs(p.z) < 1];
  }

  setColours({background, ink}) {
    this.scene.background = new THREE.Color(background);
    const c = new THREE.Color(ink).convertLinearToSRGB();
    this.materials.uniforms.plain.value.set(c.r, c.g, c.b);
    this.dirty = true;
  }

  /** @param {object} show toggles by name @returns whether there was anything to draw */
  draw(time, show, playing) {
    const moved = (this.orbit.enabled && this.orbit.update()) || (this.pan.enabled && this.pan.update());
    if (!this.dirty && !moved && !playing && time === this.time) return false;
    this.resize();
    this.time = time;
    this.dirty = false;
    this.update(Math.min(time, this.run.duration), show);
    this.renderer.render(this.scene, this.camera);
    return true;
  }

  update(time, show) {
    const {uniforms} = this.materials;
    uniforms.birthNow.value = this.field.birthCode(time);
    uniforms.deathNow.value = this.field.deathCode(time);
    uniforms.lowLayer.value = this.low;
    uniforms.cutLayer.value = this.cut;
    uniforms.mode.value = COLOURS.indexOf(show.colour);
    const codesPerSecond = 65000 / this.run.duration;
    uniforms.fresh.value = show.glow ? FRESH_S * codesPerSecond : 0;
    uniforms.ageSpan.value = AGE_SPAN * 65000;
    this.closed.visible = show.outside;
    this.cap.position.z = this.cut;
    this.missed.visible = show.colour === 'difference';
    this.fleet.update(time, show);
    this.frontiers.update(time, show.frontiers);
    const uav = this.follow ?? show.potentialOf ?? 0;
    this.potential.update(time, show.potential, Math.min(this.cut, this.field.size[2] - 1), uav, this.fleet.uavs);
    this.fleet.uavs.forEach((one, id) => {
      const ridden = this.riding && this.follow === id;
      one.inside = this.shows(one.pose.z);
      one.body.visible = !ridden && one.inside;
      one.goal.visible = one.goal.visible && this.shows(one.goal.position.z);
      one.frustum.visible = one.frustum.visible && !ridden && one.inside;
    });
    this.moveCamera();
  }

  /** What the last picture cost and shows. */
  stats() {
    const {triangles, calls} = this.renderer.info.render;
    return {
      triangles,
      calls,
      voxels: this.field.visible(Math.min(this.time, this.run.duration), this.low, this.cut),
      frontier: this.frontiers.cells.size,
    };
  }
}
