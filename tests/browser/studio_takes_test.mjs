// What `corpus studio` makes of takes, without a browser: the program is given what a browser would have recorded, made
// from a clip of a real speaker: node studio_takes_test.mjs CORPUS CLIPS_FOLDER SCRATCH_FOLDER
// ANCHORS_OF_MAKEHUMAN_MALE
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { endServer } from './environment.mjs';
import { anyClip, ask, freshFolder, judged, otherSentence, promptOf, recorded, startStudio } from './studio_server.mjs';

const [corpus, clips, scratchFolder, anchors] = process.argv.slice(2);
const { file, sentence } = anyClip(clips);
const scratch = freshFolder(scratchFolder, sentence);
const me = join(scratch, 'me');

const recording = (name, videoFilter, soundFilter) => recorded(file, join(scratch, `${name}.webm`), videoFilter, soundFilter);

let server = await startStudio(corpus, scratch);
async function say(text, video) {
  await ask(server, '/take', { prompt: await promptOf(server, text) }, video);
  return judged(server, text);
}
const takes = () => readdirSync(join(me, 'takes'));

// --- What a person before the camera is told, by one picture: rows of RGBA.
const look = (filter, width = 360, height = 288) => ask(server, '/look', { width, height }, execFileSync('ffmpeg', ['-nostdin', '-v', 'error',
  '-ss', '1', '-i', file, '-vf', filter, '-frames:v', '1', '-f', 'rawvideo', '-pix_fmt', 'rgba', '-'], { maxBuffer: 1 << 26 }));
const whole = await look('null');
assert.deepEqual([whole.face, whole.advice], [true, []]);
assert.ok(whole.points.length > 80 && whole.points.every(([x, y]) => x > 0 && x < 1 && y > 0 && y < 1));
const advices = {  // a face that is followed goes there step by step
  'No face is seen': 'drawbox=color=gray:t=fill',
  'Come closer': 'scale=180:144,pad=360:288:90:72',
  'Move back': [240, 200, 180, 160, 145].map((w) => `crop=${w}:${0.8 * w}:${152 - w / 2}:${165 - 0.4 * w},scale=360:288`),
  'outside the picture': [60, 85, 105].map((x) => `crop=250:200:${x}:60,scale=360:288`),
  'Hold your head upright': [0.1, 0.2, 0.3, 0.4].map((turn) => `rotate=${turn}`),
  'too dark': 'eq=brightness=-0.45',
  'too bright': 'eq=brightness=0.45',
  'from one side': 'drawbox=x=0:w=172:color=black@0.75:t=fill',
};
for (const [told, filters] of Object.entries(advices)) {
  let advice = [];
  for (const filter of ['null', ...[filters].flat(), [filters].flat().at(-1)]) ({ advice } = await look(filter));
  assert.ok(advice.some((line) => line.includes(told)), `${told}: found ${advice.join(' ') || 'nothing'}`);
}

// --- Requests of others, and nonsense: refused in one line, nothing is written.
const origin = new URL(server.address).origin;
for (const [path, options] of [['/state', {}], ['/?token=0', {}], ['/take?prompt=0', { method: 'POST', body: 'x' }], ['/forget-all', { method: 'POST' }],
  [`/state${new URL(server.address).search}`, { headers: { Origin: 'http://example.org' } }]])
  assert.ok((await fetch(origin + path, options)).status >= 400, path);
for (const [path, parameters, body] of [['/look', { width: 100000, height: 100000 }, 'x'], ['/look', { width: 4, height: 4 }, 'x'],
  ['/look', { width: -1, height: 1 }, 'x'], ['/take', { prompt: '-1' }, 'x'], ['/take', { prompt: '99999999999' }, 'x'], ['/take', {}, 'x'],
  ['/head', { name: '../../away.obj/../x' }, 'x'], ['/wear', { head: '../takes' }, ''], ['/make', {}, 'Words.'], ['/make', { voice: '' }, ' ']]) {
  const { error } = await ask(server, path, parameters, body);
  assert.ok(error && !error.includes('\n'), `${path} ${JSON.stringify(parameters)}: ${error}`);
}
assert.deepEqual(readdirSync(me).sort(), ['incoming', 'takes', 'videos']);

// --- Faults: each is told, nothing of the take stays.
// Chromium's recorder now and then gives two pictures one time.
const good = recording('good', "setpts='if(eq(N,1),PTS-0.0398/TB,PTS)'", 'volume=0.5');
const faults = {
  'face was lost': recording('left', "drawbox=enable='gt(t,1.6)':color=gray:t=fill", 'volume=0.5'),
  'sound is clipped': recording('loud', 'null', 'volume=30'),
  'pictures were dropped': recording('dropped', "select='gt(mod(n,8),1)'", 'volume=0.5'),
  'only \\d+ pictures a second': recording('slow', 'fps=12', 'volume=0.5'),
  'hardly heard': recording('faint', 'null', 'volume=0.001'),
  'cannot be used': Buffer.from('this is no video'),
};
for (const [why, video] of Object.entries(faults)) {
  const { state, faults: told } = await say(sentence, video);
  assert.equal(state, 'again', why);
  assert.match(told, new RegExp(why));
  assert.deepEqual([...takes(), ...readdirSync(join(me, 'incoming'))], [], why);
}
const wrong = await say(otherSentence, good);
assert.equal(wrong.state, 'again');
assert.match(wrong.faults, /Other words were heard/);
assert.deepEqual(await say(sentence, good), { state: 'good', faults: '' });
const kept = takes();
assert.deepEqual(kept.map((name) => name.slice(name.lastIndexOf('.'))).sort(), ['.TextGrid', '.c3d', '.txt', '.wav']);

// --- A worse take of the same sentence does not replace a good one; a number that is no prompt is refused.
const worse = await say(sentence, faults['sound is clipped']);
assert.equal(worse.state, 'good');
assert.match(worse.faults, /clipped.*The take before it is kept/);
assert.deepEqual(takes(), kept);
assert.match((await ask(server, '/take', { prompt: 7 }, good)).error, /no prompt/);

// --- A head of one's own speaks the line: its mesh and its anchors, in the order in which the page sends them.
const heads = join(clips, '..', '..', 'faces');
assert.match((await ask(server, '/head', { name: 'head.exe' }, 'MZ')).error, /no head/);
await ask(server, '/head', { name: 'solid.obj' }, 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n');
async function make() {
  assert.equal((await ask(server, '/make', {}, 'The time is now.')).error, undefined);
  for (let i = 0; i < 600; ++i) {
    const { stage, trouble, has_line: hasLine } = await ask(server, '/state');
    if (stage === '') return { trouble, hasLine };
    await new Promise((done) => setTimeout(done, 250));
  }
  throw new Error('the line was not made in two minutes and a half');
}
assert.match((await make()).trouble, /no face/);
await ask(server, '/head', { name: 'makehuman_male.obj' }, readFileSync(join(heads, 'makehuman_male.obj')));
assert.deepEqual(await make(), { trouble: '', hasLine: true });  // by anchors that are found
await ask(server, '/head', { name: 'makehuman_male.anchors.json' }, readFileSync(anchors));
assert.deepEqual(await make(), { trouble: '', hasLine: true });
assert.equal((await ask(server, '/state')).head, 'file');
assert.ok(existsSync(join(me, 'head', 'head.face')) && existsSync(join(me, 'line', 'face.glb')));

// --- A head in the person's own shape: the sample head, bent.
assert.match((await ask(server, '/wear', { head: 'hat' }, '')).error, /no head/);
await ask(server, '/wear', { head: 'own' }, '');
assert.deepEqual(await make(), { trouble: '', hasLine: true });
assert.equal((await ask(server, '/state')).head, 'own');
const vertices = (path) => readFileSync(path, 'utf8').split('\n').filter((line) => line.startsWith('v ')).map((line) => line.split(' ').slice(1, 4).map(Number));
const own = vertices(join(me, 'head', 'head.obj')), sample = vertices(join(dirname(corpus), '..', 'share', 'mouthpiece', 'default.obj'));
assert.equal(own.length, sample.length);
const far = own.map((place, i) => Math.hypot(...place.map((value, axis) => value - sample[i][axis]))).sort((a, b) => a - b);
assert.ok(far[far.length >> 1] > 1 && far[far.length >> 1] < 60, `half of the vertices are moved by ${far[far.length >> 1]} mm`);

// --- Killed with a recording that was not yet judged: the next session judges it; what was kept is there.
await ask(server, '/take', { prompt: await promptOf(server, sentence) }, good);
await endServer(server, 'SIGKILL');
assert.deepEqual(takes().filter((name) => !kept.includes(name) && !name.startsWith('.')), []);
server = await startStudio(corpus, scratch);
assert.equal((await judged(server, sentence)).state, 'good');
assert.deepEqual(readdirSync(join(me, 'incoming')), []);

// --- A delete that deletes, also while a take is looked at and a line is made.
const nothingIsLeft = () => {
  assert.deepEqual(readdirSync(me).sort(), ['incoming', 'takes', 'videos']);
  assert.ok(['incoming', 'takes', 'videos'].every((name) => readdirSync(join(me, name)).length === 0));
};
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
await ask(server, '/make', {}, 'The time is now.');
await pause(300);
await ask(server, '/forget-all', {}, '');
nothingIsLeft();
await ask(server, '/take', { prompt: await promptOf(server, sentence) }, good);
await pause(300);
await ask(server, '/forget-all', {}, '');
nothingIsLeft();
await pause(3000);
nothingIsLeft();
assert.deepEqual((await ask(server, '/state')).prompts.map(({ state }) => state), ['none', 'none']);
await endServer(server, 'SIGINT');
assert.ok(existsSync(me));
console.log('ok');
