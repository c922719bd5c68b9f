// The page of `corpus studio`: camera and microphone here, everything else in the program.
import { Ears } from './ears.js';
import { Eyes } from './eyes.js';
import { address, post, state } from '../serve/api.js';

const $ = (id) => document.getElementById(id);
const kLongestTake = 20, kQuietToStop = 1.3;  // s

const signs = { none: '○', waiting: '…', working: '…', good: '✓', again: '✗' };
let known = null, chosen = 0, recorder = null, ears = null, eyes = null, shownLine = '', shownRows = '';

function tell(place, text) {
  place.hidden = !text;
  place.textContent = text ?? '';
}

function isOpen(prompt) {
  return prompt.state === 'none' || prompt.state === 'again';
}

/** The first sentence first (the lips are measured in it), then what adds most for its length. */
function nextPrompt() {
  if (isOpen(known.prompts[0])) return 0;
  let best = -1, gain = -1;
  known.prompts.forEach((prompt, i) => {
    const value = prompt.adds / (10 + prompt.text.length);
    if (isOpen(prompt) && i !== chosen && value > gain) [best, gain] = [i, value];
  });
  return best >= 0 ? best : chosen;
}

function rowOf(prompt, i) {
  const row = document.createElement('li');
  row.className = i === chosen ? 'chosen' : '';
  const text = document.createElement('span');
  text.textContent = prompt.text;
  const sign = document.createElement('span');
  sign.textContent = signs[prompt.state];
  row.append(sign, text);
  if (prompt.state === 'good') {
    const forget = document.createElement('button');
    forget.textContent = 'delete';
    forget.onclick = async (event) => {
      event.stopPropagation();
      await post('/forget', { prompt: i });
      refresh();
    };
    row.append(forget);
  }
  if (prompt.faults.length) {
    const why = document.createElement('span');
    why.className = 'why';
    why.textContent = prompt.faults.join(' ');
    row.append(why);
  }
  row.onclick = () => { if (!recorder) choose(i); };
  return row;
}

function choose(i) {
  chosen = i;
  show();
}

function show() {
  const prompt = known.prompts[chosen];
  $('prompt').textContent = prompt.text;
  $('adds').textContent = prompt.state === 'good' ? 'You have said this; saying it again replaces it.'
    : `It would add ${prompt.adds} of the ${known.possible_pairs} sound pairs that these sentences hold.`;
  // A row that is made anew under a pressed mouse is not clicked.
  const rows = JSON.stringify([chosen, known.prompts]);
  if (rows !== shownRows) {
    shownRows = rows;
    $('sentences').replaceChildren(...known.prompts.map(rowOf));
  }
  const good = known.prompts.filter((p) => p.state === 'good').length;
  const share = Math.round((100 * known.held_pairs) / known.possible_pairs);
  $('covered').style.width = `${share}%`;
  $('progress').textContent = `${good} of ${known.prompts.length} sentences, ${share} % of the sound pairs; `
    + `about ${known.minutes_left} min left.`;
  document.querySelectorAll('.folder').forEach((place) => { place.textContent = known.folder; });
  $('video-note').textContent = known.keeps_video ? 'The pictures are kept, too.' : 'The pictures are deleted once the face has been followed in them.';
  $('make').disabled = good === 0 || known.stage !== '';
  if (document.activeElement !== $('head')) $('head').value = known.head;
  $('heads').hidden = $('head').value !== 'file';
  $('stage').textContent = known.stage ? `${known.stage} …` : '';
  tell($('trouble'), known.trouble);
  if (known.has_line && known.stage === '' && shownLine !== known.said) {
    shownLine = known.said;
    $('spoken').src = address('/line', { of: Date.now() });
  }
  $('spoken').hidden = !known.has_line;
}

async function refresh() {
  const before = known;
  known = await state();
  if (!before) choose(nextPrompt());
  // A take that was refused is offered again at once, unless something else is being said.
  const refused = known.prompts.findIndex((p, i) => p.state === 'again' && before && before.prompts[i].state !== 'again');
  if (refused >= 0 && !recorder) chosen = refused;
  show();
}

async function poll() {
  try {
    await refresh();
  } catch (error) {
    tell($('trouble'), error.message);
  }
  setTimeout(poll, 700);
}

function advise() {
  const lines = [...(eyes.advice ?? []), ...ears.advice(Boolean(recorder))];
  if (eyes.rate > 0 && eyes.rate < 22) lines.push(`The camera gives only ${eyes.rate.toFixed(0)} pictures a second: more light helps.`);
  $('advice').replaceChildren(...(lines.length ? lines : ['Everything is well.']).map((line) => {
    const item = document.createElement('li');
    item.textContent = line;
    if (!lines.length) item.className = 'fine';
    return item;
  }));
  $('rate').textContent = `${eyes.rate.toFixed(0)} pictures a second`;
  $('level').style.width = `${ears.share()}%`;
  $('level').className = ears.isClipped ? 'clipped' : '';
}

function kindOfRecording() {
  return ['video/webm;codecs=vp8,pcm', 'video/webm;codecs=vp8,opus', 'video/webm', 'video/mp4'].find((kind) => MediaRecorder.isTypeSupported(kind));
}

function record(stream) {
  const prompt = chosen, parts = [];
  recorder = new MediaRecorder(stream, { mimeType: kindOfRecording(), videoBitsPerSecond: 8e6, audioBitsPerSecond: 256e3 });
  recorder.ondataavailable = (event) => parts.push(event.data);
  recorder.onstop = async () => {
    recorder = null;
    $('record').textContent = 'Record';
    $('record').classList.remove('on');
    $('light').hidden = true;
    try {
      await post('/take', { prompt }, new Blob(parts));
      await refresh();
      choose(nextPrompt());
    } catch (error) {
      tell($('trouble'), error.message);
    }
  };
  ears.beginTake();
  recorder.start();
  $('record').textContent = 'Done';
  $('record').classList.add('on');
  $('light').hidden = false;
  const began = performance.now(), mine = recorder;
  const watch = setInterval(() => {
    const seconds = (performance.now() - began) / 1000;
    if (recorder !== mine) return clearInterval(watch);
    if (seconds > kLongestTake || (seconds > 1.5 && ears.quietAfterSpeech() > kQuietToStop)) {
      clearInterval(watch);
      stopRecording();
    }
    return undefined;
  }, 100);
}

function stopRecording() {
  if (recorder?.state === 'recording') recorder.stop();
}

async function begin() {
  tell($('begin-trouble'), '');
  let stream;
  try {
    stream = await navigator.mediaDevices.getUserMedia({
      video: { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } },
      audio: { echoCancellation: false, noiseSuppression: false, autoGainControl: false },
    });
  } catch (error) {
    const why = error.name === 'NotAllowedError' ? 'The browser may not use the camera and the microphone: allow it beside the address.'
      : `There is no camera and microphone to use (${error.message}).`;
    tell($('begin-trouble'), why);
    return;
  }
  $('welcome').hidden = true;
  $('take').hidden = false;
  $('video').srcObject = stream;
  await $('video').play();
  ears = new Ears(stream);
  eyes = new Eyes($('video'), $('drawing'));
  eyes.start(() => Boolean(recorder));
  setInterval(advise, 150);
  $('record').onclick = () => (recorder ? stopRecording() : record(stream));
  $('skip').onclick = () => { if (!recorder) choose(nextPrompt()); };
  document.addEventListener('keydown', (event) => {
    if (event.code !== 'Space' || /^(INPUT|SELECT|BUTTON|TEXTAREA)$/.test(event.target.tagName)) return;
    event.preventDefault();
    $('record').click();
  });
}

$('begin').onclick = begin;
$('say').onsubmit = async (event) => {
  event.preventDefault();
  shownLine = '';
  try {
    await post('/make', { voice: $('voice').value }, $('line').value);
    await refresh();
  } catch (error) {
    tell($('trouble'), error.message);
  }
};
$('head').onchange = async () => {
  const head = $('head').value;
  $('head').blur();
  if (head === 'file') {
    $('heads').hidden = false;
    $('heads').click();
    return;
  }
  try {
    await post('/wear', { head });
    await refresh();
  } catch (error) {
    tell($('trouble'), error.message);
  }
};
$('heads').onchange = async () => {
  try {
    // A mesh begins anew: its anchors come after it.
    const files = [...$('heads').files].sort((a, b) => a.name.endsWith('.json') - b.name.endsWith('.json'));
    for (const file of files) await post('/head', { name: file.name }, file);
    await refresh();
  } catch (error) {
    tell($('trouble'), error.message);
  }
};
$('forget').onclick = async () => {
  if (!window.confirm('Delete all recordings, takes, the corpus and the spoken line? They cannot be had back.')) return;
  await post('/forget-all');
  shownLine = '';
  $('spoken').removeAttribute('src');
  await refresh();
  choose(0);
};
poll();
