// Bundles src/main.js into dist/viewer.js. With --check: says whether the committed bundle is what the sources give.
import {readFile, writeFile} from 'node:fs/promises';

const {build} = await import('esbuild').catch(() => {
  console.log('skipped: esbuild is not installed (npm ci --prefix viewer)');
  process.exit(77);
});

const banner = `/*! Stairwell's replay. Copyright the Stairwell authors, Apache-2.0. Holds three.js, copyright 2010-2026 three.js authors, MIT:
Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated documentation files (the
"Software"), to deal in the Software without restriction, including without limitation the rights to use, copy, modify, merge, publish,
distribute, sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is furnished to do so, subject to
the following conditions: The above copyright notice and this permission notice shall be included in all copies or substantial portions of
the Software. THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE
WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE
LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION
WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE. */`;

const here = name => new URL(name, import.meta.url);
const result = await build({
  entryPoints: [here('src/main.js').pathname],
  bundle: true,
  minify: true,
  format: 'iife',
  target: ['es2022'],
  charset: 'ascii',
  legalComments: 'none',
  banner: {js: banner},
  write: false,
});
const bundle = result.outputFiles[0].text;
if (/<\/script|<!--|\)stairwell"/i.test(bundle)) throw new Error('the bundle cannot stand inside a page');
const target = here('dist/viewer.js');
if (process.argv.includes('--check')) {
  const committed = await readFile(target, 'utf8').catch(() => '');
  if (committed !== bundle) {
    console.error('viewer/dist/viewer.js is not what viewer/src gives: run  npm --prefix viewer run build');
    process.exit(1);
  }
  console.log('viewer/dist/viewer.js is up to date');
} else {
  await writeFile(target, bundle);
  console.log(`viewer/dist/viewer.js: ${(bundle.length / 1024).toFixed(0)} KiB`);
}
