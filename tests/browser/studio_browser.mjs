// What the tests of `corpus studio` in Chromium share: a camera and a microphone fed from a clip, and what a person does
// on the page.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { launchBrowser, openPage } from './environment.mjs';
import { ffmpeg, judged, promptOf } from './studio_server.mjs';

/** Chromium's options for devices that loop: the speaker rests, says the sentence, rests. `camera`, `microphone`: what
 * ffmpeg's filters make of picture and sound. */
export function fakeDevices(clip, scratch, { camera, microphone, rate = 25, name = 'devices' }) {
  const video = join(scratch, `${name}.y4m`), sound = join(scratch, `${name}.wav`);
  ffmpeg('-i', clip, '-vf', `tpad=start_mode=clone:start_duration=0.8:stop_mode=clone:stop_duration=3,${camera}`, '-t', '6',
    '-pix_fmt', 'yuv420p', '-r', String(rate), video,
    '-af', `adelay=800:all=1,apad=whole_dur=6,${microphone}`, '-t', '6', '-ac', '1', '-ar', '48000', sound);
  return ['--use-fake-device-for-media-stream', '--use-fake-ui-for-media-stream', '--autoplay-policy=no-user-gesture-required',
    `--use-file-for-fake-video-capture=${video}`, `--use-file-for-fake-audio-capture=${sound}`];
}

/** A browser with the studio's page. What the page asks of others than the server, and what it throws, are complaints. */
export async function openStudioPage(server, devices, complaints, before = () => {}) {
  const browser = await launchBrowser(devices);
  const page = await openPage(browser, { viewport: { width: 1280, height: 900 } });
  page.setDefaultTimeout(120000);  // beside a camera and a tracker a loaded machine is slow
  const origin = new URL(server.address).origin;
  page.on('pageerror', (error) => complaints.push(error.message));
  page.on('dialog', (dialog) => dialog.accept());
  page.on('request', (request) => {
    if (!/^(blob|data):/.test(request.url()) && !request.url().startsWith(origin)) complaints.push(`asks ${request.url()}`);
  });
  await page.addInitScript(before);
  await page.goto(server.address);
  await page.waitForFunction(() => document.querySelectorAll('#sentences li').length === 2);
  return { browser, page };
}

export async function turnOn(page) {
  await page.click('#begin');
  await page.waitForFunction(() => document.getElementById('video').videoWidth > 0);
}

export const rowOf = (page, text) => page.locator('#sentences li', { hasText: text });

/** A person begins when it is quiet, and the page stops by itself when it is quiet again. `during`: what is done while
 * the take is running. */
export async function sayPrompt(server, page, text, during = async () => {}) {
  await rowOf(page, text).click();
  await page.evaluate(() => { window.heard = { loud: false, quietSince: null }; });
  await page.waitForFunction(() => {
    const level = parseFloat(document.getElementById('level').style.width || '0');
    if (level > 30) window.heard = { loud: true, quietSince: null };
    else if (window.heard.loud) window.heard.quietSince ??= performance.now();
    return window.heard.quietSince !== null && performance.now() - window.heard.quietSince > 1000;
  }, null, { polling: 50 });
  // A verdict on an earlier take stands until the server has got this one.
  const sent = page.waitForResponse((answer) => new URL(answer.url()).pathname === '/take');
  await page.click('#record');
  await page.waitForFunction(() => document.getElementById('record').textContent === 'Done');
  await during();
  await page.waitForFunction(() => document.getElementById('record').textContent === 'Record', null, { timeout: 25000 });
  assert.equal((await sent).status(), 200);
  return judged(server, text);
}

/** Six seconds of the devices, recorded as the studio's page does by a page that does nothing else, are sent as a take. */
export async function recordBarely(server, devices, text) {
  const browser = await launchBrowser(devices);
  const page = await browser.newPage();
  await page.goto(server.address);
  await page.evaluate(async (prompt) => {
    const stream = await navigator.mediaDevices.getUserMedia({ video: true, audio: true });
    const recorder = new MediaRecorder(stream, { mimeType: 'video/webm;codecs=vp8,opus', videoBitsPerSecond: 8e6 });
    const parts = [];
    recorder.ondataavailable = (event) => parts.push(event.data);
    const stopped = new Promise((done) => { recorder.onstop = done; });
    recorder.start();
    await new Promise((done) => { setTimeout(done, 6000); });
    recorder.stop();
    await stopped;
    await fetch(`/take${window.location.search}&prompt=${prompt}`, { method: 'POST', body: new Blob(parts) });
  }, await promptOf(server, text));
  await browser.close();
}
