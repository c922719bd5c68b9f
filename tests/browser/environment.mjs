// What the tests in this folder need from outside: the viewer's Node modules (MOUTHPIECE_NODE_MODULES, in the build folder)
// and a Chromium.
import { existsSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';

/// CTest's SKIP_RETURN_CODE.
export const SKIPPED = 77;

export function skip(reason) {
  console.log(`skipped: ${reason}`);
  process.exit(SKIPPED);
}

export function requireFromViewer(name) {
  const modules = process.env.MOUTHPIECE_NODE_MODULES;
  if (!modules || !existsSync(join(modules, name))) {
    skip(`the Node module ${name} is not installed (MOUTHPIECE_NODE_MODULES=${modules ?? ''}); build the target viewer_page first`);
  }
  return createRequire(join(modules, 'anchor.js'))(name);
}

/// Chromium through playwright-core, as every test here wants it.
export function launchBrowser(more = []) {
  const { chromium } = requireFromViewer('playwright-core');
  return chromium.launch({
    executablePath: findChromium(),
    headless: true,
    args: ['--no-sandbox', '--disable-dev-shm-usage', '--no-first-run', '--disable-background-networking',
      '--disable-component-update', ...more],
  });
}

function findChromium() {
  const candidates = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
  const found = candidates.find((path) => path && existsSync(path));
  if (!found) skip('no Chromium found; get it with: sudo apt-get install chromium');
  return found;
}
