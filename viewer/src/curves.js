// The strip under the phones: the sound as a band, the opening of the lips as a line.

/** The loudest sample of each of `columns` equal parts of the samples from `first` to `last`. */
function peaksOf(samples, first, last, columns) {
  const peaks = new Float32Array(columns);
  const step = (last - first) / columns;
  for (let column = 0; column < columns; ++column) {
    const end = Math.min(first + (column + 1) * step, samples.length);
    let peak = 0;
    for (let i = Math.max(0, Math.floor(first + column * step)); i < end; ++i) peak = Math.max(peak, Math.abs(samples[i]));
    peaks[column] = peak;
  }
  return peaks;
}

export function loudestOf(samples) {
  let loudest = 1;
  for (const sample of samples) loudest = Math.max(loudest, Math.abs(sample));
  return loudest;
}

/** Draws into `canvas`, `width` x `height` CSS pixels, the line from `start` to `end` seconds. */
export function drawCurves(canvas, width, height, { sound, loudest, lipOpening, lipWidth = [], framesPerSecond, start, end }) {
  const scale = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  const style = getComputedStyle(canvas);
  const context = canvas.getContext('2d');
  context.scale(scale, scale);

  const peaks = peaksOf(sound.samples, start * sound.sampleRate, end * sound.sampleRate, Math.max(Math.round(width), 1));
  context.fillStyle = style.getPropertyValue('--wave');
  peaks.forEach((peak, x) => {
    const half = Math.max(0.5, (peak / loudest) * (height / 2 - 3));
    context.fillRect(x, height / 2 - half, 1, 2 * half);
  });

  const drawLine = (values, low, color, dashes) => {
    if (values.length < 2) return;
    const high = values.reduce((most, value) => Math.max(most, value), low + 1e-6);
    context.strokeStyle = style.getPropertyValue(color);
    context.lineWidth = dashes.length ? 1.25 : 1.75;
    context.lineJoin = 'round';
    context.setLineDash(dashes);
    context.beginPath();
    const last = Math.min(Math.ceil(end * framesPerSecond) + 1, values.length);
    for (let frame = Math.max(0, Math.floor(start * framesPerSecond) - 1); frame < last; ++frame) {
      context.lineTo(((frame / framesPerSecond - start) / (end - start)) * width, height - 5 - ((values[frame] - low) / (high - low)) * (height - 10));
    }
    context.stroke();
  };
  drawLine(lipWidth, lipWidth.reduce((least, value) => Math.min(least, value), Infinity), '--faint', [2, 3]);
  drawLine(lipOpening, 0, '--lips', []);
}
