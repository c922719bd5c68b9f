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

/** Everything in the page, decoded; each text element is freed once it is read. */
export function readPageData() {
  const data = JSON.parse(textOf('mouthpiece-data'));
  const wav = bytesFromBase64(textOf('mouthpiece-sound'));
  const glb = bytesFromBase64(textOf('mouthpiece-face'));
  for (const id of ['mouthpiece-sound', 'mouthpiece-face']) document.getElementById(id).textContent = '';
  const positions = bytesFromBase64(data.control.positions_m);
  return {
    ...data,
    control: { ...data.control, positions: new Float32Array(positions.buffer, positions.byteOffset, positions.length / 4) },
    glb,
    wav,
    sound: soundFromWav(wav),
  };
}
