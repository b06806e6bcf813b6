// The pictures of docs/report.md, from reports on the disk.
//   node viewer/screenshots.mjs TOWER.html DUPLEX.html DUPLEX_BOTH.html docs/images
import {resolve} from 'node:path';
import {pathToFileURL} from 'node:url';
import {chromium} from 'playwright-core';

const [tower, duplex, both, folder] = process.argv.slice(2);

/** File, name, size, colours of the page, what to do with the player `p`. */
const shots = [
  [tower, 'replay_tower', 1280, 800, 'light', p => (p.seek(62), p.setCut(p.bottom, p.top))],
  [tower, 'replay_tower_storey', 1280, 800, 'light', p => (p.seek(75), p.set({colour: 'uav'}), p.showStorey(1))],
  [tower, 'replay_tower_potential', 1040, 640, 'dark', p => (p.seek(40.8), p.setOrtho(true), p.showStorey(1), p.set({potential: true, potentialOf: 3}))],
  [duplex, 'replay_duplex', 1280, 800, 'light', p => (p.seek(60), p.showStorey(0))],
  [duplex, 'replay_duplex_ride', 1280, 800, 'light', p => (p.seek(52), p.set({colour: 'age'}), p.follow(0, 1, true))],
  [both, 'replay_duplex_both', 1280, 720, 'light', p => (p.seek(50), p.showStorey(0))],
  [duplex, 'replay_phone', 390, 844, 'dark', p => (p.seek(70), p.showStorey(0))],
];

const browser = await chromium.launch({
  executablePath: '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
});
for (const [file, name, width, height, colorScheme, action] of shots) {
  const page = await browser.newPage({viewport: {width, height}, colorScheme});
  await page.goto(pathToFileURL(resolve(file)).href);
  await page.evaluate(() => window.stairwell.ready.then(() => true));
  await page.evaluate(`(${action})(window.stairwell.player); undefined`);
  await page.evaluate(() => new Promise(done => setTimeout(done, 1500)));
  await page.screenshot({path: `${folder}/${name}.png`});
  const [run] = await page.evaluate(() => window.stairwell.player.state().runs);
  console.log(`${name}: ${run.voxels} voxels, ${run.triangles} triangles, ${run.calls} draw calls`);
  await page.close();
}
await browser.close();
