// `corpus studio` as a person meets it, the camera and the microphone fed from a clip of a real speaker:
// node studio_page_test.mjs CORPUS CLIPS_FOLDER SCRATCH_FOLDER SCREENSHOT_STEM
// What is made of bad takes needs no browser: studio_takes_test.mjs.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readdirSync, statSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { endServer } from './environment.mjs';
import { fakeDevices, openStudioPage, recordBarely, rowOf, sayPrompt, turnOn } from './studio_browser.mjs';
import { anyClip, ask, freshFolder, judged, otherSentence, promptOf, recorded, startStudio } from './studio_server.mjs';

const [corpus, clips, scratchFolder, screenshotStem] = process.argv.slice(2);
const { file, sentence } = anyClip(clips);
const scratch = freshFolder(scratchFolder, sentence);
mkdirSync(dirname(resolve(screenshotStem)), { recursive: true });
const me = join(scratch, 'me');

let server = await startStudio(corpus, scratch);
const stateOf = async (text) => (await ask(server, '/state')).prompts.find((prompt) => prompt.text === text).state;

const complaints = [];
const devices = fakeDevices(file, scratch, { camera: 'null', microphone: 'volume=0.5' });
const openStudio = () => openStudioPage(server, devices, complaints);

const hasDropped = ({ faults }) => /dropped|only \d+ pictures/.test(faults);

/** A machine that others use drops pictures, and the take is rightly refused: it is said again, as a person would. Where
 * a page that does nothing but record drops pictures of the same camera, too, no page could have done it, and the take
 * goes on with a recording that no browser made. */
async function sayUntilWhole(page, text) {
  for (let i = 0; i < 5; ++i) {
    const verdict = await sayPrompt(server, page, text);
    if (!hasDropped(verdict)) return verdict;
  }
  await recordBarely(server, devices, text);
  const bare = await judged(server, text);
  assert.ok(hasDropped(bare), `the page drops pictures where one that only records has ${JSON.stringify(bare)}`);
  console.log(`a page that only records: ${bare.faults} The take is a recording that no browser made.`);
  await ask(server, '/take', { prompt: await promptOf(server, text) }, recorded(file, join(scratch, 'whole.webm'), 'null', 'volume=0.5'));
  return judged(server, text);
}

/** Share of a picture that has the colours of skin: on a page with nothing drawn it is nothing. */
async function skinShare(browser, png) {
  const probe = await browser.newPage();
  const share = await probe.evaluate(async (bytes) => {
    const picture = await createImageBitmap(new Blob([new Uint8Array(bytes)]));
    const context = new OffscreenCanvas(picture.width, picture.height).getContext('2d');
    context.drawImage(picture, 0, 0);
    const { data } = context.getImageData(0, 0, picture.width, picture.height);
    let skin = 0;
    for (let i = 0; i < data.length; i += 4) skin += data[i] > data[i + 1] + 25 && data[i + 1] > data[i + 2] ? 1 : 0;
    return (4 * skin) / data.length;
  }, [...png]);
  await probe.close();
  return share;
}

// --- From the opened page to a take.
let { browser, page } = await openStudio();
assert.match(await page.textContent('#welcome'), /Nothing leaves this machine/);
assert.ok((await page.textContent('#welcome')).includes(me));
await page.screenshot({ path: `${screenshotStem}.welcome.png` });
await turnOn(page);
await page.waitForFunction(() => {
  const canvas = document.getElementById('drawing');
  return canvas.width > 0 && canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((v) => v > 0);
}, null, { timeout: 20000 });
assert.deepEqual(await sayUntilWhole(page, sentence), { state: 'good', faults: '' });
await rowOf(page, sentence).getByText('✓').waitFor();
await page.screenshot({ path: `${screenshotStem}.take.png` });
for (const name of readdirSync(join(me, 'takes'))) assert.equal(statSync(join(me, 'takes', name)).mode & 0o077, 0, `${name} is readable by others`);
assert.equal(statSync(me).mode & 0o077, 0);
assert.equal(readdirSync(join(me, 'incoming')).length + readdirSync(join(me, 'videos')).length, 0, 'the pictures are kept');

// --- Two browsers at once see one session; what one says the other shows.
const second = await openStudio();
await rowOf(second.page, sentence).getByText('✓').waitFor();
await page.reload();  // without its camera: two at once are more than two cores can follow
await turnOn(second.page);
const wrong = await sayUntilWhole(second.page, otherSentence);
assert.equal(wrong.state, 'again');
assert.match(wrong.faults, /Other words were heard/);
await rowOf(page, otherSentence).getByText(wrong.faults.slice(0, 30)).waitFor();
await second.browser.close();

// --- Corpus and line: the head is there.
await page.click('#make');
await page.waitForFunction(() => !document.getElementById('spoken').hidden, null, { timeout: 120000 });
assert.ok(existsSync(join(me, 'own.corpus')) && existsSync(join(me, 'line', 'speech.wav')));
await page.locator('#spoken').scrollIntoViewIfNeeded();
const frame = await (await page.locator('#spoken').elementHandle()).contentFrame();
await frame.waitForFunction(() => window.mouthpiece, null, { timeout: 60000 });
// Software draws about one picture a second beside a camera: the first may take its time.
for (let i = 0; ; ++i) {
  const share = await skinShare(browser, await frame.locator('#view').screenshot());
  if (share > 0.05) break;
  assert.ok(i < 20, `the head is not drawn: ${share} of the picture is skin`);
  await page.waitForTimeout(1000);
}
await page.screenshot({ path: `${screenshotStem}.line.png` });

// --- The server is killed in a take: the page says what is wrong; what was done is there in the next session.
await turnOn(page);
await rowOf(page, otherSentence).click();
await page.click('#record');
await page.waitForTimeout(500);
await endServer(server, 'SIGKILL');
await page.waitForFunction(() => /does not answer/.test(document.getElementById('trouble').textContent), null, { timeout: 20000 });
await browser.close();
server = await startStudio(corpus, scratch);
assert.equal(await stateOf(sentence), 'good', 'the take of the killed session is gone');

// --- A delete that deletes.
({ browser, page } = await openStudio());
await page.click('#forget');
await page.waitForFunction(() => [...document.querySelectorAll('#sentences li')].every((row) => !row.querySelector('button')));
assert.deepEqual(readdirSync(me).sort(), ['incoming', 'takes', 'videos']);
await browser.close();
await endServer(server, 'SIGINT');
assert.deepEqual(complaints, []);
console.log('ok');
