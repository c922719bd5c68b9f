// Where the energy of the sound lies, 0 to 8 kHz, under the part of the line that is in sight.

const SIZE = 512;
const HIGHEST_HZ = 8000;
const RANGE_DB = 70;

const WINDOW = Float32Array.from({ length: SIZE }, (_, i) => 0.5 - 0.5 * Math.cos((2 * Math.PI * i) / SIZE));

/** Power in each of SIZE / 2 bands, in place (radix 2). */
function powers(samples, middle) {
  const re = new Float32Array(SIZE);
  const im = new Float32Array(SIZE);
  for (let i = 0, j = 0; i < SIZE; ++i) {
    re[j] = WINDOW[i] * (samples[middle - SIZE / 2 + i] ?? 0);
    let bit = SIZE >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
  }
  for (let length = 2; length <= SIZE; length <<= 1) {
    const half = length >> 1;
    for (let k = 0; k < half; ++k) {
      const angle = (-2 * Math.PI * k) / length;
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      for (let i = k; i < SIZE; i += length) {
        const [xr, xi] = [re[i + half] * c - im[i + half] * s, re[i + half] * s + im[i + half] * c];
        re[i + half] = re[i] - xr;
        im[i + half] = im[i] - xi;
        re[i] += xr;
        im[i] += xi;
      }
    }
  }
  return re.subarray(0, SIZE / 2).map((value, i) => value * value + im[i] * im[i]);
}

export function drawSpectrogram(canvas, height, { sound, start, end, width, color }) {
  const columns = Math.max(1, Math.round(width / 2));
  canvas.width = columns;
  canvas.height = height;
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  const context = canvas.getContext('2d');
  const image = context.createImageData(columns, height);
  const [red, green, blue] = color;
  const bands = Math.min(SIZE / 2, Math.round((HIGHEST_HZ / (sound.sampleRate / 2)) * (SIZE / 2)));
  const levels = [];
  let loudest = 1e-9;
  for (let x = 0; x < columns; ++x) {
    const middle = Math.round((start + ((end - start) * (x + 0.5)) / columns) * sound.sampleRate);
    levels.push(powers(sound.samples, middle));
    for (let band = 0; band < bands; ++band) loudest = Math.max(loudest, levels[x][band]);
  }
  for (let x = 0; x < columns; ++x) {
    for (let y = 0; y < height; ++y) {
      const power = levels[x][Math.floor(((height - 1 - y) / height) * bands)];
      const share = Math.max(0, 1 + (10 * Math.log10((power + 1e-9) / loudest)) / RANGE_DB);
      const at = 4 * (y * columns + x);
      image.data.set([red, green, blue, 255 * share * share], at);
    }
  }
  context.putImageData(image, 0, 0);
}
