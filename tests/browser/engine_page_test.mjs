// The page that makes its line again by itself: node engine_page_test.mjs SYNTH SCRATCH_FOLDER SCREENSHOT_STEM
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { launchBrowser, listen, openPage, prepareFolders, runChecks, untilFace } from './environment.mjs';

const TEXT = 'the time is now';
const NEAR_MM = 0.01;

const [synth, scratch, screenshotStem] = process.argv.slice(2);
prepareFolders(scratch, screenshotStem);

function speak(...options) {
  const run = spawnSync(synth, ['--text', TEXT, ...options], { encoding: 'utf8' });
  if (/make wasm/.test(run.stderr)) {
    console.log(`skipped: ${run.stderr.trim()}`);
    process.exit(77);
  }
  assert.equal(run.status, 0, run.stderr);
}

speak('--page-engine', '-o', join(scratch, 'view.html'), '-o', join(scratch, 'report.json'));
const { units, phones } = JSON.parse(readFileSync(join(scratch, 'report.json'), 'utf8'));

/** Every vertex of every frame as synth makes the line with these edits, and the fragments that it is made of. */
function madeBySynth(edits, name) {
  const file = (ending) => join(scratch, `${name}${ending}`);
  writeFileSync(file('.json'), JSON.stringify(edits));
  speak('--edits', file('.json'), '-o', file('.pc2'), '-o', file('.report.json'));
  const bytes = readFileSync(file('.pc2'));
  const [vertices, frames] = [bytes.readInt32LE(16), bytes.readInt32LE(28)];
  const positions = new Float32Array(bytes.buffer.slice(bytes.byteOffset + 32, bytes.byteOffset + 32 + 12 * vertices * frames));
  return { frames, width: 3 * vertices, positions, units: JSON.parse(readFileSync(file('.report.json'), 'utf8')).units };
}

const browser = await launchBrowser(['--autoplay-policy=no-user-gesture-required']);
const complaints = [];
const page = await openPage(browser, { viewport: { width: 1280, height: 1100 }, acceptDownloads: true });
listen(page, complaints);
await page.goto(pathToFileURL(resolve(join(scratch, 'view.html'))).href);
await untilFace(page);
await page.waitForFunction(() => window.mouthpiece.engine);

const edits = () => page.evaluate(() => mouthpiece.edits);
const untilMade = () => page.waitForFunction(() => mouthpiece.made?.edits === JSON.stringify(mouthpiece.edits));
const weights = (frame) => page.evaluate((at) => mouthpiece.weights(at)[0], frame);
const sources = (list) => list.map(({ first, last, take, source_first: from }) => [first, last, take, from]);

/** Farthest that a vertex of the page's line lies from synth's, in mm: the default face's unit. */
async function farthest(made) {
  let most = 0;
  for (let frame = 0; frame < made.frames; ++frame) {
    const text = await page.evaluate((at) => {
      const bytes = new Uint8Array(mouthpiece.engine.vertices(at).buffer);
      let characters = '';
      for (let i = 0; i < bytes.length; i += 8192) characters += String.fromCharCode(...bytes.subarray(i, i + 8192));
      return btoa(characters);
    }, frame);
    const own = new Float32Array(new Uint8Array(Buffer.from(text, 'base64')).buffer);
    assert.equal(own.length, made.width);
    for (let i = 0; i < made.width; i += 3) {
      const [x, y, z] = [0, 1, 2].map((axis) => own[i + axis] - made.positions[frame * made.width + i + axis]);
      most = Math.max(most, Math.hypot(x, y, z));
    }
  }
  return most;
}

/** The page's line is synth's with the same edits, where that is made of the fragments `own`. */
async function expectSame(name, own) {
  await untilMade();
  const how = await page.evaluate(() => mouthpiece.made);
  assert.equal(how.fits, true, how.warnings);
  const made = madeBySynth(await edits(), name);
  assert.deepEqual(sources(made.units), own, 'synth chose other fragments for this edit: choose one for which it does not');
  const distance = await farthest(made);
  console.log(`  ${name}: ${made.frames} frames, ${made.width / 3} vertices, at most ${distance.toFixed(6)} mm apart`);
  assert.ok(distance < NEAR_MM, `${distance} mm`);
}

const before = await Promise.all(phones.map(({ start_s: start }) => weights(Math.floor(start * 60))));

const checks = {
  async 'a border that is moved moves the face, as synth would have it'() {
    await page.locator('#edit').click();
    await page.locator('.phone').nth(5).focus();
    for (let i = 0; i < 2; ++i) await page.keyboard.press('Alt+ArrowRight');
    assert.equal((await edits())[0].kind, 'border');
    await expectSame('border', sources(units));
    const after = await Promise.all(phones.map(({ start_s: start }) => weights(Math.floor(start * 60))));
    assert.ok(after.some((each, i) => each.some((weight, k) => Math.abs(weight - before[i][k]) > 0.02)), 'the face shown moved');
    assert.match(await page.locator('#edit-state').textContent(), /has all your changes/);
    await page.screenshot({ path: `${screenshotStem}.png` });
  },

  async 'a fragment from elsewhere, likewise'() {
    await page.evaluate(() => mouthpiece.seek(1.1));
    await page.locator('#offers').waitFor();
    await page.locator('#offers').selectOption('0');
    const unit = (await edits()).find(({ kind }) => kind === 'unit');
    assert.ok(unit.take, JSON.stringify(unit));
    await untilMade();
    const made = madeBySynth(await edits(), 'unit');
    assert.ok(made.units.some(({ take }) => take === unit.take));
    await expectSame('unit_again', sources(made.units));
  },

  async 'a word waits for synth; all taken back, the face is as it was'() {
    const word = page.locator('.word', { hasText: 'now' }).last();
    const box = await word.boundingBox();
    await page.mouse.dblclick(box.x + box.width / 2, box.y + 10);
    await page.locator('.retype').fill('here');
    await page.keyboard.press('Enter');
    await untilMade();
    assert.match(await page.locator('#edit-state').textContent(), /1 change will be seen when the line is made again/);
    while ((await edits()).length > 0) await page.locator('#undo').click();
    const after = await Promise.all(phones.map(({ start_s: start }) => weights(Math.floor(start * 60))));
    assert.deepEqual(after, before);
  },

  async 'nothing was complained about'() {
    assert.deepEqual(complaints, []);
  },
};

await runChecks(checks, page, () => browser.close());
