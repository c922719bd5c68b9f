// How long the page's script takes for a picture of a long line: node frame_times_test.mjs VIEW.html
// The page is to have drawn a picture before the next of 60 a second is due, whatever the graphics card does meanwhile.
// Exit 0: all held; 1: something did not; 77: there is no browser here.
import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { launchBrowser, skip } from './environment.mjs';

const LIMIT_MS = 17;
const SHARE = 0.95;
const WATCHED_S = 15;
const STRETCHES = 3;
const LEAST_PICTURES = 15;

const [, , pageFile] = process.argv;
if (!pageFile) {
  console.error('usage: node frame_times_test.mjs VIEW.html');
  process.exit(2);
}
if (!existsSync(pageFile)) skip(`${pageFile} is not there`);

const browser = await launchBrowser(['--autoplay-policy=no-user-gesture-required']);
const page = await browser.newPage({ viewport: { width: 1280, height: 860 } });
await page.addInitScript(() => {
  window.frameTimes = [];
  const request = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (callback) => request((time) => {
    const begun = performance.now();
    callback(time);
    window.frameTimes.push(performance.now() - begun);
  });
});
await page.goto(pathToFileURL(resolve(pageFile)).href);
await page.waitForFunction(() => window.mouthpiece, null, { timeout: 60000 });
await page.evaluate(() => window.mouthpiece.ready);
const { duration, shapes } = await page.evaluate(() => ({ duration: mouthpiece.duration, shapes: mouthpiece.shapeCount }));
assert.ok(duration >= 55, `a line of ${duration.toFixed(1)} s is not long`);

const at = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
/** Times of the pictures while the line plays from `start`. */
async function timesFrom(start) {
  await page.evaluate((time) => { mouthpiece.seek(time); window.frameTimes.length = 0; return mouthpiece.play(); }, start);
  await page.waitForTimeout(1000 * WATCHED_S);
  return page.evaluate(() => { mouthpiece.pause(); return [...window.frameTimes].sort((a, b) => a - b); });
}

// Other work on the machine makes times longer, never shorter: the best stretch tells what the page needs.
let best;
for (let i = 0; i < STRETCHES && !(best?.length >= LEAST_PICTURES && at(best, SHARE) < LIMIT_MS); ++i) {
  const times = await timesFrom(i * (duration / STRETCHES));
  console.log(`${times.length} pictures, script in ms: median ${at(times, 0.5).toFixed(1)}, 95 % ${at(times, SHARE).toFixed(1)}, worst ${times.at(-1).toFixed(1)} (${shapes} shapes, ${duration.toFixed(0)} s)`);
  if (!best || at(times, SHARE) < at(best, SHARE)) best = times;
}
await browser.close();
assert.ok(best.length >= LEAST_PICTURES, `only ${best.length} pictures in ${WATCHED_S} s`);
assert.ok(at(best, SHARE) < LIMIT_MS, `95 % of the pictures within ${at(best, SHARE).toFixed(1)} ms; expected ${LIMIT_MS}`);
