// Editing on the page: node edit_page_test.mjs VIEW.html SYNTH SCRATCH_FOLDER SCREENSHOT_STEM
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { expectFits, launchBrowser, listen, openPage, prepareFolders, runChecks, untilFace } from './environment.mjs';

const [pageFile, synth, scratch, screenshotStem] = process.argv.slice(2);
prepareFolders(scratch, screenshotStem);

const browser = await launchBrowser(['--autoplay-policy=no-user-gesture-required']);
const complaints = [];
const page = await openPage(browser, { viewport: { width: 1280, height: 1100 }, acceptDownloads: true });
listen(page, complaints);
await page.goto(pathToFileURL(resolve(pageFile)).href);
await untilFace(page);

const edits = () => page.evaluate(() => window.mouthpiece.edits);
/** A point of a track: share of its width, and of its height from the top. */
const pointOf = async (label, x, y) => {
  const row = page.locator('.edit-track', { has: page.locator('.edit-label', { hasText: new RegExp(`^${label}`) }) });
  await row.scrollIntoViewIfNeeded();
  const box = await row.locator('canvas').boundingBox();
  return [box.x + x * box.width, box.y + y * box.height];
};
const middle = await page.evaluate(() => Math.floor(mouthpiece.frameCount / 2));
const own = await page.evaluate(() => mouthpiece.weights(Math.floor(mouthpiece.frameCount / 2))[0]);

const checks = {
  async 'Edit opens the tracks, E closes them'() {
    await page.locator('#edit').click();
    await page.locator('.edit-track').first().waitFor();
    assert.ok((await page.locator('.edit-track').count()) >= 4);
    await page.locator('#view').focus();
    await page.keyboard.press('e');
    assert.equal(await page.locator('#editor').isVisible(), false);
    await page.keyboard.press('e');
    await page.screenshot({ path: `${screenshotStem}_open.png` });
  },

  async 'a key on Strength is seen on the face at once, and undone'() {
    const [x, y] = await pointOf('Strength', 0.5, 0.25);
    await page.mouse.dblclick(x, y);
    const [edit] = await edits();
    assert.equal(edit.kind, 'dial');
    assert.equal(edit.dial, 'strength');
    assert.ok(edit.keys[0].value > 1.4, JSON.stringify(edit));
    const now = await page.evaluate((at) => mouthpiece.weights(at)[0], middle);
    now.forEach((weight, k) => assert.ok(Math.abs(weight - edit.keys[0].value * own[k]) < 1e-4, `${k}: ${weight}, ${own[k]}`));
    await page.locator('#undo').click();
    assert.deepEqual(await edits(), []);
    assert.ok(Math.abs((await page.evaluate((at) => mouthpiece.weights(at)[0], middle))[0] - own[0]) < 1e-6);
    await page.keyboard.press('Control+y');
    assert.equal((await edits()).length, 1);
  },

  async 'a key is dragged, and moved by the keyboard'() {
    const [{ keys: [key] }] = await edits();
    const duration = await page.evaluate(() => mouthpiece.duration);
    const [x] = await pointOf('Strength', key.time_s / duration, 0);
    const [, top] = await pointOf('Strength', 0, 0);
    const y = top + 62 - 8 - (key.value / 2) * (62 - 16);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 60, y + 12, { steps: 5 });
    await page.mouse.up();
    const [{ keys: [moved] }] = await edits();
    assert.ok(moved.time_s > key.time_s + 0.02 && moved.value < key.value, JSON.stringify([key, moved]));
    await page.keyboard.press('Control+z');
    assert.equal((await edits())[0].keys[0].time_s, key.time_s, 'a drag is one step back');
    await page.keyboard.press('Control+y');
    await page.locator('.edit-track canvas').first().focus();
    await page.keyboard.press('ArrowUp');
    assert.ok((await edits())[0].keys[0].value > moved.value);
    await page.keyboard.press('Delete');
    assert.deepEqual(await edits(), []);
    const [sx, sy] = await pointOf('Strength', 0.5, 0.3);
    await page.mouse.dblclick(sx, sy);
  },

  async 'hold, lead and smoothing are seen at once'() {
    for (const [label, y] of [['Hold', 0.2], ['Lead', 0.2], ['Smoothing', 0.4]]) {
      const before = await page.evaluate(() => mouthpiece.weights(Math.floor(0.6 * mouthpiece.frameCount))[0]);
      await page.mouse.dblclick(...(await pointOf(label, 0.5, y)));
      const after = await page.evaluate(() => mouthpiece.weights(Math.floor(0.6 * mouthpiece.frameCount))[0]);
      assert.ok(after.some((weight, k) => Math.abs(weight - before[k]) > 1e-4), label);
    }
  },

  async 'a curve gets a key, and the face follows'() {
    const name = await page.locator('.edit-track .edit-label').last().textContent();
    const before = await page.evaluate(() => JSON.stringify(mouthpiece.weights(Math.floor(0.45 * mouthpiece.frameCount))[0]));
    await page.mouse.dblclick(...(await pointOf(name, 0.45, 0.15)));
    const list = await edits();
    assert.equal(list[list.length - 1].curve, name);
    assert.notEqual(await page.evaluate(() => JSON.stringify(mouthpiece.weights(Math.floor(0.45 * mouthpiece.frameCount))[0])), before);
  },

  async 'a border between phones is dragged'() {
    const grip = page.locator('.border').nth(3);
    const box = await grip.boundingBox();
    await page.mouse.move(box.x + 4, box.y + 15);
    await page.mouse.down();
    await page.mouse.move(box.x + 14, box.y + 15, { steps: 4 });
    await page.mouse.up();
    const border = (await edits()).find(({ kind }) => kind === 'border');
    assert.ok(border.to_s > border.at_s, JSON.stringify(border));
    await page.locator('.phone').nth(6).focus();
    await page.keyboard.press('Alt+ArrowLeft');
    assert.equal((await edits()).filter(({ kind }) => kind === 'border').length, 2);
  },

  async 'a word is retyped'() {
    const word = page.locator('.word', { hasText: 'now' }).last();
    const box = await word.boundingBox();
    await page.mouse.dblclick(box.x + box.width / 2, box.y + 10);
    await page.locator('.retype').fill('here');
    await page.keyboard.press('Enter');
    assert.deepEqual((await edits()).find(({ kind }) => kind === 'word'), { kind: 'word', word: 'now', number: 0, to: 'here' });
    assert.match(await page.locator('#edit-state').textContent(), /made again/);
  },

  async 'a unit is taken from elsewhere, a stretch is drawn with curves'() {
    await page.evaluate(() => mouthpiece.seek(0.3));
    await page.locator('#offers').waitFor();
    await page.locator('#offers').selectOption('0');
    const unit = (await edits()).find(({ kind }) => kind === 'unit');
    assert.ok(unit.take && unit.phones.length >= 2, JSON.stringify(unit));
    let offered = 0;
    for (const phone of await page.locator('.phone').all()) {
      await phone.click();
      const name = (await phone.textContent()).trim() || 'sil';
      const offers = (await page.locator('#offers option').allTextContents()).slice(1);
      for (const offer of offers) assert.ok(offer.split(', ')[1].split(' (')[0].split(' ').includes(name), `${name} is not in "${offer}"`);
      offered += offers.length > 0 ? 1 : 0;
    }
    assert.ok(offered > 2, `${offered} phones have offers`);
    await page.evaluate(() => mouthpiece.seek(0.3));
    await page.locator('#offers').waitFor();
    await page.locator('#edit-unit button', { hasText: 'curves' }).click();
    assert.ok((await edits()).some(({ kind }) => kind === 'curves'));
    await page.locator('#undo').click();
  },

  async 'the edits are saved, and synth makes the line with them'() {
    await page.screenshot({ path: `${screenshotStem}.png`, fullPage: true });
    const [download] = await Promise.all([page.waitForEvent('download'), page.locator('#save-edits').click()]);
    assert.equal(download.suggestedFilename(), 'edits.json');
    const text = readFileSync(await download.path(), 'utf8');
    assert.deepEqual(JSON.parse(text), await edits());
    const file = join(scratch, 'edits.json');
    writeFileSync(file, text);
    const run = spawnSync(synth, ['--text', 'the time is now', '--edits', file, '--out', join(scratch, 'out')], { encoding: 'utf8' });
    assert.equal(run.status, 0, run.stderr);
    const report = JSON.parse(readFileSync(join(scratch, 'out', 'report.json'), 'utf8'));
    assert.equal(report.text, 'the time is here');
    assert.equal(report.settings.strength !== undefined, true);
    await page.goto(pathToFileURL(resolve(join(scratch, 'out', 'view.html'))).href);
    await page.waitForFunction(() => window.mouthpiece);
    await page.evaluate(() => window.mouthpiece.ready);
    assert.deepEqual(await edits(), JSON.parse(text), 'the page knows the edits that it was made with');
  },

  async 'dark and narrow it fits, too'() {
    await page.locator('#edit').click();
    await page.emulateMedia({ colorScheme: 'dark' });
    await expectFits(page);
    await page.screenshot({ path: `${screenshotStem}_narrow.png`, fullPage: true });
  },

  async 'nothing was complained about'() {
    assert.deepEqual(complaints, []);
  },
};

await runChecks(checks, page, () => browser.close());
