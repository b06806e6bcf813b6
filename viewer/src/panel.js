/** The controls beside the picture. */
import {el, setPressed, toggleButton} from './dom.js';
import {rampCss} from './voxel_material.js';

const COLOUR_NAMES = {height: 'Height', uav: 'Discovering UAV', age: 'Age', difference: 'Difference to the world'};
const TOGGLES = {
  paths: 'Flown paths', plans: 'Plans', goals: 'Goals', frustums: 'Sensor view', frontiers: 'Frontiers', potential: 'Potential',
  outside: 'Outer faces', glow: 'Glow of new',
};
const KEYS = [
  ['space', 'play, pause'], ['← →', '1 s back, on; with shift 10 s'], [', .', 'one step'], ['home end', 'first, last moment'], ['↑ ↓', 'cut higher, lower'],
  ['page up, down', 'storey above, below'], ['1 … 9', 'follow UAV 0 … 8; again: ride its camera'], ['esc', 'let go'], ['v', 'whole view'], ['t', 'from above'], ['o', 'orthographic slice'],
  ['c', 'next colouring'], ['f', 'full screen'],
];

function section(title, ...children) {
  return el('fieldset', {}, el('legend', {text: title}), ...children);
}

export class Panel {
  /** @param {import('./player.js').Player} player */
  constructor(player) {
    this.player = player;
    this.element = el('div', {class: 'panel'},
      this.colourSection(), this.cutSection(), this.showSection(), this.uavSection(), this.viewSection(), this.helpSection());
  }

  colourSection() {
    const {show} = this.player;
    this.colours = el('select', {'aria-label': 'Colour of the voxels', onchange: () => this.player.set({colour: this.colours.value})},
      ...Object.entries(COLOUR_NAMES).map(([value, text]) => el('option', {value, text, selected: show.colour === value})));
    this.legend = el('div', {class: 'legend-3d'});
    return section('Colour', this.colours, this.legend);
  }

  cutSection() {
    const {bottom, top, storeys} = this.player;
    this.cut = el('input', {type: 'range', min: bottom.toFixed(2), max: top.toFixed(2), step: 0.1, value: top, 'aria-label': 'Cut the building open at this height', oninput: () => this.player.setCut(bottom, Number(this.cut.value))});
    this.cutText = el('output', {});
    this.storeyButtons = [toggleButton('All', 'Show all storeys', () => this.player.showStorey(null))];
    storeys.forEach((_, k) => this.storeyButtons.push(toggleButton(String(k), `Show storey ${k} alone`, () => this.player.showStorey(k))));
    return section('Storeys', el('div', {class: 'row'}, this.cut, this.cutText), el('div', {class: 'row wrap', role: 'group', 'aria-label': 'Storeys'}, ...this.storeyButtons));
  }

  uavSection() {
    this.uavButtons = [];
    const rows = [];
    this.player.stages.forEach((stage, s) => {
      if (this.player.stages.length > 1) rows.push(el('p', {class: 'of', text: stage.run.about.name}));
      stage.fleet.uavs.forEach((_, id) => {
        const follow = toggleButton('Follow', `Follow UAV ${id}`, () => this.player.follow(s, id, false));
        const ride = toggleButton('Ride', `Ride the camera of UAV ${id}`, () => this.player.follow(s, id, true));
        this.uavButtons.push({s, id, follow, ride});
        rows.push(el('div', {class: 'row uav'}, el('span', {class: `dot s${id % 8}`}), el('span', {text: `UAV ${id}`}), follow, ride));
      });
    });
    return section('UAVs', el('div', {class: 'uavs'}, ...rows));
  }

  viewSection() {
    const button = (text, label, action) => el('button', {type: 'button', text, title: label, 'aria-label': label, onclick: action});
    this.ortho = toggleButton('Slice', 'Orthographic slice view (o)', () => this.player.setOrtho(!this.player.ortho));
    const buttons = [button('Whole', 'The whole building (v)', () => this.player.home(false)), button('Above', 'From above (t)', () => this.player.home(true)), this.ortho,
      button('Full screen', 'Full screen (f)', () => this.player.fullscreen())];
    return section('View', el('div', {class: 'row wrap'}, ...buttons));
  }

  showSection() {
    this.boxes = {};
    const rows = Object.entries(TOGGLES).map(([name, text]) => {
      const box = el('input', {type: 'checkbox', checked: this.player.show[name], onchange: () => this.player.set({[name]: box.checked})});
      this.boxes[name] = box;
      return el('label', {}, box, text);
    });
    return section('Show', el('div', {class: 'checks'}, ...rows));
  }

  helpSection() {
    const rows = KEYS.flatMap(([key, what]) => [el('dt', {text: key}), el('dd', {text: what})]);
    return el('details', {}, el('summary', {text: 'Keyboard and mouse'}),
      el('p', {text: 'Drag turns, right drag (two fingers) moves, the wheel zooms. A click on a UAV follows it.'}), el('dl', {}, ...rows));
  }

  update() {
    const {show, low, cutHeight, bottom, top, storey, stages, ortho} = this.player;
    this.colours.value = show.colour;
    for (const [name, box] of Object.entries(this.boxes)) box.checked = show[name];
    this.cut.value = cutHeight;
    this.cutText.textContent = cutHeight >= top - 1e-6 && low <= bottom ? 'open' : `${cutHeight.toFixed(1)} m`;
    this.storeyButtons.forEach((button, k) => setPressed(button, k === 0 ? storey === null && cutHeight >= top - 1e-6 : storey === k - 1));
    for (const {s, id, follow, ride} of this.uavButtons) {
      const mine = stages[s].follow === id;
      setPressed(follow, mine && !stages[s].riding);
      setPressed(ride, mine && stages[s].riding);
    }
    setPressed(this.ortho, ortho);
    this.showLegend(show.colour);
  }

  showLegend(colour) {
    if (this.shownLegend === colour) return;
    this.shownLegend = colour;
    const bar = (from, to) => [el('div', {class: 'ramp', style: `background:${rampCss(colour)}`}), el('div', {class: 'ends'}, el('span', {text: from}), el('span', {text: to}))];
    const patch = (name, text) => el('span', {class: 'patch'}, el('i', {class: name}), text);
    const {bottom, top, duration} = this.player;
    const parts = {
      height: () => bar(`${bottom.toFixed(1)} m`, `${top.toFixed(1)} m`),
      age: () => bar(`older than ${Math.round(duration / 2)} s`, 'new'),
      uav: () => [el('p', {text: 'As the UAVs below: who saw it first.'})],
      difference: () => [patch('agrees', 'agrees'), patch('wrong', 'only in the map'), patch('missed', 'only in the world')],
    };
    this.legend.replaceChildren(...parts[colour]());
  }
}
