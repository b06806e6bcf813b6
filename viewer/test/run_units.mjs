// node --test on test/unit; exit code 77 where three.js is not installed.
import {spawnSync} from 'node:child_process';
import {existsSync, readdirSync} from 'node:fs';
import {fileURLToPath} from 'node:url';

const here = name => fileURLToPath(new URL(name, import.meta.url));
if (!existsSync(here('../node_modules/three'))) {
  console.log('skipped: three.js is not installed (npm ci --prefix viewer)');
  process.exit(77);
}
const files = readdirSync(here('unit')).map(name => here(`unit/${name}`));
process.exit(spawnSync(process.execPath, ['--test', ...files], {stdio: 'inherit'}).status ?? 1);
