// TinyUSDZ, a reader of USD that is not Pixar's, in Node.
import { copyFileSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { pathFromViewer } from './environment.mjs';

export async function startTinyUsdz() {
  Object.defineProperty(process, 'type', { value: 'renderer' });  // it takes Node for an unknown place
  globalThis.window = globalThis;
  globalThis.document = { currentScript: null };
  globalThis.location = { href: 'file:///' };
  // A module by what it holds, not by its package.json: before Node 20.19 only its name can say so.
  const module = join(mkdtempSync(join(tmpdir(), 'tinyusdz-')), 'tinyusdz.mjs');
  copyFileSync(pathFromViewer('tinyusdz/tinyusdz.js'), module);
  const start = (await import(pathToFileURL(module).href)).default;
  rmSync(dirname(module), { recursive: true });
  return start({ wasmBinary: readFileSync(pathFromViewer('tinyusdz/tinyusdz.wasm')) });
}
