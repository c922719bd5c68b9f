// What synth put into the page: the report, the face and the sound.

function textOf(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error('This page is a template without data; synth fills it.');
  return element.textContent;
}

export function bytesFromBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/** Samples of the 16-bit mono WAV that synth writes: the header is always 44 bytes. */
function soundFromWav(wav) {
  const header = new DataView(wav.buffer, wav.byteOffset, 44);
  return { sampleRate: header.getUint32(24, true), samples: new Int16Array(wav.buffer.slice(wav.byteOffset + 44)) };
}

/**
 * The markers lie on the lips' outer edges. What they leave when the lips meet (in B, P and M, or else as the line
 * begins, in silence) is no opening.
 */
function betweenLips(distances, report) {
  const closures = report.phones.filter(({ phone }) => ['B', 'P', 'M'].includes(phone));
  const inClosures = closures.flatMap((phone) => distances.slice(Math.floor(phone.start_s * report.fps), Math.ceil(phone.end_s * report.fps)));
  // A line that leads its sound closes beside its closures: a tenth of its frames is no wider than closed, then.
  const narrow = [...distances].sort((a, b) => a - b)[Math.floor(distances.length / 10)];
  const closed = inClosures.length ? Math.min(narrow, inClosures.reduce((least, value) => Math.min(least, value))) : distances[0];
  return distances.map((distance) => Math.max(0, distance - closed));
}

/** What synth has deflated into an element. */
async function unpacked(id) {
  const packed = new Blob([bytesFromBase64(textOf(id))]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(packed).arrayBuffer());
}

/** What makes the line again in the page, and what it makes it of, where synth has put them in; both freed once read. */
export async function readEngine() {
  const ids = ['mouthpiece-engine', 'mouthpiece-line'];
  if (!ids.every((id) => document.getElementById(id))) return null;
  const [code, line] = await Promise.all(ids.map(unpacked));
  for (const id of ids) document.getElementById(id).textContent = '';
  return { code, line };
}

/** Everything in the page, decoded; each text element is freed once it is read. */
export async function readPageData() {
  const data = JSON.parse(textOf('mouthpiece-data'));
  const [wav, glb] = await Promise.all([unpacked('mouthpiece-sound'), unpacked('mouthpiece-face')]);
  for (const id of ['mouthpiece-sound', 'mouthpiece-face']) document.getElementById(id).textContent = '';
  const positions = bytesFromBase64(data.control.positions_m);
  return {
    ...data,
    lip_opening_mm: betweenLips(data.lip_opening_mm, data.report),
    control: { ...data.control, positions: new Float32Array(positions.buffer, positions.byteOffset, positions.length / 4) },
    glb,
    wav,
    sound: soundFromWav(wav),
  };
}
