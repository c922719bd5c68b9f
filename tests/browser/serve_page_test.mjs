// `synth serve` as a user meets it: node serve_page_test.mjs SYNTH SCRATCH_FOLDER SCREENSHOT_STEM
import assert from 'node:assert/strict';
import { existsSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { endServer, expectFits, launchBrowser, listen, openPage, prepareFolders, runChecks, startServer, untilFace } from './environment.mjs';

const [synth, scratch, screenshotStem] = process.argv.slice(2);
prepareFolders(scratch, screenshotStem);
const out = join(resolve(scratch), 'lines');

const serve = () => startServer(synth, ['serve', '--out', out]);
let server = await serve();
const browser = await launchBrowser(['--autoplay-policy=no-user-gesture-required']);
const complaints = [];
const requests = [];

async function openDesk() {
  const page = await openPage(browser, { viewport: { width: 1360, height: 880 } });
  listen(page, complaints, /status of 400/);
  page.on('request', (request) => requests.push(request.url()));
  await page.goto(server.address);
  await page.waitForFunction(() => document.querySelectorAll('#voice option').length > 0);
  return page;
}

/// Vertices of the default head: the tracker's landmarks.
const TEN_PLACES = {
  LIP_CORNER_R: 61, LIP_CORNER_L: 291, LIP_UP_MID: 0, LIP_LO_MID: 17, NOSE_TIP: 1, CHIN_LOW: 152,
  CANTHUS_OUT_R: 33, CANTHUS_OUT_L: 263, EYE_IN_R: 133, EYE_IN_L: 362,
};

const items = (page) => page.locator('#lines li');
/** The page of the line that is shown, once its face is there. */
async function shownLine(page, text) {
  await page.waitForFunction((wanted) => document.querySelector('#frames > iframe')?.title.includes(wanted), text, { timeout: 60000 });
  const frame = await (await page.locator('#frames > iframe').elementHandle()).contentFrame();
  await untilFace(frame);
  return frame;
}
const drop = (page, files) => page.setInputFiles('#files', files);

const checks = {
  async 'a typed line is spoken and shown'(page) {
    await page.locator('#text').fill('the time is now');
    await page.locator('#make').click();
    const frame = await shownLine(page, 'the time is now');
    const facts = await frame.evaluate(() => ({ text: mouthpiece.report.text, shapes: mouthpiece.shapeCount, frames: mouthpiece.frameCount }));
    assert.equal(facts.text, 'the time is now');
    assert.ok(facts.shapes > 0 && facts.frames > 30, JSON.stringify(facts));
    await page.waitForTimeout(500);
    await page.screenshot({ path: `${screenshotStem}.png` });
    const folder = join(out, '001-the-time-is-now');
    for (const name of ['speech.wav', 'face.glb', 'view.html', 'report.json', 'line.json']) assert.ok(existsSync(join(folder, name)), name);
  },

  async 'a line is changed on its page and made again; the first stays'(page) {
    let frame = await shownLine(page, 'the time is now');
    await frame.locator('#edit').click();
    const word = await frame.locator('.word', { hasText: 'now' }).last().boundingBox();
    await page.mouse.dblclick(word.x + word.width / 2, word.y + 10);
    await frame.locator('.retype').fill('here');
    await page.keyboard.press('Enter');
    const track = frame.locator('.edit-track canvas').first();
    await track.focus();
    await page.keyboard.press('Enter');
    await page.keyboard.press('ArrowUp');
    await frame.locator('#apply').click();
    frame = await shownLine(page, 'the time is here');
    const now = await frame.evaluate(() => ({ text: mouthpiece.report.text, kinds: mouthpiece.edits.map(({ kind }) => kind), strength: mouthpiece.report.settings.strength }));
    assert.equal(now.text, 'the time is here');
    assert.deepEqual(now.kinds.sort(), ['dial', 'word']);
    assert.ok(now.strength, 'the dial was turned');
    assert.equal(await frame.locator('#editor').isVisible(), true, 'the editor is as it was');
    await frame.locator('#undo').click();
    assert.ok((await frame.evaluate(() => mouthpiece.edits.length)) >= 1);
    await frame.locator('#redo').click();
    const text = (folder) => JSON.parse(readFileSync(join(out, folder, 'report.json'), 'utf8')).text;
    assert.equal(text('001-the-time-is-now'), 'the time is now');
    assert.equal(text('001-the-time-is-now.2'), 'the time is here');
    assert.ok(existsSync(join(out, '001-the-time-is-now.2', 'edits.json')));
  },

  async 'a unit shows the take that it came from'(page) {
    const frame = await shownLine(page, 'the time is here');
    await frame.evaluate(() => mouthpiece.seek(0.3));
    await frame.locator('#edit-unit button', { hasText: 'source' }).click();
    const beside = await (await page.locator('.beside iframe').elementHandle()).contentFrame();
    await beside.waitForFunction(() => window.mouthpiece, null, { timeout: 60000 });
    const source = await beside.evaluate(() => ({ method: mouthpiece.report.method, take: mouthpiece.report.units[0].take, frames: mouthpiece.frameCount }));
    assert.equal(source.method, 'as captured');
    assert.ok(source.take && source.frames > 10, JSON.stringify(source));
    await page.waitForTimeout(1500);
    await page.screenshot({ path: `${screenshotStem}_source.png` });
    await page.locator('.beside button').click();
  },

  async 'files of a line can be had'(page) {
    const [download] = await Promise.all([page.waitForEvent('download'), page.locator('#downloads a', { hasText: 'phones.TextGrid' }).click()]);
    assert.equal(download.suggestedFilename(), 'phones.TextGrid');
    assert.match(readFileSync(await download.path(), 'utf8'), /TextGrid/);
  },

  async 'a recording is dropped, with what it says'(page) {
    const wav = readFileSync(join(out, '001-the-time-is-now', 'speech.wav'));
    await drop(page, [{ name: 'My Voice (1).wav', mimeType: 'audio/wav', buffer: wav }]);
    await page.waitForFunction(() => !document.getElementById('dropped').hidden);
    assert.equal(await page.locator('#recording').textContent(), 'My Voice (1).wav');
    await page.locator('#text').fill('the time is now');
    await page.locator('#make').click();
    await page.waitForFunction(() => document.querySelectorAll('#lines li').length === 2);
    await page.waitForFunction(() => document.querySelector('#lines li .how').textContent.includes(' s'), null, { timeout: 60000 });
    const line = JSON.parse(readFileSync(join(out, '002-the-time-is-now', 'line.json'), 'utf8'));
    assert.equal(line.recording, 'my-voice-1.wav');
    const report = JSON.parse(readFileSync(join(out, '002-the-time-is-now', 'report.json'), 'utf8'));
    assert.ok(report.voice.startsWith('recorded:'), report.voice);
  },

  async 'what cannot be done is said in one line'(page) {
    await page.locator('#text').fill('   ');
    await page.locator('#make').click();
    await page.locator('#trouble:not([hidden])').waitFor();
    assert.match(await page.locator('#trouble').textContent(), /nothing to say/);
    await drop(page, [{ name: 'notes.docx', mimeType: 'application/x', buffer: Buffer.from('no') }]);
    await page.waitForFunction(() => document.getElementById('trouble').textContent.includes('notes.docx'));
    await drop(page, [{ name: 'broken.wav', mimeType: 'audio/wav', buffer: Buffer.from('no sound at all') }]);
    await page.locator('#make').click();
    await page.waitForFunction(() => document.querySelector('#lines li .failed'), null, { timeout: 60000 });
    const told = await page.locator('#lines li .failed').first().textContent();
    assert.match(told, /broken\.wav/);
    assert.ok(!told.includes('\n'));
    await page.screenshot({ path: `${screenshotStem}_trouble.png` });
  },

  async 'a head is dropped: without anchors it says what to do'(page) {
    await drop(page, [{ name: 'My Head.obj', mimeType: 'text/plain', buffer: Buffer.from('v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n') }]);
    await page.waitForFunction(() => [...document.querySelectorAll('#lines li .failed')].some((how) => how.textContent.includes('anchors')), null, { timeout: 60000 });
  },

  async 'a head with its anchors is fitted, is a face, and speaks'(page) {
    const mesh = readFileSync(join(dirname(synth), '../share/mouthpiece/default.obj'));
    await drop(page, [
      { name: 'ann.anchors.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify({ markers: TEN_PLACES })) },
      { name: 'ann.obj', mimeType: 'text/plain', buffer: mesh }]);
    await page.waitForFunction(() => [...document.querySelectorAll('#lines li .how')].some((how) => how.textContent.includes('is a face now')), null, { timeout: 180000 });
    assert.equal(await page.locator('#face').inputValue(), 'ann', 'the new face is chosen');
    await page.locator('#text').fill('hot pots');
    await page.locator('#make').click();
    const frame = await shownLine(page, 'hot pots');
    assert.ok(await frame.evaluate(() => mouthpiece.shapeCount > 0));
    const folder = readdirSync(out).find((name) => name.endsWith('-hot-pots'));
    assert.equal(JSON.parse(readFileSync(join(out, folder, 'line.json'), 'utf8')).face, 'ann');
    await page.screenshot({ path: `${screenshotStem}_head.png` });
    await page.locator('#face').selectOption('default');
  },

  async 'voice, lids, eyes, head and a mood are chosen, and stay with the line; its text stays text'(page) {
    const before = await items(page).count();
    await page.locator('#voice').selectOption('flite:slt');
    await page.locator('#expression summary').click();
    await page.locator('#upper-face').selectOption('rules');
    await page.locator('#gaze').check();
    await page.locator('#head-motion').check();
    await page.locator('#mood').selectOption('joy');
    await page.screenshot({ path: `${screenshotStem}_expression.png` });
    // A whole tag is left out as mark-up; one that does not close is text.
    await page.locator('#text').fill('what a day it was <img src=x onerror=alert(1)');
    await page.locator('#text').press('Enter');
    const frame = await shownLine(page, 'onerror');
    assert.equal(await page.evaluate(() => document.images.length), 0);
    assert.equal(await items(page).count(), before + 1);
    const report = await frame.evaluate(() => mouthpiece.report);
    assert.equal(report.voice, 'flite:slt');
    assert.equal(report.settings['upper face'], 'rules');
    const folder = readdirSync(out).find((name) => name.includes('what-a-day-it-was'));
    assert.deepEqual(JSON.parse(readFileSync(join(out, folder, 'line.json'), 'utf8')).expression,
      { gaze: true, head_motion: true, mood: 'joy', mood_strength: 0.5, upper_face: 'rules' });
  },

  async 'a line that waits can be stopped'(page) {
    for (const text of ['one two three four five six seven eight nine ten', 'stop this one please']) {
      await page.locator('#text').fill(text);
      await page.locator('#make').click();
    }
    const stop = page.locator('#lines li', { hasText: 'stop this one please' }).locator('button', { hasText: 'Stop' });
    // A quick machine may be done before the click.
    await stop.click({ timeout: 3000 }).catch(() => {});
    await page.waitForFunction(() => ![...document.querySelectorAll('#lines li .how')].some((how) => /waits|…/.test(how.textContent)), null, { timeout: 60000 });
  },

  async 'an expression that is none is refused'() {
    const { origin } = new URL(server.address);
    const token = new URL(server.address).searchParams.get('token');
    const good = { upper_face: 'rules', gaze: true, head_motion: false, mood: 'joy', mood_strength: 0.5 };
    const bad = [{ mood: '/etc/passwd' }, { mood: 'weights.json' }, { mood: 'joy:1' }, { mood_strength: 2 }, { mood_strength: null }, { gaze: 'yes' }, { upper_face: 'all' }, { upper_face: 3 }];
    for (const expression of [...bad.map((change) => ({ ...good, ...change })), [], 'rules', {}]) {
      const reply = await fetch(`${origin}/line?token=${token}`, { method: 'POST', headers: { origin }, body: JSON.stringify({ text: 'a', expression }) });
      assert.equal(reply.status, 400, JSON.stringify(expression));
      assert.match(await reply.text(), /expression/);
    }
  },

  async 'nobody without the token gets anything'() {
    const { origin } = new URL(server.address);
    for (const path of ['/', '/state', '/file?line=0&name=speech.wav']) assert.equal((await fetch(origin + path)).status, 403);
    const token = new URL(server.address).searchParams.get('token');
    for (const name of ['../../../../etc/passwd', 'line.json', '/etc/passwd']) {
      const reply = await fetch(`${origin}/file?line=0&name=${encodeURIComponent(name)}&token=${token}`);
      assert.equal(reply.status, 400, name);
    }
  },

  async 'narrow and dark'(page) {
    await page.emulateMedia({ colorScheme: 'dark' });
    await expectFits(page);
    await page.screenshot({ path: `${screenshotStem}_narrow.png`, fullPage: true });
    await page.setViewportSize({ width: 1360, height: 880 });
    await page.emulateMedia({ colorScheme: 'light' });
  },

  async 'a stopped session has its lines again'(page) {
    await page.close();
    assert.equal(await endServer(server), 'SIGINT');
    assert.deepEqual(readdirSync(out).filter((name) => name.includes('.tmp')), []);
    server = await serve();
    const again = await openDesk();
    await again.waitForFunction(() => document.querySelectorAll('#lines li').length >= 3);
    await again.locator('#lines li', { hasText: 'the time is here' }).locator('.open').click();
    assert.equal(await (await shownLine(again, 'the time is here')).evaluate(() => mouthpiece.report.text), 'the time is here');
    await again.close();
  },

  async 'nothing was asked of the network, nothing complained'() {
    assert.deepEqual(requests.filter((url) => !/^(http:\/\/127\.0\.0\.1:|blob:|data:)/.test(url)), []);
    assert.deepEqual(complaints, []);
  },
};

await runChecks(checks, await openDesk(), async () => {
  await browser.close();
  await endServer(server);
});
