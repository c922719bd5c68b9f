// What the tests of `corpus studio` share: clips of a real speaker, made into what a camera could have seen, and the
// server.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { skip, startServer } from './environment.mjs';

// GRID's names spell the sentence.
const words = {
  0: { b: 'bin', l: 'lay', p: 'place', s: 'set' }, 1: { b: 'blue', g: 'green', r: 'red', w: 'white' },
  2: { a: 'at', b: 'by', i: 'in', w: 'with' },
  4: { z: 'zero', 1: 'one', 2: 'two', 3: 'three', 4: 'four', 5: 'five', 6: 'six', 7: 'seven', 8: 'eight', 9: 'nine' },
  5: { a: 'again', n: 'now', p: 'please', s: 'soon' },
};

/** The first clip that nobody has tracked, and what is said in it. Skips the test where there is none, or no ffmpeg. */
export function anyClip(clips) {
  const folder = join(clips, 'untracked');
  const name = existsSync(folder) && readdirSync(folder).filter((file) => file.endsWith('.mpg')).sort()[0];
  if (!name) skip(`no clips in ${clips}`);
  try {
    execFileSync('ffmpeg', ['-version'], { stdio: 'ignore' });
  } catch {
    skip('no ffmpeg; get it with: sudo apt-get install ffmpeg');
  }
  return { file: join(folder, name), sentence: [...name.slice(0, -4)].map((c, i) => words[i]?.[c] ?? c.toUpperCase()).join(' ') };
}

export const otherSentence = 'The quick brown fox jumps over seven lazy elephants in Amsterdam.';

/** An empty folder, with the sentence of a clip and another one in prompts.txt. */
export function freshFolder(path, sentence) {
  const folder = resolve(path);
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(folder, { recursive: true });
  writeFileSync(join(folder, 'prompts.txt'), `${sentence}\n${otherSentence}\n`);
  return folder;
}

export function ffmpeg(...options) {
  execFileSync('ffmpeg', ['-nostdin', '-v', 'error', '-y', ...options], { stdio: ['ignore', 'ignore', 'inherit'] });
}

/** As a browser's recording of a clip: WebM, of pictures that come at their own times. */
export function recorded(clip, made, videoFilter, soundFilter) {
  ffmpeg('-i', clip, '-vf', `settb=1/1000000,${videoFilter}`, '-fps_mode', 'passthrough', '-enc_time_base', '1:1000000',
    '-c:v', 'libvpx', '-deadline', 'realtime', '-b:v', '3M', '-af', soundFilter, '-ac', '1', '-ar', '48000', '-c:a', 'libopus', '-b:a', '128k', made);
  return readFileSync(made);
}

export const startStudio = (corpus, scratch) =>
  startServer(corpus, ['studio', join(scratch, 'me'), '--text', join(scratch, 'prompts.txt'), '--count', '2']);

/** GET, or POST of a body. Gives what the server tells. */
export async function ask(server, path, parameters = {}, body = undefined) {
  const url = new URL(server.address);
  url.pathname = path;
  Object.entries(parameters).forEach(([name, value]) => url.searchParams.set(name, value));
  const answer = await fetch(url, body === undefined ? {} : { method: 'POST', body });
  return answer.json();
}

export const promptOf = async (server, text) => (await ask(server, '/state')).prompts.findIndex((prompt) => prompt.text === text);

/** The prompt of that text, once its take has been judged. */
export async function judged(server, text) {
  for (let i = 0; i < 240; ++i) {
    const prompt = (await ask(server, '/state')).prompts.find((one) => one.text === text);
    if (prompt.state === 'good' || prompt.state === 'again') return { state: prompt.state, faults: prompt.faults.join(' ') };
    await new Promise((done) => setTimeout(done, 250));
  }
  throw new Error(`the take of “${text}” was not judged in a minute`);
}
