// `corpus studio` as a person meets it, the camera and the microphone fed from a clip of a real speaker:
// node studio_page_test.mjs CORPUS CLIPS_FOLDER SCRATCH_FOLDER SCREENSHOT_STEM
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { existsSync, mkdirSync, readdirSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { launchBrowser, skip } from './environment.mjs';

const [corpus, clips, scratchFolder, screenshotStem] = process.argv.slice(2);
const folder = join(clips, 'untracked');
const anyClip = existsSync(folder) ? join(folder, readdirSync(folder).filter((name) => name.endsWith('.mpg')).sort()[0]) : '';
if (!anyClip) skip(`no clips in ${clips}`);
try {
  execFileSync('ffmpeg', ['-version'], { stdio: 'ignore' });
} catch {
  skip('no ffmpeg; get it with: sudo apt-get install ffmpeg');
}
const scratch = resolve(scratchFolder);
rmSync(scratch, { recursive: true, force: true });
mkdirSync(scratch, { recursive: true });
mkdirSync(dirname(resolve(screenshotStem)), { recursive: true });
const me = join(scratch, 'me');

// GRID's names spell the sentence.
const words = {
  0: { b: 'bin', l: 'lay', p: 'place', s: 'set' }, 1: { b: 'blue', g: 'green', r: 'red', w: 'white' },
  2: { a: 'at', b: 'by', i: 'in', w: 'with' },
  4: { z: 'zero', 1: 'one', 2: 'two', 3: 'three', 4: 'four', 5: 'five', 6: 'six', 7: 'seven', 8: 'eight', 9: 'nine' },
  5: { a: 'again', n: 'now', p: 'please', s: 'soon' },
};
const code = anyClip.slice(-10, -4);
const sentence = [...code].map((c, i) => words[i]?.[c] ?? c.toUpperCase()).join(' ');
const other = 'The quick brown fox jumps over seven lazy elephants in Amsterdam.';
writeFileSync(join(scratch, 'prompts.txt'), `${sentence}\n${other}\n`);

function media(name, videoFilter, soundFilter) {
  const video = join(scratch, `${name}.y4m`), sound = join(scratch, `${name}.wav`);
  execFileSync('ffmpeg', ['-v', 'error', '-y', '-i', anyClip, '-vf', videoFilter, '-pix_fmt', 'yuv420p', '-r', '25', video,
    '-af', soundFilter, '-ac', '1', '-ar', '48000', sound]);
  return [`--use-file-for-fake-video-capture=${video}`, `--use-file-for-fake-audio-capture=${sound}`];
}

function startServer() {
  const child = spawn(corpus, ['studio', me, '--text', join(scratch, 'prompts.txt'), '--count', '2'], { stdio: ['ignore', 'pipe', 'inherit'] });
  return new Promise((done, fail) => {
    let said = '';
    child.stdout.on('data', (bytes) => {
      said += bytes;
      const address = said.match(/http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]+/)?.[0];
      if (address) done({ child, address });
    });
    child.on('exit', (status, signal) => fail(new Error(`corpus studio ended (${status ?? signal}): ${said}`)));
  });
}

function endServer(server, signal) {
  server.child.removeAllListeners('exit');
  return new Promise((done) => {
    server.child.on('exit', done);
    server.child.kill(signal);
  });
}

const complaints = [];
async function openStudio(address, fakes) {
  const browser = await launchBrowser(['--use-fake-device-for-media-stream', '--use-fake-ui-for-media-stream',
    '--autoplay-policy=no-user-gesture-required', ...fakes]);
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 }, colorScheme: 'light' });
  page.on('pageerror', (error) => complaints.push(error.message));
  page.on('dialog', (dialog) => dialog.accept());
  page.on('request', (request) => {
    if (!request.url().startsWith(address.slice(0, address.indexOf('/?')))) complaints.push(`asks ${request.url()}`);
  });
  await page.goto(address);
  await page.waitForFunction(() => document.querySelectorAll('#sentences li').length === 2);
  return { browser, page };
}

const stateOf = (page) => page.evaluate(async () => {
  const token = new URLSearchParams(location.search).get('token');
  return (await fetch('/state', { headers: { 'X-Mouthpiece-Token': token } })).json();
});

async function turnOn(page) {
  await page.click('#begin');
  await page.waitForFunction(() => document.getElementById('video').videoWidth > 0);
}

async function sayPrompt(page, prompt, seconds = 4) {
  await page.click(`#sentences li:nth-child(${prompt + 1})`);
  await page.click('#record');
  await page.waitForTimeout(1000 * seconds);
  if ((await page.textContent('#record')) === 'Done') await page.click('#record');
}

async function judged(page, prompt) {
  for (let i = 0; i < 120; ++i) {
    const { state, faults } = (await stateOf(page)).prompts[prompt];
    if (state === 'good' || state === 'again') return { state, faults: faults.join(' ') };
    await page.waitForTimeout(500);
  }
  throw new Error('a take was not judged in a minute');
}

/** A machine that others use drops pictures, and the take is rightly refused: it is said again, as a person would. */
async function sayUntilWhole(page, prompt, seconds) {
  for (let i = 0; ; ++i) {
    await sayPrompt(page, prompt, seconds);
    const verdict = await judged(page, prompt);
    if (verdict.state === 'good' || i === 5 || !/dropped|only \d+ pictures/.test(verdict.faults)) return verdict;
  }
}

let server = await startServer();

// --- From the opened page to a spoken line.
const good = media('good', 'null', 'volume=0.5');
let { browser, page } = await openStudio(server.address, good);
assert.match(await page.textContent('#welcome'), /Nothing leaves this machine/);
assert.match(await page.textContent('#welcome'), new RegExp(me.replaceAll('/', '\\/')));
await page.screenshot({ path: `${screenshotStem}.welcome.png` });
await turnOn(page);
await page.waitForFunction(() => {
  const canvas = document.getElementById('drawing');
  return canvas.width > 0 && canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((v) => v > 0);
}, null, { timeout: 20000 });
assert.deepEqual(await sayUntilWhole(page, 0), { state: 'good', faults: '' });
await page.screenshot({ path: `${screenshotStem}.take.png` });
const takes = readdirSync(join(me, 'takes'));
assert.deepEqual(takes.map((n) => n.slice(n.lastIndexOf('.'))).sort(), ['.TextGrid', '.c3d', '.txt', '.wav']);
for (const name of takes) assert.equal(statSync(join(me, 'takes', name)).mode & 0o077, 0, `${name} is readable by others`);
assert.equal(statSync(me).mode & 0o077, 0);
assert.equal(readdirSync(join(me, 'incoming')).length + readdirSync(join(me, 'videos')).length, 0, 'the pictures are kept');

// --- Other words than the sentence's are offered again.
const wrong = await sayUntilWhole(page, 1);
assert.equal(wrong.state, 'again');
assert.match(wrong.faults, /Other words|cannot be used/);

// --- Two browsers at once see one session.
const second = await openStudio(server.address, good);
assert.equal((await stateOf(second.page)).prompts[0].state, 'good');
await second.browser.close();

// --- Corpus and line.
await page.click('#make');
await page.waitForFunction(() => !document.getElementById('spoken').hidden, null, { timeout: 120000 });
assert.ok(existsSync(join(me, 'own.corpus')) && existsSync(join(me, 'line', 'speech.wav')));
const frame = await (await page.locator('#spoken').elementHandle()).contentFrame();
await frame.waitForFunction(() => window.mouthpiece, null, { timeout: 60000 });
await page.screenshot({ path: `${screenshotStem}.line.png` });

// --- The server is killed while a take is recorded: what was done is there again, the page says what is wrong.
await page.click('#sentences li:nth-child(2)');
await page.click('#record');
await page.waitForTimeout(800);
await endServer(server, 'SIGKILL');
await page.waitForFunction(() => /does not answer/.test(document.getElementById('trouble').textContent), null, { timeout: 20000 });
await browser.close();
server = await startServer();

// --- A face that leaves, and a clipped sound.
({ browser, page } = await openStudio(server.address, media('bad', "drawbox=enable='gt(mod(t,3),1)':color=gray:t=fill", 'volume=30')));
assert.equal((await stateOf(page)).prompts[0].state, 'good', 'the take of the killed session is gone');
await turnOn(page);
await sayPrompt(page, 1, 5);
const lost = await judged(page, 1);
assert.equal(lost.state, 'again');
assert.match(lost.faults, /face was lost/);
assert.match(lost.faults, /clipped/);
assert.ok(!readdirSync(join(me, 'takes')).some((name) => name.startsWith('the-quick')));

// --- A delete that deletes.
await page.click('#forget');
await page.waitForFunction(() => [...document.querySelectorAll('#sentences li')].every((row) => !row.querySelector('button')));
const left = ['takes', 'incoming', 'videos'].flatMap((name) => readdirSync(join(me, name)));
assert.deepEqual(left, []);
assert.deepEqual(readdirSync(me).sort(), ['incoming', 'takes', 'videos']);
await browser.close();
await endServer(server, 'SIGINT');
assert.deepEqual(complaints, []);
console.log('ok');
