// Opens view.html from disk in headless Chromium, as a user does: node view_page_test.mjs VIEW.html SCREENSHOT_STEM
// Exit 0: all held; 1: something did not; 77: there is no browser here.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync } from 'node:fs';
import { dirname, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { drawn, expectFits, launchBrowser, listen, openPage, runChecks, skip, untilFace } from './environment.mjs';

const [, , pageFile, screenshotStem] = process.argv;
if (!pageFile || !screenshotStem) {
  console.error('usage: node view_page_test.mjs VIEW.html SCREENSHOT_STEM');
  process.exit(2);
}
if (!existsSync(pageFile)) skip(`${pageFile} is not there`);

const browser = await launchBrowser(['--autoplay-policy=no-user-gesture-required']);

const complaints = [];
const requests = [];

async function openLine() {
  const page = await openPage(browser, { viewport: { width: 1280, height: 860 } });
  listen(page, complaints);
  page.on('dialog', (dialog) => { complaints.push(`dialog: ${dialog.message()}`); dialog.dismiss(); });
  page.on('request', (request) => requests.push(request.url()));
  await page.goto(pathToFileURL(resolve(pageFile)).href);
  await untilFace(page);
  return page;
}

/** Lip opening of the displayed face, frame by frame. */
function shownOpenings(page) {
  return page.evaluate(() => {
    const { mouthpiece } = window;
    return Array.from({ length: mouthpiece.frameCount }, (_, frame) => {
      mouthpiece.seek((frame + 1e-4) / mouthpiece.report.fps);
      return mouthpiece.lipOpening();
    });
  });
}

/** The lip opening that was planned: distance of the retargeted lip markers, frame by frame, in mm. */
function plannedOpenings(page) {
  return page.evaluate(() => {
    const { control } = JSON.parse(document.getElementById('mouthpiece-data').textContent);
    const bytes = Uint8Array.from(atob(control.positions_m), (letter) => letter.charCodeAt(0));
    const positions = new Float32Array(bytes.buffer);
    const [upper, lower] = ['LIP_UP_MID', 'LIP_LO_MID'].map((name) => control.names.indexOf(name));
    return Array.from({ length: control.frames }, (_, frame) => {
      const at = (point, axis) => positions[3 * (frame * control.count + point) + axis];
      return 1000 * Math.hypot(...[0, 1, 2].map((axis) => at(upper, axis) - at(lower, axis)));
    });
  });
}

function correlation(a, b) {
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const [meanA, meanB] = [mean(a), mean(b)];
  const product = (x, y, meanX, meanY) => x.reduce((sum, value, i) => sum + (value - meanX) * (y[i] - meanY), 0);
  return product(a, b, meanA, meanB) / Math.sqrt(product(a, a, meanA, meanA) * product(b, b, meanB, meanB));
}

/** A small picture of the view, to see whether it changed. */
const viewPicture = (page) => page.locator('#view').screenshot().then((png) => png.toString('base64'));

const checks = {
  async 'opens from disk and fetches nothing'(page) {
    const outside = requests.filter((url) => !/^(file|blob|data):/.test(url));
    assert.deepEqual(outside, []);
    const facts = await page.evaluate(() => ({ frames: mouthpiece.frameCount, shapes: mouthpiece.shapeCount, duration: mouthpiece.duration, title: document.title }));
    assert.ok(facts.frames > 1 && facts.shapes > 0, JSON.stringify(facts));
    assert.match(facts.title, /Mouthpiece$/);
  },

  async 'tells the share of back-off as the report does'(page) {
    const { told, share } = await page.evaluate(() => ({
      told: [...document.querySelectorAll('#facts .fact')].find((fact) => fact.textContent.startsWith('back-off')).textContent,
      share: mouthpiece.report.backoff_share,
    }));
    const expected = share > 0 ? `${(100 * share).toFixed(0)} % of phone pairs` : 'none';
    assert.equal(told, `back-off${expected}`);
  },

  async 'text from outside stays text'(page) {
    const found = await page.evaluate(() => ({
      images: document.images.length,
      scripts: document.scripts.length,
      heading: document.getElementById('text').textContent === mouthpiece.report.text,
      words: [...document.querySelectorAll('.word')].every((word) => word.children.length === 0),
    }));
    assert.deepEqual(found, { images: 0, scripts: 4, heading: true, words: true });
  },

  async 'shows every phone, word and join'(page) {
    const found = await page.evaluate(() => ({
      phones: document.querySelectorAll('.phone').length === mouthpiece.report.phones.length,
      joins: document.querySelectorAll('.join').length === mouthpiece.report.joins.length,
      backoff: document.querySelectorAll('.phone.backoff').length === mouthpiece.report.phones.filter((phone) => phone.from === 'backoff').length,
      takes: document.querySelectorAll('.take').length === new Set(mouthpiece.report.units.map((unit) => unit.take)).size,
      words: document.querySelectorAll('.word').length > 0,
    }));
    assert.deepEqual(found, { phones: true, joins: true, backoff: true, takes: true, words: true });
  },

  async 'the displayed mouth moves as planned'(page) {
    const [shown, planned] = [await shownOpenings(page), await plannedOpenings(page)];
    assert.equal(shown.length, planned.length);
    const r = correlation(shown, planned);
    const range = Math.max(...shown) - Math.min(...shown);
    console.log(`  lips: ${range.toFixed(1)} mm of movement, correlation with the plan ${r.toFixed(4)}`);
    assert.ok(range > 1, `the lips move by ${range} mm`);
    assert.ok(r > 0.97, `correlation ${r}`);
  },

  async 'plays in step with its sound'(page) {
    // Small and slow: this machine may have no graphics card and be busy.
    await page.setViewportSize({ width: 480, height: 620 });
    const playAt = (speed) => page.evaluate(async (rate) => {
      const { mouthpiece } = window;
      mouthpiece.seek(0);
      mouthpiece.setSpeed(rate);
      await mouthpiece.play();
      const started = performance.now();
      const seen = [];
      while (mouthpiece.playing && performance.now() - started < (1000 / rate) * mouthpiece.duration + 15000) {
        await new Promise(requestAnimationFrame);
        seen.push({ wall: (performance.now() - started) / 1000, time: mouthpiece.shownTime, lips: mouthpiece.lipOpening() });
      }
      const shown = document.getElementById('speed').value;
      mouthpiece.setSpeed(1);
      return { shown, seen, ended: !mouthpiece.playing };
    }, speed);
    let samples = await playAt(0.25);
    assert.equal(samples.shown, '0.25', 'the menu shows the speed');
    // Drawn by a busy processor a picture may take a second: slower then, so that there are enough of them.
    if (samples.seen.length < 12) samples = await playAt(0.1);
    await page.setViewportSize({ width: 1280, height: 860 });
    assert.ok(samples.ended, 'it plays to its end');
    assert.ok(samples.seen.length > 5, `${samples.seen.length} pictures`);
    const times = samples.seen.map(({ time }) => time);
    assert.ok(times.every((time, i) => i === 0 || time >= times[i - 1] - 1e-3), 'time runs forward');
    const planned = await plannedOpenings(page);
    const fps = await page.evaluate(() => mouthpiece.report.fps);
    const due = samples.seen.map(({ time }) => planned[Math.min(Math.round(time * fps), planned.length - 1)]);
    const r = correlation(samples.seen.map(({ lips }) => lips), due);
    console.log(`  ${samples.seen.length} pictures while it played, correlation with what was due ${r.toFixed(4)}`);
    assert.ok(r > 0.95, `correlation ${r}`);
  },

  async 'scrubbing, keys and a click on the timeline go there'(page) {
    const duration = await page.evaluate(() => mouthpiece.duration);
    await page.evaluate(() => mouthpiece.pause());
    await page.locator('#scrub').fill(String(Number((duration / 2).toFixed(3))));
    assert.ok(Math.abs((await page.evaluate(() => mouthpiece.time)) - duration / 2) < 0.01);
    await page.locator('#view').focus();
    await page.keyboard.press('ArrowLeft');
    assert.ok(Math.abs((await page.evaluate(() => mouthpiece.time)) - (duration / 2 - 0.1)) < 0.01);
    await page.keyboard.press('Home');
    assert.equal(await page.evaluate(() => mouthpiece.time), 0);
    const box = await page.locator('#track').boundingBox();
    const scroller = await page.locator('#scroller').boundingBox();
    const x = Math.min(box.x + box.width / 4, scroller.x + scroller.width - 5);
    await page.mouse.click(x, box.y + 40);
    assert.ok(Math.abs((await page.evaluate(() => mouthpiece.time)) - ((x - box.x) / box.width) * duration) < 0.03);
    await page.locator('#loop').click(); // a slow machine must not come to the line's end between two keys
    await page.locator('#view').focus();
    await page.keyboard.press(' ');
    assert.equal(await page.evaluate(() => mouthpiece.playing), true);
    await page.keyboard.press(' ');
    assert.equal(await page.evaluate(() => mouthpiece.playing), false);
    // Between its end and its beginning a line that loops does not stand: a key that is to pause it would start it there.
    const stops = await page.evaluate(async () => {
      mouthpiece.seek(mouthpiece.duration - 0.1);
      await mouthpiece.play();
      let count = 0;
      const button = document.getElementById('play');
      new MutationObserver(() => { count += button.getAttribute('aria-label') === 'Play' ? 1 : 0; }).observe(button, { attributeFilter: ['aria-label'] });
      while (mouthpiece.time > mouthpiece.duration / 2) await new Promise((done) => setTimeout(done, 20));
      return count;
    });
    assert.equal(stops, 0);
    await page.evaluate(() => mouthpiece.pause());
    await page.locator('#loop').click();
    // Stopped before its first sound: not an error (the browser rejects the start then).
    await page.evaluate(() => {
      mouthpiece.play();
      mouthpiece.pause();
    });
    await page.locator('#speed').selectOption('0.5');
    assert.equal(await page.evaluate(() => document.querySelector('#speed').value), '0.5');
    await page.locator('#speed').selectOption('1');
  },

  async 'wireframe, markers and turning change the picture'(page) {
    await page.setViewportSize({ width: 700, height: 620 });  // lines are slow to draw without a graphics card
    await drawn(page);
    let before = await viewPicture(page);
    for (const id of ['wireframe', 'markers']) {
      await page.locator(`#${id}`).click();
      await drawn(page);
      assert.equal(await page.locator(`#${id}`).getAttribute('aria-pressed'), 'true');
      const after = await viewPicture(page);
      assert.notEqual(after, before, id);
      before = after;
    }
    await page.screenshot({ path: `${screenshotStem}_wireframe_markers.png` });
    for (const id of ['wireframe', 'markers']) await page.locator(`#${id}`).click();
    const view = await page.locator('#view').boundingBox();
    await page.mouse.move(view.x + view.width / 2, view.y + view.height / 2);
    await page.mouse.down();
    await page.mouse.move(view.x + view.width / 2 + 120, view.y + view.height / 2, { steps: 4 });
    await page.mouse.up();
    await drawn(page);
    assert.notEqual(await viewPicture(page), before, 'turning');
    await page.locator('#reset-view').click();
    await page.setViewportSize({ width: 1280, height: 860 });
  },

  async 'parts are hidden and shown by keys'(page) {
    await page.locator('#view').focus();
    await page.keyboard.press('p');
    assert.equal(await page.locator('#parts').getAttribute('aria-expanded'), 'true');
    const names = (await page.locator('#part-list label').allTextContents()).map((name) => name.trim());
    assert.ok(names.length > 1 && new Set(names).size === names.length && names.every(Boolean), JSON.stringify(names));
    await drawn(page);
    const whole = await viewPicture(page);
    await page.locator('#part-list input').first().focus();
    await page.keyboard.press(' ');
    await drawn(page);
    assert.equal(await page.locator('#part-list input').first().isChecked(), false);
    assert.equal(await page.evaluate(() => mouthpiece.playing), false, 'the box takes the space bar');
    assert.notEqual(await viewPicture(page), whole, 'the first part is hidden');
    await page.screenshot({ path: `${screenshotStem}_parts.png` });
    await page.keyboard.press(' ');
    await drawn(page);
    assert.equal(await page.locator('#part-list input').first().isChecked(), true);
    await page.keyboard.press('Escape');
    assert.equal(await page.locator('#part-list').isVisible(), false);
    assert.equal(await page.evaluate(() => document.activeElement.id), 'parts');
  },

  async 'phones are reached and told by keys'(page) {
    await page.evaluate(() => mouthpiece.seek(0));
    const at = () => page.evaluate(() => {
      const focused = document.activeElement;
      return { phone: Number(focused.dataset.phone), label: focused.getAttribute('aria-label'), time: mouthpiece.time, stops: document.querySelectorAll('.phone[tabindex="0"]').length };
    });
    await page.locator('.phone[tabindex="0"]').focus();
    await page.keyboard.press('ArrowRight');
    await drawn(page);
    const { second, last } = await page.evaluate(() => ({ second: mouthpiece.report.phones[1], last: mouthpiece.report.phones.length - 1 }));
    const found = await at();
    assert.equal(found.phone, 1);
    assert.equal(found.stops, 1);
    assert.ok(found.label.startsWith(second.phone) && found.label.includes(second.start_s.toFixed(2)), found.label);
    assert.ok(found.time > second.start_s && found.time < second.end_s, `${found.time}`);
    await page.keyboard.press('End');
    await drawn(page);
    assert.equal((await at()).phone, last);
    await page.keyboard.press('ArrowRight');
    assert.equal((await at()).phone, last);
  },

  async 'the timeline is zoomed about the playhead'(page) {
    const size = () => page.evaluate(() => {
      const scroller = document.getElementById('scroller');
      const playhead = document.getElementById('playhead').getBoundingClientRect();
      return { track: document.getElementById('track').clientWidth, scroller: scroller.clientWidth, curves: document.getElementById('curves').clientWidth, playhead: playhead.left - scroller.getBoundingClientRect().left };
    });
    await page.evaluate(() => mouthpiece.seek(mouthpiece.duration / 2));
    await page.locator('#zoom-fit').click();
    await drawn(page);
    const whole = await size();
    assert.equal(whole.track, whole.scroller);
    for (let i = 0; i < 4; ++i) await page.locator('#zoom-in').click();
    await drawn(page);
    const near = await size();
    assert.ok(near.track > 2 * whole.track, JSON.stringify(near));
    assert.ok(Math.abs(near.playhead - whole.playhead) < 8, `${whole.playhead} to ${near.playhead}`);
    assert.equal(near.curves, near.scroller);
    await page.locator('#view').focus();
    for (let i = 0; i < 9; ++i) await page.keyboard.press('-');
    assert.equal((await size()).track, whole.scroller);
  },

  async 'doubts are told, the clock is not read aloud, the volume turns'(page) {
    const found = await page.evaluate(() => {
      const volume = document.getElementById('volume');
      volume.value = 0.25;
      volume.dispatchEvent(new Event('input'));
      const doubts = document.getElementById('doubts');
      return {
        told: [...doubts.querySelectorAll('li')].map((item) => item.textContent), hidden: doubts.hidden, warnings: mouthpiece.report.warnings ?? [],
        live: document.getElementById('clock').getAttribute('aria-live'), volume: mouthpiece.volume, least: Math.min(...mouthpiece.openings),
      };
    });
    assert.deepEqual(found.told, found.warnings);
    assert.equal(found.hidden, found.warnings.length === 0);
    assert.equal(found.live, 'off');
    assert.equal(found.volume, 0.25);
    assert.equal(found.least, 0, 'millimetres between the lips, not between markers');
  },

  async 'a phone tells where it came from'(page) {
    await page.locator('.phone').nth(1).hover();
    const text = await page.locator('#tooltip').textContent();
    const take = await page.evaluate(() => mouthpiece.report.units[0].take);
    assert.ok(text.includes(take) && text.includes('cost'), text);
    await page.mouse.move(5, 5);
  },

  async 'looks right at its widest mouth, light and dark, wide and narrow'(page) {
    const shown = await shownOpenings(page);
    const widest = shown.indexOf(Math.max(...shown));
    await page.evaluate((frame) => mouthpiece.seek(frame / mouthpiece.report.fps), widest);
    await page.waitForTimeout(1200);  // what stands still is drawn at its best
    await page.screenshot({ path: `${screenshotStem}.png` });
    await page.emulateMedia({ colorScheme: 'dark' });
    await drawn(page);
    await page.screenshot({ path: `${screenshotStem}_dark.png` });
    await expectFits(page);
    await page.screenshot({ path: `${screenshotStem}_narrow.png` });
  },

  async 'nothing was complained about'() {
    assert.deepEqual(complaints, []);
  },
};

mkdirSync(dirname(resolve(screenshotStem)), { recursive: true });
await runChecks(checks, await openLine(), () => browser.close());
