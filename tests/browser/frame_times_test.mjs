// How long the page's script takes for a picture of a long line: node frame_times_test.mjs VIEW.html
// The page is to have drawn a picture before the next of 60 a second is due, whatever the graphics card does meanwhile.
// A machine that others keep busy is too slow for that at times: there a picture may take as long as four passes over
// 8 MB of numbers beside it.
// Exit 0: all held; 1: something did not; 77: there is no browser here.
import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { launchBrowser, skip } from './environment.mjs';

const LIMIT_MS = 17;
const LIMIT_LOOPS = 4;
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
  window.loopTimes = [];
  const numbers = new Float32Array(1 << 21).fill(1);
  const loop = () => {
    for (let i = 0; i < numbers.length; ++i) numbers[i] = numbers[i] * 0.999 + 0.001;
  };
  const request = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (callback) => request((time) => {
    const begun = performance.now();
    callback(time);
    const done = performance.now();
    window.frameTimes.push(done - begun);
    loop();
    window.loopTimes.push(performance.now() - done);
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
  await page.evaluate((time) => { mouthpiece.seek(time); window.frameTimes.length = window.loopTimes.length = 0; return mouthpiece.play(); }, start);
  await page.waitForTimeout(1000 * WATCHED_S);
  return page.evaluate(() => {
    mouthpiece.pause();
    const sorted = (times) => [...times].sort((one, other) => one - other);
    return { pictures: sorted(window.frameTimes), loops: sorted(window.loopTimes) };
  });
}

// Other work on the machine makes times longer, never shorter: the best stretch tells what the page needs.
const shareOf = ({ pictures, loops }) =>
  at(pictures, SHARE) / Math.max(LIMIT_MS, LIMIT_LOOPS * at(loops, SHARE));
let best;
for (let i = 0; i < STRETCHES && !(best?.pictures.length >= LEAST_PICTURES && shareOf(best) < 1); ++i) {
  const times = await timesFrom(i * (duration / STRETCHES));
  const [pictures, loops] = [times.pictures, times.loops].map((all) => [0.5, SHARE, 1].map((share) => at(all, share).toFixed(1)));
  console.log(`${times.pictures.length} pictures, script in ms: median ${pictures[0]}, 95 % ${pictures[1]}, worst ${pictures[2]}; the loop ${loops.join(', ')} (${shapes} shapes, ${duration.toFixed(0)} s)`);
  if (!best || shareOf(times) < shareOf(best)) best = times;
}
await browser.close();
assert.ok(best.pictures.length >= LEAST_PICTURES, `only ${best.pictures.length} pictures in ${WATCHED_S} s`);
assert.ok(shareOf(best) < 1, `95 % of the pictures within ${at(best.pictures, SHARE).toFixed(1)} ms, of the loop within ${at(best.loops, SHARE).toFixed(1)}; expected ${LIMIT_MS} ms, or ${LIMIT_LOOPS} loops`);
