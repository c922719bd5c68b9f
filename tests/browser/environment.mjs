// What the tests in this folder need from outside: the viewer's Node modules (MOUTHPIECE_NODE_MODULES, in the build folder)
// and a Chromium.
import { spawn } from 'node:child_process';
import { existsSync, mkdirSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';

/// CTest's SKIP_RETURN_CODE.
export const SKIPPED = 77;

export function skip(reason) {
  console.log(`skipped: ${reason}`);
  process.exit(SKIPPED);
}

/// A file or module of the viewer's.
export function pathFromViewer(path) {
  const modules = process.env.MOUTHPIECE_NODE_MODULES;
  if (!modules || !existsSync(join(modules, path))) {
    skip(`the Node module ${path} is not installed (MOUTHPIECE_NODE_MODULES=${modules ?? ''}); build the target viewer_page first`);
  }
  return join(modules, path);
}

export const requireFromViewer = (name) => createRequire(join(dirname(pathFromViewer(name)), 'anchor.js'))(name);

/// Chromium through playwright-core, as every test here wants it.
export function launchBrowser(more = []) {
  const { chromium } = requireFromViewer('playwright-core');
  return chromium.launch({
    executablePath: findChromium(),
    headless: true,
    // No graphics card draws here: four samples a pixel would take a third of a test's time.
    args: ['--webgl-antialiasing-mode=none', '--no-sandbox', '--disable-dev-shm-usage', '--no-first-run', '--disable-background-networking',
      '--disable-component-update', ...more],
  });
}

/// A page at half the resolution: without a graphics card most of a test's time goes into pixels.
export const openPage = (browser, options) => browser.newPage({ deviceScaleFactor: 0.5, colorScheme: 'light', ...options });

/// Two pictures later: what was asked for is laid out and drawn.
export const drawn = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

function findChromium() {
  const candidates = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
  const found = candidates.find((path) => path && existsSync(path));
  if (!found) skip('no Chromium found; get it with: sudo apt-get install chromium');
  return found;
}

/// The scratch folder, emptied, and the folder of the screenshots: made.
export function prepareFolders(scratch, screenshotStem) {
  rmSync(scratch, { recursive: true, force: true });
  mkdirSync(scratch, { recursive: true });
  mkdirSync(dirname(resolve(screenshotStem)), { recursive: true });
}

/// What a page says on its console as an error, and throws, is pushed to `complaints`, but for what matches `expected`.
export function listen(page, complaints, expected = /^(?!)/) {
  page.on('console', (message) => message.type() === 'error' && !expected.test(message.text()) && complaints.push(message.text()));
  page.on('pageerror', (error) => complaints.push(error.message));
}

/// The page of a line, or a frame that shows one, is ready: its face is there.
export async function untilFace(page) {
  await page.waitForFunction(() => window.mouthpiece, null, { timeout: 60000, polling: 100 });
  await page.evaluate(() => window.mouthpiece.ready);
}

// A server that a failed test leaves would hold CTest's pipe until its time is over, so all end with the process.
const children = new Set();
process.on('exit', () => children.forEach((child) => child.kill('SIGKILL')));

/// Starts a program that serves a page; resolves with its process and the address that it prints.
export function startServer(program, args) {
  const child = spawn(program, args, { stdio: ['ignore', 'pipe', 'inherit'] });
  children.add(child);
  return new Promise((done, fail) => {
    let said = '';
    child.stdout.on('data', (bytes) => {
      said += bytes;
      const address = said.match(/http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]+/)?.[0];
      if (address) done({ child, address });
    });
    child.on('exit', (status, signal) => fail(new Error(`${program} ${args[0]} ended (${status ?? signal}): ${said}`)));
  });
}

/// Ends it; resolves with its status, or with the signal that it did not outlive.
export function endServer({ child }, signal = 'SIGINT') {
  child.removeAllListeners('exit');
  return new Promise((done) => {
    child.on('exit', (status, by) => done(by ?? status));
    child.kill(signal);
  });
}

/// Runs the checks one after another, each with `subject`, says what became of each, and sets the exit status. `close`
/// is called at the end, whatever happened.
export async function runChecks(checks, subject, close) {
  let failed = 0;
  try {
    for (const [name, check] of Object.entries(checks)) {
      const begun = performance.now();
      try {
        await check(subject);
        console.log(`ok      ${name} (${((performance.now() - begun) / 1000).toFixed(1)} s)`);
      } catch (error) {
        failed += 1;
        console.log(`FAILED  ${name}\n        ${error.message}`);
      }
    }
  } finally {
    await close();
  }
  process.exitCode = failed === 0 ? 0 : 1;
}

/// No window from a phone's to a wide screen's has to be scrolled sideways. Leaves the narrowest.
export async function expectFits(page, narrowest = 420) {
  for (const width of [1360, 1024, 900, 768, 641, 600, narrowest]) {
    await page.setViewportSize({ width, height: 860 });
    await drawn(page);
    const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    if (overflow > 0) throw new Error(`${overflow} pixels too wide at ${width}`);
  }
}
