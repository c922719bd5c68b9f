// What the page of `corpus studio` says while something is wrong, before a take and in it, and what becomes of the take:
// node studio_trouble_test.mjs CORPUS CLIPS_FOLDER SCRATCH_FOLDER SCREENSHOT_STEM
import assert from 'node:assert/strict';
import { mkdirSync, readdirSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { endServer } from './environment.mjs';
import { fakeDevices, openStudioPage, sayPrompt, turnOn } from './studio_browser.mjs';
import { anyClip, freshFolder, startStudio } from './studio_server.mjs';

const [corpus, clips, scratchFolder, screenshotStem] = process.argv.slice(2);
const { file, sentence } = anyClip(clips);
const scratch = freshFolder(scratchFolder, sentence);
mkdirSync(dirname(resolve(screenshotStem)), { recursive: true });
const server = await startStudio(corpus, scratch);
const complaints = [];
const takes = () => readdirSync(join(scratch, 'me', 'takes'));

/** Until all of these were among the advice at some time; a camera's pictures loop. */
async function untilTold(page, words) {
  for (const one of words) {
    await page.waitForFunction((said) => document.getElementById('advice').textContent.includes(said), one, { timeout: 30000, polling: 40 });
  }
}

/** The take is refused with these words, nothing of it is kept, and the sentence is offered again. */
async function isRefused(page, verdict, ...reasons) {
  assert.equal(verdict.state, 'again');
  for (const reason of reasons) assert.match(verdict.faults, reason);
  assert.deepEqual(takes(), []);
  await page.waitForFunction((text) => document.getElementById('prompt').textContent === text, sentence, { polling: 100 });
}

// --- The speaker leaves the picture in the middle of the sentence, and is too loud for the microphone.
const gone = fakeDevices(file, scratch, { name: 'gone', camera: "drawbox=enable='between(t,2,3.6)':color=gray:t=fill",
  microphone: "volume=40:enable='between(t,1,3.5)'" });
const leaving = await openStudioPage(server, gone, complaints);
await turnOn(leaving.page);
await untilTold(leaving.page, ['No face is seen', 'The sound is clipped']);
await isRefused(leaving.page, await sayPrompt(server, leaving.page, sentence, async () => {
  await untilTold(leaving.page, ['The sound is clipped']);
  await leaving.page.screenshot({ path: `${screenshotStem}.clipped.png` });
  await untilTold(leaving.page, ['No face is seen']);
  await leaving.page.screenshot({ path: `${screenshotStem}.no_face.png` });
}), /Your face was lost/, /The sound is clipped/);
await leaving.page.screenshot({ path: `${screenshotStem}.refused.png` });
await leaving.browser.close();

// --- Of eight pictures three never come.
const good = fakeDevices(file, scratch, { name: 'good', camera: 'null', microphone: 'volume=0.5' });
const dropping = await openStudioPage(server, good, complaints, () => {
  const real = navigator.mediaDevices.getUserMedia.bind(navigator.mediaDevices);
  navigator.mediaDevices.getUserMedia = async (wanted) => {
    const stream = await real(wanted);
    const seen = new MediaStreamTrackProcessor({ track: stream.getVideoTracks()[0] });
    const shown = new MediaStreamTrackGenerator({ kind: 'video' });
    let number = 0;
    seen.readable.pipeThrough(new TransformStream({
      transform(frame, out) {
        number += 1;
        if (number % 8 < 3) frame.close();
        else out.enqueue(frame);
      },
    })).pipeTo(shown.writable);
    return new MediaStream([shown, ...stream.getAudioTracks()]);
  };
});
await turnOn(dropping.page);
await untilTold(dropping.page, ['pictures a second: more light helps']);
await isRefused(dropping.page, await sayPrompt(server, dropping.page, sentence), /pictures were dropped|only \d+ pictures a second/);
await dropping.page.screenshot({ path: `${screenshotStem}.dropped.png` });
await dropping.browser.close();

// --- A dark room with a fan and a slow camera.
const dark = fakeDevices(file, scratch, { name: 'dark', rate: 10, camera: 'eq=brightness=-0.35',
  microphone: 'volume=0.5,aeval=val(0)+0.05*(2*random(0)-1)' });
const dim = await openStudioPage(server, dark, complaints);
await turnOn(dim.page);
await untilTold(dim.page, ['It is too dark', 'The room is loud', 'pictures a second: more light helps']);
await dim.page.screenshot({ path: `${screenshotStem}.dark.png` });
await dim.browser.close();

await endServer(server, 'SIGINT');
assert.deepEqual(complaints, []);
console.log('ok');
