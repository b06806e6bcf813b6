/** Starts the replay of the page's runs. */
import {DamagedReport, parseRun, unpack} from './decode.js';
import {Player} from './player.js';

function notice(text) {
  const p = document.createElement('p');
  p.className = 'notice';
  p.setAttribute('role', 'alert');
  p.textContent = text;
  document.body.prepend(p);
}

function hasWebGl2() {
  return Boolean(document.createElement('canvas').getContext('webgl2'));
}

/** Whatever goes wrong while the data are read is damage. */
async function readRuns() {
  const runs = [];
  try {
    for (const script of document.querySelectorAll('script.run')) {
      const {bytes, crc} = script.dataset;
      runs.push(parseRun(await unpack(script.textContent, {bytes: Number(bytes), crc: Number(crc)})));
      script.remove();
    }
  } catch (error) {
    throw error instanceof DamagedReport ? error : new DamagedReport(error.message);
  }
  return runs;
}

async function start() {
  if (!document.getElementById('end')) return null; // truncated: the page itself says so
  const runs = await readRuns();
  if (!hasWebGl2()) {
    notice('This browser shows no WebGL 2: the picture below stands in for the 3D replay. Plots and tables are complete.');
    return null;
  }
  const player = new Player(document.getElementById('replay'), runs);
  const missing = runs.flatMap(run => run.about.left_out);
  if (missing.length) player.say(`Left out of this report because of its size: ${[...new Set(missing)].join(', ')}.`);
  return player;
}

function whenParsed() {
  if (document.readyState !== 'loading') return Promise.resolve();
  return new Promise(resolve => document.addEventListener('DOMContentLoaded', resolve));
}

const ready = whenParsed()
  .then(start)
  .catch(error => {
    if (!(error instanceof DamagedReport)) throw error;
    notice(`This report is damaged: ${error.message}. There is no replay, and the rest may be wrong. Make it again: stairwell report DIR`);
    return null;
  });
window.stairwell = {ready};
ready.then(player => player && Object.assign(window.stairwell, {player}));
