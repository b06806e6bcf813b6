// Reports of real runs in a headless browser, from disk and without network.
//   node report.test.mjs PROGRAM WORLD WORK_FOLDER     exit code 77: something it needs is not installed
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {existsSync, mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {pathToFileURL} from 'node:url';

const SKIP = 77;
const [program, world, work] = process.argv.slice(2).map(word => resolve(word));

function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(SKIP);
}

const browserFile = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'].find(existsSync);
if (!browserFile) skip('there is no chromium (apt-get install chromium)');
const {chromium} = await import('playwright-core').catch(() => skip('playwright-core is not installed (npm ci --prefix viewer)'));

/** Two short runs, and what is made of them. */
function makeReports() {
  rmSync(work, {recursive: true, force: true});
  mkdirSync(work, {recursive: true});
  const explore = (name, mode) => {
    const common = ['--uavs', '2', '--rays', '64x48', '--charge-planning', 'off', '--time-limit', '40', '--quiet', '--mode', mode];
    execFileSync(program, ['explore', world, ...common, '--out', join(work, name)]);
    return join(work, name);
  };
  const runs = [explore('volume', 'volume'), explore('slice', 'slice')];
  execFileSync(program, ['report', ...runs, '-o', join(work, 'both.html')]);
  return {one: join(runs[0], 'report.html'), both: join(work, 'both.html')};
}

const launch = () =>
  chromium.launch({
    executablePath: browserFile,
    args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
  });

/** A page that fails the test on console errors and on any request but for the file itself. */
async function open(browser, file, options = {}) {
  const context = await browser.newContext({viewport: {width: 900, height: 700}, offline: true, ...options});
  const page = await context.newPage();
  page.troubles = [];
  page.on('console', message => message.type() === 'error' && page.troubles.push(message.text()));
  page.on('pageerror', error => page.troubles.push(String(error)));
  page.on('request', request => !request.url().match(/^(file|data|blob):/) && page.troubles.push(`asks for ${request.url()}`));
  await page.goto(pathToFileURL(file).href);
  await page.evaluate(() => window.stairwell?.ready.then(() => true));
  return page;
}

const state = page => page.evaluate(() => window.stairwell.player.state());

/** Waits until what is asked of the state holds. */
async function until(page, holds, what) {
  for (let i = 0; i < 200; ++i) {
    const now = await state(page);
    if (holds(now)) return now;
    await page.waitForTimeout(50);
  }
  return assert.fail(`${what}: ${JSON.stringify(await state(page))}`);
}

/** Share of the picture that is not background, and a small grey copy of it. */
async function look(page, index = 0) {
  await page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)))));
  const png = await page.locator('.stage canvas').nth(index).screenshot();
  return page.evaluate(async url => {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [90, 60];
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0, 90, 60);
    const {data} = context.getImageData(0, 0, 90, 60);
    const grey = [];
    let ink = 0;
    for (let i = 0; i < data.length; i += 4) {
      if (Math.abs(data[i] - data[0]) + Math.abs(data[i + 1] - data[1]) + Math.abs(data[i + 2] - data[2]) > 24) ++ink;
      grey.push((data[i] + data[i + 1] + data[i + 2]) / 3);
    }
    return {share: ink / grey.length, grey};
  }, `data:image/png;base64,${png.toString('base64')}`);
}

/** Share of the pixels that differ clearly. */
const difference = (a, b) => a.grey.filter((value, i) => Math.abs(value - b.grey[i]) > 12).length / a.grey.length;

const tests = {
  async 'loads, and shows the explored building'(browser, {one}) {
    const page = await open(browser, one);
    const {share} = await look(page);
    assert.ok(share > 0.1 && share < 0.9, `share of the picture: ${share}`);
    const now = await state(page);
    assert.ok(now.runs[0].voxels > 1000 && now.runs[0].triangles > 100 && now.runs[0].calls < 200);
    assert.equal(await page.locator('figure').count(), 11);
    return page;
  },

  async 'plays to the end and stops'(browser, {one}) {
    const page = await open(browser, one);
    await page.getByRole('button', {name: 'Step back'}).click();
    await page.locator('.stage canvas').focus();
    await page.keyboard.press('Home');
    assert.equal((await state(page)).time, 0);
    await page.getByLabel('Speed', {exact: true}).selectOption('10');
    await page.getByRole('button', {name: 'Play', exact: true}).click();
    await until(page, now => now.time > 3 && now.playing, 'plays');
    await page.getByLabel('Speed', {exact: true}).selectOption('50');
    const end = await until(page, now => !now.playing, 'ends');
    assert.equal(end.time, end.duration);
    return page;
  },

  async 'the time slider changes what is there'(browser, {one}) {
    const page = await open(browser, one);
    for (const layer of ['Flown paths', 'Plans', 'Goals', 'Sensor view', 'Frontiers']) await page.getByLabel(layer).uncheck();
    const late = await look(page);
    const lateState = await state(page);
    await page.getByLabel('Time', {exact: true}).fill('1');
    const early = await look(page);
    const earlyState = await state(page);
    assert.ok(earlyState.runs[0].voxels < 0.8 * lateState.runs[0].voxels, 'fewer voxels');
    assert.ok(early.share < 0.8 * late.share, `less is there: ${early.share}, ${late.share}`);
    await page.getByLabel('Time', {exact: true}).fill(String(lateState.duration));
    assert.ok(difference(await look(page), late) < 0.005, 'and back again');
    await page.locator('.stage canvas').focus();
    await page.keyboard.press('ArrowLeft');
    assert.ok(Math.abs((await state(page)).time - (lateState.duration - 1)) < 0.01);
    await page.locator('svg.time').first().click({position: {x: 200, y: 60}});
    assert.ok((await state(page)).time < lateState.duration - 2, 'a click in a plot seeks');
    return page;
  },

  async 'storeys are cut open'(browser, {one}) {
    const page = await open(browser, one);
    const whole = await look(page);
    const before = await state(page);
    await page.getByRole('button', {name: 'Show storey 0 alone'}).click();
    const cut = await look(page);
    const after = await state(page);
    assert.ok(after.runs[0].voxels < 0.9 * before.runs[0].voxels);
    assert.ok(difference(whole, cut) > 0.02);
    await page.getByRole('button', {name: 'Show all storeys'}).click();
    await page.getByLabel('Cut the building open at this height').fill('1.2');
    assert.ok(Math.abs((await state(page)).cut - 1.2) < 0.06);
    await page.locator('.stage canvas').focus();
    await page.keyboard.press('o');
    assert.equal((await state(page)).ortho, true);
    assert.ok((await look(page)).share > 0.02, 'the slice shows something');
    return page;
  },

  async 'a UAV is followed, and its camera ridden'(browser, {one}) {
    const page = await open(browser, one);
    const free = await look(page);
    await page.locator('.label').first().click();
    assert.equal((await state(page)).runs[0].follow, 0);
    assert.ok(difference(free, await look(page)) > 0.02, 'the camera moved');
    await page.getByRole('button', {name: 'Ride the camera of UAV 1'}).click();
    assert.deepEqual([(await state(page)).runs[0].follow, (await state(page)).runs[0].riding], [1, true]);
    assert.ok((await look(page)).share > 0.02, 'something is ahead');
    await page.locator('.stage canvas').focus();
    await page.keyboard.press('Escape');
    assert.equal((await state(page)).runs[0].follow, null);
    await look(page);
    const at = await page.evaluate(() => {
      const [stage] = window.stairwell.player.stages;
      return stage.project(stage.fleet.uavs[1].body.position);
    });
    await page.evaluate(() => document.querySelectorAll('.label').forEach(label => (label.style.pointerEvents = 'none')));
    await page.locator('.stage canvas').click({position: {x: at[0], y: at[1]}});
    assert.equal((await state(page)).runs[0].follow, 1, 'a click on its body');
    return page;
  },

  async 'colours and layers can be chosen'(browser, {one}) {
    const page = await open(browser, one);
    const pictures = [];
    for (const colour of ['height', 'uav', 'age', 'difference']) {
      await page.getByLabel('Colour of the voxels').selectOption(colour);
      pictures.push(await look(page));
    }
    for (let i = 1; i < 4; ++i) assert.ok(difference(pictures[i - 1], pictures[i]) > 0.02, `colouring ${i}`);
    await page.getByRole('button', {name: 'Show storey 0 alone'}).click();
    const plain = await look(page);
    await page.getByLabel('Potential').check();
    assert.ok(difference(plain, await look(page)) > 0.02, 'the potential');
    await page.getByLabel('Outer faces').check();
    assert.ok((await state(page)).runs[0].triangles > 0);
    return page;
  },

  async 'two runs side by side keep the same time'(browser, {both}) {
    const page = await open(browser, both, {viewport: {width: 1200, height: 800}});
    assert.equal((await state(page)).runs.length, 2);
    assert.ok((await look(page, 0)).share > 0.05);
    assert.ok((await look(page, 1)).share > 0.05);
    await page.getByLabel('Time', {exact: true}).fill('5');
    await look(page);
    const counts = (await state(page)).runs.map(run => run.voxels);
    const held = await page.evaluate(() => window.stairwell.player.stages.map(stage => stage.time));
    assert.deepEqual(held, [5, 5]);
    assert.ok(counts.every(count => count > 0));
    return page;
  },

  async 'a phone has room for everything, and the dark suits it'(browser, {one}) {
    const page = await open(browser, one, {viewport: {width: 360, height: 740}, colorScheme: 'dark', hasTouch: true, isMobile: true});
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(width <= 360, `the page is ${width} px wide`);
    const [r, g, b] = (await page.evaluate(() => getComputedStyle(document.body).backgroundColor)).match(/\d+/g).map(Number);
    assert.ok(r + g + b < 200);
    assert.ok((await look(page)).share > 0.05);
    return page;
  },

  async 'a damaged or truncated report says so'(browser, {one}) {
    const html = readFileSync(one, 'utf8');
    const data = html.indexOf('class="run"') + 400;
    const flipped = html[data] === 'A' ? 'B' : 'A';
    const cases = {
      'damaged.html': [html.slice(0, data) + flipped + html.slice(data + 1), /damaged/],
      'in_the_data.html': [html.slice(0, data + 500), /truncated/],
      'in_the_script.html': [html.slice(0, html.length - 3000), /truncated/],
      'in_the_tables.html': [html.slice(0, html.indexOf('<table')), /truncated/],
    };
    let page;
    for (const [name, [text, words]] of Object.entries(cases)) {
      writeFileSync(join(work, name), text);
      page = await open(browser, join(work, name));
      assert.match(await page.getByRole('alert').innerText(), words, name);
      page.troubles = page.troubles.filter(trouble => !/SyntaxError/.test(trouble));
    }
    return page;
  },
};

const files = makeReports();
const browser = await launch();
let failed = 0;
for (const [name, test] of Object.entries(tests)) {
  try {
    const page = await test(browser, files);
    assert.deepEqual(page.troubles, [], 'errors on the console, or requests');
    await page.context().close();
    console.log(`ok      ${name}`);
  } catch (error) {
    ++failed;
    console.log(`FAILED  ${name}\n${error.stack}`);
  }
}
await browser.close();
process.exit(failed ? 1 : 0);
