/** The page's replay: one clock for all runs, the controls, the keyboard. */
import * as THREE from 'three';
import {el} from './dom.js';
import {Panel} from './panel.js';
import {PlotCursors} from './plot_cursors.js';
import {Stage} from './stage.js';
import {STEP_S, Timeline} from './timeline.js';
import {lastAt, poseAt} from './fleet.js';
import {COLOURS} from './voxel_material.js';

const PLAY_WHOLE_S = 40; // a run at its first speed takes about so long
const CUT_STEP_M = 0.1;
const SLOW_MS = 30; // a frame, on average of so many ...
const FRAMES = 30;
const LEAST_QUALITY = 0.5;

const cssColour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Whether a control has a use of its own for a key. */
function keepsKey(control, key) {
  if (control.type === 'range') return /^(Arrow|Page|Home|End)/.test(key);
  if (/^(SELECT|INPUT)$/.test(control.tagName)) return key !== 'Escape';
  return key === ' ' && /^(BUTTON|SUMMARY)$/.test(control.tagName);
}

export class Player {
  /** @param {HTMLElement} section takes the place of what is in there @param {object[]} runs as `parseRun` gives */
  constructor(section, runs) {
    this.section = section;
    this.duration = Math.max(...runs.map(run => run.duration));
    this.show = {colour: 'height', paths: true, plans: true, goals: true, frustums: true, frontiers: true, potential: false, outside: false, glow: true};
    this.time = 0;
    this.playing = false;
    this.speed = [1, 2, 5, 10, 20, 50].find(x => this.duration / x <= PLAY_WHOLE_S) ?? 50;
    this.ortho = false;
    this.frameTimes = [];
    this.makeStages(runs);
    const boxes = this.stages.map(stage => stage.box);
    this.bottom = Math.min(...boxes.map(box => box.min.z));
    this.top = Math.max(...boxes.map(box => box.max.z));
    this.storeys = runs[0].storeys;
    this.storey = null;
    [this.low, this.cutHeight] = [this.bottom, this.top];
    this.timeline = new Timeline(runs, this.duration, {
      seek: t => this.seek(t), toggle: () => this.toggle(), step: d => this.step(d), setSpeed: x => (this.speed = x),
    });
    this.panel = new Panel(this);
    this.status = el('p', {class: 'status', role: 'status', 'aria-live': 'polite'});
    this.cursors = new PlotCursors(t => this.seek(t));
    this.build();
    this.listen();
    this.seek(this.duration);
    this.setCut(this.bottom, this.top);
    requestAnimationFrame(now => this.frame(now));
  }

  makeStages(runs) {
    const colours = Array.from({length: 8}, (_, i) => cssColour(`--u${i}`));
    this.holders = runs.map(run => {
      const words = `Replay of ${run.about.name}: ${run.header.uavs} UAVs, ${Math.round(run.duration)} s. Keys: space plays, arrows move in time and cut.`;
      const canvas = el('canvas', {tabindex: 0, role: 'img', 'aria-label': words});
      const labels = el('div', {class: 'labels'});
      const stats = el('p', {class: 'stats', 'aria-hidden': 'true'});
      const name = runs.length > 1 ? el('p', {class: 'name', text: run.about.name}) : null;
      return {canvas, labels, stats, element: el('div', {class: 'stage'}, canvas, labels, name, stats)};
    });
    this.stages = runs.map((run, i) => new Stage(this.holders[i].canvas, run, colours));
    this.stages.forEach((stage, s) => this.wire(stage, s));
  }

  /** Labels that can be clicked, clicks on bodies, cameras that move together. */
  wire(stage, s) {
    const {canvas, labels} = this.holders[s];
    stage.labels = stage.fleet.uavs.map((_, id) => {
      const label = el('button', {type: 'button', class: `label s${id % 8}`, text: String(id), tabindex: -1, 'aria-label': `Follow UAV ${id}`, onclick: () => this.follow(s, id, false)});
      labels.append(label);
      return label;
    });
    let down = null;
    canvas.addEventListener('pointerdown', event => (down = [event.offsetX, event.offsetY]));
    canvas.addEventListener('pointerup', event => {
      if (!down || Math.hypot(event.offsetX - down[0], event.offsetY - down[1]) > 4) return;
      const id = stage.pick(event.offsetX, event.offsetY);
      if (id !== null) this.follow(s, id, false);
    });
    canvas.addEventListener('dblclick', () => this.home(false));
    stage.onTouched = () => (this.leading = s);
  }

  build() {
    const stages = el('div', {class: 'stages'}, ...this.holders.map(holder => holder.element));
    this.element = el('div', {class: 'viewer'}, el('div', {class: 'picture'}, stages, this.timeline.element), this.panel.element, this.status);
    this.section.replaceChildren(this.element);
    this.section.classList.add('live');
  }

  listen() {
    this.section.addEventListener('keydown', event => this.onKey(event));
    new ResizeObserver(() => this.stages.forEach(stage => stage.resize())).observe(this.element);
    const dark = matchMedia('(prefers-color-scheme: dark)');
    const recolour = () => this.stages.forEach(stage => stage.setColours({background: cssColour('--stage'), ink: cssColour('--agrees')}));
    dark.addEventListener('change', recolour);
    recolour();
  }

  seek(time) {
    this.time = Math.min(this.duration, Math.max(0, time));
    this.refresh();
  }
  toggle() {
    if (!this.playing && this.time >= this.duration) this.time = 0;
    this.playing = !this.playing;
    this.frameTimes = [];
    if (!this.playing) this.setQuality(Infinity);
    this.refresh();
    if (!this.playing) this.say(`Paused at ${this.time.toFixed(1)} s, coverage ${this.coverageText()}`);
  }
  step(direction) {
    this.playing = false;
    this.seek(Math.round(this.time / STEP_S + direction) * STEP_S);
  }
  set(changes) {
    Object.assign(this.show, changes);
    this.stages.forEach(stage => (stage.dirty = true));
    this.refresh();
  }
  setCut(low, cut, storey = null) {
    this.storey = storey;
    this.low = low;
    this.cutHeight = Math.min(this.top, Math.max(this.bottom + CUT_STEP_M, cut));
    this.stages.forEach(stage => stage.setCut(low, this.cutHeight));
    this.refresh();
  }
  /** One storey without its ceiling; null: all. */
  showStorey(k) {
    if (k === null || !this.storeys[k]) {
      this.stages.forEach(stage => stage.lookAtHeight((this.bottom + this.top) / 2));
      return this.setCut(this.bottom, this.top);
    }
    const {floor, ceiling} = this.storeys[k];
    const low = k === 0 ? this.bottom : floor - 0.3;
    this.stages.forEach(stage => stage.lookAtHeight((floor + ceiling) / 2));
    return this.setCut(low, floor + Math.min(0.72 * (ceiling - floor), ceiling - floor - 0.5), k);
  }
  follow(s, id, riding) {
    const stage = this.stages[s];
    const same = stage.follow === id && stage.riding === riding;
    if (same) this.release(s);
    else {
      if (riding && this.ortho) this.setOrtho(false);
      this.bringIntoView(stage, id);
      stage.followUav(id, riding);
      this.say(riding ? `Riding UAV ${id}` : `Following UAV ${id}`);
    }
    this.refresh();
  }
  /** Cuts elsewhere when the UAV is hidden. */
  bringIntoView(stage, id) {
    const {z} = poseAt(stage.run.tracks[id], this.time);
    if (stage.shows(z)) return;
    const k = this.storeys.findIndex(({floor, ceiling}) => z >= floor - 0.3 && z < ceiling - 0.3);
    this.showStorey(k < 0 ? null : k);
  }
  release(s) {
    const stage = this.stages[s];
    const wasRiding = stage.riding;
    stage.followUav(null);
    if (wasRiding) stage.home();
    this.refresh();
  }
  setOrtho(on) {
    this.ortho = on;
    this.stages.forEach(stage => stage.setOrtho(on));
    if (on && this.storey === null && this.cutHeight >= this.top - 1e-6 && this.storeys.length) this.showStorey(0);
    this.refresh();
  }
  home(fromAbove) {
    this.stages.forEach(stage => {
      stage.followUav(null);
      stage.home(fromAbove);
    });
    this.setOrtho(false);
  }
  fullscreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.element.requestFullscreen?.();
  }
  /** Coarser pictures while a slow computer plays, full ones when it stands still. */
  setQuality(factor) {
    this.frameTimes = [];
    for (const stage of this.stages) {
      stage.quality = Math.min(1, Math.max(LEAST_QUALITY, stage.quality * factor));
      stage.dirty = true;
    }
  }
  say(text) {
    this.status.textContent = text;
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (keepsKey(event.target, event.key)) return;
    const jump = event.shiftKey ? 10 : 1;
    const storey = this.storey ?? (this.cutHeight >= this.top - 1e-6 ? this.storeys.length : 0);
    const actions = {
      ' ': () => this.toggle(), ArrowLeft: () => this.seek(this.time - jump), ArrowRight: () => this.seek(this.time + jump),
      ArrowUp: () => this.setCut(this.low, this.cutHeight + CUT_STEP_M), ArrowDown: () => this.setCut(this.low, this.cutHeight - CUT_STEP_M),
      PageUp: () => this.showStorey(storey + 1 >= this.storeys.length ? null : storey + 1), PageDown: () => this.showStorey(Math.max(0, storey - 1)),
      ',': () => this.step(-1), '.': () => this.step(1), Home: () => this.seek(0), End: () => this.seek(this.duration),
      Escape: () => this.stages.forEach((_, s) => this.release(s)), v: () => this.home(false), t: () => this.home(true), o: () => this.setOrtho(!this.ortho),
      c: () => this.set({colour: COLOURS[(COLOURS.indexOf(this.show.colour) + 1) % COLOURS.length]}), f: () => this.fullscreen(),
    };
    const uav = '123456789'.indexOf(event.key);
    const stage = this.stages[0];
    if (uav >= 0 && uav < stage.fleet.uavs.length) this.follow(0, uav, stage.follow === uav && !stage.riding);
    else if (actions[event.key]) actions[event.key]();
    else return;
    event.preventDefault();
  }

  coverageText() {
    return this.stages.map(({run}) => {
      const [times, coverage] = run.about.coverage;
      const k = lastAt(times, this.time);
      return `${(100 * (k < 0 ? 0 : (coverage[k] ?? 0))).toFixed(1)} %`;
    }).join(' / ');
  }

  refresh() {
    this.timeline.show(this.time, this.playing, this.speed, this.coverageText());
    this.panel.update();
    this.cursors.show(this.time);
  }

  frame(now) {
    const elapsed = Math.min(0.25, (now - (this.last ?? now)) / 1e3);
    this.last = now;
    if (this.playing) {
      this.seek(this.time + elapsed * this.speed);
      if (this.time >= this.duration) this.toggle();
    }
    this.linkCameras();
    const before = performance.now();
    const drawn = this.stages.map(stage => stage.draw(this.time, this.show, this.playing));
    if (drawn.includes(true)) this.afterDrawing(performance.now() - before, elapsed);
    requestAnimationFrame(later => this.frame(later));
  }

  /** The camera that was touched last leads, unless someone is followed. */
  linkCameras() {
    if (this.stages.length < 2 || this.leading === undefined) return;
    const lead = this.stages[this.leading];
    for (const stage of this.stages) {
      if (stage === lead || stage.follow !== null || lead.follow !== null) continue;
      if (stage.perspective.position.distanceTo(lead.perspective.position) < 1e-6 && stage.flat.zoom === lead.flat.zoom && stage.flat.position.distanceTo(lead.flat.position) < 1e-6) continue;
      stage.perspective.position.copy(lead.perspective.position);
      stage.orbit.target.copy(lead.orbit.target);
      stage.flat.position.copy(lead.flat.position);
      stage.flat.zoom = lead.flat.zoom;
      stage.flat.updateProjectionMatrix();
      stage.pan.target.copy(lead.pan.target);
      stage.dirty = true;
    }
  }

  afterDrawing(cost_ms, elapsed) {
    this.frameTimes.push(elapsed * 1e3);
    if (this.frameTimes.length > FRAMES) this.frameTimes.shift();
    const mean = this.frameTimes.reduce((a, b) => a + b, 0) / this.frameTimes.length;
    if (this.playing && this.frameTimes.length === FRAMES && mean > SLOW_MS) this.setQuality(0.75);
    this.stages.forEach((stage, s) => {
      const {triangles, calls, voxels} = stage.stats();
      const count = n => n.toLocaleString('en').replaceAll(',', '\u202f');
      const rate = this.playing ? ` · ${mean.toFixed(1)} ms a frame` : '';
      this.holders[s].stats.textContent = `${count(voxels)} voxels · ${count(triangles)} triangles · ${calls} draw calls${rate}`;
      this.placeLabels(stage);
    });
    this.cost_ms = cost_ms;
  }

  placeLabels(stage) {
    const above = new THREE.Vector3();
    stage.fleet.uavs.forEach((uav, id) => {
      above.copy(uav.body.position).z += 0.45;
      const [x, y, visible] = stage.project(above);
      const label = stage.labels[id];
      label.hidden = !visible || (stage.riding && stage.follow === id) || x < 0 || y < 0 || x > stage.width || y > stage.height;
      label.style.transform = `translate(${x.toFixed(1)}px,${y.toFixed(1)}px) translate(-50%,-50%)`;
      label.classList.toggle('followed', stage.follow === id);
      label.classList.toggle('away', !uav.inside);
    });
  }

  /** For scripts and tests: what is shown now. */
  state() {
    return {time: this.time, playing: this.playing, duration: this.duration, cut: this.cutHeight, storey: this.storey, ortho: this.ortho, runs: this.stages.map(stage => ({...stage.stats(), follow: stage.follow, riding: stage.riding}))};
  }

  /** Frames drawn one after another, each waited for. @returns milliseconds a frame */
  measure(frames = 20) {
    const [stage] = this.stages;
    const gl = stage.renderer.getContext();
    const pixel = new Uint8Array(4);
    const draw = () => {
      stage.dirty = true;
      stage.draw(this.time, this.show, false);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    };
    draw();
    const before = performance.now();
    for (let i = 0; i < frames; ++i) draw();
    return (performance.now() - before) / frames;
  }
}
