/** Slider, play, speed and steps; the coverage over time behind the slider. */
import {clockText, el} from './dom.js';

const SPEEDS = [0.5, 1, 2, 5, 10, 20, 50];
export const STEP_S = 0.2;

const SVG = 'http://www.w3.org/2000/svg';
const ICONS = {play: 'M5 3l12 7-12 7z', pause: 'M5 3h4v14H5zM11 3h4v14h-4z', back: 'M4 3h2.4v14H4zM16 3v14L7.4 10z', on: 'M13.6 3H16v14h-2.4zM4 3l8.6 7L4 17z'};

function icon(name) {
  const svg = document.createElementNS(SVG, 'svg');
  svg.setAttribute('viewBox', '0 0 20 20');
  svg.setAttribute('class', 'icon');
  svg.setAttribute('aria-hidden', 'true');
  svg.append(svgPath(ICONS[name], ''));
  return svg;
}

function svgPath(d, name) {
  const path = document.createElementNS(SVG, 'path');
  path.setAttribute('d', d);
  path.setAttribute('class', name);
  return path;
}

/** Coverage curves, and ticks where something went another way than planned. */
function backdrop(runs, duration) {
  const svg = document.createElementNS(SVG, 'svg');
  svg.setAttribute('viewBox', '0 0 1000 40');
  svg.setAttribute('preserveAspectRatio', 'none');
  svg.setAttribute('aria-hidden', 'true');
  runs.forEach((run, i) => {
    const [times, coverage] = run.about.coverage;
    const points = times.map((t, k) => [(1000 * t) / duration, 38 - 34 * (coverage[k] ?? 0)]).filter(p => p.every(Number.isFinite));
    if (points.length < 2) return;
    const line = points.map(p => p.map(c => c.toFixed(1)).join(' ')).join('L');
    if (i === 0) svg.append(svgPath(`M${points[0][0].toFixed(1)} 40L${line}L${points.at(-1)[0].toFixed(1)} 40Z`, 'area'));
    svg.append(svgPath(`M${line}`, `curve run${i}`));
  });
  const ticks = runs.flatMap(run => run.about.events.filter(e => ['collision', 'emergency_stop', 'fallback'].includes(e[2])));
  if (ticks.length) svg.append(svgPath(ticks.map(e => `M${((1000 * e[0]) / duration).toFixed(1)} 0V7`).join(''), 'tick'));
  return svg;
}

export class Timeline {
  /** @param {{seek: (t: number) => void, toggle: () => void, step: (direction: number) => void, setSpeed: (x: number) => void}} actions */
  constructor(runs, duration, actions) {
    this.duration = duration;
    this.slider = el('input', {
      type: 'range', min: 0, max: duration, step: 0.1, value: 0, class: 'time', 'aria-label': 'Time',
      oninput: () => actions.seek(Number(this.slider.value)),
    });
    this.play = el('button', {type: 'button', class: 'play', title: 'Play, pause (space)', onclick: actions.toggle});
    const step = (name, label, direction) => el('button', {type: 'button', 'aria-label': label, title: label, onclick: () => actions.step(direction)}, icon(name));
    this.speed = el('select', {'aria-label': 'Speed', title: 'Speed', onchange: () => actions.setSpeed(Number(this.speed.value))},
      ...SPEEDS.map(x => el('option', {value: x, text: `${x}×`})));
    this.text = el('output', {class: 'clock', 'aria-label': 'Time shown'});
    this.element = el('div', {class: 'timeline', role: 'group', 'aria-label': 'Playback'},
      el('div', {class: 'buttons'}, step('back', 'Step back (comma)', -1), this.play, step('on', 'Step forward (full stop)', 1), this.speed),
      el('div', {class: 'track'}, backdrop(runs, duration), this.slider),
      this.text);
  }

  show(time, playing, speed, coverage) {
    this.slider.value = time;
    const words = `${clockText(time)} of ${clockText(this.duration)}`;
    this.slider.setAttribute('aria-valuetext', `${words}, coverage ${coverage}`);
    this.text.textContent = `${clockText(time)} / ${clockText(this.duration)} · ${coverage}`;
    if (this.shownPlaying !== playing) {
      this.shownPlaying = playing;
      this.play.replaceChildren(icon(playing ? 'pause' : 'play'));
      this.play.setAttribute('aria-label', playing ? 'Pause' : 'Play');
    }
    this.speed.value = speed;
  }
}
