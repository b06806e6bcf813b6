/** UAVs over time: bodies, flown paths, plans, goals, frustums. */
import * as THREE from 'three';
import {Line2} from 'three/examples/jsm/lines/Line2.js';
import {LineGeometry} from 'three/examples/jsm/lines/LineGeometry.js';
import {LineMaterial} from 'three/examples/jsm/lines/LineMaterial.js';

/** Last index whose value is not above `value`; -1 before the first. */
export function lastAt(times, value, of = x => x) {
  let a = 0;
  let b = times.length;
  while (a < b) {
    const middle = (a + b) >> 1;
    if (of(times[middle]) <= value) a = middle + 1;
    else b = middle;
  }
  return a - 1;
}

/** Position, yaw and the index of the sample before. */
export function poseAt(track, time) {
  const k = Math.max(0, lastAt(track.t, time));
  const next = Math.min(k + 1, track.t.length - 1);
  const span = track.t[next] - track.t[k];
  const f = span > 0 ? Math.min(1, Math.max(0, (time - track.t[k]) / span)) : 0;
  const mix = values => values[k] + (values[next] - values[k]) * f;
  const turn = Math.atan2(Math.sin(track.yaw[next] - track.yaw[k]), Math.cos(track.yaw[next] - track.yaw[k]));
  return {x: mix(track.x), y: mix(track.y), z: mix(track.z), yaw: track.yaw[k] + turn * f, index: k};
}

/** Where a UAV was going at that time, or null. */
export function goalAt(goals, states, time) {
  const goal = goals[lastAt(goals, time, g => g[0])];
  const state = states[lastAt(states, time, s => s[0])];
  return goal && state && state[2] === 'travel' && state[0] <= time ? goal[2] : null;
}

/** The rim of what a sensor sees, from the sensor, x forward. */
export function frustumLines(sensor) {
  const half = sensor.azimuth_fov_rad / 2;
  const [lo, hi] = [sensor.elevation_lo_rad, sensor.elevation_hi_rad];
  const allRound = half > 1.7;
  const steps = allRound ? 48 : 10;
  const ray = (az, el) => {
    const d = allRound
      ? [Math.cos(az) * Math.cos(el), Math.sin(az) * Math.cos(el), Math.sin(el)]
      : [1, Math.tan(az), Math.tan(el)];
    const length = sensor.max_range_m / Math.hypot(...d);
    return d.map(c => c * length);
  };
  const lines = [];
  const arc = (from, to) => {
    for (let i = 0; i < steps; ++i) {
      const at = f => ray(from[0] + (to[0] - from[0]) * f, from[1] + (to[1] - from[1]) * f);
      lines.push(...at(i / steps), ...at((i + 1) / steps));
    }
  };
  arc([-half, lo], [half, lo]);
  arc([-half, hi], [half, hi]);
  if (allRound) return lines;
  arc([-half, lo], [-half, hi]);
  arc([half, lo], [half, hi]);
  for (const az of [-half, half]) for (const el of [lo, hi]) lines.push(0, 0, 0, ...ray(az, el));
  return lines;
}

function bodyMesh(radius, colour) {
  const group = new THREE.Group();
  const hull = new THREE.MeshLambertMaterial({color: colour});
  const dark = new THREE.MeshLambertMaterial({color: 0x20242b});
  const r = Math.max(0.15, radius) * 1.35;
  group.add(new THREE.Mesh(new THREE.SphereGeometry(r * 0.42, 20, 12).scale(1.15, 1, 0.6), hull));
  const rotor = new THREE.CylinderGeometry(r * 0.42, r * 0.42, r * 0.07, 24).rotateX(Math.PI / 2);
  const ring = new THREE.TorusGeometry(r * 0.42, r * 0.06, 8, 28);
  for (const [sx, sy] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
    const disc = new THREE.Mesh(rotor, new THREE.MeshLambertMaterial({color: colour, transparent: true, opacity: 0.45}));
    const hoop = new THREE.Mesh(ring, hull);
    disc.position.set(sx * r * 0.62, sy * r * 0.62, r * 0.18);
    hoop.position.copy(disc.position);
    group.add(disc, hoop);
  }
  const arm = new THREE.BoxGeometry(r * 1.75, r * 0.1, r * 0.1);
  for (const turn of [Math.PI / 4, -Math.PI / 4]) group.add(new THREE.Mesh(arm.clone().rotateZ(turn), dark));
  const nose = new THREE.Mesh(new THREE.ConeGeometry(r * 0.16, r * 0.34, 16).rotateZ(-Math.PI / 2), dark);
  nose.position.x = r * 0.6;
  group.add(nose);
  return group;
}

/** One UAV's things in the scene. */
class UavThings {
  constructor(run, id, colour, clipping) {
    this.run = run;
    this.track = run.tracks[id];
    this.plans = run.plans[id];
    this.goals = run.about.goals.filter(goal => goal[1] === id);
    this.states = run.about.states.filter(state => state[1] === id);
    this.body = bodyMesh(run.header.robot_radius_m, colour);
    const points = [];
    for (let k = 0; k < this.track.t.length; ++k) points.push(this.track.x[k], this.track.y[k], this.track.z[k]);
    const line = (width, opacity, dashed) => new LineMaterial({color: colour, linewidth: width, transparent: true, opacity, dashed, dashSize: 0.14, gapSize: 0.1, clippingPlanes: clipping});
    this.trail = new Line2(new LineGeometry(), line(2.2, 0.85, false));
    if (points.length > 3) this.trail.geometry.setPositions(points);
    this.plan = new Line2(new LineGeometry(), line(3.2, 1, true));
    this.goal = new THREE.Mesh(new THREE.OctahedronGeometry(0.12), new THREE.MeshLambertMaterial({color: colour, emissive: colour, emissiveIntensity: 0.35}));
    const rim = new THREE.BufferGeometry();
    rim.setAttribute('position', new THREE.Float32BufferAttribute(frustumLines(run.header.sensor), 3));
    this.frustum = new THREE.LineSegments(rim, new THREE.LineBasicMaterial({color: colour, transparent: true, opacity: 0.75}));
    for (const thing of [this.trail, this.plan]) thing.frustumCulled = false;
  }

  get objects() {
    return [this.body, this.trail, this.plan, this.goal, this.frustum];
  }

  moveTo(time, show) {
    const pose = poseAt(this.track, time);
    this.pose = pose;
    for (const thing of [this.body, this.frustum]) {
      thing.position.set(pose.x, pose.y, pose.z);
      thing.rotation.z = pose.yaw;
    }
    this.frustum.visible = show.frustums;
    this.trail.visible = show.paths && pose.index > 0;
    this.trail.geometry.instanceCount = Math.max(0, pose.index);
    this.showPlan(time, show.plans);
    const goal = goalAt(this.goals, this.states, time);
    this.goal.visible = show.goals && goal !== null;
    if (goal) this.goal.position.set(...goal);
  }

  /** What is left to fly of the last command. */
  showPlan(time, wanted) {
    const plan = this.plans[lastAt(this.plans, time, p => p.time)];
    this.plan.visible = false;
    if (!wanted || !plan || time >= plan.start + plan.duration) return;
    const count = plan.points.length / 3;
    const f = plan.duration > 0 ? Math.max(0, (time - plan.start) / plan.duration) * (count - 1) : 0;
    const rest = [this.pose.x, this.pose.y, this.pose.z, ...plan.points.subarray(3 * (Math.floor(f) + 1))];
    if (rest.length < 6) return;
    this.plan.geometry.dispose();
    this.plan.geometry = new LineGeometry();
    this.plan.geometry.setPositions(rest);
    this.plan.computeLineDistances();
    this.plan.visible = true;
  }
}

export class FleetView {
  constructor(run, colours, clipping) {
    this.group = new THREE.Group();
    this.uavs = run.tracks.map((_, id) => new UavThings(run, id, colours[id % colours.length], clipping));
    for (const uav of this.uavs) this.group.add(...uav.objects);
  }
  update(time, show) {
    for (const uav of this.uavs) uav.moveTo(time, show);
  }
  /** Lines need the size of the picture. */
  resize(width, height) {
    for (const uav of this.uavs) for (const line of [uav.trail, uav.plan]) line.material.resolution.set(width, height);
  }
}
