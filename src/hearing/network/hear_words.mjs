// Hears the words of sounds: Moonshine's network (N. Jeffries et al., "Moonshine: Speech Recognition for Live Transcription
// and Voice Commands", 2024; tiny, English) by ONNX Runtime. node hear_words.mjs, started by word_network.cpp.
// Standard input: for each sound how many samples it has and how many bytes its text (32 bits each), then the samples, 16
// kHz, 16 bits, all little-endian, then the text. Descriptor 3 gets a line of JSON for each: its words, and of each the
// natural logarithm of its probability. With a text, words between blanks, the answer is how likely each of them is after
// those before it, and last that nothing follows: the logarithm, and by how much it lies behind the likeliest in its place;
// beside it what is heard without the text, and the logarithms of both and in how many tokens what is heard was written.
// With kEncoded in place of the text's bytes the answer is what the encoder makes of the sound, 288 numbers a frame of 24
// ms, of each the upper 16 bits as four hexadecimal digits.
import { readFileSync, readSync, writeSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { InferenceSession, Tensor } from 'onnxruntime-node';
import { WordPieces } from './word_pieces.mjs';

const kAnswers = 3;
const kEncoded = 0xffffffff;
const kRateHz = 16000;
const kMostSeconds = 60;
const kLeastSamples = 1600; // its first layers take no fewer
const kMostTokensASecond = 7; // what says more has begun to repeat itself
const kFirstToken = 1;
const kLastToken = 2;
const kLayers = 6;
const kHeads = 8;
const kHeadWidth = 36;

/** The next `count` bytes of standard input; null where it ends before the first of them. */
function read(count) {
  const bytes = Buffer.alloc(count);
  for (let at = 0; at < count;) {
    const taken = readSync(0, bytes, at, count - at);
    if (taken === 0 && at === 0) return null;
    if (taken === 0) throw new Error('what is sent ends within a sound');
    at += taken;
  }
  return bytes;
}

/** 0.7 at the loudest: the network hears quiet sounds worse. */
function samplesOf(bytes) {
  const samples = new Float32Array(bytes.length / 2);
  let loudest = 1;
  for (let i = 0; i < samples.length; ++i) {
    samples[i] = bytes.readInt16LE(2 * i);
    loudest = Math.max(loudest, Math.abs(samples[i]));
  }
  for (let i = 0; i < samples.length; ++i) samples[i] = (0.7 * samples[i]) / loudest;
  return samples;
}

const folder = dirname(process.argv[1]);
const pieces = new WordPieces(readFileSync(join(folder, 'word_pieces.txt'), 'utf8'));
// The graphs were made faster when they were stored (store_word_network.py).
const options = { intraOpNumThreads: 1, interOpNumThreads: 1, graphOptimizationLevel: 'disabled' };
// What the encoder takes at once grows with the sound, and an arena keeps the most; the decoder's many small pieces need one.
const encoder = await InferenceSession.create(join(folder, 'encoder_model.ort'), { ...options, enableCpuMemArena: false });
// Who only encodes needs no decoder, which has most of the memory.
let decoder = null;
const runDecoder = async (inputs) => {
  decoder ??= await InferenceSession.create(join(folder, 'decoder_model_merged.ort'), options);
  return decoder.run(inputs);
};

/** What the decoder keeps from token to token, nothing yet. */
function emptyMemory() {
  const memory = {};
  for (let layer = 0; layer < kLayers; ++layer) {
    for (const of of ['decoder', 'encoder']) {
      for (const what of ['key', 'value'])
        memory[`past_key_values.${layer}.${of}.${what}`] = new Tensor('float32', new Float32Array(0), [0, kHeads, 1, kHeadWidth]);
    }
  }
  return memory;
}

/** The likeliest token and the natural logarithm of its probability. */
function likeliest(logits) {
  let best = 0;
  for (let i = 1; i < logits.length; ++i) if (logits[i] > logits[best]) best = i;
  const sum = logits.reduce((total, logit) => total + Math.exp(logit - logits[best]), 0);
  return [best, -Math.log(sum)];
}

const heardIn = (samples) => encoder.run({ input_values: new Tensor('float32', samples, [1, samples.length]) });

/** Tokens and their logarithms, the likeliest after each other; the last token among them where it came. */
async function tokensOf(heard, samples) {
  const memory = emptyMemory();
  const tokens = [];
  const most = Math.ceil((samples.length / kRateHz) * kMostTokensASecond) + 4;
  for (let token = kFirstToken; token !== kLastToken && tokens.length < most;) {
    const isFirst = tokens.length === 0;
    const result = await runDecoder({
      input_ids: new Tensor('int64', BigInt64Array.of(BigInt(token)), [1, 1]),
      encoder_hidden_states: heard.last_hidden_state,
      use_cache_branch: new Tensor('bool', [!isFirst]),
      ...memory,
    });
    const logits = result.logits.data;
    if (isFirst) logits[kLastToken] = -Infinity; // something is said: the stretch was cut out of silence
    const [next, logProbability] = likeliest(logits);
    tokens.push({ id: next, logProbability });
    token = next;
    for (const name of Object.keys(memory)) {
      if (isFirst || name.includes('.decoder.')) memory[name] = result[name.replace('past_key_values', 'present')];
    }
  }
  return tokens;
}

/** Blanks part words, whatever tokens they are of. */
function wordsOf(tokens) {
  const words = [];
  let said = '';
  const ids = [];
  for (const { id, logProbability } of tokens) {
    ids.push(id);
    const text = id === kLastToken ? said : pieces.decode(ids);
    if (words.length === 0 || /^\s/.test(text.slice(said.length))) words.push({ text: '', logProbability: 0 });
    const word = words[words.length - 1];
    const part = text.slice(said.length).trim();
    word.text += part;
    if (/[\p{L}\p{N}]/u.test(part)) word.logProbability += logProbability;
    said = text;
  }
  // What a token has of a character in several may be half of it.
  for (const word of words) word.text = word.text.replace(/\p{Surrogate}/gu, '');
  return words.filter((word) => word.text !== '');
}

const kDigits = ['zero', 'one', 'two', 'three', 'four', 'five', 'six', 'seven', 'eight', 'nine', 'ten', 'eleven', 'twelve'];

/** As the network writes words: with a capital in front and numbers in digits. */
function written(word, i) {
  if (kDigits.includes(word)) return String(kDigits.indexOf(word));
  return i === 0 || word.length === 1 ? word[0].toUpperCase() + word.slice(1) : word;
}

/** How likely each of the words is, written so, and last that nothing follows. */
async function scoresOf(heard, words) {
  const tokens = pieces.encode(words.join(' '));
  const ids = [kFirstToken, ...tokens];
  const { logits } = await runDecoder({
    input_ids: new Tensor('int64', BigInt64Array.from(ids, BigInt), [1, ids.length]),
    encoder_hidden_states: heard.last_hidden_state,
    use_cache_branch: new Tensor('bool', [false]),
    ...emptyMemory(),
  });
  const size = logits.data.length / ids.length;
  const scores = [...words, ''].map(() => ({ log_probability: 0, behind: 0 }));
  for (let i = 0; i < ids.length; ++i) {
    const own = logits.data.subarray(i * size, (i + 1) * size);
    const [best, bestLog] = likeliest(own);
    if (i === tokens.length) {
      const end = Math.max(own[kLastToken], own[pieces.idOf('.')]) - own[best];
      scores[words.length] = { log_probability: end + bestLog, behind: end };
      break;
    }
    // Blanks part words, whatever tokens they are of.
    const word = pieces.decode(tokens.slice(0, i + 1)).trim().split(' ').length - 1;
    const score = scores[Math.min(word, words.length - 1)];
    score.log_probability += own[tokens[i]] - own[best] + bestLog;
    score.behind += own[tokens[i]] - own[best];
  }
  return scores;
}

const sumOf = (scores) => scores.reduce((total, score) => total + score.log_probability, 0);
const wordsOfTokens = (tokens) => wordsOf(tokens).map(({ text, logProbability }) => ({ text, log_probability: logProbability }));

/** The better of both ways to write each word, and what is heard without the text. */
async function scoresOfText(samples, words) {
  const heard = await heardIn(samples);
  const tokens = await tokensOf(heard, samples);
  const usual = await scoresOf(heard, words.map(written));
  const small = await scoresOf(heard, words.map((word) => word.toLowerCase()));
  return {
    words: usual.map((score, i) => ({
      log_probability: Math.max(score.log_probability, small[i].log_probability),
      behind: Math.max(score.behind, small[i].behind),
    })),
    log_probability: Math.max(sumOf(usual), sumOf(small)),
    heard: wordsOfTokens(tokens),
    heard_log_probability: tokens.reduce((total, token) => total + token.logProbability, 0),
    heard_tokens: tokens.length,
  };
}

/** Of each number the nearest that the upper half of its bits can tell. */
async function encodingOf(samples) {
  if (samples.length < kLeastSamples) return '';
  const { data } = (await heardIn(samples)).last_hidden_state;
  const bits = new Uint32Array(data.buffer, data.byteOffset, data.length);
  const upper = new Uint16Array(bits.length);
  for (let i = 0; i < bits.length; ++i) upper[i] = (bits[i] + 0x8000) >>> 16;
  return Buffer.from(upper.buffer).swap16().toString('hex');
}

async function answerTo(samples, text) {
  if (samples.length < kLeastSamples) return text === '' ? [] : null;
  if (text !== '') return scoresOfText(samples, text.split(' '));
  return wordsOfTokens(await tokensOf(await heardIn(samples), samples));
}

for (let head = read(8); head !== null; head = read(8)) {
  const count = head.readUInt32LE(0);
  if (count > kMostSeconds * kRateHz) throw new Error(`a sound of ${count} samples; expected a minute at most`);
  const samples = samplesOf(read(2 * count));
  const bytes = head.readUInt32LE(4);
  const answer = bytes === kEncoded ? await encodingOf(samples) : await answerTo(samples, read(bytes).toString('utf8'));
  writeSync(kAnswers, JSON.stringify(answer) + '\n');
}
